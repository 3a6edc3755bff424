"""Hinges locked where they are and unlocked again: mechanisms that change while they move."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .. import _core
from ..arguments import several, switch, text
from .asides import Asides
from .grafting import Grafting
from .handles import Hinge

if TYPE_CHECKING:
    from .multibody import Multibody


class Stop(NamedTuple):
    """What `lock` did to the motion.

    hinges : names of the hinges that were locked, in the model's order
    energy_before, energy_after : kinetic energy (J), rotors included
    loss : what of it is gone (J): -½ v·p over the locked hinges, half the square of their velocity by the Schur complement of ℳ + J. Never
        negative but for rounding, and found without a difference of large numbers.
    momentum_before, momentum_after : (6,), of all bodies about the world's origin in world axes, angular first (N m s, N s)
    impulses : by hinge the impulse that stopped it, one number a coordinate (N m s, N s)
    """

    hinges: tuple[str, ...]
    energy_before: float
    energy_after: float
    loss: float
    momentum_before: np.ndarray
    momentum_after: np.ndarray
    impulses: dict[str, np.ndarray]


class Locking(Grafting):
    """Hinges that are locked, and unlocked."""

    _whole: Multibody | None
    _hinges_before: Mapping[str, dict[str, Any]] = {}
    """Of each locked hinge "hinge" and "q" as they were, "body" that it moves, "welded", its placement since; what the model's file said of
    its coordinates, "left aside" and "actuators"."""
    kinetic_energy: Callable[..., Any]
    momentum: Callable[..., Any]
    _sums: Callable[..., np.ndarray]

    def lock(self, hinges: Any, *, impulsive: bool = False) -> Stop:
        """Lock hinges where they are: they become welds, with their names, and have no coordinates until they are unlocked.

        Bodies, nodes and frames stay where they are, with their names; q and v of the other hinges are carried over. A coupling of
        `loops` holds its other coordinates by the locked ones, until they are unlocked. Operators and parts
        made before are stale. A rotor on a locked hinge does not spin. Locked bodies still cost a step of each sweep; `coalesce` makes
        them one with what carries them.

        Parameters
        ----------
        hinges : names, patterns of them ("left_*", "finger?"), or handles, one or several
            A pattern is of hinges that have coordinates.
        impulsive : bool
            Hinges that move are stopped at once, by impulses at these hinges alone: momenta along the coordinates that stay are kept,
            v⁺ = v_f + (ℳ_ff + J_f)⁻¹ ℳ_fl v_l, and so are the momenta of a model that floats freely. Energy is lost. Left False, hinges
            that move are not locked.

        Returns
        -------
        Stop : energy and momentum before and after, what was lost, and the impulses

        Raises
        ------
        ModelError
            A name that is not there, a hinge without coordinates, a hinge that moves where `impulsive` is False, all hinges that a
            coupling of `loops` is of; a part, whose structure is the whole's. The model is as it was.
        SingularHingeError
            Of impulsive locking: a coordinate that stays feels no inertia.

        Cost: O(N), far below that of the next evaluation, which sees a model of other coordinates; impulsive, a forward dynamics more.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> arm = pc.chain(3)
        >>> arm.v = [1, 0, 0]
        >>> arm.lock("hinge2").loss                    # it does not move: nothing is lost
        0.0
        >>> arm.nv, arm.locked
        (2, ['hinge2'])
        >>> stop = arm.lock("hinge0", impulsive=True)
        >>> bool(np.isclose(stop.energy_before - stop.energy_after, stop.loss)), arm.v.shape
        (True, (1,))
        >>> arm.unlock()
        ['hinge2', 'hinge0']
        """
        chosen, impulsive = self._hinges_to_lock(hinges), switch(impulsive, "impulsive")
        held = self._held_couplings({name: self.q[self._slices(self._hinge_index(name))[0]] for name in chosen})
        numbers = sorted(self._hinge_index(name) for name in chosen)
        data = [self._body(k) for k in numbers]
        names = tuple(body["hinge"]["name"] for body in data)
        slices = [self._slices(k) for k in numbers]
        v = np.array(self.v)
        moving = next((i for i, (_, own) in enumerate(slices) if np.any(v[own])), None)
        if moving is not None and not impulsive:
            rate = ", ".join(f"{x:.6g}" for x in v[slices[moving][1]])
            raise _core.ModelError(
                f"hinge {names[moving]!r} moves (v = {rate}) and is locked at rest only;"
                " impulsive=True stops it by an impulse and says what energy that loses"
            )
        after, impulses = (v, np.zeros(self.nv)) if moving is None else self._stop_at_once(numbers)
        stop = self._stopped(names, slices, v, after, impulses)
        self._locked_now(numbers, after)
        self._hold(held)
        return stop

    def unlock(self, hinges: Any = None) -> list[str]:
        """Unlock hinges, all where none are named: each is what it was when it was locked, at the coordinates it had, and at rest.

        Nothing moves otherwise than before: poses, velocities, momentum and energy stay, to rounding. Bit for bit the hinge is what it was
        unless its placement was set while it was locked, or what carries it was coalesced: then its old placement moves along.

        Parameters
        ----------
        hinges : names, patterns of names, or handles, one or several; of locked hinges

        Returns
        -------
        list of str : the hinges that are unlocked, in the order in which they were locked

        Raises
        ------
        ModelError
            A hinge that is not locked, or whose body is coalesced: split it first; a coordinate whose name another one took meanwhile.

        Cost: as of `lock`.
        """
        self._unlock([])  # a part refuses
        locked = self.locked
        chosen = locked if hinges is None else self._named_among(hinges, locked, self._why_not_unlocked)
        names = [name for name in locked if name in set(chosen)]
        aside = Asides(self)
        self._unlock([self._hinges_before[name] for name in names])
        aside.put(self)
        for name in names:
            aside.put_back(self, name, self._hinges_before[name])
        self._hinges_before = {name: one for name, one in self._hinges_before.items() if name not in set(names)}
        self._hold(self._held_couplings({}))
        return names

    def _held_couplings(self, more: Mapping[str, np.ndarray]) -> dict[str, dict[str, Any]]:
        """Couplings as they are to be declared where more hinges are locked, at these coordinates, beside those that are."""
        if not self._kept_loops:
            return {}
        locked = {name: one["q"] for name, one in self._hinges_before.items()}
        return self.loops._held(locked | {name: np.array(q) for name, q in more.items()})

    def _hold(self, couplings: Mapping[str, Mapping[str, Any]]) -> None:
        if couplings:
            self.loops._declare_anew(couplings)

    @property
    def locked(self) -> list[str]:
        """Names of the locked hinges, in the order in which they were locked; of a part those that are its own."""
        kept = self._hinges_before if self._whole is None else self._whole._hinges_before
        if not kept:
            return []
        own = set(self._names()[1])
        return [name for name, one in kept.items() if name in own and self._is_locked(name, one["body"])]

    def _locked_now(self, numbers: list[int], v: np.ndarray) -> None:
        """Locks the hinges of these bodies, velocities of the others from v."""
        kept, aside = dict(self._hinges_before), Asides(self)
        for k in numbers:
            body = self._body(k)
            name, q = body["hinge"]["name"], np.array(self.q[self._slices(k)[0]])
            kept[name] = {"hinge": body["hinge"], "q": q, "body": body["name"]} | aside.of(name)
        self._lock(numbers, v)
        aside.put(self)
        for k in numbers:
            now = self._body(k)["hinge"]
            kept[now["name"]]["welded"] = (now["placement"]["rotation"], now["placement"]["position"])
        self._hinges_before = kept

    def _require_uncoupled(self, hinge: str) -> None:
        """What couples a coordinate of a hinge would couple another one, metres for radians, when another hinge has its name, and none
        when it is locked."""
        for name in self._kept_loops or ():
            if self.loops[name].kind == "coupling" and hinge in self.loops._stands_on(name):
                what = f"hinge {hinge!r} is in use: its coordinates are those of coupling {name!r}"
                raise _core.ModelError(f"{what}; remove that first, and declare it anew")

    # ------------------------------------------------------------------ which hinges
    def _hinges_to_lock(self, hinges: Any) -> list[str]:
        known = self._hinge_sizes()
        moving = [name for name, size in zip(*known, strict=True) if size]
        return self._named_among(hinges, moving, self._why_not_locked)

    def _named_among(self, given: Any, known: list[str], why_not: Callable[[str], str]) -> list[str]:
        """The names among those known that are given, each once. ModelError for one that is not, and for a pattern that fits none."""
        found: dict[str, None] = {}
        there = set(known)
        for one in several(given, (str, Hinge)):
            name = one.name if isinstance(one, Hinge) else text(one, "a hinge")
            if name in there:
                found[name] = None
                continue
            fitting = [other for other in known if fnmatchcase(other, name)] if _is_pattern(name) else []
            if not fitting:
                raise _core.ModelError(why_not(name))
            found.update(dict.fromkeys(fitting))
        return list(found)

    def _why_not_locked(self, name: str) -> str:
        if self._kind_of(name) is None:
            return f"no hinge of {self.name!r} that has coordinates fits {name!r}"
        return f"hinge {name!r} {'is locked already' if name in self.locked else 'is a weld'} and has no coordinates to lock"

    def _why_not_unlocked(self, name: str) -> str:
        one = self._hinges_before.get(name)
        if one is not None and one["body"] not in self._names()[0]:
            return f"hinge {name!r} moves body {one['body']!r}, which is coalesced: split it off first, split({one['body']!r})"
        kind, locked = self._kind_of(name), f"locked are {', '.join(self.locked[:12]) or 'none'}"
        if kind is None:
            return f"no locked hinge of {self.name!r} fits {name!r}; {locked}"
        return f"hinge {name!r} ({kind}) was not locked in this model; {locked}"

    def _kind_of(self, name: str) -> str | None:
        """Of a hinge; None of a pattern. ModelError, with the names there are, where no hinge is called so."""
        names = self._names()[1]
        if name not in names and _is_pattern(name):
            return None
        return self._body(self._hinge_index(name))["hinge"]["kind"]

    def _is_locked(self, name: str, body: str) -> bool:
        """Whether the hinge of this name is the one that was locked: a weld, and of the same body."""
        now = self._body(self._hinge_index(name))
        return now["name"] == body and not now["hinge"]["subhinges"]

    # ------------------------------------------------------------------ before and after
    def _stopped(self, names: tuple[str, ...], slices: list[Any], v: np.ndarray, after: np.ndarray, impulses: np.ndarray) -> Stop:
        loss = -0.5 * sum(float(v[own] @ impulses[own]) for _, own in slices)
        momentum, energy = self._whole_momentum(v), float(self.kinetic_energy(self.q, v))
        same = after is v
        return Stop(
            names,
            energy,
            energy if same else float(self.kinetic_energy(self.q, after)),
            loss + 0.0,
            momentum,
            momentum if same else self._whole_momentum(after),
            {name: impulses[own] for name, (_, own) in zip(names, slices, strict=True)},
        )

    def _whole_momentum(self, v: np.ndarray) -> np.ndarray:
        """Of all bodies about the world's origin, in one sweep."""
        if not self.mass:
            return self.momentum(self.q, v).value
        sums = self._sums(self.q, v, "double")
        centre, about = sums[:3], sums[15:]
        return np.r_[about[:3] + np.cross(centre, about[3:]), about[3:]]


def _is_pattern(name: str) -> bool:
    return any(letter in name for letter in "*?[")
