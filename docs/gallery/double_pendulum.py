"""A double pendulum: coordinates, energies and their balance, with units; and a page that plays the run."""

import pycraft as pc

scene = pc.mechanisms.double_pendulum().add(pc.effects.Damping(0.05))
run = scene.simulate(6.0, q=[2.0, 1.0], rtol=1e-9)
run.plot()
page = run.to_html(trace="lower")
