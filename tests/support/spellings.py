"""Expressions that must be planned without a dense step: ℳ, its inverse and resolvents in many spellings, sums and inverses
that no theorem knows, borders of low rank, node operators, diagonal blocks and roots. Each is a function of the letters `o` and
the constants `c` of a model, so that the same formula is evaluated by the package and by dense NumPy.
"""

import numpy as np

from support.formulas import letters_of
from support.mechanisms import every_kind


class Constants:
    """Seeded constants on the spaces of one operator set: positive blocks, thin borders, a full matrix."""

    def __init__(self, o, seed=0):
        rng, soa = np.random.default_rng(seed), o.soa
        n = len(soa.Theta)
        self.damping = o.constant(rng.uniform(0.1, 1, n), soa.Theta, soa.Theta, "C")
        self.border = o.constant(rng.normal(size=(n, 2)), 2, soa.Theta, "U")
        self.small = o.constant(np.array([[2.0, 0.3], [0.3, 1.0]]), 2, 2, "S")
        self.loads = o.constant([spd(rng, s.stop - s.start) for _, s, _ in soa.F.blocks], soa.V, soa.F, "W")
        full = rng.normal(size=(n, n))
        self.full = lambda: o.constant(full @ full.T / n, soa.Theta, soa.Theta, "full")


_made = {}


def letters_and_constants(rotor_inertia):
    """One branched tree of every hinge kind, welds kept, with or without rotors."""
    if rotor_inertia not in _made:
        o = letters_of(every_kind(rotor_inertia))
        _made[rotor_inertia] = o, Constants(o)
    return _made[rotor_inertia]


def spd(rng, n):
    """A symmetric positive definite block."""
    x = rng.normal(size=(n, n))
    return x @ x.T / max(n, 1) + np.eye(n)


def A(o):
    return o.I + o.H @ o.phi @ o.K


def S(o):
    return o.I - o.H @ o.psi @ o.K


def nodes(o):
    return o.B(["node9", "node10"])


# ℳ, or ℳ + J, depending on the spelling: one kernel for all of them.
MASS_MATRIX = {
    "as typed": lambda o: o.H @ o.phi @ o.M @ o.phi.T @ o.H.T,
    "with stars": lambda o: o.H * o.phi * o.M * o.phi.T * o.H.T,
    "associated in the middle": lambda o: o.H @ ((o.phi @ o.M) @ o.phi.T) @ o.H.T,
    "associated from the right": lambda o: o.H @ (o.phi @ (o.M @ (o.phi.T @ o.H.T))),
    "square": lambda o: (o.H @ o.phi) @ o.M @ (o.H @ o.phi).T,
    "transposed": lambda o: (o.H @ o.phi @ o.M @ o.phi.T @ o.H.T).T,
    "transposed inside": lambda o: o.H @ (o.phi @ o.M @ o.phi.T).T @ o.H.T,
    "identities inside": lambda o: o.H @ o.I @ o.phi @ o.M @ (o.I @ o.phi.T) @ o.H.T,
    "φ spelled as inverse": lambda o: o.H @ (o.I - o.E).inv() @ o.M @ (o.I - o.E).inv().T @ o.H.T,
    "φ spelled as I + φ̃": lambda o: o.H @ (o.I + o.phi_tilde) @ o.M @ (o.I + o.phi_tilde).T @ o.H.T,
    "by composite bodies": lambda o: o.H @ (o.R + o.phi_tilde @ o.R + o.R @ o.phi_tilde.T) @ o.H.T,
    "by composite bodies, distributed": lambda o: o.H @ o.R @ o.H.T + o.H @ o.phi_tilde @ o.R @ o.H.T + o.H @ o.R @ o.phi_tilde.T @ o.H.T,
    "by composite bodies, in φ": lambda o: o.H @ (o.phi @ o.R + o.R @ o.phi.T - o.R) @ o.H.T,
    "halves": lambda o: 0.5 * o.MM + o.MM / 2,
    "scaled": lambda o: -3 * o.H @ o.phi @ o.M @ (2 * o.phi.T) @ o.H.T,
    "inverted twice": lambda o: o.MM.inv().inv(),
    "with J": lambda o: o.MM + o.J,
    "with J, factored": lambda o: A(o) @ o.D @ A(o).T,
    "with J, factored and distributed": lambda o: (
        o.D + o.H @ o.phi @ o.K @ o.D + o.D @ o.K.T @ o.phi.T @ o.H.T + o.H @ o.phi @ o.K @ o.D @ o.K.T @ o.phi.T @ o.H.T
    ),
    "with J, factors inverted": lambda o: (S(o).T @ o.D.inv() @ S(o)).inv(),
}

