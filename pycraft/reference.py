"""The oracle: every operator of the algebra as a dense NumPy matrix, textbook-literal and slow.

Each operator is the formula that its docstring states: matrices are formed, inverses are inverses, recursions are loops
over bodies. The module imports NumPy and SciPy only, and nothing of the rest of the package, so agreement with it is
evidence. Notation and results follow A. Jain, *Robot and Multibody Dynamics*, Springer 2011; `*` is the transpose.

Conventions: SI units and radians; spatial vectors are angular part first, about the body frame's origin, in body-frame
components; the body frame is the outboard side of the body's hinge; parents come before children, generalized
coordinates in the same order. Θ holds generalized coordinates (nv), V and F stacked body motions and forces (6n).

A model is a plain dictionary, the *description*; lists may stand for arrays::

    {"name": str, "gravity": (3,) in world axes,
     "bodies": [{"name": str, "parent": int (-1 is the base), "mass": float, "com": (3,),
                 "inertia": (3, 3) about the centre of mass in body axes,
                 "hinge": {"name": str, "kind": str, "rotor_inertia": (nv_k,),
                           "placement": {"rotation": (3, 3), "position": (3,)},   # inboard frame in the parent's frame
                           "subhinges": [{"kind": "pin" | "slider" | "screw" | "ball" | "free",
                                          "axis": (3,), "point": (3,), "pitch": metres per radian}, ...]}}, ...],
     "nodes": [{"name": str, "body": int, "rotation": (3, 3), "position": (3,)}, ...]}

Numbers. All functions compute in the numbers that the coordinates are of: float64; complex, so that a complex step
differentiates them to rounding; or, in arrays of dtype object, mpmath numbers of any number of digits::

    with mpmath.workdps(60):
        vdot = reference.forward_dynamics(description, q * mpmath.mpf(1), v, tau)  # (nv,), dtype object, 60 digits

Velocities, forces and the description may stay doubles, which are then taken as exact. Only what a double cannot be, a unit axis or
an orthogonal rotation, is made so to the present digits: an axis is divided by its length, a rotation is that of its quaternion.
Raw blocks (`sko_operators`) are given as arrays of mpmath numbers.

Forms. The articulated-body inertia is carried from tip to base in one of the `FORMS` of `articulated_inertia`, which agree but for
rounding; `form=` chooses it wherever it matters.
"""

from functools import cached_property, partial, reduce
from types import SimpleNamespace

import numpy as np
from scipy.linalg import expm

Q_SIZE = {"pin": 1, "slider": 1, "screw": 1, "ball": 4, "free": 7}
V_SIZE = {"pin": 1, "slider": 1, "screw": 1, "ball": 3, "free": 6}

FORMS = ("fast", "joseph", "ud", "square-root")

# D(k) counts as singular where its smallest singular value, in units in which |H||R||H*| + |J| (D with all outboard hinges
# locked and no cancellation) has a diagonal of ones, is at most SINGULAR eps. What rounding leaves of an exact zero is below 2 eps
# there on random chains; a chain of ten links with a tip 1e13 times heavier still has 50 eps, a legitimate D. The forms that carry
# factors have a root of D, and hold its singular values against the same limit: theirs of D is (SINGULAR eps)².
SINGULAR = 16


# Numbers --------------------------------------------------------------------------------------------------------------


def mpmath_context(*arrays):
    """The mpmath context (its functions and precision) of the numbers in the arrays; None where they hold NumPy's own numbers."""
    objects = (x for array in arrays if array.dtype == object for x in array.flat)
    return next((x.context for x in objects if hasattr(x, "context")), None)


def converted(x, context):
    """The array x in numbers of an mpmath context, exactly; x itself where that is None."""
    return x if context is None else np.vectorize(context.convert, otypes=[object])(x)


def in_doubles(x):
    """The array x rounded to doubles where it holds mpmath numbers."""
    return x.astype(float) if x.dtype == object else x


def epsilon(x):
    """The distance from one to the next number of the kind in the array x."""
    context = mpmath_context(x)
    return np.finfo(float).eps if context is None else context.eps


