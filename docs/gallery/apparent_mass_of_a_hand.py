"""The apparent mass of the hand of a planar arm in every direction, along a reach: the inverse square of the ellipse's radius."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

arm = pc.Multibody("planar")
for k in range(3):
    rod = dict(mass=1.0, com=(0.25, 0, 0), inertia=np.diag([0.001, 0.02, 0.02]))
    arm.add_body(f"link{k}", parent=f"link{k - 1}" if k else None, position=(0.5 if k else 0, 0, 0), axis=(0, 0, 1), **rod)
arm.add_node("hand", "link2", position=(0.5, 0, 0))
figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
circle = np.array([np.cos(np.linspace(0, 2 * np.pi, 90)), np.sin(np.linspace(0, 2 * np.pi, 90))])
for bend in np.linspace(0.3, 1.8, 6):
    q = np.array([0.0, bend, -0.5 * bend])
    X, J = arm.pose("hand", q), arm.jacobian("hand", q)[3:]
    mobility = (X[:3, :3] @ J @ np.linalg.solve(arm.mass_matrix(q), J.T) @ X[:3, :3].T)[:2, :2]
    axes.plot(*(X[:2, 3:] + 0.05 * np.linalg.cholesky(mobility) @ circle), color=plt.cm.viridis(bend / 2))
axes.set(title="mobility of the hand", xlabel="x, m", ylabel="y, m", aspect="equal")
