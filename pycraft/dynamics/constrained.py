"""Forward dynamics and impacts of models on their loops, by tree augmentation or constraint embedding (docs/loops.md)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..arguments import chosen, one_number, text
from ..state import at_state
from .interbody import pushed

METHODS = ("augment", "embed")


class LoopForce(NamedTuple):
    """What a loop puts on the two frames that it joins, the moment first, each in its frame's axes about its origin (N m, N).

    b, a : (6,) or (B, 6); zeros of couplings, whose forces are those along their coordinates, Q*λ. Of velocities: impulses (N m s, N s).
    """

    b: np.ndarray
    a: np.ndarray


@dataclass(frozen=True)
class ConstrainedDynamics:
    """Accelerations of a model on its loops, with a leading axis (B, ...) for batches.

    Attributes
    ----------
    vdot : (nv,)
    multipliers : (rows,) in the order of `loops.rows`: (ℳ + J) v̇ + 𝒞 = τ + Q*λ. Of a row along a direction λ is the force on b by a there
        (N), of one about it the moment (N m).
    by_loop : the same by the loops' names, (rows of the loop,) each
    forces : `LoopForce` by the loops' names
    rank : () the rank of Q that was found; rows - rank multipliers are a choice, the least Σ λ², by embedding zero of rows left out
    """

    vdot: np.ndarray
    multipliers: np.ndarray
    by_loop: Mapping[str, np.ndarray]
    forces: Mapping[str, LoopForce]
    rank: np.ndarray


@dataclass(frozen=True)
class ConstrainedVelocities:
    """Velocities that keep the rows of all loops, after the impulse that takes a model there, with a leading axis for batches.

    Attributes
    ----------
    v : (nv,) with Q v = 0
    multipliers : (rows,) impulses: (ℳ + J)(v - v⁻) = p + Q*λ
    by_loop, forces, rank : as of `ConstrainedDynamics`
    """

    v: np.ndarray
    multipliers: np.ndarray
    by_loop: Mapping[str, np.ndarray]
    forces: Mapping[str, LoopForce]
    rank: np.ndarray


class ConstrainedCalls:
    """Equations of motion with the loops' forces in them."""

    nv: int
    loops: Any

    def constrained_dynamics(
        self, q=None, v=None, tau=None, *, wrenches: Mapping[Any, Any] | None = None, wrench_axes: str = "world", method: str = "augment",
        form: str = "fast", refine: int | str = 0, residual: str = "same", precision: str = "double", alpha: float = 0.0, beta: float = 0.0,
        independent: Any = None,
    ) -> ConstrainedDynamics:  # fmt: skip
        """Forward dynamics on the loops: v̇ that keeps every row, and the loops' forces. No mass matrix is formed.

        (ℳ + J) v̇ + 𝒞 = τ + Q*λ,   Q v̇ + Q̇v + 2α Qv + β² r = 0,   by   Q(ℳ + J)⁻¹Q* λ = -(Q v̇_free + ...):

        v̇_free and the factors of Q(ℳ + J)⁻¹Q* by the articulated bodies, of each group of loops that share hinges by itself. Dependent
        rows are found by rank, and have the multipliers of least Σ λ²; v̇ does not hang on that choice.

        By "embed" the bodies around loops that hang together are one body of a tree without loops, v = X v_r, γ = Ẋv_r:

        X*(ℳ + J)X v̇_r = X*(τ - 𝒞 - (ℳ + J)γ),   v̇ = X v̇_r + γ

        no multiplier is solved for, and bodies without mass are fine that move with others. λ follows from v̇: zero of rows that hang on
        others and are left out. Singular states are refused where no coordinates describe what is free.

        Parameters
        ----------
        q, v : (nq,), (nv,), each with an optional leading batch axis; states on the loops (`assemble`) where λ is to mean something
        tau : (nv,), N m and N; zeros by default
        wrenches, wrench_axes : as in `interbody_forces`
        method : {"augment", "embed"}
        form : {"fast", "ud", "square-root"}, of the tree's sweep; by "embed" "fast" alone
        refine, residual : int or "auto", {"same", "wider"}
            Steps of refinement of both equations, with residuals in the same or the next wider precision ("wider" to "extended"); by
            "embed" the same alone.
        precision : {"single", "double", "extended", "quad"}, of everything
        alpha, beta : float, 1/s
            Baumgarte's: r̈ + 2α ṙ + β² r = 0, of rows of velocities ṙ alone; by "augment".
        independent : names of coordinates or hinges, by "embed"
            Around loops that hang together as many as are free, or none of them (None, an empty list): then they are chosen at each
            state, by complete pivoting in units of energy.

        Returns
        -------
        ConstrainedDynamics

        Raises
        ------
        EvaluationError
            Rows that ask different accelerations of one motion (at singular states, where v leaves no branch; functions that conflict), by
            name. Results that miss a row or an equation of motion, near singular states, by name: what is returned was put into both. A
            method that is not there, and what "embed" has not. Coordinates that are not independent at a state, with such as are.
        SingularHingeError
            As `forward_dynamics`, of the tree alone; also where a coordinate feels hardly any inertia. By "embed" of what is independent.
        ModelError
            Arrays of another shape, not finite; a loop that has lost a body; alpha or beta below zero.

        Rows count as dependent where in units of their own, and of energy, less than √ε of them is left beside the others (in
        "quad" 64 ε of a double: states are doubles); a row or an equation is missed from 64 times that of its largest term on, a row also
        in its own units. Where that happens the state is solved in the next wider precision, up to "quad", and refused if it happens there;
        couplings by functions of a user are in double alone and refused at once.

        Cost: O(N), O(depth) a row, and up to rows² · coordinates in each group; linear in loops
        that share hinges with a few others (docs/loops.md). By "embed" O(N), and n³ of loops that hang together around n coordinates.
        Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, ch. 11 and the chapter on constraint embedding; J. Baumgarte 1972.

        Examples
        --------
        >>> import pycraft as pc
        >>> bars = pc.chain(3)
        >>> closure = bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
        >>> bars.gravity = (0, -10, 0)
        >>> square = bars.constrained_dynamics([np.pi / 2, -np.pi / 2, -np.pi / 2], [0, 0, 0])  # balanced: cranks upright
        >>> (square.forces["closure"].b.round(9) + 0).tolist()  # a crank of 1 kg and half of the rod on top, carried by the ground
        [0.0, 0.0, 0.0, -15.0, 0.0, 0.0]
        >>> int(square.rank), bars.loops.rows[0], float(square.multipliers[0])  # planar: three rows ask nothing
        (2, 'closure: about x', 0.0)
        >>> by_crank = bars.constrained_dynamics([1, -1, 1 - np.pi], [1, -1, 1], method="embed", independent=["hinge0"])
        >>> bool(np.allclose(by_crank.vdot, bars.constrained_dynamics([1, -1, 1 - np.pi], [1, -1, 1]).vdot, atol=1e-12))
        True
        """
        text(method, "method")
        if method not in METHODS:
            raise _core.EvaluationError(f"method={method!r} of constrained dynamics: there are {', '.join(map(repr, METHODS))}")
        q, v = at_state(self, q, v)
        tau = np.zeros(self.nv) if tau is None else tau
        numbers = one_number(alpha, "alpha"), one_number(beta, "beta")
        pushes = pushed(wrenches, wrench_axes)
        if method == "embed":
            from .linear_on_loops import independent_numbers  # which imports linear models

            _check_embedding(form, residual, *numbers)
            numbers_of = independent_numbers(self, independent) or []
            given = self.loops._core.embedded_accelerations(q, v, tau, *pushes, numbers_of, refine, precision)
            return ConstrainedDynamics(*by_loop(self.loops, *given))
        if independent is not None:
            raise _core.EvaluationError("independent= is of method='embed'; method='augment' has no independent coordinates")
        given = self.loops._core.accelerations(q, v, tau, *pushes, form, refine, chosen(residual, "residual"), precision, *numbers)
        return ConstrainedDynamics(*by_loop(self.loops, *given))

    def constrained_velocities(
        self, q=None, v=None, impulse=None, *, form: str = "fast", precision: str = "double"
    ) -> ConstrainedVelocities:  # fmt: skip
        """Velocities taken onto the rows of all loops by an impulse of the loops: what is nearest in kinetic energy, and loses least.

        (ℳ + J)(v⁺ - v) = p + Q*λ,   Q v⁺ = 0: a plastic impact, as when loops close; rows of velocities are kept, too.

        Parameters
        ----------
        q, v : (nq,), (nv,), each with an optional leading batch axis
        impulse : (nv,), p along the coordinates, N m s and N s; zeros by default
        form, precision : as in `constrained_dynamics`, whose factors, errors and cost these are

        Examples
        --------
        >>> import pycraft as pc
        >>> gears = pc.chain(2)
        >>> gear = gears.add_coupling({"hinge0": 1.0, "hinge1": -1.0}, name="gear")
        >>> after = gears.constrained_velocities([0, 0], [1.0, 0.0])
        >>> after.v.round(6).tolist()
        [0.75, 0.75]
        """
        q, v = at_state(self, q, v)
        impulse = np.zeros(self.nv) if impulse is None else impulse
        return ConstrainedVelocities(*by_loop(self.loops, *self.loops._core.velocities(q, v, impulse, form, precision)))


