"""Error against time of integrators: one motion at many tolerances."""

import pycraft as pc

swing = pc.chain(3)
swing.gravity = (0, -9.81, 0)
chosen = dict(integrators=["dopri5", "dop853", "scipy:DOP853"], tolerances=[1e-4, 1e-6, 1e-8, 1e-10], seconds=0.0)
pc.work_precision(swing, [0.3, 0.2, 0.1], duration=0.5, **chosen).plot()
