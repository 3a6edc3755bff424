"""The oracle: every operator of the algebra as a dense NumPy matrix, textbook-literal and slow.

Each operator is the formula in its docstring: matrices are formed, inverses are inverses, recursions are loops
over bodies. The modules `reference` and `reference_...` import NumPy and SciPy only, and nothing of the rest of the
package, so agreement with them is evidence. Notation and results follow A. Jain, *Robot and Multibody Dynamics*,
Springer 2011; `*` is the transpose.

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

Numbers. All functions compute in the number type of the coordinates: float64; complex, so that a complex step
differentiates them to rounding; or, in arrays of dtype object, mpmath numbers of any number of digits::

    with mpmath.workdps(60):
        vdot = reference.forward_dynamics(description, q * mpmath.mpf(1), v, tau)  # (nv,), dtype object, 60 digits

Velocities, forces and the description may stay doubles, which are then exact. Only values that a double cannot represent, a unit axis or an
orthogonal rotation, are computed to the present digits: an axis is divided by its length, a rotation comes from its quaternion. Raw blocks
(`sko_operators`) are given as arrays of mpmath numbers.

Forms. The articulated-body inertia is carried from tip to base in one of the `FORMS` of `articulated_inertia`, which agree except for
rounding; `form=` selects it wherever it matters.
"""

from functools import cached_property
from types import SimpleNamespace

import numpy as np

from .forms import FORMS, articulated_inertia  # noqa: F401 - part of this module's face
from .numbers import converted, in_doubles, inv, mpmath_context
from .spatial import (
    Q_SIZE,
    V_SIZE,
    crf,
    crm,
    force_transform,
    hinge_kinematics,
    hinge_sizes,
    in_the_numbers_of,
    pose,
    skew,
    spatial_inertia,
    split,
)
from .spatial import (
    subhinge_step as subhinge_step,
)
from .tree_operators import SINGULAR, Operators, block_diagonal, sko_operators, symbol  # noqa: F401 - part of this module's face

# The algebra of a rigid multibody model -------------------------------------------------------------------------------


class RigidOperators(Operators):
    """`Operators` of rigid bodies, with the operators of mechanics: see `operators`."""

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
        """Return (body, pose in the body) of the named node, or of the body of that name; ValueError for an unknown name."""
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

        Raises ArithmeticError if 𝒥 lacks full row rank: the nodes then have motions that no hinge can produce.
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

    @cached_property
    def hinge_cross(self):
        """θ̇ ×*, Θ → Θ, (nv, nv), block diagonal: ω̃ of a ball, crf(V) of a free subhinge, zero of one coordinate."""
        blocks, at = [], 0
        for body in self.description["bodies"]:
            for subhinge in body["hinge"]["subhinges"]:
                size = V_SIZE[subhinge["kind"]]
                v = self.v[at : at + size]
                blocks.append({1: lambda _: np.zeros((1, 1)), 3: skew, 6: crf}[size](v))
                at += size
        return block_diagonal(blocks)

    b_J = symbol(
        lambda o: o.hinge_cross @ o.J @ o.v, "b_J: gyroscopic forces of rotors, (nv,): θ̇ ×* (Jθ̇), of energy ½θ̇*Jθ̇ [Euler–Poincaré]."
    )


def operators(description, q, v=None, form="fast"):
    """Return every operator of a rigid multibody model at one state.

    Parameters
    ----------
    description : dict as in the module's docstring
    q, v : generalized coordinates (nq,) and velocities (nv,), zero if None
    form : of the articulated-body inertia, one of `FORMS`

    Returns
    -------
    RigidOperators : as from `sko_operators` and, all in body-frame components, the attributes Delta_theta_dot V_tilde V_bar momentum_cross
        H_dot V a b b_J hinge_cross a_gravity, and the methods B(names) Jacobian(names) Lambda(names) Delta(i) world_pose(k).
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
    """alpha = φ*(H*θ̈ + a), f = φ(Mα + b), both (6n,), and T = Hf + Jθ̈ + b_J, (nv,), as a namespace.

    With gravity α is the body-frame derivative of V minus the field of gravity, and f the true interbody forces.
    """
    o = operators(description, q, v)
    alpha = o.phi.T @ (o.H.T @ vdot + o.a)
    f = o.phi @ (o.M @ alpha + o.b)
    return SimpleNamespace(alpha=alpha, f=f, T=o.H @ f + o.J @ vdot + o.b_J)


def forward_dynamics_vectors(description, q, v, tau, form="fast"):
    """z, epsilon, nu, alpha, f and vdot of the articulated-body recursion at generalized forces T = tau, as a namespace.

    z = ψ(KT + Pa + b), ε = T − Hz with T = tau − b_J, ν = D⁻¹ε, α = ψ*(H*ν + a), f = P(α − a) + z, θ̈ = [I − HψK]*ν − K*ψ*a.
    """
    o = operators(description, q, v, form)
    T = tau - o.b_J
    z = o.psi @ (o.K @ T + o.P @ o.a + o.b)
    epsilon = T - o.H @ z
    nu = o.D_inverse @ epsilon
    alpha = o.psi.T @ (o.H.T @ nu + o.a)
    f = o.P @ (alpha - o.a) + z
    vdot = o.innovations.T @ nu - o.K.T @ o.psi.T @ o.a
    return SimpleNamespace(z=z, epsilon=epsilon, nu=nu, alpha=alpha, f=f, vdot=vdot)


def inverse_dynamics(description, q, v, vdot):
    """T, (nv,): (ℳ + J)θ̈ + 𝒞, the generalized forces that produce the accelerations vdot against gravity."""
    return inverse_dynamics_vectors(description, q, v, vdot).T


def forward_dynamics(description, q, v, tau, form="fast"):
    """θ̈, (nv,): the accelerations under the generalized forces tau, and gravity. ArithmeticError if a D(k) is singular."""
    return forward_dynamics_vectors(description, q, v, tau, form).vdot


def bias_forces(description, q, v):
    """𝒞, (nv,): Hφ(Mφ*a + b) + b_J, Coriolis, gyroscopic and gravity forces."""
    o = operators(description, q, v)
    return o.H @ o.phi @ (o.M @ o.phi.T @ o.a + o.b) + o.b_J


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
