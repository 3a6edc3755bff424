"""A linear model with named states, inputs and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number, several

METHODS = ("zoh", "foh", "bilinear", "euler", "backward_diff", "impulse")
"""Methods of discretization, SciPy's."""


@dataclass(frozen=True, eq=False)
class LinearModel:
    """δẋ = A δx + B δu, δy = C δx + D δu near a state of a model or scene; with `dt`, δx⁺ = A δx + B δu from step to step.

    For a batch of states all arrays have a leading axis, and an index returns the model at one state.

    Attributes
    ----------
    A, B, C, D : (n, n), (n, m), (p, n), (p, m)
        The states are displacements along coordinates (on ball and free hinges in the axes of v), velocities, and the effects' own states
        of a scene.
    rate : (n,), ẋ at the state itself: zero at an equilibrium
    states, inputs, outputs : their names
    units : units of the states, by name
    dt : s, None for continuous time
    model, q, v, t : the state at which it was linearized
    tangent : (2 nv + ..., n), for a model on its loops, with independent coordinates as states: the tree's states in terms of these, to
        first order; None if the states are the tree's
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    rate: np.ndarray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: dict[str, str]
    model: Any = field(repr=False)
    q: np.ndarray = field(repr=False)
    v: np.ndarray = field(repr=False)
    t: Any = 0.0
    dt: float | None = None
    tangent: np.ndarray | None = field(default=None, repr=False)

    @property
    def displacements(self) -> int:
        """Number of states that are displacements; these come first."""
        return sum(name.startswith("q.") for name in self.states)

    def __bool__(self) -> bool:
        return self.A.ndim == 2 or len(self.A) > 0

    def __len__(self) -> int:
        if self.A.ndim == 2:
            raise TypeError("a linear model at one state has no length; its arrays are .A, .B, .C, .D")
        return len(self.A)

    def __getitem__(self, index: int) -> LinearModel:
        if self.A.ndim == 2:
            raise TypeError("a linear model at one state takes no index; its arrays are .A, .B, .C, .D")
        q, v = (x if x.ndim == 1 else x[index] for x in (self.q, self.v))
        return replace(
            self,
            A=self.A[index],
            B=self.B[index],
            C=self.C[index],
            D=self.D[index],
            rate=self.rate[index],
            q=q,
            v=v,
            t=self.t if np.ndim(self.t) == 0 else float(self.t[index]),
            tangent=None if self.tangent is None else self.tangent[index],
        )

    def __repr__(self) -> str:
        many = "" if self.A.ndim == 2 else f"{len(self.A)} of "
        time = "" if self.dt is None else f", step {self.dt:g} s"
        n, m, p = len(self.states), len(self.inputs), len(self.outputs)
        return f"<linear model: {many}{self.model.name!r}, {n} states, {m} inputs, {p} outputs{time}>"

    # ------------------------------------------------------------------ parts of it
    def place(self, names: Any, of: str = "states") -> list[int]:
        """Return the indices of states, "inputs" or "outputs" by name. ModelError for an unknown name lists the known ones."""
        if of not in ("states", "inputs", "outputs"):
            raise _core.ModelError(f"of={of!r:.80}: there are 'states', 'inputs' and 'outputs'")
        known = list(getattr(self, of))
        wanted = several(names)
        for name in wanted:
            if name not in known:
                raise _core.ModelError(f"{self.model.name!r} linearized has no {of[:-1]} {name!r}; there are {', '.join(known[:20])}")
        return [known.index(name) for name in wanted]

    def select(self, inputs: Any = None, outputs: Any = None) -> LinearModel:
        """Return the same model with some of the inputs and outputs, in the order of their names; None: all."""
        j = list(range(len(self.inputs))) if inputs is None else self.place(inputs, "inputs")
        i = list(range(len(self.outputs))) if outputs is None else self.place(outputs, "outputs")
        return replace(
            self, B=self.B[..., j], C=self.C[..., i, :], D=self.D[..., i, :][..., j], inputs=tuple(self.inputs[k] for k in j),
            outputs=tuple(self.outputs[k] for k in i),
        )  # fmt: skip

    def one(self, what: str) -> LinearModel:
        """Return the model itself; ModelError for a batch, since `what` takes one state at a time."""
        if self.A.ndim != 2:
            raise _core.ModelError(f"{what} takes one state; this is a batch of {len(self.A)}: select one by its index")
        return self

    # ------------------------------------------------------------------ in time
    def step_of(self, dt: Any, order: str) -> float:
        """Return dt in seconds. EvaluationError unless it is positive and finite, and if this model of some order is already discrete."""
        step = one_number(dt, "dt")
        if not 0 < step < np.inf:
            raise _core.EvaluationError(f"dt={step:g}: a step is a positive number of seconds")
        if self.dt is not None:
            raise _core.EvaluationError(f"this {order} model is discrete already, with a step of {self.dt:g} s")
        return step

    def discrete(self, dt: float, method: str = "zoh") -> LinearModel:
        """Return the discrete model with steps of dt seconds: SciPy's `cont2discrete`.

        Parameters
        ----------
        dt : s
        method : {"zoh", "foh", "bilinear", "euler", "backward_diff", "impulse"}
            "zoh", inputs held over a step, is exact for such inputs.

        Raises
        ------
        EvaluationError
            An unknown method, a step that is not a positive number or over which the model overflows, a model that is already discrete.
        """
        from scipy.signal import cont2discrete

        step = self.step_of(dt, "linear")
        if method not in METHODS:
            raise _core.EvaluationError(f"method={method!r}: there are {', '.join(map(repr, METHODS))}")
        with np.errstate(all="ignore"):
            if self.A.ndim == 2:
                A, B, C, D, _ = cont2discrete((self.A, self.B, self.C, self.D), step, method)
            else:
                members = [cont2discrete(parts, step, method)[:4] for parts in zip(self.A, self.B, self.C, self.D, strict=True)]
                shapes = (self.A.shape, self.B.shape, self.C.shape, self.D.shape)
                A, B, C, D = (np.reshape([member[i] for member in members], shape) for i, shape in enumerate(shapes))
        if not all(np.isfinite(x).all() for x in (A, B, C, D)):
            raise _core.EvaluationError(f"dt={step:g}: by {method!r} {self.model.name!r} leaves the range of its numbers over such a step")
        return replace(self, A=A, B=B, C=C, D=D, dt=step)

    # ------------------------------------------------------------------ analysis
    def modes(self) -> Any:
        """Return its natural modes: `pycraft.linear.modes.Modes`, with frequencies, damping ratios and shapes."""
        from .modes import modes_of

        return modes_of(self.one("modes()"))

    def controllability(self, tolerance: float | None = None) -> Any:
        """Return what its inputs reach: `pycraft.linear.reach.Reach`, with the uncontrollable directions by name."""
        from .reach import controllability_of

        return controllability_of(self.one("controllability()"), tolerance)

    def observability(self, tolerance: float | None = None) -> Any:
        """Return what its outputs show: `pycraft.linear.reach.Reach`, with the unobservable directions by name."""
        from .reach import observability_of

        return observability_of(self.one("observability()"), tolerance)

    # ------------------------------------------------------------------ export
    def to_scipy(self) -> Any:
        """Return a `scipy.signal.StateSpace`."""
        from scipy.signal import StateSpace

        one = self.one("to_scipy()")
        return StateSpace(one.A, one.B, one.C, one.D, **({} if one.dt is None else {"dt": one.dt}))

    def to_control(self) -> Any:
        """Return a `control.StateSpace` with the names, "q_elbow" for "q.elbow". ImportError without python-control (extra [control])."""
        try:
            import control
        except ImportError:
            raise ImportError("to_control() needs python-control: pip install 'pycraft-soa[control]'; to_scipy() needs nothing") from None
        one = self.one("to_control()")
        names = {of: [name.replace(".", "_") for name in getattr(one, of)] for of in ("states", "inputs", "outputs")}
        return control.ss(one.A, one.B, one.C, one.D, 0 if one.dt is None else one.dt, **names)

    def to_numpy(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return (A, B, C, D)."""
        return self.A, self.B, self.C, self.D


