"""Every letter of the algebra as a sparse matrix of closed forms: the formulas of `pycraft.reference`, entry by entry exact.

Notation and conventions are those of `docs/notation.md`; `*` is the transpose. [Jain 2011]
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from itertools import accumulate
from typing import Any

import sympy

from .. import _core
from .parameters import Parameters
from .sparse import Matrix
from .sparse_hinges import KINDS, Hinges
from .sparse_spatial import Pose, composed, crf, crm, force_transform, in_blocks, momentum_cross, skew, still


class Letters:
    """The letters of a tree of rigid bodies at symbols q and v. Each is computed on first use.

    Parameters
    ----------
    parameters : of the model
    q, v : symbols of the coordinates and velocities
    unit : assume unit quaternions; otherwise q/|q|
    """

    def __init__(self, parameters: Parameters, q: Sequence[sympy.Symbol], v: Sequence[sympy.Symbol], unit: bool):
        self.parameters, self.v = parameters, list(v)
        self.hinges = Hinges(parameters, q, v, unit)
        self.field = self.hinges.field
        self.parents = [b["parent"] for b in parameters.bodies]
        ends = list(accumulate(sum(KINDS[s["kind"]].nv for s in b["subhinges"]) for b in parameters.bodies))
        self.coordinates = [slice(i, j) for i, j in zip([0, *ends], ends, strict=False)]
        self.states = [slice(6 * k, 6 * k + 6) for k in range(len(self.parents))]
        self._made: dict[Any, Matrix] = {}

    def _matrix(self, entries: Sequence[Sequence[Any]], columns: int | None = None) -> Matrix:
        return Matrix.of(self.field, entries, columns)

    # ------------------------------------------------------------------ letters
    def __call__(self, name: str, of: tuple[Any, ...] = ()) -> Matrix:
        """Return a letter by its ASCII name, and its arguments as in `Letter.arguments`."""
        if (name, of) not in self._made:
            if name not in LETTERS:
                raise _core.EvaluationError(f"the letter {name!r} has no closed form here")
            self._made[name, of] = LETTERS[name](self, of) if of else LETTERS[name](self)  # type: ignore[call-arg]  # as the letter takes
        return self._made[name, of]

    def _zeros(self, rows: str, columns: str) -> Matrix:
        size = {"t": self.coordinates[-1].stop if self.coordinates else 0, "s": 6 * len(self.parents)}
        return Matrix.zeros(self.field, size[rows], size[columns])

    def _diagonal(self, blocks: Sequence[Matrix]) -> Matrix:
        return Matrix.diagonal(self.field, list(blocks))

    def _each(self, make: Callable[[Matrix], Matrix], x: Matrix) -> Matrix:
        """Return the block diagonal of make(x(k))."""
        return Matrix.diagonal(x.field, [make(x.block(s, slice(0, 1))) for s in self.states])

    def _identity(self) -> Matrix:
        return Matrix.identity(self.field, 6 * len(self.parents))

    def _E(self) -> Matrix:
        made = self._zeros("s", "s")
        for k, p in enumerate(self.parents):
            if p >= 0:
                made.place(self.states[p], self.states[k], force_transform(self.hinges.poses[k]))
        return made

    def _resolvent(self, name: str) -> Matrix:
        """Return (I − E)⁻¹, block by block along the paths to the base: column k is e_k + E's column k in the parent's column."""
        E, made = self(name), self._identity()
        for k, p in enumerate(self.parents):
            if p >= 0:
                inboard = slice(0, self.states[p].stop)
                made.place(inboard, self.states[k], made.block(inboard, self.states[p]) @ E.block(self.states[p], self.states[k]))
        return made

    def _stacked(self, k: int) -> Matrix:
        """Return H(k)."""
        rows = [row for part in self.hinges.rows[k] for row in part.rows]
        return Matrix(self.field, rows, 6)

    def _inertia(self, k: int) -> Matrix:
        """Return M(k): [[𝓘 − m c̃c̃, m c̃], [−m c̃, m I]]."""
        body = self.parameters.bodies[k]
        c, m = skew(self._matrix([[x] for x in body["com"]], 1)), self.field.element(body["mass"])
        first = c.scaled(m)
        return in_blocks(self._matrix(body["inertia"]) - first @ c, first, -first, Matrix.identity(self.field, 3).scaled(m))

    def _J(self) -> Matrix:
        rotors = [r for b in self.parameters.bodies for r in b["rotor_inertia"]]
        return self._diagonal([self._matrix([[r]]) for r in rotors])

    def _carried(self, E: Matrix, inertias: Matrix, k: int) -> Matrix:
        """Return Σ over the children c of body k: E(k,c) X(c) E*(k,c)."""
        total = Matrix.zeros(self.field, 6, 6)
        for c, p in enumerate(self.parents):
            if p == k:
                block = E.block(self.states[k], self.states[c])
                total = total + block @ inertias.block(self.states[c], self.states[c]) @ block.T
        return total

    def _R(self) -> Matrix:
        """R(k) = M(k) + Σ E_φ(k,c)R(c)E_φ*(k,c), tip to base."""
        M, E, made = self("M"), self("E"), self._zeros("s", "s")
        for k in reversed(range(len(self.parents))):
            s = self.states[k]
            made.place(s, s, M.block(s, s) + self._carried(E, made, k))
        return made

    def _articulated(self, name: str) -> Matrix:
        """P(k) = M(k) + Σ E_φP⁺E_φ*, D = HPH* + J, G = PH*D⁻¹, P⁺ = τ̄P, tip to base: all four at once."""
        M, E, H, J = self("M"), self("E"), self("H"), self("J")
        P, P_plus, D, G = (self._zeros(*sizes) for sizes in ("ss", "ss", "tt", "st"))
        inverse = self._zeros("t", "t")
        for k in reversed(range(len(self.parents))):
            s, t = self.states[k], self.coordinates[k]
            inertia = M.block(s, s) + self._carried(E, P_plus, k)
            h = H.block(t, s)
            force = inertia @ h.T
            d = h @ force + J.block(t, t)
            try:
                inverted = d.inverse()
            except _core.SingularOperatorError:
                body = self.parameters.bodies[k]
                raise _core.SingularHingeError(
                    f"D is singular at hinge '{body['hinge']}' of body '{body['name']}': some motion of it feels no inertia at any state"
                ) from None
            gain = force @ inverted
            for made, row, column, block in (
                (P, s, s, inertia), (D, t, t, d), (inverse, t, t, inverted), (G, s, t, gain), (P_plus, s, s, inertia - gain @ force.T),
            ):  # fmt: skip
                made.place(row, column, block)
        self._made |= {(n, ()): x for n, x in zip(("P", "P_plus", "D", "D_inverse", "G"), (P, P_plus, D, inverse, G), strict=True)}
        return self._made[name, ()]

    def _Upsilon(self) -> Matrix:
        """Υ(k) = H*(k)D⁻¹(k)H(k) + E_ψ*(p,k)Υ(p)E_ψ(p,k), base to tip."""
        H, E, made = self("H"), self("E_psi"), self._zeros("s", "s")
        own = H.T @ self("D_inverse") @ H
        for k, p in enumerate(self.parents):
            s = self.states[k]
            block = own.block(s, s)
            if p >= 0:
                up = E.block(self.states[p], s)
                block = block + up.T @ made.block(self.states[p], self.states[p]) @ up
            made.place(s, s, block)
        return made

    # ------------------------------------------------------------------ nodes, coordinates, velocities
    def _node(self, name: str) -> tuple[int, Pose]:
        for k, body in enumerate(self.parameters.bodies):
            if body["name"] == name:
                return k, still(self.field)
        for node in self.parameters.nodes:
            if node["name"] == name:
                return node["body"], (self._matrix(node["rotation"]), self._matrix([[x] for x in node["position"]], 1))
        raise _core.ModelError(f"no node or body is called {name!r}")

    def _B(self, of: tuple[Any, ...]) -> Matrix:
        _, *names = of
        made = Matrix.zeros(self.field, 6 * len(self.parents), 6 * len(names))
        for j, name in enumerate(names):
            k, pose = self._node(name)
            if k >= 0:
                made.place(self.states[k], slice(6 * j, 6 * j + 6), force_transform(pose))
        return made

    def _Lambda(self, of: tuple[Any, ...]) -> Matrix:
        B = self("B", of)
        return (B.T @ self("Omega") @ B).inverse()

    def _twist(self, of: tuple[Any, ...]) -> Matrix:
        """Return h, stacked: the twist of a coordinate, or component c in the axes before subhinge p of body k; in the body's axes."""
        if of[0] == "coordinate":
            return self("H").T.block(slice(0, 6 * len(self.parents)), slice(of[1], of[1] + 1))
        _, k, position, component = of
        made = Matrix.zeros(self.field, 6 * len(self.parents), 1)
        unit = Matrix.identity(self.field, 6).block(slice(0, 6), slice(component, component + 1))
        made.place(
            self.states[k], slice(0, 1), force_transform(reduce(composed, self.hinges.steps[k][position:], still(self.field))).T @ unit
        )
        return made

    def _Delta(self, of: tuple[Any, ...]) -> Matrix:
        return self._each(crf, self("h", of))

    def _Pi(self, of: tuple[Any, ...]) -> Matrix:
        """Return Π: ones at one coordinate, or at those of subhinges first to last of hinge k (-1: of all)."""
        chosen = [of[1]]
        if of[0] == "subhinges":
            _, body, first, last = of
            chosen = []
            for k, (parts, t) in enumerate(zip(self.hinges.rows, self.coordinates, strict=True)):
                ends = list(accumulate((len(p.rows) for p in parts), initial=t.start))
                if body in (-1, k):
                    chosen += range(ends[min(first, len(parts))], ends[min(last, len(parts))])
        rows = [{i: self.field.one} if i in chosen else {} for i in range(len(self.v))]
        return Matrix(self.field, rows, len(self.v))

    def _dM(self, of: tuple[Any, ...]) -> Matrix:
        """Return ∂M by mass, centre of mass (3) and inertia (xx xy xz yy yz zz) of one body, one after the other."""
        _, k, *parameters = of
        m, *c = sympy.symbols("m c:3", cls=sympy.Dummy)
        inertia = sympy.symbols("i:6", cls=sympy.Dummy)
        xx, xy, xz, yy, yz, zz = inertia
        skew = sympy.Matrix([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
        body = self.parameters.bodies[k]
        block = sympy.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - m * skew * skew
        full = sympy.Matrix(sympy.BlockMatrix([[block, m * skew], [-m * skew, m * sympy.eye(3)]]))
        for p in parameters:
            full = full.diff([m, *c, *inertia][p])
        of = body["inertia"]
        values = [body["mass"], *body["com"], of[0][0], of[0][1], of[0][2], of[1][1], of[1][2], of[2][2]]
        full = full.subs(dict(zip([m, *c, *inertia], values, strict=True)))
        made = self._zeros("s", "s")
        made.place(self.states[k], self.states[k], self._matrix(full.tolist()))
        return made

    def function(self, name: str, x: Matrix) -> Matrix:
        """Return crm, crf or mcross of every body's part of a stacked vector."""
        makers = {"crm": crm, "crf": crf, "mcross": momentum_cross}
        if name not in makers:
            raise _core.EvaluationError(f"the function {name!r} has no closed form here")
        return self._each(makers[name], x)

    def _rotor_forces(self) -> Matrix:
        """Return θ̇ ×* (Jθ̇): by subhinges ω̃ of a ball's rates, crf of a free one's, zero of one coordinate."""
        x, at = self("theta_dot"), 0
        blocks = []
        for kind in (KINDS[s["kind"]] for b in self.parameters.bodies for s in b["subhinges"]):
            part = x.block(slice(at, at + kind.nv), slice(0, 1))
            blocks.append({3: skew, 6: crf}[kind.nv](part) if kind.nv > 1 else Matrix.zeros(x.field, 1, 1))
            at += kind.nv
        return Matrix.diagonal(x.field, blocks) @ self("J") @ x

    def _theta_dot(self) -> Matrix:
        return self._matrix([[x] for x in self.v], 1)

    def _H_dot(self) -> Matrix:
        """Row j of Ḣ(k) is row j of H(k) times crf of the velocity of the subhinges after j."""
        blocks, speeds = [], self("theta_dot")
        for parts, t in zip(self.hinges.rows, self.coordinates, strict=True):
            rows: list[dict[int, Any]] = []
            at = t.start
            for part in parts:
                at += len(part.rows)
                later = slice(at, t.stop)
                after = self._stacked_after(parts, part)
                rows += (part @ crf(after.T @ speeds.block(later, slice(0, 1)))).rows
            blocks.append(Matrix(self.field, rows, 6))
        return self._diagonal(blocks)

    def _stacked_after(self, parts: Sequence[Matrix], part: Matrix) -> Matrix:
        index = next(i for i, p in enumerate(parts) if p is part)
        return Matrix(self.field, [row for p in parts[index + 1 :] for row in p.rows], 6)

    def _world(self, k: int) -> Pose:
        own = self.hinges.poses[k]
        return own if self.parents[k] < 0 else composed(self._world(self.parents[k]), own)

    def _field_of_gravity(self, roots_only: bool) -> Matrix:
        """Return φ*(0,k)(0; g) at every body; at the roots alone and negative, the base's acceleration."""
        g = self._matrix([[0], [0], [0], *[[x] for x in self.parameters.gravity]], 1)
        rows: list[dict[int, Any]] = []
        for k, p in enumerate(self.parents):
            if roots_only:
                rows += (-force_transform(self._world(k)).T @ g).rows if p < 0 else [{} for _ in range(6)]
            else:
                rows += (force_transform((self._world(k)[0], still(self.field)[1])).T @ g).rows
        return Matrix(self.field, rows, 1)


LETTERS: dict[str, Callable[..., Matrix]] = {
    "E": Letters._E,
    "phi": lambda o: o._resolvent("E"),
    "phi_tilde": lambda o: o("phi") - o._identity(),
    "H": lambda o: o._diagonal([o._stacked(k) for k in range(len(o.parents))]),
    "M": lambda o: o._diagonal([o._inertia(k) for k in range(len(o.parents))]),
    "J": Letters._J,
    "R": Letters._R,
    "P": lambda o: o._articulated("P"),
    "P_plus": lambda o: o._articulated("P_plus"),
    "D": lambda o: o._articulated("D"),
    "D_inverse": lambda o: o._articulated("D_inverse"),
    "G": lambda o: o._articulated("G"),
    "K": lambda o: o("E") @ o("G"),
    "tau": lambda o: o("G") @ o("H"),
    "tau_bar": lambda o: o._identity() - o("tau"),
    "E_psi": lambda o: o("E") @ o("tau_bar"),
    "psi": lambda o: o._resolvent("E_psi"),
    "psi_tilde": lambda o: o("psi") - o._identity(),
    "Upsilon": Letters._Upsilon,
    "Omega": lambda o: o("psi").T @ o("H").T @ o("D_inverse") @ o("H") @ o("psi"),
    "B": Letters._B,
    "Jacobian": lambda o, of: o("B", of).T @ o("phi").T @ o("H").T,
    "Lambda": Letters._Lambda,
    "Delta": Letters._Delta,
    "h": Letters._twist,  # this and the next two come up in derivatives
    "Pi": Letters._Pi,
    "dM": Letters._dM,
    "theta_dot": Letters._theta_dot,
    "H_dot": Letters._H_dot,
    "Delta_theta_dot": lambda o: o._each(crf, o("H").T @ o("theta_dot")),
    "velocity": lambda o: o("phi").T @ o("H").T @ o("theta_dot"),
    "V_tilde": lambda o: o._each(crm, o("velocity")),
    "V_bar": lambda o: o._each(crf, o("velocity")),
    "momentum_cross": lambda o: o._each(momentum_cross, o("M") @ o("velocity")),
    "a": lambda o: o("V_tilde") @ o("H").T @ o("theta_dot") + o("H_dot").T @ o("theta_dot"),
    "b": lambda o: o("V_bar") @ o("M") @ o("velocity"),
    "X_world": lambda o: o._diagonal([force_transform(o._world(k)) for k in range(len(o.parents))]),
    "gravity_field": lambda o: o._field_of_gravity(False),
    "gravity_base": lambda o: o._field_of_gravity(True),
    # Frequent expressions with names: ℳ as typed, the equations of motion's mass matrix, its inverse, bias forces.
    "MM": lambda o: o("H") @ o("phi") @ o("M") @ o("phi").T @ o("H").T,
    "mass_matrix": lambda o: o("MM") + o("J"),
    "innovations": lambda o: Matrix.identity(o.field, len(o.v)) - o("H") @ o("psi") @ o("K"),
    "mass_matrix_inverse": lambda o: o("innovations").T @ o("D_inverse") @ o("innovations"),
    "bias_forces": lambda o: o("H") @ o("phi") @ (o("M") @ o("phi").T @ (o("a") + o("gravity_base")) + o("b")) + o._rotor_forces(),
}
