"""Inertial parameters, and other forces at hinges, from logged motion and forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _core
from ..arguments import listed, one_number, text
from ..state import at_state
from .inertial_fit import Base, LeastSquares, base_of, distance, is_consistent, least_squares, nearest, nearest_bodies, without_rounding
from .logged_motion import logged_motion

PARAMETERS = ("mass", "mx", "my", "mz", "ixx", "ixy", "ixz", "iyy", "iyz", "izz")
"""Parameters of a body, in the regressor's order: m, m c, and the inertia about its origin."""
EXCITING = 4
"""Ratio of equations to parameters from which states show everything identifiable."""


@dataclass(frozen=True)
class BaseParameter:
    """A combination of parameters that motion and forces determine: its value after the fit, and the standard error of least squares."""

    name: str
    value: float
    standard_error: float

    def __str__(self) -> str:
        return f"{self.value:12.6g} ± {self.standard_error:.2g}  {self.name}"


@dataclass(frozen=True)
class BodyParameters:
    """`mass` kg, `com` (3,) m in the body's axes (zero without mass), `inertia` (3, 3) kg m² about the centre of mass."""

    mass: float
    com: np.ndarray
    inertia: np.ndarray

    @classmethod
    def of(cls, pi: np.ndarray) -> BodyParameters:
        mass, about_origin = float(pi[0]), np.zeros((3, 3))
        com = pi[1:4] / mass if mass else np.zeros(3)
        about_origin[np.triu_indices(3)] = pi[4:]
        about_origin += np.triu(about_origin, 1).T
        return cls(mass, com, about_origin - mass * (com @ com * np.eye(3) - np.outer(com, com)))


@dataclass(frozen=True)
class Identification:
    """Results of an identification: parameters after the fit, and their uncertainty.

    Attributes
    ----------
    parameters : (10 n,) in the order of `Multibody.inertial_parameters`; parameters that were not identified have the model's values
    rotor_inertia, viscous, coulomb : (nv,) J, c, F of T = Y π + Y_J J + c v + F sign(v); J has the model's values if not identified
    base : identifiable combinations, by name, with standard errors of least squares
    condition : condition number of the base columns, each of unit length
    consistent : whether all parameters are physically possible (pseudo-inertias positive, scalars not negative)
    by : "least squares", or "clarabel" if these parameters were not physically possible and `consistent` was set
    residuals : (K, nv), the logged forces minus the fitted ones
    noise : (nv,) standard deviations of forces, given or estimated
    """

    model: Any = field(repr=False)
    parameters: np.ndarray = field(repr=False)
    rotor_inertia: np.ndarray = field(repr=False)
    viscous: np.ndarray = field(repr=False)
    coulomb: np.ndarray = field(repr=False)
    base: tuple[BaseParameter, ...] = field(repr=False)
    condition: float
    consistent: bool
    by: str
    residuals: np.ndarray = field(repr=False)
    noise: np.ndarray = field(repr=False)

    @property
    def bodies(self) -> dict[str, BodyParameters]:
        """Return mass, centre of mass and inertia by body."""
        return dict(zip(self.model.bodies, map(BodyParameters.of, self.parameters.reshape(-1, 10)), strict=True))

    def predict(self, q: Any = None, v: Any = None, vdot: Any = None) -> np.ndarray:
        """Return T (nv,) or (B, nv) of the fit: inverse dynamics with its parameters, and its friction. O(N · depth)."""
        q, v = at_state(self.model, q, v)
        given = (("v", v), ("vdot", np.zeros(self.model.nv) if vdot is None else vdot))
        v, vdot = (np.asarray(_core.real_array(x, name), float) for name, x in given)
        forces = self.model.inertial_regressor(q, v, vdot) @ self.parameters
        forces = forces + self.model.rotor_regressor(v, vdot) @ self.rotor_inertia
        return forces + self.viscous * v + self.coulomb * np.sign(v)

    def apply(self) -> Any:
        """Set these bodies and rotors on the model; return the model. Friction is an effect: `pc.effects.Damping(found.viscous)`.

        ModelError if the parameters are not physically possible; the model is then unchanged.
        """
        if not self.consistent:
            bad = next((name for name, L in self._weakest().items() if L < 0), "a rotor or friction")
            raise _core.ModelError(f"these parameters are not physically possible, first those of {bad!r}: identify with consistent=True")
        model = self.model
        before = {name: (body.mass, body.com, body.inertia) for name, body in model.bodies.items()}
        rotors = {name: hinge.rotor_inertia for name, hinge in model.hinges.items()}
        try:
            for name, found in self.bodies.items():
                model.bodies[name]._set(mass=found.mass, com=found.com, inertia=found.inertia)
            for name, hinge in model.hinges.items():
                if not np.array_equal(self.rotor_inertia[hinge.v_slice], rotors[name]):
                    hinge.rotor_inertia = np.maximum(self.rotor_inertia[hinge.v_slice], 0.0)
        except _core.Error:
            for name, (mass, com, inertia) in before.items():
                model.bodies[name]._set(mass=mass, com=com, inertia=inertia)
            for name, hinge in model.hinges.items():
                hinge.rotor_inertia = rotors[name]
            raise
        return model

    def _weakest(self) -> dict[str, float]:
        """Return the weakest value by body, 0 or -1 if the parameters are not those of a body."""
        return {
            name: 0.0 if is_consistent(pi[None]) else -1.0
            for name, pi in zip(self.model.bodies, self.parameters.reshape(-1, 10), strict=True)
        }

    def __str__(self) -> str:
        head = f"{self.model.name!r}: {len(self.base)} base parameters by {self.by}, condition {self.condition:.3g}"
        kind = "bodies" if self.consistent else "parameters of no body"
        lines = [f"{head}, {kind}", f"residuals (rms) {', '.join(f'{x:.3g}' for x in np.sqrt((self.residuals**2).mean(axis=0)))}"]
        return "\n".join([*lines, *map(str, self.base)])


