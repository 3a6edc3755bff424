"""The articulated-body inertia of the oracle, by form. See `pycraft.reference`."""

from functools import partial
from types import SimpleNamespace

import numpy as np

from .numbers import converted, epsilon, inv, mpmath_context

FORMS = ("fast", "joseph", "ud", "square-root")


def unit_factors(A):
    """U, w: A = U diag(w) U* with as many columns and weights w > 0 as A, symmetric and positive semidefinite, has rank.

    LDL*, with the largest remaining pivot next, as long as it exceeds n eps of its original value. ArithmeticError if a diagonal term turns
    negative instead: A is indefinite.
    """
    whole, columns, w = np.where(np.diag(A) > 0, np.diag(A), 1), [np.zeros((len(A), 0), A.dtype)], []
    while (left := np.diag(A) / whole).max(initial=0) > len(A) * epsilon(A):
        i = np.argmax(left)
        columns.append(A[:, i : i + 1] / A[i, i])
        w.append(A[i, i])
        A = A - w[-1] * columns[-1] @ columns[-1].T
    if left.min(initial=0) < -len(A) * epsilon(A):
        raise ArithmeticError("an inertia is indefinite: only the forms 'fast' and 'joseph' accept it")
    return np.hstack(columns), np.array(w, A.dtype)


def gram_schmidt(rows, w):
    """U, d: U unit lower triangular, rows diag(w) rows* = U diag(d) U*; each row in turn is removed from the later ones, weighted by w."""
    rows, U, d = rows.copy(), np.eye(len(rows)).astype(rows.dtype), np.zeros(len(rows), rows.dtype)
    for r in range(len(rows)):
        d[r] = rows[r] * w @ rows[r]
        for s in range(r + 1, len(rows)) if d[r] > 0 else ():
            U[s, r] = rows[s] * w @ rows[r] / d[r]
            rows[s] = rows[s] - U[s, r] * rows[r]
    return U, d


def lower_triangle(rows):
    """L, (n, n): lower triangular with LL* = rows rows*, by Householder's reflections from the right."""
    L = np.hstack([rows, np.zeros((len(rows), len(rows)), rows.dtype)])
    for r in range(len(L)):
        x = L[r, r:].copy()
        x[0] += (x @ x) ** 0.5 * (1 if x[0] >= 0 else -1)
        if x[0] != 0:
            L[:, r:] = L[:, r:] - np.outer(L[:, r:] @ x, x) * (2 / (x @ x))
    return L[:, : len(L)]


def completion(H):
    """N, C: rows N of the identity with [H; N][B, C] = I for some B: the coordinates without a pivot when H is eliminated."""
    A, left, n = H.copy(), list(range(H.shape[1])), len(H)
    for r in range(n):
        left.remove(i := max(left, key=lambda j: abs(A[r, j])))
        A[r + 1 :] = A[r + 1 :] - np.outer(A[r + 1 :, i] / A[r, i], A[r])
    N = np.eye(H.shape[1]).astype(H.dtype)[left]
    return N, inv(np.vstack([H, N]))[:, n:]


def articulated_inertia(o, form="fast"):
    """P, P_plus, D, D_inverse and G of the `Operators` o as a namespace, by the recursion from tip to base.

    P(k) = M(k) + Σ_children E_φ(k,c) P⁺(c) E_φ*(k,c)      D(k) = H(k)P(k)H*(k) + J(k)
    G(k) = P(k)H*(k)D⁻¹(k)                                 P⁺(k) = (I − G(k)H(k)) P(k)

    Parameters
    ----------
    form : the quantity carried from body to body
        fast: P⁺ = P − GDG*.
        joseph: P⁺ = τ̄Pτ̄* + GJG*, τ̄ = I − GH: a sum of squares, but not more accurate; for demonstration.
        ud: U⁺ and w⁺ of P⁺ = U⁺ diag(w⁺) U⁺*. No difference of inertias is taken: see `factors_across_hinge`.
        square-root: the same of P⁺ = LL*, w = 1.

    Raises ArithmeticError, naming body and hinge, if no D⁻¹(k) exists (see `SINGULAR`), and if an inertia is indefinite and the form needs
    its factors.
    """
    if form not in FORMS:
        raise ValueError(f"form={form!r}: there are {', '.join(FORMS)}")
    cross = inertia_across_hinge if form in ("fast", "joseph") else factors_across_hinge
    shapes = {"P": o.M, "P_plus": o.M, "D": o.J, "D_inverse": o.J, "G": o.H.T}
    made = {name: np.zeros(x.shape, np.result_type(o.E, o.H)) for name, x in shapes.items()}
    carried = {}  # P⁺(k), or (U⁺(k), w⁺(k))
    for k in reversed(range(len(o.parents))):
        s, t = o.states[k], o.coordinates[k]
        outboard = [(o.E[s, o.states[c]], carried[c]) for c, p in enumerate(o.parents) if p == k]
        here, carried[k] = cross(o.M[s, s], outboard, o.H[t, s], o.J[t, t], form, partial(o.require_regular, k))
        for name, where in {"P": (s, s), "P_plus": (s, s), "D": (t, t), "D_inverse": (t, t), "G": (s, t)}.items():
            made[name][where] = here[name]
    return SimpleNamespace(**{name: converted(x, mpmath_context(o.I)) for name, x in made.items()})


