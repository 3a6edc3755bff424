"""Lock hinges where they are and unlock them again: mechanisms that change during motion."""

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
    """The effect of `lock` on the motion.

    hinges : names of the hinges that were locked, in the model's order
    energy_before, energy_after : kinetic energy (J), rotors included
    loss : the lost energy (J): -½ v·p over the locked hinges, half the square of their velocity by the Schur complement of ℳ + J. Never
        negative except for rounding, and computed without a difference of large values.
    momentum_before, momentum_after : (6,), of all bodies about the world's origin in world axes, angular first (N m s, N s)
    impulses : by hinge the impulse that stopped it, one value per coordinate (N m s, N s)
    """

    hinges: tuple[str, ...]
    energy_before: float
    energy_after: float
    loss: float
    momentum_before: np.ndarray
    momentum_after: np.ndarray
    impulses: dict[str, np.ndarray]


class Locking(Grafting):
    """Locking and unlocking of hinges."""

    _whole: Multibody | None
    _hinges_before: Mapping[str, dict[str, Any]] = {}
    """For each locked hinge: "hinge" and "q" as they were, "body" that it moves, "welded", its placement since; the data of the model's
    file on its coordinates, "left aside" and "actuators"."""
    kinetic_energy: Callable[..., Any]
    momentum: Callable[..., Any]
    _sums: Callable[..., np.ndarray]

    def lock(self, hinges: Any, *, impulsive: bool = False) -> Stop:
        """Lock hinges where they are: they become welds with the same names, without coordinates until they are unlocked.

        Bodies, nodes and frames stay where they are, with their names; q and v of the other hinges are carried over. A coupling of `loops`
        constrains its other coordinates with the locked ones constant, until they are unlocked. Operators and parts made before are stale.
        A rotor on a locked hinge does not spin. Locked bodies still cost a step of each sweep; `coalesce` merges them with their carriers.

        Parameters
        ----------
        hinges : names, patterns of them ("left_*", "finger?"), or handles, one or several
            A pattern matches hinges that have coordinates.
        impulsive : bool
            Stop moving hinges at once, by impulses at these hinges alone: momenta along the remaining coordinates are conserved, v⁺ = v_f +
            (ℳ_ff + J_f)⁻¹ ℳ_fl v_l, and so are the momenta of a freely floating model. Energy is lost. If False, moving hinges are refused.

        Returns
        -------
        Stop : energy and momentum before and after, what was lost, and the impulses

        Raises
        ------
        ModelError
            An unknown name, a hinge without coordinates, a moving hinge unless `impulsive`, all hinges of a coupling of `loops`; a part:
            its structure belongs to the whole model. The model is unchanged.
        SingularHingeError
            In impulsive locking: a remaining coordinate feels no inertia.

        Cost: O(N), far below the cost of the next evaluation with other coordinates; impulsive locking adds one forward dynamics.

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
                " impulsive=True stops it by an impulse and reports the lost energy"
            )
        after, impulses = (v, np.zeros(self.nv)) if moving is None else self._stop_at_once(numbers)
        stop = self._stopped(names, slices, v, after, impulses)
        self._locked_now(numbers, after)
        self._hold(held)
        return stop

    def unlock(self, hinges: Any = None) -> list[str]:
        """Unlock hinges, default: all. Each returns to its state before it was locked, at the coordinates that it had, and at rest.

        No motion changes: poses, velocities, momentum and energy stay, to rounding. The hinge is restored bit for bit unless its placement
        was set while it was locked, or its carrier was coalesced: then its old placement moves along.

        Parameters
        ----------
        hinges : names, patterns of names, or handles of locked hinges, one or several

        Returns
        -------
        list of str : the unlocked hinges, in the order in which they were locked

        Raises
        ------
        ModelError
            A hinge that is not locked, or that moves a coalesced body: split it first; a coordinate with a name that is in use by now.

        Cost: as `lock`.
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
        """Return the declarations of couplings with more hinges locked, at these coordinates, beside those locked already."""
        if not self._kept_loops:
            return {}
        locked = {name: one["q"] for name, one in self._hinges_before.items()}
        return self.loops._held(locked | {name: np.array(q) for name, q in more.items()})

    def _hold(self, couplings: Mapping[str, Mapping[str, Any]]) -> None:
        if couplings:
            self.loops._declare_anew(couplings)

    @property
    def locked(self) -> list[str]:
        """Names of the locked hinges, in the order in which they were locked; for a part, its own."""
        kept = self._hinges_before if self._whole is None else self._whole._hinges_before
        if not kept:
            return []
        own = set(self._names()[1])
        return [name for name, one in kept.items() if name in own and self._is_locked(name, one["body"])]

    def _locked_now(self, numbers: list[int], v: np.ndarray) -> None:
        """Lock the hinges of these bodies, with velocities of the others from v."""
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
        """Refuse a hinge with coupled coordinates: its coupling would apply to another coordinate, metres for radians, when another hinge
        gets its name, and to none while it is locked."""
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
        """Return the known names that are given, each once. ModelError for an unknown name, and for a pattern that matches none."""
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
        """Return the kind of a hinge; None for a pattern. ModelError, with the known names, for an unknown hinge."""
        names = self._names()[1]
        if name not in names and _is_pattern(name):
            return None
        return self._body(self._hinge_index(name))["hinge"]["kind"]

    def _is_locked(self, name: str, body: str) -> bool:
        """Check that the hinge of this name is the one that was locked: a weld of the same body."""
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
        """Return the momentum of all bodies about the world's origin, in one sweep."""
        if not self.mass:
            return self.momentum(self.q, v).value
        sums = self._sums(self.q, v, "double")
        centre, about = sums[:3], sums[15:]
        return np.r_[about[:3] + np.cross(centre, about[3:]), about[3:]]


def _is_pattern(name: str) -> bool:
    return any(letter in name for letter in "*?[")
