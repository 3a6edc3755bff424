"""A double pendulum: coordinates, energies and their balance, with units."""

import pycraft as pc

scene = pc.mechanisms.double_pendulum().add(pc.effects.Damping(0.05))
scene.simulate(6.0, rtol=1e-9).plot()