def stacked(each: list[LinearModel], count: int | None = None) -> LinearModel:
    """Stack linear models with the same states, inputs and outputs to a batch of the first `count`; 0: empty, with the sizes of one."""
    first, each = each[0], each[:count]
    if not each:
        return _none_like(first)
    A, B, C, D, rate, q, v = (np.stack([getattr(one, name) for one in each]) for name in ("A", "B", "C", "D", "rate", "q", "v"))
    tangent = None if first.tangent is None else np.stack([one.tangent for one in each if one.tangent is not None])
    t = np.array([one.t for one in each])
    return LinearModel(A, B, C, D, rate, first.states, first.inputs, first.outputs, first.units, first.model, q, v, t, tangent=tangent)


def _none_like(one: LinearModel) -> LinearModel:
    A, B, C, D, rate, q, v = (np.zeros((0, *getattr(one, name).shape)) for name in ("A", "B", "C", "D", "rate", "q", "v"))
    tangent = None if one.tangent is None else np.zeros((0, *one.tangent.shape))
    return LinearModel(A, B, C, D, rate, one.states, one.inputs, one.outputs, one.units, one.model, q, v, np.zeros(0), tangent=tangent)


def names_of_states(coordinates: Sequence[str], own: int = 0) -> tuple[str, ...]:
    """ "q.elbow", ..., "v.elbow", ..., "state.0", ..."""
    return (*(f"q.{name}" for name in coordinates), *(f"v.{name}" for name in coordinates), *(f"state.{i}" for i in range(own)))