def inertia_across_hinge(M, outboard, H, J, form, require_regular):
    """The operators of one body, and P⁺, which is carried on: see `articulated_inertia`."""
    P = M + sum(E @ P_plus @ E.T for E, P_plus in outboard)
    D = H @ P @ H.T + J
    require_regular(D)
    G = P @ H.T @ inv(D)
    tau_bar = np.eye(len(M)) - G @ H
    P_plus = P - G @ D @ G.T if form == "fast" else tau_bar @ P @ tau_bar.T + G @ J @ G.T
    P_plus = (P_plus + P_plus.T) / 2
    return dict(P=P, P_plus=P_plus, D=D, D_inverse=inv(D), G=G), P_plus


def factors_across_hinge(M, outboard, H, J, form, require_regular):
    """The operators of one body, and (U⁺, w⁺) of P⁺ = U⁺ diag(w⁺) U⁺*, which is carried on: see `articulated_inertia`.

    P = A diag(w) A* with the columns of M and of all children, A = [U_M, E_φ(k,c)U⁺(c), ...]; J = A_J diag(w_J) A_J*. The rows
    [HA, A_J] first and [A, 0] after them are made orthogonal in the inner product diag(w, w_J), by weighted Gram–Schmidt (Bierman
    and Thornton) or, with the weights' roots in A, by Householder's reflections, rows of A heaviest first:

        [HA, A_J]   [U_D    0] [V_D]      D = U_D diag(d) U_D*      G = A diag(w) V_D* d⁻¹ U_D⁻¹
        [ A,  0 ] = [GU_D  U⁺] [V⁺ ]      P⁺ = U⁺ diag(w⁺) U⁺*,  w⁺ the squares of the rows V⁺

    Where J = 0, NA stands for A, N the rows of the identity that complete H to a basis, and [H; N]⁻¹ takes it back: HU⁺ = 0.
    """
    columns = [unit_factors(M), *[(E @ U, w) for E, (U, w) in outboard]]
    A, w = np.hstack([U for U, _ in columns]), np.concatenate([w for _, w in columns])
    A_J, w_J = unit_factors(J)
    if form == "square-root":
        A, A_J, w, w_J = A * w**0.5, A_J * w_J**0.5, np.ones(len(w)), np.ones(len(w_J))
    n, hinge, weights = len(H), np.hstack([H @ A, A_J]), np.concatenate([w, w_J])
    require_regular(root=lower_triangle(hinge * weights**0.5))
    N, C = (np.eye(len(M)),) * 2 if len(w_J) else completion(H)
    body = np.hstack([N @ A, np.zeros((len(N), len(w_J)), A.dtype)])
    if form == "square-root":
        order = np.argsort(-(body**2).sum(axis=1), kind="stable")
        U, d = lower_triangle(np.vstack([hinge, body[order]])), np.ones(n + len(body))
        U[n + order] = U[n:]
    else:
        U, d = gram_schmidt(np.vstack([hinge, body]), weights)
    U_D_inverse, d_D, U_plus, w_plus = inv(U[:n, :n]), d[:n], C @ U[n:, n:], d[n:]
    G = A * w @ (U_D_inverse @ H @ A).T / d_D @ U_D_inverse
    D, D_inverse = hinge * weights @ hinge.T, U_D_inverse.T / d_D @ U_D_inverse
    return dict(P=A * w @ A.T, P_plus=U_plus * w_plus @ U_plus.T, D=D, D_inverse=D_inverse, G=G), (U_plus, w_plus)
