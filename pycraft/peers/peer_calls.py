"""Computations of other packages on our models, as calls without arguments for timing, and their values in our form.

A timed call gets arguments in the package's own order: nothing is converted while the clock runs. Each of these classes has `name` and
`calls(q, v, u, X)`; a package has only its own calls with equal results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib.util import find_spec
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ..interop.drake import drake_plant
from ..interop.export import refuse_large, to_mjcf, to_pinocchio
from ..interop.mujoco import acceleration_to_mujoco, to_mujoco, velocity_map
from ..interop.packages import required
from ..interop.peer import PeerRefusal
from .clock import Clock, elapsed

ONE_THREAD = 64
"""Number of states of a batch that Pinocchio computes on one thread, for the time of a call in C++."""


_ANGULAR = [3, 4, 5, 0, 1, 2]  # first


class Call(NamedTuple):
    """A package's call: the function to time, its value in our form, and how many arrays of the size of ℳ its bindings copy."""

    run: Callable[[], Any]
    value: Callable[[], tuple[np.ndarray, ...]]
    copies: int = 0


def _full(upper: np.ndarray) -> np.ndarray:
    return np.triu(upper) + np.triu(upper, 1).T


class PinocchioCalls:
    """Pinocchio's calls on a model. MissingPackageError if it is not installed; PeerRefusal for a model that it refuses."""

    name = "Pinocchio"

    def __init__(self, model: Any):
        self.pin = required("pinocchio", "peers", "comparison with Pinocchio needs")
        refuse_large(model.nv)
        self.twin = to_pinocchio(model)
        self.model = self.twin.model
        self.data = self.model.createData()

    def calls(self, q: np.ndarray, v: np.ndarray, u: np.ndarray, X: np.ndarray) -> dict[str, Call]:
        of_v = self.twin.of_v
        return self._calls(self.twin.q(q), v[of_v], u[of_v], X[of_v], np.argsort(of_v), self.twin.bodies)

    def _calls(
        self, q: np.ndarray, v: np.ndarray, u: np.ndarray, X: np.ndarray, back: np.ndarray, bodies: tuple[tuple[int, Any], ...]
    ) -> dict[str, Call]:
        pin, model, data = self.pin, self.model, self.data
        tip, both = self._held(bodies[-1:]), self._held((bodies[-1], bodies[len(bodies) // 2]))

        def square(matrix: np.ndarray) -> np.ndarray:
            return np.asarray(matrix)[np.ix_(back, back)]

        def inertia(held: tuple[Any, Any], count: int) -> tuple[np.ndarray, ...]:
            order = [6 * i + j for i in range(count) for j in _ANGULAR]
            return (np.linalg.inv(pin.computeDelassusMatrix(model, data, q, *held))[np.ix_(order, order)],)

        def derivatives(found: Any) -> tuple[np.ndarray, ...]:
            along_q, along_v, third = found
            return square(along_q), square(along_v), square(_full(third))

        return {
            "forward_dynamics": Call(
                lambda: pin.aba(model, data, q, v, u),
                lambda: (pin.aba(model, data, q, v, u)[back],),
            ),
            "inverse_dynamics": Call(
                lambda: pin.rnea(model, data, q, v, u),
                lambda: (pin.rnea(model, data, q, v, u)[back],),
            ),
            "mass_matrix": Call(
                lambda: pin.crba(model, data, q),
                lambda: (square(_full(pin.crba(model, data, q))),),
                copies=2,
            ),
            "mass_matrix_inverse": Call(
                lambda: pin.computeMinverse(model, data, q),
                lambda: (square(_full(pin.computeMinverse(model, data, q))),),
                copies=2,
            ),
            "inverse_dynamics_derivatives": Call(
                lambda: pin.computeRNEADerivatives(model, data, q, v, u),
                lambda: derivatives(pin.computeRNEADerivatives(model, data, q, v, u)),
            ),
            "forward_dynamics_derivatives": Call(
                lambda: pin.computeABADerivatives(model, data, q, v, u),
                lambda: derivatives(pin.computeABADerivatives(model, data, q, v, u)),
            ),
            "coriolis_matrix": Call(
                lambda: pin.computeCoriolisMatrix(model, data, q, v),
                lambda: (square(pin.computeCoriolisMatrix(model, data, q, v)),),
                copies=1,
            ),
            "operational_space_inertia": Call(  # without the inverse, which from Python is NumPy's and slower
                lambda: pin.computeDelassusMatrix(model, data, q, *tip),
                lambda: inertia(tip, 1),
            ),
            "operational_space_inertia_of_two": Call(
                lambda: pin.computeDelassusMatrix(model, data, q, *both),
                lambda: inertia(both, 2),
            ),
            "mass_matrix_inverse_product": Call(
                lambda: pin.computeMinverse(model, data, q) @ X,
                lambda: ((_full(pin.computeMinverse(model, data, q)) @ X)[back],),
            ),
        }

    def _held(self, bodies: Iterable[tuple[int, Any]]) -> tuple[Any, Any]:
        """Return constraints of these bodies in all directions, and their data, for a Delassus matrix."""
        pin, held, data = self.pin, self.pin.StdVec_RigidConstraintModel(), self.pin.StdVec_RigidConstraintData()
        for joint, placement in bodies:
            held.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_6D, self.model, joint, placement, pin.LOCAL))
            data.append(held[len(held) - 1].createData())
        return held, data

    def bindings(self, call: str) -> Callable[[], Any]:
        """Return the call on a model without joints: its time is not the call's own work. One joint if the call needs one."""
        pin, empty = self.pin, object.__new__(PinocchioCalls)
        empty.pin, empty.model = pin, pin.Model()
        if call.startswith("operational_space_inertia"):
            empty.model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "one")
            empty.model.appendBodyToJoint(1, pin.Inertia.Identity(), pin.SE3.Identity())
        empty.data = empty.model.createData()
        none = np.zeros(empty.model.nv)
        return empty._calls(none, none, none, np.zeros((len(none), 1)), np.arange(len(none)), ((len(none), pin.SE3.Identity()),))[call].run

    def in_cpp(self, call: str, q: np.ndarray, v: np.ndarray, u: np.ndarray) -> tuple[Clock, int] | None:
        """Return a clock of these states (q, v, u) in a loop in C++ on one thread; None if the package has no such loop."""
        loops = {"forward_dynamics": "abaInParallel", "inverse_dynamics": "rneaInParallel"}
        if call not in loops or not hasattr(self.pin, loops[call]) or self.model.nv > 100:  # its pool doubles the work space
            return None
        loop, pool = getattr(self.pin, loops[call]), self.pin.ModelPool(self.model, 1)
        times = -(-ONE_THREAD // len(q))
        Q, V, U = (
            np.asfortranarray(np.tile(np.array(rows), (times, 1)).T)
            for rows in ([self.twin.q(x) for x in q], v[:, self.twin.of_v], u[:, self.twin.of_v])
        )
        out = np.zeros_like(V)
        return (lambda seconds: elapsed(lambda: loop(1, pool, Q, V, U, out), seconds)), Q.shape[1]


class MuJoCoCalls:
    """MuJoCo's calls on a model, contacts and constraints off. PeerRefusal for a model that it refuses."""

    name = "MuJoCo"

    def __init__(self, model: Any):
        self.mujoco = required("mujoco", "peers", "comparison with MuJoCo needs")
        self.ours = model
        try:
            self.model = self.mujoco.MjModel.from_xml_string(to_mjcf(model))
        except ValueError as error:
            raise PeerRefusal(" ".join(str(error).split())) from None

    def calls(self, q: np.ndarray, v: np.ndarray, u: np.ndarray, X: np.ndarray) -> dict[str, Call]:
        mj, model, ours, nv = self.mujoco, self.model, self.ours, self.ours.nv
        T, drift = velocity_map(ours, q), acceleration_to_mujoco(ours, q, v, np.zeros(nv))
        forward, inverse, positions = (mj.MjData(model) for _ in range(3))
        for data in (forward, inverse, positions):
            data.qpos, data.qvel = to_mujoco(ours, q, v)
        forward.qfrc_applied = T @ u
        inverse.qacc = acceleration_to_mujoco(ours, q, v, u)
        M, rows = np.empty((nv, nv)), np.ascontiguousarray((T @ X).T)
        solved = np.empty_like(rows)

        def inertia() -> None:
            mj.mj_kinematics(model, positions)
            mj.mj_comPos(model, positions)
            mj.mj_crb(model, positions)

        def mass_matrix() -> np.ndarray:
            inertia()
            mj.mj_fullM(model, positions, M)
            return M

        def solve() -> np.ndarray:
            inertia()
            mj.mj_factorM(model, positions)
            mj.mj_solveM(model, positions, solved, rows)
            return solved

        def accelerations() -> tuple[np.ndarray, ...]:
            mj.mj_forward(model, forward)
            return (T.T @ (forward.qacc - drift),)

        def forces() -> tuple[np.ndarray, ...]:
            mj.mj_inverse(model, inverse)
            return (T.T @ inverse.qfrc_inverse,)

        return {
            "forward_dynamics": Call(lambda: mj.mj_forward(model, forward), accelerations),
            "inverse_dynamics": Call(lambda: mj.mj_inverse(model, inverse), forces),
            "mass_matrix": Call(mass_matrix, lambda: (T.T @ mass_matrix() @ T,)),
            "mass_matrix_inverse_product": Call(solve, lambda: (T.T @ solve().T,)),
        }


class DrakeCalls:
    """Drake's calls on a continuous plant. PeerRefusal for a model that it refuses."""

    name = "Drake"

    def __init__(self, model: Any):
        self.plant, self.of_q, self.of_v = drake_plant(model)

    def calls(self, q: np.ndarray, v: np.ndarray, u: np.ndarray, X: np.ndarray) -> dict[str, Call]:
        """Return the calls; each sets its state, without which the plant returns cached results."""
        from pydrake.multibody.tree import MultibodyForces

        plant, of_v, nv = self.plant, self.of_v, len(self.of_v)
        context = plant.CreateDefaultContext()
        state, vdot, applied = np.empty(len(self.of_q) + nv), np.empty(nv), np.empty(nv)
        state[self.of_q], state[len(self.of_q) + of_v], vdot[of_v], applied[of_v] = q, v, u, u
        plant.get_applied_generalized_force_input_port().FixValue(context, applied)
        forces = MultibodyForces(plant)

        def accelerations() -> Any:
            plant.SetPositionsAndVelocities(context, state)
            return plant.EvalTimeDerivatives(context)

        def inverse_dynamics() -> np.ndarray:
            plant.SetPositionsAndVelocities(context, state)
            plant.CalcForceElementsContribution(context, forces)
            return plant.CalcInverseDynamics(context, vdot, forces)

        def mass_matrix() -> np.ndarray:
            plant.SetPositionsAndVelocities(context, state)
            return plant.CalcMassMatrix(context)

        return {
            "forward_dynamics": Call(accelerations, lambda: (accelerations().CopyToVector()[-nv:][of_v],)),
            "inverse_dynamics": Call(inverse_dynamics, lambda: (inverse_dynamics()[of_v],)),
            "mass_matrix": Call(mass_matrix, lambda: (mass_matrix()[np.ix_(of_v, of_v)],)),
        }


Package: TypeAlias = type[PinocchioCalls] | type[MuJoCoCalls] | type[DrakeCalls]


def other_packages(leave_out: Callable[[str], None]) -> list[Package]:
    """Return constructors of packages' calls: Pinocchio first, then others that are installed; missing ones are reported."""
    required("pinocchio", "peers", "comparison with Pinocchio needs")
    makers: list[Package] = [PinocchioCalls]
    others: tuple[tuple[str, Package, str], ...] = (("mujoco", MuJoCoCalls, "'pycraft-soa[peers]'"), ("pydrake", DrakeCalls, "drake"))
    for package, make, remedy in others:
        if find_spec(package) is None:
            leave_out(f"{make.name}: not installed: pip install {remedy}")
        else:
            makers.append(make)
    leave_out("CasADi: not timed: it has no dynamics of its own, and those of pinocchio.casadi are in no package of PyPI")
    return makers
