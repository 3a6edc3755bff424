"""What a step of a scene is spent on, part by part and effect by effect."""

import pycraft as pc

arm = pc.robots.panda()
scene = pc.Scene(arm).add(pc.effects.Gravity(), pc.effects.Damping(0.5), pc.effects.Spring(5.0))
scene.cost().plot()
