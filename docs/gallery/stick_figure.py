"""A robot drawn from its hinges; the cross is its centre of mass."""

import pycraft as pc

robot = pc.robots.g1()
robot.plot(com=True)