def _check_embedding(form: str, residual: str, alpha: float, beta: float) -> None:
    if text(form, "form") != "fast":
        raise _core.EvaluationError(f"form={form!r} of method='embed': it has 'fast' alone; take method='augment', or soa.embedded()")
    if text(residual, "residual") != "same":
        raise _core.EvaluationError(
            f"residual={residual!r} of method='embed': it has 'same' alone; take a wider precision, or method='augment'"
        )
    if alpha or beta:
        raise _core.EvaluationError("alpha and beta are of method='augment': they draw states to loops; assemble(q, v) takes them there")


class _OfLoops(Mapping[str, Any]):
    """What is each loop's own, by name, made when it is asked for: most callers ask for none. Classes, as results are pickled."""

    def __init__(self, places: Mapping[str, int]):
        self._places = places

    @abstractmethod
    def _own(self, place: int) -> Any: ...

    def __getitem__(self, name: str) -> Any:
        return self._own(self._places[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def __repr__(self) -> str:
        return repr(dict(self))


class _Multipliers(_OfLoops):
    def __init__(self, places: Mapping[str, int], first: Sequence[int], multipliers: np.ndarray):
        super().__init__(places)
        self._first, self._multipliers = first, multipliers

    def _own(self, place: int) -> np.ndarray:
        return self._multipliers[..., self._first[place] : self._first[place + 1]]


class _Forces(_OfLoops):
    def __init__(self, places: Mapping[str, int], forces: np.ndarray):
        super().__init__(places)
        self._forces = forces

    def _own(self, place: int) -> LoopForce:
        return LoopForce(self._forces[..., place, 0, :], self._forces[..., place, 1, :])


def by_loop(
    loops: Any, x: np.ndarray, multipliers: np.ndarray, forces: np.ndarray, rank: np.ndarray
) -> tuple[np.ndarray, np.ndarray, Mapping[str, np.ndarray], Mapping[str, LoopForce], np.ndarray]:  # fmt: skip
    """What the core gives of all loops, and of multipliers and forces each loop's own by name."""
    places, first = loops.numbered()
    return x, multipliers, _Multipliers(places, first, multipliers), _Forces(places, forces), rank