class IdentificationCalls:
    """Parameters of a model from logs of its motion."""

    nv: int
    inertial_regressor: Callable[..., Any]
    inertial_parameters: Callable[..., Any]

    def identify(
        self, q=None, v=None, vdot=None, tau=None, *, bodies: Any = None, rotors: Any = None, viscous: Any = None, coulomb: Any = None,
        consistent: bool = True, regularizer: str = "metric", regularization: float = 1e-3, noise: Any = None, apply: bool = False,
    ) -> Identification:  # fmt: skip
        """Identify inertial parameters of bodies from logged motion and forces, T = Y(q, v, v̇) π + Y_J J + c v + F sign(v).

        T determines combinations of parameters, the base parameters, found by least squares; among all parameters with these combinations
        the ones nearest to the model's present parameters, the prior, are returned. If they are not physically possible (a negative mass,
        an impossible inertia) and `consistent`, the nearest possible ones are: the least sum of squares in units of standard errors, plus
        `regularization` times the squared distance from the prior, with positive pseudo-inertias, a semidefinite program.

        Gravity is the model's; without it masses that turn nothing are not identifiable. Cost O(K N · depth) for the equations, O(K nv p²)
        for p parameters.

        Parameters
        ----------
        q, v, vdot, tau : (K, nq), (K, nv), (K, nv), (K, nv), forces as `inverse_dynamics` gives them
            Forces of rotors, Y_J J (`rotor_regressor`), and friction included.
            Or q alone: a run, or a table of one (`Run.to_dataframe`, columns "q.elbow", "v.elbow", "vdot.elbow"), with `tau` the names of
            the effects with measured forces; for a table None: columns "tau.elbow".
        bodies : names, or a list of them, of the bodies to identify; None: all
        rotors, viscous, coulomb : names of hinges, coordinates or patterns with unknown J, c, F; True: all; None: none
        consistent : whether parameters must be physically possible, and scalars not negative
        regularizer : {"metric", "frobenius"}: distances independent of units and axes, or of pseudo-inertias entry by entry
        regularization : weight in the semidefinite program, in squares of standard errors
        noise : standard deviations of forces, one for all or (nv,); None: one for all, estimated from the residuals
        apply : whether to set the parameters on the model (`Identification.apply`)

        Raises
        ------
        ModelError
            Sizes, names, values that are not finite (with the row and the coordinate).
        EvaluationError
            A log that does not excite a combination, by name; values with squares beyond the range of doubles.
        ImportError
            The semidefinite program is needed, but clarabel is missing (extra [identify]).

        Source: M. Gautier, W. Khalil, Direct calculation of minimum set of inertial parameters of serial robots, IEEE Transactions on
        Robotics and Automation 6 (1990); P. M. Wensing, S. Kim, J.-J. E. Slotine, IEEE Robotics and Automation Letters 3 (2018).

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> arm = pc.chain(2)
        >>> rng = np.random.default_rng(1)
        >>> q, v, vdot = rng.uniform(-1, 1, (3, 50, 2))
        >>> tau = arm.inverse_dynamics(q, v, vdot)
        >>> arm.bodies["body0"].mass = 1.3  # forgotten, and found again: as far as forces tell
        >>> found = arm.identify(q, v, vdot, tau)
        >>> bool(np.abs(found.residuals).max() < 1e-10), [each.name for each in found.base]
        (True, ['body0.izz + body1.mass', 'body1.mx', 'body1.my', 'body1.izz'])
        """
        model: Any = self
        q, v, vdot, tau = logged_motion(model, q, v, vdot, tau)
        unknown = _Unknowns.named(model, bodies, rotors, viscous, coulomb)
        deviations = _deviations(noise, model.nv)
        base = unknown.base(model)
        weights = np.ones(model.nv) if deviations is None else 1.0 / deviations
        rows = unknown.rows(model, q, v, vdot)
        with np.errstate(over="ignore"):  # it is refused
            b = (tau - unknown.known(model, q, v, vdot)) * weights
            equations = (rows * weights[:, None])[:, :, base.columns].reshape(b.size, len(base.columns))
            _refuse_beyond_range(model, equations, b)
        found = least_squares(equations, b.ravel())
        _refuse_unexcited(model, unknown, base, found, len(q))
        sigma = np.sqrt(found.left) if deviations is None else 1.0
        prior = unknown.prior(model)
        many = 10 * len(unknown.bodies)
        typical = _typical(rows[:, :, many:], tau, prior[many:])
        W = distance(prior[:many].reshape(-1, 10), typical, regularizer)
        weight = one_number(regularization, "regularization")
        if not 0 < weight < np.inf:
            raise _core.EvaluationError(f"regularization={weight:g}: it is a positive number")
        theta, by = nearest(prior, W, base, found.beta), "least squares"
        theta[:many] = without_rounding(theta[:many].reshape(-1, 10), prior[:many].reshape(-1, 10)).ravel()
        if consistent and not unknown.consistent(theta, typical):
            floor = 1e-4 * np.sqrt(np.mean(b**2))
            theta, by = nearest_bodies(prior, W, base, found, max(sigma, floor), weight, len(unknown.bodies)), "clarabel"
        residuals = tau - unknown.known(model, q, v, vdot) - rows @ theta
        errors = _standard_errors(found, sigma)
        values = base.combinations @ theta
        told = tuple(BaseParameter(*each) for each in zip(unknown.combinations(base), values.tolist(), errors.tolist(), strict=True))
        pi, J, c, F = unknown.all_of(model, theta)
        result = Identification(
            model, pi, J, c, F, told, found.condition, unknown.consistent(theta, typical), by, residuals,
            np.full(model.nv, sigma) if deviations is None else deviations,
        )  # fmt: skip
        if apply:
            result.apply()
        return result


