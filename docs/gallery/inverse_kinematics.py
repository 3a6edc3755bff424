"""A hand moved to a point by inverse kinematics, before and after."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

arm = pc.robots.panda()
start = np.array([0, -0.3, 0, -2.2, 0, 2.0, 0.8])
target = arm.pose("panda_link7", start)
target[:3, 3] += (0.1, 0.35, -0.2)
found = arm.solve_ik({"panda_link7": target}, start)
figure = plt.figure(figsize=(5, 4.6), layout="constrained")
axes = figure.add_subplot(projection="3d")
arm.plot(start, ax=axes)
arm.plot(found.q, ax=axes)
axes.set_title(f"reached: {found.reached}")
