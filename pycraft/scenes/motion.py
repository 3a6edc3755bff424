"""States of a scene over time, and quantities computed from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from ..dynamics.interbody import forces_of_scene


@dataclass(frozen=True)
class FrameMotion:
    """A body or node over K times: `pose` X_WF (K, 4, 4), its origin `position` (K, 3) m, its velocity `twist` (K, 6), angular first."""

    pose: np.ndarray
    twist: np.ndarray

    @property
    def position(self) -> np.ndarray:
        return self.pose[..., :3, 3]


class Motion:
    """K states of a scene, and quantities computed from them. At a single time the axis K is missing.

    Attributes
    ----------
    t : (K,) s
    q, v : (K, nq), (K, nv)
    states : (K, n), the effects' own
    """

    def __init__(self, about: Mapping[str, Any], rows: Mapping[str, np.ndarray], calls: Any = None, alone: bool = False):
        self._about, self._calls, self._alone = dict(about), calls, alone
        self._parameters: int | None = (
            self.model._parameters
        )  # count of the model's edits at the time of the run; None for a model edited since
        self.t, self.q, self.v, self.states = (rows[name] for name in ("t", "q", "v", "states"))
        self._work = rows["work"]
        if alone:
            self.t, self.q, self.v, self.states, self._work = (x[0] for x in (self.t, self.q, self.v, self.states, self._work))

    # ------------------------------------------------------------------ what the scene was
    @property
    def model(self) -> Any:
        """The model."""
        return self._about["model"]

    @property
    def effects(self) -> list[str]:
        """The names of the effects that were on."""
        return list(self._about["effects"])

    @property
    def workers(self) -> list[str]:
        """The effects with recorded works, in the order of the columns of `energy["work"]`."""
        return [self._about["effects"][i] for i in self._about["workers"]]

    @property
    def _edited(self) -> bool:
        """True if the model was edited since."""
        return self._parameters != self.model._parameters

    def _unedited_model(self) -> Any:
        """Return the model, if it was not edited: values that are not computed yet would belong to another model."""
        if self._edited:
            raise _core.StaleOperatorError(
                f"{self.model.name!r} was edited since this motion was computed: t, q, v and states stay valid; simulate again "
                "for other quantities, or read them before the edit"
            )
        return self.model

    # ------------------------------------------------------------------ what follows
    def _rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        t, q, v, states = self.t, self.q, self.v, self.states
        return (np.atleast_1d(t), q[None], v[None], states[None]) if self._alone else (t, q, v, states)

    def _scene(self) -> Any:
        """Return the scene that computes."""
        if self._calls is None:
            raise _core.EvaluationError(
                "this motion has no scene: for a run that was pickled or read from a file, accelerations, forces and energies "
                "are known only at its own times"
            )
        self._unedited_model()
        return self._calls

    @cached_property
    def _along(self) -> dict[str, np.ndarray]:
        found = self._scene().along(*self._rows())
        if not self._alone:
            return found
        return {name: x[:, 0] if name == "forces" else x[0] for name, x in found.items()}

    @property
    def vdot(self) -> np.ndarray:
        """(K, nv) accelerations, rad/s² and m/s²."""
        return self._along["vdot"]

    @property
    def forces(self) -> dict[str, np.ndarray]:
        """(K, nv) generalized forces of every effect, by name."""
        return dict(zip(self.effects, self._along["forces"], strict=True))

    @property
    def energy(self) -> dict[str, np.ndarray]:
        """Energies in J: "kinetic" (K,), rotors included; "potential" (K,), of all effects that have one; "work" (K, n), work of each
        effect of `workers` since the start. kinetic + potential - Σ work is constant, except for the integrator's error.
        """
        if not self._about["energy"]:
            raise _core.EvaluationError("this run did not record works; simulate with energy=True")
        return {"kinetic": self._along["kinetic"], "potential": self._along["potential"].sum(axis=-1), "work": self._work}

    @property
    def balance(self) -> np.ndarray:
        """(K,) kinetic + potential - Σ work, J: constant, except for the integrator's error."""
        energy = self.energy
        return energy["kinetic"] + energy["potential"] - energy["work"].sum(axis=-1)

    @property
    def drift(self) -> dict[str, np.ndarray]:
        """Largest residual (K,), m and rad, by loop of the model with residuals, even for loops that no effect keeps."""
        model = self._unedited_model()
        residual, of_positions = np.abs(model.loops.residual(self.q)), np.asarray(model.loops.of_positions, bool)
        own = {name: np.arange(len(of_positions))[loop.slice][of_positions[loop.slice]] for name, loop in model.loops.items()}
        return {name: residual[..., rows].max(axis=-1) for name, rows in own.items() if len(rows)}

    @cached_property
    def momentum(self) -> dict[str, np.ndarray]:
        """Spatial momentum (K, 6) of all bodies in the world's axes, angular first, N m s and N s: "origin", about the world's origin,
        and "com", about the centre of mass; zero about any point for a model without mass.
        """
        about_origin = self._unedited_model().momentum(self.q, self.v).value
        about_com = about_origin.copy()
        if self.model.mass > 0:
            about_com[..., :3] -= np.cross(self.centre_of_mass, about_origin[..., 3:])
        return {"origin": about_origin, "com": about_com}

    @cached_property
    def centre_of_mass(self) -> np.ndarray:
        """(K, 3) m, in the world."""
        return self._unedited_model().centre_of_mass(self.q)

    def interbody_forces(self, hinges: Any = None, *, axes: Any = "body", about: Any = None, part: str = "whole") -> np.ndarray:
        """Return the spatial forces (moment; force) of parents on their children through the hinges, under all effects: N m and N.

        Parameters
        ----------
        hinges : a name or `Hinge`, or a list of them; None: all, in the model's order
        axes, about, part : as in `Multibody.interbody_forces`; frames moved by a function are placed at the motion's times

        Returns
        -------
        (K, N, 6); for one hinge (K, 6)

        Examples
        --------
        >>> import pycraft as pc
        >>> run = pc.mechanisms.pendulum().simulate(1.0)
        >>> run.interbody_forces(next(iter(run.model.hinges)), axes="world").shape == (len(run.t), 6)
        True
        """
        f = forces_of_scene(self._scene(), self.model, *self._rows(), hinges, axes, about, part)
        return f[0] if self._alone else f

    def frame(self, name: str, *, axes: str = "body") -> FrameMotion:
        """Return a body or node over time: poses in the world and velocities, in its own axes or in the axes of `Multibody.jacobian`.

        Parameters
        ----------
        name : name of a body or node
        axes : {"body", "aligned", "world"}
        """
        model = self._unedited_model()
        jacobian = model.jacobian(name, self.q, axes=axes)
        return FrameMotion(model.pose(name, self.q), np.einsum("...ij,...j->...i", jacobian, self.v))

    def __len__(self) -> int:
        return np.size(self.t)

    # ------------------------------------------------------------------ copies
    def __getstate__(self) -> dict[str, Any]:
        """Pickle the data, after computing all derived values, because the scene that computes them is not pickled."""
        if self._calls is not None and not self._edited:
            self._along  # noqa: B018 - computes and caches
        return {**self.__dict__, "_calls": None, "_parameters": None if self._edited else 0}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if self._parameters is not None:  # the model's count restarts
            self._parameters = self.model._parameters
