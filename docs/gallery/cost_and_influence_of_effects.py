"""The cost of each effect of a scene and, in the same colours, the error of the motion without it."""

import pycraft as pc

arm, effects = pc.robots.panda(), pc.effects
scene = pc.Scene(arm).add(effects.Gravity((0, 0, -9.81)), effects.Damping(0.5), effects.CoulombFriction(0.2, 0.05))
scene.add(effects.Wrench("panda_link7", (0, 0, 0, 0, 0, 1)), effects.NodeSpring(None, "panda_link7", 2.0))
scene.compare(T=0.2, seconds=0.002).stack()
