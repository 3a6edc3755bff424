"""The operator set of a model (`soa.phi`, `soa.H`, ...), and the evaluation and display of expressions in Python."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial, reduce
from operator import mul
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from .. import _core
from ..arguments import several, text
from ..closed import Closed
from .letters_with_arguments import NAMES, LetterWithArguments, listed_names
from .loop_letters import NAMES as _OF_LOOPS
from .loop_letters import loop_letter
from .rotor_letters import NAMES as _OF_ROTORS
from .rotor_letters import rotor_letter

if TYPE_CHECKING:
    from .free_operators import FreeOperators

_PLAIN = tuple(s.name for s in _core.symbols if s.takes == "nothing")
_OF_GROUPS = ("phi_S", "H_S")
_SPACES = ("Theta", "V", "F")
_COMPOSED: dict[str, Callable[[Any], _core.Operator]] = {
    "MM": lambda soa: soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T,
    "MM_inv": lambda soa: soa.MM.inv(),
}


class OperatorSet(Closed):
    """The spatial operators of one model.

    Attributes are the book's letters in ASCII: ``E phi phi_tilde H M J R P P_plus D G K tau tau_bar E_psi psi psi_tilde Upsilon Omega``,
    ``I`` the identity, ``MM = H φ M φ* H*`` and its inverse ``MM_inv`` (if hinges have rotor inertias, the equations of motion have ``MM +
    J``), the velocity-dependent ``Delta_theta_dot V_tilde V_bar momentum_cross H_dot``, the vectors ``theta_dot velocity a b gravity_field
    gravity_base``, and ``X_world``; for rotors ``b_J``, ``C_J`` and ``hinge_cross``; for loops ``Q`` and ``A``. With arguments:
    ``B(names)``, ``Jacobian(names)``, ``Lambda(names)`` of nodes, ``Delta(coordinate)``. Spaces: ``Theta``, ``V``, ``F``,
    ``NodesV(names)``, ``NodesF(names)``. Calling the set with a string of names returns a tuple.

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.chain(3)
    >>> H, phi, M = arm.soa("H phi M")
    >>> H @ phi @ M @ phi.T @ H.T
    <H φ M φ* H* : Θ (3) → Θ (3)>
    """

    def __init__(self, source: _core.SkoSource, model: Any = None):
        self._source = source
        self._model = model  # keeps the Python part alive: the core knows only its own part
        self._made: dict[str, _core.Operator] = {}

    def is_current(self) -> bool:
        """True if the model's structure has not changed since these operators were made."""
        try:
            self._source.check_current()
        except _core.StaleOperatorError:
            return False
        return True

    def __call__(self, names: str) -> Any:
        operators = tuple(getattr(self, name) for name in text(names, "a set of operators").split())
        return operators[0] if len(operators) == 1 else operators

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name == "I":
            return _core.identity()
        if name in _COMPOSED:
            if name not in self._made:
                self._made[name] = _COMPOSED[name](self)
            return self._made[name]
        if name in _OF_ROTORS:
            return rotor_letter(self, name)
        if name in _OF_LOOPS:
            return loop_letter(self._source, self._model, name, self._made)
        if name in _SPACES:
            return getattr(self._source, name)
        if name in NAMES and name not in _PLAIN:
            return LetterWithArguments(self, name)
        if name in _PLAIN or (name in _OF_GROUPS and self._source.groups is not None):
            if name not in self._made:
                try:
                    self._made[name] = self._source.symbol(name)
                except _core.EvaluationError as error:
                    raise AttributeError(str(error)) from None
            return self._made[name]
        raise AttributeError(
            f"no operator is called {name!r}; there are {', '.join((*NAMES, *_COMPOSED))}, I, and the spaces Theta, V, F, NodesV, NodesF"
        )

    def __dir__(self) -> Iterable[str]:
        return [*super().__dir__(), *NAMES, "I", *_COMPOSED, *_OF_ROTORS, *_OF_LOOPS, *_SPACES]

    def _ipython_key_completions_(self) -> list[str]:
        return [*NAMES, "I", *_COMPOSED, *_OF_ROTORS, *_OF_LOOPS]

    def NodesV(self, names: str | Sequence[str]) -> _core.Space:
        """Return the space of stacked motions of these nodes, six components each."""
        return self._source.nodes_space(listed_names(names), True)

    def NodesF(self, names: str | Sequence[str]) -> _core.Space:
        """Return the space of stacked forces on these nodes, six components each."""
        return self._source.nodes_space(listed_names(names), False)

    def grouped(self, groups: Iterable[Iterable[str]]) -> OperatorSet:
        """Return the operators of the same robot with some connected sets of bodies as one node each, beside single bodies.

        A group S of n bodies has blocks of 6n rows, ``H = H_S φ_S`` and ``M = M_S`` with ``φ_S = (I - E_S)⁻¹`` (the letters ``phi_S`` and
        ``H_S``); other bodies stay single, with their own cheap blocks. Coordinates keep their order, and Θ is one space:
        ``arm.soa.MM - grouped.MM`` is an expression, and zero. V and F are other spaces, stacked group by group.

        Parameters
        ----------
        groups : names of bodies, group by group
            Each must be connected by hinges, and a body belongs to one group.

        Raises
        ------
        ModelError
            A body that is unknown, named twice, or not connected to its group; a model that is not a multibody system.

        Notes
        -----
        Cost: a sweep takes O((6n)³) in a group, unchanged elsewhere. Source: A. Jain, Robot and Multibody Dynamics, Springer 2011,
        the chapter on constraint embedding, here without constraints.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(4)
        >>> pairs = arm.soa.grouped([list(arm.bodies)[1:3]])
        >>> pairs.MM
        <H φ M φ* H* : Θ (4) → Θ (4)>
        >>> float((pairs.MM - arm.soa.MM).norm()) < 1e-13
        True
        """
        if not isinstance(self._source, _core.MultibodyOperators):
            raise _core.ModelError(f"bodies of {self._source.name!r} cannot be grouped: it is not a complete multibody model")
        if isinstance(groups, (str, bytes)) or not isinstance(groups, Iterable):
            raise _core.ModelError(f"groups of {self._source.name!r}: a list of lists of bodies, not {groups!r}")
        named = [_listed_bodies(group, self._source.name) for group in groups]
        return OperatorSet(_core._grouped(self._source, named), self._model)

    def embedded(self, independent: Any = None, q: Any = None) -> Any:
        """Return the operators of the model with its loops embedded: a tree without loops, on independent velocities θ̇_r.

        The bodies around each loop, up to their nearest common carrier, are one node; loops with bodies in common are one set.
        ``θ̇ = X_r θ̇_r``, ``X_r = [1; -Q_d⁻¹ Q_r]``, and ``H = X_r* H_S φ_S``, ``J = X_r* J_S X_r``, so that ``ℳ = X_r* ℳ_tree X_r``.

        Parameters
        ----------
        independent : names of coordinates or hinges
            Around each set of loops as many as it has freedoms, or none: then they are chosen by conditioning.
        q : (nq,), or a State on the loops at which to choose; default: the model's present one.

        Raises
        ------
        ModelError
            A state that is off the loops or singular, coordinates that do not determine the others; with a choice that does.

        Notes
        -----
        The choice stays as q changes: EvaluationError at a state where it is invalid. Cost: a sweep takes O((6n)³) in a set of n bodies.
        Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the chapter on constraint embedding.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> bars = pc.chain(3)
        >>> closure = bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
        >>> bars.q = bars.assemble([1.0, -1.4, -1.5], fix="hinge0").q
        >>> linkage = bars.soa.embedded(["hinge0"])
        >>> linkage.MM
        <H φ M φ* H* : Θ (1) → Θ (1)>
        >>> linkage.X_r.dense().round(6).ravel().tolist()
        [1.0, -1.0, 1.0]
        """
        return _core._face["embedded"](self, independent, q)

    def free(self, prescribed: Any) -> FreeOperators:
        """Return the operators of the free coordinates with others prescribed: ``H_f``, ``D_f``, ``ψ_f``, ...

        H keeps the rows of free coordinates, and every letter that contains H follows from that; φ and M are the same, on the same spaces V
        and F, so that they combine with the letters of the model and of
        `prescribed`. Θ is the space of the free coordinates, in their order.

        Parameters
        ----------
        prescribed : names of hinges, coordinates or patterns, or a list of them
            As in `Multibody.hybrid_dynamics`.

        Raises
        ------
        ModelError
            An unknown name, a coordinate that is prescribed twice; a model that is not a multibody system.

        Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the chapter on prescribed motion; docs/hybrid_dynamics.md.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(4)
        >>> free = arm.soa.free(["hinge1"])
        >>> free.H
        <H : F (24) → Θ (3)>
        >>> jacobian = free.generalized_Jacobian("body3")
        >>> jacobian.shape  # from the prescribed coordinate to the motion of the tip, the free ones following
        (6, 1)
        """
        from .free_operators import FreeOperators

        return FreeOperators(self, self._held(prescribed))

    def prescribed(self, prescribed: Any) -> OperatorSet:
        """Return the operators of the prescribed coordinates, ``H_p`` and letters that contain it, with the free ones locked; as `free`."""
        return some_of(self, self._held(prescribed))

    def _held(self, prescribed: Any) -> list[bool]:
        if not isinstance(self._source, _core.MultibodyOperators):
            raise _core.ModelError(f"coordinates of {self._source.name!r} cannot be prescribed: it is not a complete multibody model")
        names = [text(getattr(one, "name", one), "what is prescribed") for one in several(prescribed)]
        return [bool(one) for one in _core.prescribed_by(self._source.model, names)]

    def random_state(self, rng: Any) -> Any:
        """Return a random state for trying statements."""
        return self._model.random_state(rng)

    def check(self, **options: Any):
        """Check every theorem on this model; see `pycraft.identities.check_model`."""
        return _core._face["check_model"](self, **options)

    def theorems(self) -> list[_core.Theorem]:
        """Return every theorem as data: name, both sides as expressions, hypotheses, source. Includes loops if the model has some."""
        theorems = list(_core.theorems(self._source))
        if isinstance(self._source, _core.MultibodyOperators) and len(getattr(self._model, "loops", ())):
            loop_letter(self._source, self._model, "Q", self._made)
            rows: Any = self._made["loops"]
            theorems += _core._theorems_of_rows(rows)
        return theorems

    def __repr__(self) -> str:
        return f"<operators of {self._source.name!r}: {self._source.Theta.dimension} degrees of freedom>"

    def __reduce__(self):
        return _operators_again, (self._source, self._model)


