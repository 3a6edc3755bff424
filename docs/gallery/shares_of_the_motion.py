"""The shares tr(Υ(k)M(k)) of the bodies add up to the number of coordinates: who has the degrees of freedom."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

arm = pc.chain(7, seed=3)
shares = np.diag((arm.soa.Upsilon @ arm.soa.M).dense()).reshape(-1, 6).sum(axis=1)
figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
axes.bar(range(1, 8), shares, color="#1f4e79")
axes.set(title=f"shares of the bodies, {shares.sum():.6f} together", xlabel="body, base to tip", ylabel="tr Υ(k)M(k)")
