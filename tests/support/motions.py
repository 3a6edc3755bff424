"""Poses, twists and sums of all bodies of a model by the oracle, by name: what edits of a structure leave as it was."""

import numpy as np

from support.oracle import reference


class Motions:
    """Of a model at its present state: `poses` (4, 4) in the world, `twists` (6,) in the body's axes; of all `energy` and `momentum`.

    The momentum is about the world's origin, in its axes, angular first. Rotors have a share in `energy`, none in `energy_of_bodies`.
    """

    def __init__(self, model):
        described = {key: value for key, value in model.description().items() if key != "frames"}
        names = [body["name"] for body in described["bodies"]]
        self.poses, self.twists = {}, {}
        self.energy = self.energy_of_bodies = 0.0
        self.momentum = np.zeros(6)
        if not names:
            return
        o = self.operators = reference.operators(described, np.array(model.q), np.array(model.v))
        V = o.phi.T @ o.H.T @ model.v
        self.energy_of_bodies = V @ o.M @ V / 2
        self.energy = self.energy_of_bodies + model.v @ o.J @ model.v / 2
        for k, name in enumerate(names):
            own = slice(6 * k, 6 * k + 6)
            X, f = o.world_pose(k), (o.M @ V)[own]
            self.poses[name], self.twists[name] = X, V[own]
            linear = X[:3, :3] @ f[3:]
            self.momentum += np.r_[X[:3, :3] @ f[:3] + np.cross(X[:3, 3], linear), linear]

    def assert_same(self, other, bound, names=None):
        """Poses and twists of bodies, all of them or those that are named, as others are."""
        names = self.poses if names is None else names
        assert set(names) <= set(other.poses)
        for name in names:
            scale = 1 + np.abs(self.poses[name]).max() + np.abs(self.twists[name]).max()
            assert np.abs(self.poses[name] - other.poses[name]).max() <= bound * scale, name
            assert np.abs(self.twists[name] - other.twists[name]).max() <= bound * scale**2, name
