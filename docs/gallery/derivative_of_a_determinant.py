"""ln det ℳ of an arm along its elbow, with slopes at some points from the derivative of the expression."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

arm = pc.robots.panda()
H, phi, M = arm.soa("H phi M")
size = (H @ phi @ M @ phi.T @ H.T).logdet()
angle = np.linspace(-3, 0, 61)
q = np.zeros((61, 7))
q[:, 3] = angle
values, slopes = (np.array([e.at(state).value() for state in q]) for e in (size, size.diff("panda_joint4")))
figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
axes.plot(angle, values, color="#1f4e79")
for k in range(5, 60, 10):
    ends = np.array([-0.25, 0.25])
    axes.plot(angle[k] + ends, values[k] + slopes[k] * ends, color="#c55a11")
axes.set(title="ln det ℳ and its derivative", xlabel="elbow, rad", ylabel="ln det ℳ")