INVERSE = {
    "as typed": lambda o: (o.MM + o.J).inv(),
    "power": lambda o: (o.MM + o.J) ** -1,
    "by hand": lambda o: S(o).T @ o.D.inv() @ S(o),
    "by hand, associated": lambda o: S(o).T @ (o.D.inv() @ S(o)),
    "by hand, transposed": lambda o: (S(o).T @ o.D.inv() @ S(o)).T,
    "by hand, distributed": lambda o: (
        o.D.inv()
        - o.K.T @ o.psi.T @ o.H.T @ o.D.inv()
        - o.D.inv() @ o.H @ o.psi @ o.K
        + o.K.T @ o.psi.T @ o.H.T @ o.D.inv() @ o.H @ o.psi @ o.K
    ),
    "by the other factors": lambda o: A(o).inv().T @ o.D.inv() @ A(o).inv(),
    "of the factorization": lambda o: (A(o) @ o.D @ A(o).T).inv(),
    "of the transpose": lambda o: (o.MM + o.J).T.inv(),
    "transposed": lambda o: (o.MM + o.J).inv().T,
    "of a multiple": lambda o: 6 * (-2 * (o.MM + o.J)).inv(),
    "of composite bodies": lambda o: (o.H @ (o.R + o.phi_tilde @ o.R + o.R @ o.phi_tilde.T) @ o.H.T + o.J).inv(),
}

RESOLVENTS = {
    "(I-E)⁻¹": lambda o, c: (o.I - o.E).inv(),
    "(I-E_ψ)⁻¹": lambda o, c: (o.I - o.E_psi).inv(),
    "(I-E+KH)⁻¹": lambda o, c: (o.I - o.E + o.K @ o.H).inv(),
    "(φ⁻¹+KH)⁻¹": lambda o, c: (o.phi.inv() + o.K @ o.H).inv(),
    "(ψ⁻¹-KH)⁻¹": lambda o, c: (o.psi.inv() - o.K @ o.H).inv(),
    "φ⁻¹ψ": lambda o, c: o.phi.inv() @ o.psi,
    "(φ⁻¹ψ)⁻¹": lambda o, c: (o.phi.inv() @ o.psi).inv(),
    "(I+KHφ)⁻¹": lambda o, c: (o.I + o.K @ o.H @ o.phi).inv(),
    "(I+φKH)⁻¹": lambda o, c: (o.I + o.phi @ o.K @ o.H).inv(),
    "(I+HφK)⁻¹": lambda o, c: A(o).inv(),
    "(I-HψK)⁻¹": lambda o, c: S(o).inv(),
    "(I+HφK)⁻*": lambda o, c: A(o).T.inv(),
    "(I+HφKD)⁻¹": lambda o, c: (o.I + o.H @ o.phi @ o.K @ o.D).inv(),
    "(I-E/2)⁻¹": lambda o, c: (o.I - 0.5 * o.E).inv(),
    "(φ+ψ)⁻¹": lambda o, c: (o.phi + o.psi).inv(),
    "φψφ*-like": lambda o, c: o.phi @ o.psi @ o.M @ o.psi.T @ o.phi.T,
}

NO_THEOREM = {
    "shifted": lambda o, c: (o.MM + 0.1 * o.I).inv(),
    "damped": lambda o, c: (o.MM + o.J + 0.1 * c.damping).inv(),
    "inverse of inverse and D": lambda o, c: ((o.MM + o.J).inv() + 0.01 * o.D).inv(),
    "nested shifts": lambda o, c: ((o.MM + 0.1 * o.I).inv() + (o.MM + 2 * o.I).inv()).inv(),
    "three deep": lambda o, c: (((o.MM + o.I).inv() + o.D).inv() + 0.3 * o.I).inv(),
    "filter": lambda o, c: (o.MM + 0.1 * o.I).inv() @ o.MM @ (o.MM + 0.3 * o.I).inv(),
    "implicit Euler": lambda o, c: (o.MM + o.J + 0.01 * c.damping + 1e-4 * o.D).inv() @ (o.MM + o.J),
    "φMφ* and loads": lambda o, c: (o.phi @ o.M @ o.phi.T + c.loads).inv(),
    "decomposed φMφ*": lambda o, c: (o.R + o.phi_tilde @ o.R + o.R @ o.phi_tilde.T).inv(),
    "compliance and M⁻¹": lambda o, c: (o.Omega + o.M.inv()).inv(),
    "compliance by hand": lambda o, c: (o.psi.T @ o.H.T @ o.D.inv() @ o.H @ o.psi + o.P.inv()).inv(),
    "with changed masses": lambda o, c: (o.H @ o.phi @ (o.M + c.loads) @ o.phi.T @ o.H.T + o.J).inv(),
    "difference of inverses": lambda o, c: (o.MM + o.I).inv() - (o.MM + 2 * o.I).inv(),
    "triangular product": lambda o, c: (o.I + 0.2 * o.H @ o.phi @ o.G).inv(),
}

