"""The algebra of the oracle over a tree with blocks of any size. See `pycraft.reference`."""

from functools import cached_property

import numpy as np

from .forms import articulated_inertia
from .numbers import converted, epsilon, inv, mpmath_context, smallest_singular_value

# D(k) counts as singular if its smallest singular value, in units in which |H||R||H*| + |J| (D with all outboard hinges locked and no
# cancellation) has a diagonal of ones, is at most SINGULAR eps. Rounding of an exact zero is below 2 eps there on random chains; a chain of
# ten links with a tip 1e13 times heavier still has 50 eps, a legitimate D. The forms that carry factors have a root of D, and compare its
# singular values with the same limit: their limit for D is (SINGULAR eps)².
SINGULAR = 16


def block_diagonal(blocks):
    """Block-diagonal matrix of the given blocks, blocks without rows or columns among them; (0, 0) for none."""
    rows, columns = (np.cumsum([0, *[np.shape(b)[axis] for b in blocks]]) for axis in (0, 1))
    A = np.zeros((rows[-1], columns[-1]), np.result_type(float, *map(np.asarray, blocks)))
    for k, block in enumerate(blocks):
        A[rows[k] : rows[k + 1], columns[k] : columns[k + 1]] = block
    return A


def symbol(formula, meaning):
    """Return an attribute computed from the others by its formula on first use, with its meaning as docstring."""
    attribute = cached_property(formula)
    attribute.__doc__ = meaning
    return attribute


class Operators:
    """The symbols of the algebra over a tree of bodies with blocks of any size, as dense arrays: see `sko_operators`.

    V and F have the size of all body states (6n for rigid bodies), Θ that of all hinge coordinates (nv). E: E_φ, F → F;
    H: hinge map, F → Θ; M: inertias, V → F; J: hinge-diagonal term, Θ → Θ, symmetric. form: see `articulated_inertia`.
    """

    def __init__(self, parents, E_blocks, H_blocks, M_blocks, J_blocks=None, names=None, form="fast"):
        H_blocks = [np.reshape(h, (len(h), len(m))) for h, m in zip(H_blocks, M_blocks, strict=True)]  # [] is also a block
        if any(not -1 <= p < k for k, p in enumerate(parents)):
            raise ValueError(f"parents come before their children, -1 is the base: got {list(parents)}")
        self.parents, self.form, bodies = list(parents), form, range(len(parents))
        self.names = names or [f"body {k}" for k in bodies]
        s, t = np.cumsum([0, *map(len, M_blocks)]), np.cumsum([0, *map(len, H_blocks)])
        self.states = [slice(s[k], s[k + 1]) for k in bodies]  # body k in V and F
        self.coordinates = [slice(t[k], t[k + 1]) for k in bodies]  # hinge k in Θ
        H, M = block_diagonal(H_blocks), block_diagonal(M_blocks)
        J_blocks = [np.zeros(len(h) ** 2) for h in H_blocks] if J_blocks is None else J_blocks
        J = block_diagonal([np.reshape(j, (len(h), len(h))) for j, h in zip(J_blocks, H_blocks, strict=True)])
        E = np.zeros(M.shape, np.result_type(float, *[np.asarray(e) for e in E_blocks if e is not None]))
        for k, p in enumerate(self.parents):
            if p >= 0:
                E[self.states[p], self.states[k]] = E_blocks[k]
        context = mpmath_context(E, H, M, J)
        self.E, self.H, self.M, self.J, self.I = (converted(x, context) for x in (E, H, M, J, np.eye(len(M))))

    def children(self, k):
        """States, in V and F, of the bodies whose parent is body k."""
        return [s for s, p in zip(self.states, self.parents, strict=True) if p == k]

    @cached_property
    def R(self):
        """R: composite body inertias, V → F, block diagonal: R(k) = M(k) + Σ_children E_φ(k,c) R(c) E_φ*(k,c), tip to base."""
        R = self.M.astype(self.E.dtype)
        for k in reversed(range(len(self.parents))):
            s = self.states[k]
            for c in self.children(k):
                R[s, s] += self.E[s, c] @ R[c, c] @ self.E[s, c].T
        return R

    def require_regular(self, k, D=None, root=None):
        """Raise ArithmeticError, naming body k and its hinge, if D = D(k) = root root* is singular to rounding (see `SINGULAR`)."""
        s, t = self.states[k], self.coordinates[k]
        locked = np.diag(abs(self.H[t, s]) @ abs(self.R[s, s]) @ abs(self.H[t, s]).T + abs(self.J[t, t])) ** 0.5
        scale = np.where(locked == 0, 1, locked)
        scaled = D / np.outer(scale, scale) if root is None else root / scale[:, None]
        if scaled.size and smallest_singular_value(scaled) <= SINGULAR * epsilon(scaled):
            raise ArithmeticError(f"D is singular at {self.names[k]}: some motion of its hinge feels no inertia")

    @cached_property
    def Upsilon(self):
        """Υ: compliance kernel, F → V, block diagonal: Υ(k) = H*(k)D⁻¹(k)H(k) + E_ψ*(p,k) Υ(p) E_ψ(p,k), base to tip."""
        Upsilon = self.H.T @ self.D_inverse @ self.H
        for k, p in enumerate(self.parents):
            if p >= 0:
                s, p = self.states[k], self.states[p]
                Upsilon[s, s] += self.E_psi[p, s].T @ Upsilon[p, p] @ self.E_psi[p, s]
        return Upsilon

    articulated = symbol(lambda o: articulated_inertia(o, o.form), "P, P⁺, D, D⁻¹, G: see `articulated_inertia`.")
    phi = symbol(lambda o: inv(o.I - o.E), "φ: tip-to-base gather, F → F: (I − E_φ)⁻¹.")
    phi_tilde = symbol(lambda o: o.phi - o.I, "φ̃, F → F: φ − I.")
    mass_matrix = symbol(
        lambda o: o.H @ o.phi @ o.M @ o.phi.T @ o.H.T,
        "ℳ: mass matrix of the bodies, Θ → Θ: HφMφ*H*. The equations of motion have ℳ + J in its place.",
    )
    P = symbol(lambda o: o.articulated.P, "P: articulated-body inertias, V → F, block diagonal: M + blockdiag(E_φP⁺E_φ*).")
    D = symbol(lambda o: o.articulated.D, "D: articulated hinge inertias, Θ → Θ, block diagonal: HPH* + J.")
    D_inverse = symbol(lambda o: o.articulated.D_inverse, "D⁻¹, Θ → Θ, block diagonal.")
    G = symbol(lambda o: o.articulated.G, "G: articulated-body gain, Θ → F, block diagonal: PH*D⁻¹.")
    P_plus = symbol(lambda o: o.articulated.P_plus, "P⁺: P seen across the hinge, V → F, block diagonal: τ̄P.")
    tau = symbol(lambda o: o.G @ o.H, "τ, F → F, block diagonal: GH.")
    tau_bar = symbol(lambda o: o.I - o.tau, "τ̄, F → F, block diagonal: I − τ.")
    K = symbol(lambda o: o.E @ o.G, "K: shifted gain, Θ → F: E_φG.")
    E_psi = symbol(lambda o: o.E @ o.tau_bar, "E_ψ: articulated E_φ, F → F: E_φτ̄.")
    psi = symbol(lambda o: inv(o.I - o.E_psi), "ψ: articulated gather, F → F: (I − E_ψ)⁻¹.")
    psi_tilde = symbol(lambda o: o.psi - o.I, "ψ̃, F → F: ψ − I.")
    Omega = symbol(lambda o: o.psi.T @ o.H.T @ o.D_inverse @ o.H @ o.psi, "Ω: extended operational-space compliance, F → V: ψ*H*D⁻¹Hψ.")
    innovations = symbol(lambda o: np.eye(len(o.D)) - o.H @ o.psi @ o.K, "I − HψK, Θ → Θ.")
    mass_matrix_inverse = symbol(lambda o: o.innovations.T @ o.D_inverse @ o.innovations, "(ℳ + J)⁻¹, Θ → Θ: [I − HψK]* D⁻¹ [I − HψK].")