def some_of(whole: OperatorSet, kept: Sequence[bool]) -> OperatorSet:
    """Return the operators of the kept coordinates, with the others locked."""
    return OperatorSet(_core._some_coordinates(whole._source, list(kept)), whole._model)


def _operators_again(source: _core.SkoSource, model: Any) -> OperatorSet:
    return model.soa if isinstance(source, _core.MultibodyOperators) and model is not None else OperatorSet(source, model)


def _listed_bodies(group: Any, model: str) -> list[str]:
    if isinstance(group, (str, bytes)) or not isinstance(group, Iterable):
        raise _core.ModelError(f"groups of {model!r}: a list of lists of bodies; {group!r} is no list")
    names: list[Any] = [getattr(body, "name", body) for body in group]
    if not names or not all(isinstance(name, str) for name in names):
        raise _core.ModelError(f"groups of {model!r}: names of one body or more in each, not {names!r}")
    return names


# ---------------------------------------------------------------------- functions that the core calls
def exact_numbers(parts: list[list[float]], shape: Sequence[int]) -> np.ndarray:
    """Return exact sums of doubles as an object array of mpmath numbers."""
    import mpmath

    out = np.empty(len(parts), dtype=object)
    with mpmath.workprec(512):  # eight doubles need less
        for i, terms in enumerate(parts):
            out[i] = mpmath.fsum(terms)
    return out.reshape(tuple(shape))