def inv(A):
    """A⁻¹; that of mpmath numbers by Gauss–Jordan elimination, the largest entry of a column its pivot. ArithmeticError if singular."""
    if mpmath_context(A) is None:
        return np.linalg.inv(in_doubles(A))
    n, A = len(A), np.hstack([A, np.eye(len(A))])
    for j in range(n):
        i = j + np.argmax(abs(A[j:, j]))
        A[[i, j]] = A[[j, i]]
        A[j] = A[j] / A[j, j]
        filled = A[j] != 0
        for i in np.flatnonzero(A[:, j] != 0):
            if i != j:
                A[i, filled] = A[i, filled] - A[i, j] * A[j, filled]
    return A[:, n:]


def smallest_singular_value(A):
    """σ_min of the square matrix A; of mpmath numbers 1/‖A⁻¹‖_F, which is below it by a factor √n at most."""
    if mpmath_context(A) is None:
        return np.linalg.svd(in_doubles(A), compute_uv=False).min()
    try:
        return 1 / (inv(A) ** 2).sum() ** 0.5
    except ZeroDivisionError:
        return 0


def exponential(A):
    """exp(A)."""
    context = mpmath_context(A)
    return expm(A) if context is None else np.array(context.expm(context.matrix(A.tolist())).tolist(), object)


def in_the_numbers_of(q, description):
    """The description in the numbers of q: doubles are exact, but for unit axes and orthogonal rotations, made so to the digits."""
    context = mpmath_context(np.asarray(q))
    if context is None:
        return description

    def number(x):
        return converted(np.asarray(x, float), context)[()]

    def subhinge(s):
        axis = number(s["axis"])
        return {**s, "axis": axis / (axis @ axis) ** 0.5, "point": number(s["point"]), "pitch": number(s["pitch"])}

    def placed(x):
        return {"rotation": rotation_from_quaternion(quaternion_from_rotation(number(x["rotation"]))), "position": number(x["position"])}

    def hinge(h):
        rotors, subhinges = number(h["rotor_inertia"]), [subhinge(s) for s in h["subhinges"]]
        return {**h, "rotor_inertia": rotors, "placement": placed(h["placement"]), "subhinges": subhinges}

    bodies = [{**b, "hinge": hinge(b["hinge"]), **{x: number(b[x]) for x in ("mass", "com", "inertia")}} for b in description["bodies"]]
    nodes = [{**node, **placed(node)} for node in description["nodes"]]
    return {**description, "gravity": number(description["gravity"]), "bodies": bodies, "nodes": nodes}


# Spatial algebra ------------------------------------------------------------------------------------------------------


def skew(u):
    """ũ, (3, 3): ũ w = u × w."""
    return np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])


def crm(V):
    """Ṽ, (6, 6), cross product of motions: [[ω̃, 0], [ṽ, ω̃]] for V = (ω; v)."""
    return np.block([[skew(V[:3]), np.zeros((3, 3))], [skew(V[3:]), skew(V[:3])]])


def crf(V):
    """V̄, (6, 6), cross product of a motion and a force: [[ω̃, ṽ], [0, ω̃]] = −Ṽ*."""
    return np.block([[skew(V[:3]), skew(V[3:])], [np.zeros((3, 3)), skew(V[:3])]])