BORDERS = {
    "rank two": lambda o, c: (o.MM + o.J + c.border @ c.border.T).inv(),
    "rank two, weighted": lambda o, c: (o.MM + o.J + c.border @ c.small @ c.border.T).inv(),
    "Schur complement": lambda o, c: (c.border.T @ (o.MM + o.J).inv() @ c.border).inv(),
    "Woodbury by hand": lambda o, c: (
        (o.MM + o.J).inv()
        - (o.MM + o.J).inv() @ c.border @ (c.small + c.border.T @ (o.MM + o.J).inv() @ c.border).inv() @ c.border.T @ (o.MM + o.J).inv()
    ),
    "shifted and bordered": lambda o, c: (o.MM + 0.1 * o.I + 0.5 * c.border @ c.border.T).inv(),
}

NODES = {
    "Λ": lambda o, c: o.Lambda(["node9", "node10"]),
    "(B*ΩB)⁻¹": lambda o, c: (nodes(o).T @ o.Omega @ nodes(o)).inv(),
    "(𝒥ℳ⁻¹𝒥*)⁻¹": lambda o, c: (o.Jacobian(["node9", "node10"]) @ (o.MM + o.J).inv() @ o.Jacobian(["node9", "node10"]).T).inv(),
    "𝒥": lambda o, c: o.Jacobian(["node9", "node10"]),
    "B*φ*H*": lambda o, c: nodes(o).T @ o.phi.T @ o.H.T,
    "(ℳ+𝒥*𝒥)⁻¹": lambda o, c: (o.MM + o.Jacobian(["node9"]).T @ twice(o.Jacobian(["node9"]))).inv(),
    "ℳ⁻¹𝒥*Λ": lambda o, c: (o.MM + o.J).inv() @ o.Jacobian(["node9", "node10"]).T @ o.Lambda(["node9", "node10"]),
}


def twice(jacobian):
    """W𝒥 with W = 2: NodesV → NodesF."""
    made = type(jacobian)
    import pycraft as pc

    weight = pc.constant(np.full(len(jacobian.value), 2.0), jacobian.op.codomain, jacobian.op.codomain.dual, "W")
    return made(weight, 2 * np.eye(len(jacobian.value)), 0.0) @ jacobian


BLOCKS = {
    "blockdiag φMφ*": lambda o, c: (o.phi @ o.M @ o.phi.T).blockdiag(),
    "blockdiag ψMψ*": lambda o, c: (o.psi @ o.M @ o.psi.T).blockdiag(),
    "blockdiag Ω": lambda o, c: o.Omega.blockdiag(),
    "blockdiag φ*Wφ": lambda o, c: (o.phi.T @ c.loads.inv() @ o.phi).blockdiag(),
    "blockdiag ℳ": lambda o, c: o.MM.blockdiag(),
    "blockdiag of a shifted inverse": lambda o, c: (o.MM + 0.1 * o.I).inv().blockdiag(),
    "its inverse": lambda o, c: (o.MM + o.J).blockdiag().inv(),
    "Jacobi preconditioner": lambda o, c: (o.MM + o.J).blockdiag().inv() @ (o.MM + o.J),
    "siblings": lambda o, c: o.E_psi.T @ o.Upsilon @ o.E_psi - (o.E_psi.T @ o.Upsilon @ o.E_psi).blockdiag(),
    "D^-½HψM^½": lambda o, c: o.D.sqrt().inv() @ o.H @ o.psi @ o.M.sqrt(),
    "(I+M^½*φ*...)⁻¹": lambda o, c: (o.I + o.M.sqrt().T @ o.phi.T @ o.H.T @ o.D.inv() @ o.H @ o.phi @ o.M.sqrt()).inv(),
    "sqrt of blockdiag": lambda o, c: (o.phi @ o.M @ o.phi.T).blockdiag().sqrt().inv(),
    "E X E*": lambda o, c: o.E @ (o.R - o.M) @ o.E.T + c.loads,
}

EVERYTHING = {
    **{f"ℳ {name}": lambda o, c, f=f: f(o) for name, f in MASS_MATRIX.items()},
    **{f"ℳ⁻¹ {name}": lambda o, c, f=f: f(o) for name, f in INVERSE.items()},
    **RESOLVENTS,
    **NO_THEOREM,
    **BORDERS,
    **NODES,
    **BLOCKS,
}