def scalar_at(
    scalar: _core.Scalar,
    q=None,
    v=None,
    *,
    form: str = "fast",
    refine: int | str = 0,
    residual: str = "same",
    precision: str | int = "double",
    threads: int = 1,
) -> _core.Scalar:
    """Return the same scalar bound to a state, as `Operator.at`."""
    return scalar.bound(_core._bind(scalar.operands(), q, v, form, refine, residual, precision, threads))


def operator_from_parts(
    kind: int, payload: Any, children: list[_core.Operator], leaf_binding: _core.Binding | None = None
) -> _core.Operator:
    """Rebuild an operator from its pickle; `leaf_binding` of zeros, identities, constants and vectors."""
    name = (
        "symbol",
        "vector",
        "identity",
        "zero",
        "constant",
        "external",
        "sum",
        "product",
        "scaled",
        "transpose",
        "inverse",
        "blockdiag",
        "sqrt",
        "function",
    )[kind]
    if name == "symbol":
        source, symbol, arguments, text, binding = payload
        made = source._symbol_again(symbol, arguments, text)
        return made if binding is None else made._bound(binding)
    if name == "function" and payload is not None:
        source, function, binding = payload
        return _core._function(source, function, binding, children[0])
    if name in ("vector", "identity", "zero", "constant"):
        leaf = _core._leaf_from_parts(name, payload)
        return leaf if leaf_binding is None else leaf._bound(leaf_binding)
    return _core._make(name, children, payload if name == "scaled" else 1.0)