def sko_operators(parents, E_blocks, H_blocks, M_blocks, J_blocks=None, form="fast"):
    """Return the algebra of a tree given by raw blocks: s_k states and n_k hinge coordinates at body k, zero included.

    Parameters
    ----------
    parents : index of each body's parent, −1 for roots; parents come before children
    E_blocks : E_φ(p,k), (s_p, s_k) each; None for roots
    H_blocks, M_blocks : H(k), (n_k, s_k), and M(k), (s_k, s_k), symmetric
    J_blocks : hinge-diagonal terms J(k), (n_k, n_k), symmetric; zero if None
    form : of the articulated-body inertia, one of `FORMS`

    Returns
    -------
    Operators : E phi phi_tilde H M J R P P_plus D G K tau tau_bar E_psi psi psi_tilde Upsilon Omega I innovations mass_matrix
        (HφMφ*H*, without J) mass_matrix_inverse (of ℳ + J), each computed on first use. Those that need P raise ArithmeticError if a D(k)
        is singular.

    Examples
    --------
    Two unit masses on a line, each on a slider: the articulated mass at the inner one is its own mass.

    >>> line = sko_operators([-1, 0], [None, [[1.0]]], [[[1.0]], [[1.0]]], [[[1.0]], [[1.0]]])
    >>> line.P.tolist(), line.mass_matrix.tolist()
    ([[1.0, 0.0], [0.0, 1.0]], [[2.0, 1.0], [1.0, 1.0]])
    """
    return Operators(parents, E_blocks, H_blocks, M_blocks, J_blocks, form=form)
