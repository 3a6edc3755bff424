"""The slowest mode of an arm on springs, in five phases."""

import pycraft as pc

arm = pc.robots.ur5()
scene = pc.Scene(arm).add(pc.effects.Spring(200.0))
modes = scene.linearize([0.0] * arm.nq, [0.0] * arm.nv).modes()
modes.plot(0)