def operator_from_nodes(nodes: list[tuple[int, Any, list[int], _core.Binding | None]]) -> _core.Operator:
    """Rebuild an operator from all its nodes, children first."""
    made: list[_core.Operator] = []
    for kind, payload, children, leaf_binding in nodes:
        made.append(operator_from_parts(kind, payload, [made[i] for i in children], leaf_binding))
    return made[-1]


# ---------------------------------------------------------------------- gradients
_SENSITIVITIES: WeakKeyDictionary[Any, _core.Sensitivities] = WeakKeyDictionary()


def _sensitivities_of(model: Any) -> _core.Sensitivities:
    """Return the sensitivities of a model without its Python part: cached, as they keep their recordings of batches."""
    known = _SENSITIVITIES.get(model)
    if known is None:
        known = _SENSITIVITIES[model] = _core.Sensitivities(model)
    return known


def scalar_gradient(scalar: _core.Scalar, over: str = "coordinates") -> np.ndarray:
    """Return all derivatives of a scalar expression; see `Scalar.gradient`."""
    moved: Any = _core._moved(scalar.operands())
    if moved is None:
        return np.zeros(())  # constants: zero along every direction
    if isinstance(moved, _core.MultibodyOperators):
        return _gradient(scalar, over, moved)
    return _along_coordinates(scalar, over, moved)  # embedded loops: everything along the independent ones


def _gradient(scalar: _core.Scalar, over: str, source: _core.MultibodyOperators) -> np.ndarray:
    """Differentiate term by term, so that ln det ℳ keeps its own sweep."""
    kind, value, operand, terms = scalar.kind, scalar.number, scalar.operand, scalar.terms
    if terms:
        parts = [_gradient(t, over, source) for t in terms]
        if kind in ("product", "reciprocal"):
            values = [np.asarray(t.value())[..., None] for t in terms]
            if kind == "reciprocal":
                return np.asarray(-parts[0] / values[0] ** 2)
            others = [reduce(mul, values[:i] + values[i + 1 :], 1.0) for i in range(len(terms))]
            return np.asarray(sum(x * part for x, part in zip(others, parts, strict=True)))
        return np.asarray((float(value) if kind == "scaled" else 1.0) * sum(parts))
    if operand is None or _core._moved([operand]) is None:
        return np.zeros(())
    if kind == "logdet" and _is_mass_matrix(operand, source):
        q, _, precision = operand._state or (source.model.q, None, "double")
        binding = _core._binding(operand)
        call = partial(_sensitivities_of(source.model).log_determinant, over)
        return _core._face["shared_out"](call, ["q"], (q,), {"precision": precision}, binding.threads if binding else 1)
    return _along_coordinates(scalar, over, source)


def _along_coordinates(scalar: _core.Scalar, over: str, source: _core.SkoSource) -> np.ndarray:
    if over != "coordinates":
        raise _core.EvaluationError(f"gradient over {over!r} exists for ln det of the mass matrix and of D, not for {scalar!r}")
    count = source.Theta.dimension
    return np.stack([np.asarray(scalar.diff(i), float) for i in range(count)], axis=-1) if count else np.zeros(0)


def _is_mass_matrix(operand: _core.Operator, source: _core.MultibodyOperators) -> bool:
    """Check for HφMφ*H*, plus J if there is one, or D: operators with the determinant of ℳ + J."""
    if operand.sources != [source]:
        return False
    letters = [source.symbol(name) for name in ("H", "phi", "M", "J", "D")]
    if operand._state is not None:
        binding = _core._binding(operand)
        letters = [letter._bound(binding) for letter in letters]
    H, phi, M, J, D = letters
    whole = H @ phi @ M @ phi.T @ H.T + J
    return bool(operand == D or (operand.domain == H.codomain and _core.equal_by_theorems(operand, whole)))