def pose(rotation, position):
    """X, (4, 4): the frame with the given orientation and origin; X maps its coordinates to those of the reference."""
    return np.block([[np.asarray(rotation), np.reshape(position, (3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])


def force_transform(X):
    """φ(p,k), (6, 6), carries forces from frame k to frame p: [[R, l̃R], [0, R]], X = (R, l) the pose of k in p."""
    R, l = X[:3, :3], X[:3, 3]
    return np.block([[R, skew(l) @ R], [np.zeros((3, 3)), R]])


def rotation_from_quaternion(q):
    """R(q), (3, 3): (w² − u·u)I + 2uu* + 2wũ of q/|q| = (w, u). Raises ValueError where |q| < 1e-8 or is not finite."""
    norm = np.dot(q, q) ** 0.5
    if not 1e-8 <= abs(norm) < np.inf:  # false for NaN, too
        raise ValueError(f"the quaternion {np.array2string(np.asarray(q))} has no direction")
    w, u = q[0] / norm, q[1:] / norm
    return (w * w - u @ u) * np.eye(3) + 2 * np.outer(u, u) + 2 * w * skew(u)


def quaternion_from_rotation(R):
    """A quaternion of the rotation R, of any length, from the largest of its four squares: 4w² = 1 + tr R, 4x² = 1 + 2R₀₀ − tr R, ..."""
    trace, (a, b, c) = np.trace(R), (R - R.T)[[2, 0, 1], [1, 2, 0]]
    symmetric = R + R.T + (1 - trace) * np.eye(3)
    i = np.argmax([trace, *np.diag(R)])
    return np.array([1 + trace, a, b, c]) if i == 0 else np.array([(a, b, c)[i - 1], *symmetric[i - 1]])


def spatial_inertia(body):
    """M(k), (6, 6): [[𝓘 − m c̃c̃, m c̃], [−m c̃, m I]], 𝓘 about the centre of mass c, about the body frame's origin."""
    m, c = body["mass"], skew(body["com"])
    return np.block([[np.asarray(body["inertia"]) - m * c @ c, m * c], [-m * c, m * np.eye(3)]])


# Hinges ---------------------------------------------------------------------------------------------------------------


def subhinge_rows(subhinge):
    """Rows of H of one subhinge, (n_v, 6), in the frame after its own step: axis a through the point c.

    pin (a; c×a), slider (0; a), screw (a; c×a + pitch a), ball (e_i; c×e_i), free: the identity.
    """
    a, c = np.asarray(subhinge["axis"]), np.asarray(subhinge["point"])
    return {
        "pin": lambda: np.array([[*a, *np.cross(c, a)]]),
        "slider": lambda: np.array([[0, 0, 0, *a]]),
        "screw": lambda: np.array([[*a, *(np.cross(c, a) + subhinge["pitch"] * a)]]),
        "ball": lambda: np.array([[*e, *np.cross(c, e)] for e in np.eye(3)]),
        "free": lambda: np.eye(6),
    }[subhinge["kind"]]()


def subhinge_step(subhinge, q):
    """Pose of the frame after the subhinge in the frame before it, (4, 4), at its coordinates q (Q_SIZE of its kind).

    pin, slider, screw: exp(h q) on SE(3); ball: R(q) about the point c, which stays; free: (R(q₀..₃), q₄..₆).
    """
    if subhinge["kind"] == "free":
        return pose(rotation_from_quaternion(q[:4]), q[4:])
    if subhinge["kind"] == "ball":
        R, c = rotation_from_quaternion(q), np.asarray(subhinge["point"])
        return pose(R, c - R @ c)
    (h,) = subhinge_rows(subhinge)
    return exponential(np.block([[skew(h[:3]), h[3:, None]], [np.zeros((1, 4))]]) * q[0])


def hinge_kinematics(body, q):
    """X, (4, 4), the body frame in the parent's frame: placement · step₁(q₁) · step₂(q₂) · ..., and the rows of H(k).

    One (n_v, 6) array of rows per subhinge, carried to the body frame: h_j' = φ*(later steps) h_j.
    Raises ValueError, naming hinge and body, for a quaternion without direction.
    """
    hinge = body["hinge"]
    pieces = split(q, [Q_SIZE[s["kind"]] for s in hinge["subhinges"]])
    try:
        steps = [subhinge_step(s, x) for s, x in zip(hinge["subhinges"], pieces, strict=True)]
    except ValueError as error:
        raise ValueError(f"hinge '{hinge['name']}' of body '{body['name']}': {error}") from None
    X, rows = pose(**hinge["placement"]), []
    for j, subhinge in enumerate(hinge["subhinges"]):
        X = X @ steps[j]
        later = reduce(np.matmul, steps[j + 1 :], np.eye(4))
        rows.append(subhinge_rows(subhinge) @ force_transform(later))  # (φ*h)* = h*φ
    return X, rows


def split(x, sizes):
    """The array x cut into consecutive pieces of the given sizes; ValueError unless they add up to its length."""
    x, ends = np.asarray(x), np.cumsum(np.array(sizes, int))
    if x.shape != (sum(sizes),):
        raise ValueError(f"expected an array of shape ({sum(sizes)},), got {x.shape}")
    return [x[end - size : end] for end, size in zip(ends, sizes, strict=True)]


def hinge_sizes(description, table):
    """Number of coordinates of each body's hinge: table is Q_SIZE (sums to nq) or V_SIZE (sums to nv)."""
    return [sum(table[s["kind"]] for s in body["hinge"]["subhinges"]) for body in description["bodies"]]


def block_diagonal(blocks):
    """Block-diagonal matrix of the given blocks, blocks without rows or columns among them; (0, 0) for none."""
    rows, columns = (np.cumsum([0, *[np.shape(b)[axis] for b in blocks]]) for axis in (0, 1))
    A = np.zeros((rows[-1], columns[-1]), np.result_type(float, *map(np.asarray, blocks)))
    for k, block in enumerate(blocks):
        A[rows[k] : rows[k + 1], columns[k] : columns[k + 1]] = block
    return A


# The articulated-body inertia, by form --------------------------------------------------------------------------------


def unit_factors(A):
    """U, w: A = U diag(w) U* with as many columns and weights w > 0 as A, symmetric and positive semidefinite, has rank.

    LDL*, the next pivot the one that elimination left most of, as long as that is more than n eps of it. ArithmeticError where
    a diagonal term turns negative instead: A is indefinite.
    """
    whole, columns, w = np.where(np.diag(A) > 0, np.diag(A), 1), [np.zeros((len(A), 0), A.dtype)], []
    while (left := np.diag(A) / whole).max(initial=0) > len(A) * epsilon(A):
        i = np.argmax(left)
        columns.append(A[:, i : i + 1] / A[i, i])
        w.append(A[i, i])
        A = A - w[-1] * columns[-1] @ columns[-1].T
    if left.min(initial=0) < -len(A) * epsilon(A):
        raise ArithmeticError("an inertia is indefinite: only the forms 'fast' and 'joseph' take it")
    return np.hstack(columns), np.array(w, A.dtype)


def gram_schmidt(rows, w):
    """U, d: U unit lower triangular, rows diag(w) rows* = U diag(d) U*; each row in turn leaves the later ones, weighted by w."""
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
    form : what is carried from body to body
        fast: P⁺ = P − GDG*.
        joseph: P⁺ = τ̄Pτ̄* + GJG*, τ̄ = I − GH: a sum of squares, no more accurate for it; an exhibit.
        ud: U⁺ and w⁺ of P⁺ = U⁺ diag(w⁺) U⁺*. No difference of inertias is taken: see `factors_across_hinge`.
        square-root: the same of P⁺ = LL*, w = 1.

    Raises ArithmeticError, naming body and hinge, where no D⁻¹(k) exists (see `SINGULAR`), and where an inertia is indefinite and
    the form needs its factors.
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


# The algebra over blocks of any size ----------------------------------------------------------------------------------


def symbol(formula, meaning):
    """An attribute computed from the others by its formula when first read, with its meaning as docstring."""
    attribute = cached_property(formula)
    attribute.__doc__ = meaning
    return attribute


class Operators:
    """The symbols of the algebra over a tree of bodies with blocks of any size, as dense arrays: see `sko_operators`.

    V and F have the size of all body states (6n for rigid bodies), Θ that of all hinge coordinates (nv). E: E_φ, F → F;
    H: hinge map, F → Θ; M: inertias, V → F; J: hinge-diagonal term, Θ → Θ, symmetric. form: see `articulated_inertia`.
    """

    def __init__(self, parents, E_blocks, H_blocks, M_blocks, J_blocks=None, names=None, form="fast"):
        H_blocks = [np.reshape(h, (len(h), len(m))) for h, m in zip(H_blocks, M_blocks, strict=True)]  # [] is a block too
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
        """Raise ArithmeticError, naming body k and its hinge, where D = D(k) = root root* is singular to rounding (see `SINGULAR`)."""
        s, t = self.states[k], self.coordinates[k]
        locked = np.diag(abs(self.H[t, s]) @ abs(self.R[s, s]) @ abs(self.H[t, s]).T + abs(self.J[t, t])) ** 0.5
        scale = np.where(locked == 0, 1, locked)
        scaled = D / np.outer(scale, scale) if root is None else root / scale[:, None]
        if scaled.size and smallest_singular_value(scaled) <= SINGULAR * epsilon(scaled):
            raise ArithmeticError(f"D is singular at {self.names[k]}: some motion of its hinge meets no inertia")

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
    """The algebra of a tree given by raw blocks: s_k states and n_k hinge coordinates at body k, zero included.

    Parameters
    ----------
    parents : index of each body's parent, −1 for roots; parents come before children
    E_blocks : E_φ(p,k), (s_p, s_k) each; None for roots
    H_blocks, M_blocks : H(k), (n_k, s_k), and M(k), (s_k, s_k), symmetric
    J_blocks : hinge-diagonal terms J(k), (n_k, n_k), symmetric; zero where None
    form : of the articulated-body inertia, one of `FORMS`

    Returns
    -------
    Operators : E phi phi_tilde H M J R P P_plus D G K tau tau_bar E_psi psi psi_tilde Upsilon Omega I innovations mass_matrix
        (HφMφ*H*, without J) mass_matrix_inverse (of ℳ + J), each computed when first read. Those that need P raise
        ArithmeticError where a D(k) is singular.

    Examples
    --------
    Two unit masses on a line, each on a slider: the articulated mass at the inner one is its own alone.

    >>> line = sko_operators([-1, 0], [None, [[1.0]]], [[[1.0]], [[1.0]]], [[[1.0]], [[1.0]]])
    >>> line.P.tolist(), line.mass_matrix.tolist()
    ([[1.0, 0.0], [0.0, 1.0]], [[2.0, 1.0], [1.0, 1.0]])
    """
    return Operators(parents, E_blocks, H_blocks, M_blocks, J_blocks, form=form)


# The algebra of a rigid multibody model -------------------------------------------------------------------------------


class RigidOperators(Operators):
    """`Operators` of rigid bodies, with what mechanics adds: see `operators`."""

    def __init__(self, description, q, v=None, form="fast"):
        description = in_the_numbers_of(q, description)
        bodies = description["bodies"]
        q_sizes, v_sizes = hinge_sizes(description, Q_SIZE), hinge_sizes(description, V_SIZE)
        self.description = description
        kinematics = list(map(hinge_kinematics, bodies, split(q, q_sizes)))
        self.X, self.rows = [X for X, _ in kinematics], [rows for _, rows in kinematics]
        v = np.concatenate([np.zeros(0), *split(np.zeros(sum(v_sizes)) if v is None else v, v_sizes)])
        self.v = converted(v, mpmath_context(np.asarray(q)))
        E_blocks = [force_transform(X) if body["parent"] >= 0 else None for X, body in zip(self.X, bodies, strict=True)]
        H_blocks = [np.vstack([np.zeros((0, 6)), *rows]) for rows in self.rows]
        J_blocks = [np.diag(np.asarray(body["hinge"]["rotor_inertia"])) for body in bodies]
        names = [f"hinge '{body['hinge']['name']}' of body '{body['name']}'" for body in bodies]
        super().__init__([b["parent"] for b in bodies], E_blocks, H_blocks, list(map(spatial_inertia, bodies)), J_blocks, names, form)

    def each(self, function, x):
        """Block diagonal of function(x(k)) over the bodies, (6n, 6n), for stacked 6-vectors x (6n,)."""
        return block_diagonal([function(x[s]) for s in self.states])

    def world_pose(self, k):
        """Pose of body k in the world, (4, 4); the base, k = −1, is the world."""
        return np.eye(4) if k < 0 else self.world_pose(self.parents[k]) @ self.X[k]

    def node(self, name):
        """(body, pose in the body) of the named node, or of the body of that name; ValueError where there is neither."""
        bodies = {body["name"]: (k, np.eye(4)) for k, body in enumerate(self.description["bodies"])}
        nodes = {node["name"]: (node["body"], pose(node["rotation"], node["position"])) for node in self.description["nodes"]}
        if name not in bodies | nodes:
            raise ValueError(f"no node or body is named '{name}'")
        return (bodies | nodes)[name]

    def B(self, names):
        """B: pick-off of the named nodes, F(nodes) → F, (6n, 6m): block (body, node) = φ(body, node); zero on the base."""
        B = np.zeros((len(self.M), 6 * len(names)), self.E.dtype)
        for j, (k, X) in enumerate(map(self.node, names)):
            if k >= 0:
                B[self.states[k], 6 * j : 6 * j + 6] = force_transform(X)
        return B

    def Jacobian(self, names):
        """𝒥: node Jacobian, Θ → V(nodes), (6m, nv), in the nodes' own axes: B*φ*H*."""
        return self.B(names).T @ self.phi.T @ self.H.T

    def Lambda(self, names):
        """Λ: operational-space inertia of the named nodes, V(nodes) → F(nodes), (6m, 6m): (B*ΩB)⁻¹.

        Raises ArithmeticError where 𝒥 lacks full row rank: the nodes then have motions that no hinge can give them.
        """
        J = self.Jacobian(names)
        if min(J.shape) < len(J) or (J.size and np.linalg.matrix_rank(in_doubles(J)) < len(J)):
            raise ArithmeticError(f"B*ΩB is singular for the nodes {list(names)}")
        return inv(self.B(names).T @ self.Omega @ self.B(names))

    def Delta(self, i):
        """Δ_i, F → F, (6n, 6n): crf(h_i) at the body of coordinate i, h_i the column of H*; ∂E_φ/∂θ_i = E_φΔ_i."""
        return self.each(crf, self.H[i])

    @cached_property
    def H_dot(self):
        """Ḣ, F → Θ, (nv, 6n), block diagonal: H_j(k) crf(Σ_{i>j} H_i*(k)θ̇_i) in the rows of subhinge j, i those after it."""
        blocks = []
        for rows, t in zip(self.rows, self.coordinates, strict=True):
            velocities = [h.T @ speed for h, speed in zip(rows, split(self.v[t], [len(h) for h in rows]), strict=True)]
            later = [sum(velocities[j + 1 :], np.zeros(6)) for j in range(len(rows))]
            blocks.append(np.vstack([np.zeros((0, 6)), *[h @ crf(w) for h, w in zip(rows, later, strict=True)]]))
        return block_diagonal(blocks)

    @cached_property
    def a_gravity(self):
        """Gravity as base acceleration −g, (6n,): −φ*(0,r)(0; g) at the roots r, zero elsewhere; φ* spreads it."""
        g = np.array([0, 0, 0, *self.description["gravity"]])
        blocks = [-force_transform(X).T @ g if p < 0 else np.zeros(6) for p, X in zip(self.parents, self.X, strict=True)]
        return np.concatenate([np.zeros(0), *blocks])

    Delta_theta_dot = symbol(lambda o: o.each(crf, o.H.T @ o.v), "Δ_θ̇, F → F, block diagonal: crf(H*θ̇); Ė_φ = E_φΔ_θ̇.")
    V = symbol(lambda o: o.phi.T @ o.H.T @ o.v, "V: body velocities, (6n,): φ*H*θ̇.")
    V_tilde = symbol(lambda o: o.each(crm, o.V), "Ṽ, V → V, block diagonal: crm(V).")
    V_bar = symbol(lambda o: o.each(crf, o.V), "V̄, F → F, block diagonal: crf(V).")
    momentum_cross = symbol(
        lambda o: o.each(lambda p: -np.block([[skew(p[:3]), skew(p[3:])], [skew(p[3:]), np.zeros((3, 3))]]), o.M @ o.V),
        "𝓑, V → F, block diagonal, skew: −[[ñ, f̃], [f̃, 0]] with (n; f) = M(k)V(k); 𝓑V = V̄MV.",
    )
    a = symbol(
        lambda o: o.V_tilde @ o.H.T @ o.v + o.H_dot.T @ o.v + o.a_gravity,
        "a: velocity-dependent acceleration, and gravity at the roots, (6n,): ṼH*θ̇ + Ḣ*θ̇ + a_gravity.",
    )
    b = symbol(lambda o: o.V_bar @ o.M @ o.V, "b: gyroscopic forces, (6n,): V̄MV.")


def operators(description, q, v=None, form="fast"):
    """Every operator of a rigid multibody model at one state.

    Parameters
    ----------
    description : dict as in the module's docstring
    q, v : generalized coordinates (nq,) and velocities (nv,), zero where None
    form : of the articulated-body inertia, one of `FORMS`

    Returns
    -------
    RigidOperators : what `sko_operators` returns and, all in body-frame components, the attributes Delta_theta_dot V_tilde
        V_bar momentum_cross H_dot V a b a_gravity, and the methods B(names) Jacobian(names) Lambda(names) Delta(i) world_pose(k).
        Raises ValueError for arrays of wrong length and, naming body and hinge, for a quaternion without direction.

    Examples
    --------
    A mass of 2 kg, 3 m from a pin along z:

    >>> pin = dict(name="shoulder", kind="pin", rotor_inertia=[1.0], placement=dict(rotation=np.eye(3), position=np.zeros(3)),
    ...            subhinges=[dict(kind="pin", axis=[0, 0, 1], point=[0, 0, 0], pitch=0.0)])
    >>> link = dict(name="link", parent=-1, mass=2.0, com=[3, 0, 0], inertia=np.zeros((3, 3)), hinge=pin)
    >>> mass_matrix(dict(name="arm", gravity=[0, 0, 0], bodies=[link], nodes=[]), [0.5])
    array([[19.]])
    """
    return RigidOperators(description, q, v, form)


# Dynamics -------------------------------------------------------------------------------------------------------------


def inverse_dynamics_vectors(description, q, v, vdot):
    """alpha = φ*(H*θ̈ + a), f = φ(Mα + b), both (6n,), and T = Hf + Jθ̈, (nv,), as a namespace.

    With gravity α is the body-frame derivative of V less the field of gravity, and f the true interbody forces.
    """
    o = operators(description, q, v)
    alpha = o.phi.T @ (o.H.T @ vdot + o.a)
    f = o.phi @ (o.M @ alpha + o.b)
    return SimpleNamespace(alpha=alpha, f=f, T=o.H @ f + o.J @ vdot)


def forward_dynamics_vectors(description, q, v, tau, form="fast"):
    """z, epsilon, nu, alpha, f and vdot of the articulated-body recursion at generalized forces T = tau, as a namespace.

    z = ψ(KT + Pa + b), ε = T − Hz, ν = D⁻¹ε, α = ψ*(H*ν + a), f = P(α − a) + z, θ̈ = [I − HψK]*ν − K*ψ*a.
    """
    o = operators(description, q, v, form)
    z = o.psi @ (o.K @ tau + o.P @ o.a + o.b)
    epsilon = tau - o.H @ z
    nu = o.D_inverse @ epsilon
    alpha = o.psi.T @ (o.H.T @ nu + o.a)
    f = o.P @ (alpha - o.a) + z
    vdot = o.innovations.T @ nu - o.K.T @ o.psi.T @ o.a
    return SimpleNamespace(z=z, epsilon=epsilon, nu=nu, alpha=alpha, f=f, vdot=vdot)


def inverse_dynamics(description, q, v, vdot):
    """T, (nv,): (ℳ + J)θ̈ + 𝒞, the generalized forces that give the accelerations vdot against gravity."""
    return inverse_dynamics_vectors(description, q, v, vdot).T


def forward_dynamics(description, q, v, tau, form="fast"):
    """θ̈, (nv,): the accelerations under the generalized forces tau, and gravity. ArithmeticError if a D(k) is singular."""
    return forward_dynamics_vectors(description, q, v, tau, form).vdot


def bias_forces(description, q, v):
    """𝒞, (nv,): Hφ(Mφ*a + b), Coriolis, gyroscopic and gravity forces."""
    o = operators(description, q, v)
    return o.H @ o.phi @ (o.M @ o.phi.T @ o.a + o.b)


def mass_matrix(description, q):
    """ℳ + J, (nv, nv): HφMφ*H* + J, the mass matrix of the equations of motion (`Operators.mass_matrix` is without J)."""
    o = operators(description, q)
    return o.mass_matrix + o.J


def mass_matrix_inverse(description, q, form="fast"):
    """(ℳ + J)⁻¹, (nv, nv): [I − HψK]* D⁻¹ [I − HψK]. ArithmeticError if a D(k) is singular."""
    return operators(description, q, form=form).mass_matrix_inverse


def node_jacobian(description, name, q):
    """𝒥, (6, nv): twist of the named node or body, angular part first, in its own axes, per generalized velocity: B*φ*H*."""
    return operators(description, q).Jacobian([name])


def node_pose(description, name, q):
    """Pose of the named node or body in the world, (4, 4)."""
    o = operators(description, q)
    k, X = o.node(name)
    return o.world_pose(k) @ X


def kinetic_energy(description, q, v):
    """½V*MV + ½θ̇*Jθ̇, in joules."""
    o = operators(description, q, v)
    return (o.V @ o.M @ o.V + o.v @ o.J @ o.v) / 2


def potential_energy(description, q):
    """−Σ m(k) g·c(k), c(k) the centre of mass in the world, in joules; zero with the centre of mass at the world's origin."""
    o = operators(description, q)
    bodies, gravity = o.description["bodies"], o.description["gravity"]
    moments = [body["mass"] * (o.world_pose(k) @ [*body["com"], 1.0])[:3] for k, body in enumerate(bodies)]
    return -sum(np.dot(gravity, moment) for moment in moments)
