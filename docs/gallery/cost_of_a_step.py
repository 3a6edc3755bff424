"""The cost of a step of a scene, pass by pass and effect by effect."""

import pycraft as pc

arm = pc.robots.panda()
scene = pc.Scene(arm).add(pc.effects.Gravity(), pc.effects.Damping(0.5), pc.effects.Spring(5.0))
scene.cost().plot()
