"""Truth of a statement at a state: its residual is computed in wider and wider scalars until it is decided.

The residual of a true statement is rounding, and falls with epsilon. The residual of a false one stays the same. So

- *holds*: the residual is below its derived bound (`residual_bounds`) in a scalar with a bound of at most `DECIDES`, and has fallen there
  with epsilon, or is exactly zero. If it falls twice in succession, to below `DECIDES`, it need not be below the bound; if it falls three
  times in succession, its own fall is a bound, which replaces a derived bound that is too large to decide;
- *fails*: it is the same in three successive scalars, and above its bound in the widest of them;
- *undecided*: neither, up to the widest scalar.

A bound limits the effect of rounding; no bound, however large, makes a statement true if its residual does not fall: in the widest scalar,
without another explanation, it fails. If numbers of a statement are closer to each other than `DECIDES` (φ = φ + 10⁻⁴⁰φ), a bound
decides only if it distinguishes them; if no scalar does, the statement is undecided. A scalar in which an inverse is refused as singular
is skipped for the next one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .. import _core
from .residual_bounds import CONSTANT, EPSILON, Roundings, Sizes

DECIDES = 1e-12
"""A larger bound decides nothing: it hides smaller differences."""
SCATTER = 64.0
"""Allowed factor between the fall of a residual and the ratio of the epsilons: a single residual scatters."""
STAYS = 0.5
"""A residual that keeps this fraction from one scalar to the next has not fallen."""
RUNNING = 3
"""Number of successive falls that cannot be chance: each is by the ratio of two epsilons, at least 2000."""
ROUNDING_NORMS = 1e-3
"""If a bound in double exceeds this, its norms may be rounding, and are computed again in quad."""
HOLDS, FAILS, UNDECIDED = "holds", "fails", "undecided"


class UndecidedError(_core.EvaluationError):
    """A statement was used as a condition, but is undecided in the widest scalar tried."""


@dataclass(frozen=True)
class Taken:
    """The residual in one scalar, relative to the size of the compared sides, and its derived bound."""

    precision: str | int
    residual: float
    bound: float

    @property
    def epsilon(self) -> float:
        return EPSILON[self.precision]


class BoundState:
    """One state of one model: expressions are bound to it once per precision, so that they share its values."""

    def __init__(self, operators: Any, state: Any):
        self.state = state
        self._operators = operators
        self._bindings: dict[str | int, Any] = {}
        self._sizes: dict[str | int, Sizes] = {}

    def bind(self, side: Any, precision: str | int) -> Any:
        if precision not in self._bindings:
            q, v = (None, None) if self.state is None else (self.state.q, self.state.v)
            self._bindings[precision] = _core._bind([self._operators.E], q, v, precision=precision)
        binding = self._bindings[precision]
        return side.bound(binding) if isinstance(side, _core.Scalar) else side._bound(binding)

    def sizes(self, precision: str | int, values: dict[str, list[float]]) -> Sizes:
        """Return norms in one precision, shared by all statements at this state."""
        if precision not in self._sizes:
            self._sizes[precision] = Sizes(lambda e: self.bind(e, precision), precision == "double")
        self._sizes[precision].give(values)
        return self._sizes[precision]


@dataclass
class Judgement:
    """One statement at one state: its residuals, and the verdict from them."""

    taken: list[Taken] = field(default_factory=list)
    state: Any = None
    verdict: str = UNDECIDED
    zero: bool = False
    """True if both sides are zero although neither is stated to be: the statement is then trivially true here."""

    @property
    def decisive(self) -> Taken:
        """The deciding scalar: the last one tried."""
        return self.taken[-1]

    @property
    def narrow(self) -> Taken:
        return self.taken[0]


def ladder(first: str | int = "extended", last: str | int = 100) -> list[str | int]:
    """Return double, then the scalars from `first` to `last`."""
    names: list[str | int] = list(EPSILON)
    return ["double", *names[names.index(first) : max(names.index(first), names.index(last)) + 1]]


def judge(
    lhs: Any,
    rhs: Any,
    at: BoundState,
    vectors: dict[str, np.ndarray] | None = None,
    *,
    precisions: Iterable[str | int] | None = None,
    on_one_path: bool = False,
    at_most: bool = False,
    decides: float = DECIDES,
) -> Judgement:
    """Judge lhs = rhs (lhs <= rhs, entry by entry, if `at_most`) at one state.

    Parameters
    ----------
    vectors : values of the named vectors of the statement
    precisions : double and wider ones, tried in this order until one decides; see `ladder`
    on_one_path : only blocks (i, j) with i and j on one path to the base count
    decides : the largest bound that decides; for a statement with numbers, from `statement_text.telling`

    Raises
    ------
    SingularOperatorError, SingularHingeError
        An inverse is refused in every precision tried.
    """
    values = {name: [float(x) for x in value] for name, value in (vectors or {}).items()}
    found = Judgement(state=at.state)
    scales = Scales(lhs, rhs, at, values)
    said_zero = any(isinstance(side, _core.Operator) and side.kind == "zero" for side in (lhs, rhs))
    refusal: Exception | None = None
    amplified = 1.0
    for precision in precisions or ladder():
        try:
            entries = _core.residual(at.bind(lhs, precision), at.bind(rhs, precision), values, on_one_path, at_most)
            found.taken, zero, amplified = scales.taken(precision, entries)
        except (_core.SingularOperatorError, _core.SingularHingeError) as error:
            refusal = error
            if len(found.taken) == 0 and precision == "quad":  # refused in three scalars: singular
                break
            continue
        found.zero = zero and not said_zero
        found.verdict = decided(found.taken, amplified, decides=decides)
        if found.verdict != UNDECIDED:
            break
    if not found.taken:
        assert refusal is not None
        raise refusal
    if found.verdict == UNDECIDED:
        found.verdict = decided(found.taken, amplified, last=True, decides=decides)
    if found.verdict == HOLDS and found.decisive.bound > decides:
        found.taken[-1] = replace(found.decisive, bound=seen_bound(found.taken))
    return found


def seen_bound(taken: list[Taken]) -> float:
    """Return the bound implied by a fall through several scalars: their largest residual over epsilon, in the widest, with a margin."""
    return SCATTER * taken[-1].epsilon * max(t.residual / t.epsilon for t in taken)


class Scales:
    """Scale of the difference of two sides, and the possible effect of rounding; norms are shared by all precisions."""

    def __init__(self, lhs: Any, rhs: Any, at: BoundState, values: dict[str, list[float]]):
        self._lhs, self._rhs, self._at, self._values = lhs, rhs, at, values
        self._made: dict[str | int, Roundings] = {}
        self._entries: list[tuple[str | int, float, float]] = []

    def taken(self, precision: str | int, entries: tuple[float, float, float]) -> tuple[list[Taken], bool, float]:
        """(the residuals in all precisions so far, whether both sides are rounding, the growth), with the entries of lhs - rhs, lhs, rhs.

        A side that is zero is rounding, and falls with epsilon. If both fall, the difference is relative to the values of which they are
        rounding: the largest of entry over epsilon.
        """
        made = self._roundings("double", precision in ("double", "extended"))
        sides = max(entries[1:])
        self._entries.append((precision, entries[0], sides))
        fall = self._sides_fall()
        if precision not in ("double", "extended") and not (made is not None and self._trusted(made, sides, fall)):
            made = self._roundings(precision, True)
        assert made is not None
        vanishing = made.terms == 0 and fall
        common = max(size / EPSILON[p] for p, _, size in self._entries) if vanishing else 0.0
        found = []
        for p, difference, size in self._entries:
            scale = common or max(size, made.terms)
            bound = made.bound(1.0 if common else made.size / max(scale, 1e-300), p) if scale > 0 else 0.0
            found.append(Taken(p, difference / scale if scale > 0 else difference, bound))
        return found, vanishing, made.growth

    @staticmethod
    def _trusted(made: Roundings, sides: float, fall: bool) -> bool:
        """Return True if norms in double are reliable: they are not rounding. The size of sides that fall is not needed."""
        relative = 1.0 if made.counted or (fall and made.terms == 0) else made.size / max(sides, 1e-300)
        return made.bound(relative, "double") <= ROUNDING_NORMS

    def _sides_fall(self) -> bool:
        """Return True if both sides are zero, or were rounding in the last two precisions."""
        if not any(size for *_, size in self._entries):
            return True
        if len(self._entries) < 2:
            return False
        (narrow, _, before), (wide, _, after) = self._entries[-2:]
        return after <= SCATTER * EPSILON[wide] / EPSILON[narrow] * before

    def _roundings(self, precision: str | int, needed: bool) -> Roundings | None:
        """Return roundings from norms in this precision; None if an inverse is refused in it, and they are not needed."""
        if precision not in self._made:
            try:
                self._made[precision] = Roundings(self._lhs, self._rhs, self._at.sizes(precision, self._values))
            except (_core.SingularOperatorError, _core.SingularHingeError):
                if needed:
                    raise
                return None
        return self._made[precision]


def decided(taken: list[Taken], amplified: float = 1.0, *, last: bool = False, decides: float = DECIDES) -> str:
    """Return the verdict on residuals in wider and wider scalars so far; `last` if none follows."""
    if len(taken) < 2 or not np.isfinite(taken[-1].residual):
        return UNDECIDED
    wide = taken[-1]
    pairs = list(zip(taken[:-1], taken[1:], strict=True))
    falls = [_falls(taken[:i], taken[i], amplified) for i in range(1, len(taken))]
    explained = wide.residual <= wide.bound
    if max(wide.residual, wide.bound) <= decides and falls[-1] and (explained or len(falls) > 1 and falls[-2]):
        return HOLDS
    if len(falls) >= RUNNING and all(falls[-RUNNING:]) and max(wide.residual, SCATTER * wide.epsilon) <= decides:
        return HOLDS
    stays = [STAYS * n.residual <= w.residual and w.residual > 0 and not f for (n, w), f in zip(pairs, falls, strict=True)]
    if all(stays[-2:]) and (len(stays) > 1 and not explained or last):
        return FAILS
    return UNDECIDED


def _falls(narrower: list[Taken], wide: Taken, amplified: float) -> bool:
    """Return True if a residual has fallen with epsilon. A narrower one may be small, or zero, by chance: the largest over epsilon counts,
    and the amplification of a rounding by the sweep."""
    if wide.residual == 0:
        return True
    seen = max([1.0, *(t.residual / t.epsilon for t in narrower if np.isfinite(t.residual))])
    return wide.residual <= wide.epsilon * max(SCATTER * seen, CONSTANT * amplified)


@dataclass
class Verdict:
    """One statement over several states."""

    judgements: list[Judgement] = field(default_factory=list)

    @property
    def verdict(self) -> str:
        """ "fails" if it fails at a state, "holds" if there are states and it holds at all."""
        found = {j.verdict for j in self.judgements}
        return FAILS if FAILS in found else HOLDS if found == {HOLDS} else UNDECIDED

    @property
    def states(self) -> int:
        return len(self.judgements)

    @property
    def zero(self) -> bool:
        """True if both sides were zero at every state."""
        return all(j.zero for j in self.judgements)

    @property
    def shown(self) -> Judgement:
        """The state that decides the verdict: the one with the largest residual in the widest scalar."""
        of_that = [j for j in self.judgements if j.verdict == self.verdict]
        return max(of_that, key=lambda j: (-j.decisive.epsilon, _order(j.decisive.residual)))

    @property
    def residual(self) -> float:
        """The largest in double."""
        return max((j.narrow.residual for j in self.judgements), key=_order, default=0.0)

    @property
    def bound(self) -> float:
        """The largest in double."""
        return max((j.narrow.bound for j in self.judgements), key=_order, default=0.0)


def _order(x: float) -> float:
    return x if np.isfinite(x) else np.inf


def judge_states(lhs: Any, rhs: Any, states: Iterable[BoundState], vectors: Iterable[dict[str, np.ndarray]], **options: Any) -> Verdict:
    """Return `judge` at each of these states."""
    return Verdict([judge(lhs, rhs, at, values, **options) for at, values in zip(states, vectors, strict=True)])