@dataclass
class _Unknowns:
    """The unknowns: θ = (π of bodies, J, c, F of coordinates)."""

    names: list[str]
    bodies: list[int]
    rotors: list[int]
    viscous: list[int]
    coulomb: list[int]

    @classmethod
    def named(cls, model: Any, bodies: Any, rotors: Any, viscous: Any, coulomb: Any) -> _Unknowns:
        known = list(model.bodies)
        if bodies is None:
            chosen = list(range(len(known)))
        else:
            wanted = [bodies] if isinstance(bodies, str) or hasattr(bodies, "name") else listed(bodies, "bodies")
            chosen = [model._body_index(text(getattr(one, "name", one), "one of bodies")) for one in wanted]
        of = {what: _coordinates(model, given, what) for what, given in (("rotors", rotors), ("viscous", viscous), ("coulomb", coulomb))}
        names = [f"{known[k]}.{name}" for k in dict.fromkeys(chosen) for name in PARAMETERS]
        names += [f"{what.removesuffix('s')}.{model.coordinate_names[j]}" for what, those in of.items() for j in those]
        return cls(names, list(dict.fromkeys(chosen)), *of.values())

    def rows(self, model: Any, q: np.ndarray, v: np.ndarray, vdot: np.ndarray) -> np.ndarray:
        """Return the rows (K, nv, p) of the unknowns."""
        K, n = v.shape
        Y = np.asarray(model.inertial_regressor(q, v, vdot)).reshape(K, n, len(model.bodies), 10)
        columns = [Y[:, :, self.bodies].reshape(K, n, 10 * len(self.bodies))]
        columns.append(np.asarray(model.rotor_regressor(v, vdot))[:, :, self.rotors])
        for those, x in ((self.viscous, v), (self.coulomb, np.sign(v))):
            each = np.zeros((K, n, len(those)))
            each[:, those, range(len(those))] = x[:, those]
            columns.append(each)
        return np.concatenate(columns, axis=2)

    def known(self, model: Any, q: np.ndarray, v: np.ndarray, vdot: np.ndarray) -> np.ndarray:
        """Return (K, nv): the part of the forces that is known, with the model's values."""
        pi = model.inertial_parameters().reshape(-1, 10)
        pi[self.bodies] = 0.0
        J = _rotors_of(model)
        J[self.rotors] = 0.0
        others = np.asarray(model.inertial_regressor(q, v, vdot)) @ pi.ravel() if pi.any() else 0.0
        return others + np.asarray(model.rotor_regressor(v, vdot)) @ J

    def prior(self, model: Any) -> np.ndarray:
        pi = model.inertial_parameters().reshape(-1, 10)[self.bodies].ravel()
        return np.concatenate([pi, _rotors_of(model)[self.rotors], np.zeros(len(self.viscous) + len(self.coulomb))])

    def base(self, model: Any) -> Base:
        """Return the base parameters at states that excite everything that can be excited."""
        p, rng = len(self.names), np.random.default_rng(0)
        if not p or not model.nv:
            return Base(np.zeros(0, int), np.zeros((0, p)))
        count = EXCITING * p // model.nv + EXCITING
        q = np.array([model.random_state(rng).q for _ in range(count)])
        v, vdot = rng.uniform(-3, 3, (2, count, model.nv))
        return base_of(self.rows(model, q, v, vdot).reshape(-1, p))

    def combinations(self, base: Base) -> list[str]:
        return [_written(row, self.names) for row in base.combinations]

    def consistent(self, theta: np.ndarray, typical: np.ndarray) -> bool:
        many = 10 * len(self.bodies)
        return is_consistent(theta[:many].reshape(-1, 10)) and bool((theta[many:] >= -1e-9 * typical).all())

    def all_of(self, model: Any, theta: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return π of all bodies, J, c, F of all coordinates."""
        pi, J, c, F = model.inertial_parameters().reshape(-1, 10), _rotors_of(model), np.zeros(model.nv), np.zeros(model.nv)
        counts = np.cumsum([10 * len(self.bodies), len(self.rotors), len(self.viscous)])
        pi_, J[self.rotors], c[self.viscous], F[self.coulomb] = np.split(theta, counts)
        pi[self.bodies] = pi_.reshape(-1, 10)
        return pi.ravel(), J, c, F


def _coordinates(model: Any, given: Any, what: str) -> list[int]:
    if given is None or given is False:
        return []
    if given is True:
        return list(range(model.nv))
    names = [given] if isinstance(given, str) or hasattr(given, "name") else listed(given, what)
    return _core.coordinates_named(model, [text(getattr(one, "name", one), f"one of {what}") for one in names], what)


def _rotors_of(model: Any) -> np.ndarray:
    J = np.zeros(model.nv)
    for hinge in model.hinges.values():
        J[hinge.v_slice] = hinge.rotor_inertia
    return J


def _deviations(noise: Any, nv: int) -> np.ndarray | None:
    if noise is None:
        return None
    given = _core.real_array(noise, "noise")
    if given.ndim > 1 or given.size not in (1, nv) or not (np.isfinite(given) & (given > 0)).all():
        raise _core.ModelError(f"noise must be a positive standard deviation, or one for each of {nv} coordinates, not {noise!r:.80}")
    return np.broadcast_to(given.ravel(), (nv,)).astype(float)


def _typical(rows: np.ndarray, tau: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """Return typical sizes of scalars: of the prior, or the sizes that alone would produce all forces."""
    makes = np.sqrt((rows**2).sum(axis=(0, 1)))
    alone = np.sqrt((tau**2).sum()) / np.where(makes > 0, makes, 1.0)
    return np.where(prior > 0, prior, np.where(alone > 0, alone, 1.0))


def _standard_errors(found: LeastSquares, sigma: float) -> np.ndarray:
    if not len(found.beta):
        return np.zeros(0)
    return sigma * np.sqrt((np.linalg.inv(found.R) ** 2).sum(axis=1))


def _written(row: np.ndarray, names: list[str], most: int = 0) -> str:
    """Return a combination in words, the largest part first if it is shortened."""
    those = np.flatnonzero(row)
    if most:
        those = those[np.argsort(-np.abs(row[those]), kind="stable")]
    parts = [f"{'-' if row[i] < 0 else '+'} {'' if abs(abs(row[i]) - 1) < 1e-9 else f'{abs(row[i]):.4g} '}{names[i]}" for i in those]
    if most and len(parts) > most:
        parts = [*parts[:most], "..."]
    written = " ".join(parts)
    return written.removeprefix("+ ")


def _refuse_beyond_range(model: Any, *given: np.ndarray) -> None:
    for x in given:
        squares = float((x**2).sum())
        if not np.isfinite(squares) or (squares == 0 and x.any()):
            raise _core.EvaluationError(
                f"identify: squares of the log of {model.name!r} are beyond the range of numbers, of forces over their noise or of what "
                f"parameters make of motion (the largest is {np.abs(x).max():.3g}): take other units"
            )


def _refuse_unexcited(model: Any, unknown: _Unknowns, base: Base, found: LeastSquares, count: int) -> None:
    if found.rank == len(base.columns):
        return
    weakest = found.weakest / np.abs(found.weakest).max()
    weakest[np.abs(weakest) < 1e-6] = 0.0
    told = _written(weakest, [unknown.names[i] for i in base.columns], most=4)
    raise _core.EvaluationError(
        f"{count} states of {model.name!r} determine {found.rank} of {len(base.columns)} base parameters, and not {told}: log motion "
        "that excites it, or identify only some bodies (bodies=)"
    )
