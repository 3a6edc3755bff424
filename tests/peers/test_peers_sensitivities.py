"""Derivatives against Pinocchio on ten robots of example-robot-data, fixed and floating, and on a tree with ball and free hinges inside.

Pinocchio's derivatives along q are along its tangent: for the free flyer the body twist, linear part first. So everything is brought
over by the one orthogonal S of `pycraft.interop.pinocchio.Coordinates`, v_pinocchio = S v, which is constant: the robots of the list
have no planar joint. What Pinocchio has not (∂ℳ/∂q, Christoffel symbols, ∂KE/∂q, gradients of ln det ℳ) it gives column by column:
its derivatives of inverse dynamics at rest without gravity are those of ℳ v̇, and its Coriolis matrix is linear in v.

Tolerance: each entry is a sum along the path to the root of products that both sides round, so both lie within a small multiple of
N eps of the truth, relative to the largest entry: 100 N eps of it is asked, N the number of coordinates. What holds ℳ⁻¹ is solved for,
or multiplied by it: times cond(ℳ).
"""

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

from pycraft.interop import pinocchio as convention  # noqa: E402 - after the check that the extra is there
from pycraft.peers import peers  # noqa: E402 - as above
from support.pinocchio_pairs import ANGULAR_FIRST, EPS, INSIDE, STATES, Pair, models  # noqa: E402 - as above

pytestmark = [pytest.mark.peers, pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")]

ROBOTS = {
    "double_pendulum_continuous": "cosine and sine as coordinates",
    "ur5_robot": "six-axis arm",
    "xarm7": "seven-axis arm",
    "panda": "seven-axis arm with a gripper of sliders",
    "allegro_right_hand": "hand: four branches at the root",
    "anymal": "quadruped",
    "go2": "quadruped with rotors as links",
    "baxter": "two arms",
    "simple_humanoid": "humanoid, 29 joints",
    "talos_reduced": "humanoid, 32 joints",
}
CASES = [(robot, root) for robot in ROBOTS for root in ("fixed", "free")] + [(INSIDE, "fixed")]


@pytest.fixture(scope="module", params=CASES, ids=[f"{robot}-{root}" for robot, root in CASES])
def pairs(request):
    """The model at a few seeded states."""
    model, twin, still = models(*request.param)
    rng = np.random.default_rng(7)
    states = [model.random_state(rng) for _ in range(STATES)]
    return [Pair(model, twin, still, s.q, s.v, rng.uniform(-1, 1, model.nv)) for s in states]


def agree(pair, mine, theirs, solved=False, terms=0.0):
    """Equal within the bound, relative to the largest entry, or to the largest of the terms where they are given: sums may cancel."""
    mine, theirs = np.asarray(mine), np.asarray(theirs)
    assert mine.shape == theirs.shape
    scale = max(np.abs(mine).max(initial=0), np.abs(theirs).max(initial=0))
    scale = max(scale, np.max(terms))
    assert np.isfinite(scale)
    bound = 100 * pair.model.nv * EPS * (np.linalg.cond(pair.model.mass_matrix(pair.q)) if solved else 1)
    assert np.abs(mine - theirs).max(initial=0) <= bound * scale


def about(point, forces):
    """Columns of forces about the world's origin, about `point`; and, as in the world's axes, linear part first."""
    return np.vstack([forces[3:], forces[:3] - np.cross(point[:, None], forces[3:], axis=0)])


def centre_of_mass(pair):
    bodies = [(pair.model.pose(name, pair.q), body) for name, body in pair.model.bodies.items()]
    return sum(b.mass * (X[:3, :3] @ b.com + X[:3, 3]) for X, b in bodies) / sum(b.mass for _, b in bodies)


def test_the_list():
    assert len(ROBOTS) >= 10
    assert set(ROBOTS) <= {f.stem for f in peers.robot_files()}


def test_inverse_dynamics(pairs):
    for p in pairs:
        theirs = p.call(pin.computeRNEADerivatives, p.v, p.u)
        for mine, theirs_in in zip(p.model.inverse_dynamics_derivatives(p.q, p.v, p.u), theirs, strict=True):
            agree(p, mine, p.ours(theirs_in))


def test_forward_dynamics(pairs):
    for p in pairs:
        # the generalized forces of some moderate accelerations
        tau = p.model.inverse_dynamics(p.q, p.v, p.u)
        theirs = p.call(pin.computeABADerivatives, p.v, tau)
        for mine, theirs_in in zip(p.model.forward_dynamics_derivatives(p.q, p.v, tau), theirs, strict=True):
            agree(p, mine, p.ours(theirs_in), solved=True)


def test_mass_matrix_derivative(pairs):
    for p in pairs:
        agree(p, p.model.mass_matrix_derivative(p.q), p.mass_slope(), terms=p.inertia())


def test_mass_matrix_derivative_by_rule(pairs):
    """The expression's derivative, evaluated by sweeps, along the first, the middle and the last coordinate."""
    p = pairs[0]
    H, phi, M = p.model.soa("H phi M")
    mass_matrix, slope = H @ phi @ M @ phi.T @ H.T, p.mass_slope()
    for i in {0, p.model.nv // 2, p.model.nv - 1}:
        agree(p, mass_matrix.diff(i).at(p.q).dense(), slope[:, :, i], terms=p.inertia())


def test_mass_matrix_by_parameters_of_bodies(pairs):
    """By mass, centre of mass and inertia, which are not linear parameters: the regressor times their derivatives."""
    p = pairs[0]
    H, phi, M = p.model.soa("H phi M")
    mass_matrix, slope = H @ phi @ M @ phi.T @ H.T, p.mass_columns()
    for k, body in [*enumerate(p.model.bodies.values())][:: max(1, len(p.model.bodies) // 3)]:
        m, c = body.mass, body.com
        moment = lambda A: A[np.triu_indices(3)]
        turn = np.zeros((3, 3))
        turn[0, 2] = turn[2, 0] = 1
        square = np.outer(np.eye(3)[1], c) + np.outer(c, np.eye(3)[1])
        for symbol, direction in [
            (body.symbol("mass"), np.r_[1, c, moment(c @ c * np.eye(3) - np.outer(c, c))]),
            (body.symbol("com", "y"), np.r_[0, m * np.eye(3)[1], moment(m * (2 * c[1] * np.eye(3) - square))]),
            (body.symbol("inertia", "x", "z"), np.r_[0, 0, 0, 0, moment(turn)]),
        ]:
            agree(p, mass_matrix.diff(symbol).at(p.q).dense(), slope[:, :, 10 * k : 10 * k + 10] @ direction)


def test_christoffel(pairs):
    """Pinocchio's Coriolis matrix is Christoffel's, on free and ball hinges too (Koszul's); it is linear in v."""
    for p in pairs:
        theirs = np.stack([p.ours(p.call(pin.computeCoriolisMatrix, e)) for e in np.eye(p.model.nv)], axis=-1)
        agree(p, p.model.christoffel(p.q), theirs, terms=p.inertia())


def test_coriolis_matrix(pairs):
    for p in pairs:
        theirs = p.ours(p.call(pin.computeCoriolisMatrix, p.v))
        agree(p, p.model.coriolis_matrix(p.q, p.v), theirs, terms=p.inertia() * np.abs(p.v).max())
        agree(p, p.model.coriolis_matrix(p.q, p.v, form="skew") @ p.v, theirs @ p.v, terms=abs(theirs) @ abs(p.v))


def test_kinetic_energy(pairs):
    """∂KE/∂q = ½ v·∂(ℳv)/∂q by Pinocchio's derivative at rest with the accelerations v; ℳv likewise. ½ v·(∂KE/∂v) is its energy."""
    for p in pairs:
        rest = np.zeros(p.model.nv)
        slope, _, mass = p.call(pin.computeRNEADerivatives, rest, p.v, still=True)
        dq, dv = p.model.kinetic_energy_derivatives(p.q, p.v)
        slope, mass = p.ours(slope), p.ours(mass)
        agree(p, dq, 0.5 * p.v @ slope, terms=0.5 * abs(p.v) @ abs(slope))
        agree(p, dv, mass @ p.v, terms=abs(mass) @ abs(p.v))
        agree(p, 0.5 * p.v @ dv, p.call(pin.computeKineticEnergy, p.v))


def test_momentum(pairs):
    """Ours is about the world's origin; Pinocchio's about the centre of mass, which moves: hence the terms with its velocity."""
    for p in pairs:
        momentum, centre = p.model.momentum(p.q, p.v), centre_of_mass(p)
        mass = sum(body.mass for body in p.model.bodies.values())
        data = p.pin_model.createData()
        rate = pin.dccrba(p.pin_model, data, p.pq, p.S @ p.v) @ p.S
        agree(p, about(centre, momentum.matrix), data.Ag @ p.S)
        agree(p, about(centre, momentum.value[:, None])[:, 0], np.array(data.hg))

        centre_slope = momentum.matrix[3:] / mass  # ∂c/∂q
        columns = np.stack([p.model.momentum(p.q, e).dq @ p.v for e in np.eye(p.model.nv)], axis=1)
        mine = about(centre, columns)
        mine[3:] -= np.cross((centre_slope @ p.v)[:, None], momentum.matrix[3:], axis=0)
        agree(p, mine, rate)

        mine = about(centre, momentum.dq)
        mine[3:] -= np.cross(centre_slope, momentum.value[3:, None], axis=0)
        agree(p, mine, p.call(pin.computeCentroidalDynamicsDerivatives, p.v, p.u)[0] @ p.S)


def test_centroidal_momentum(pairs):
    for p in pairs:
        h, data = p.model.centroidal_momentum(p.q, p.v), p.pin_model.createData()
        rate = pin.dccrba(p.pin_model, data, p.pq, p.S @ p.v) @ p.S
        agree(p, h.matrix[ANGULAR_FIRST], data.Ag @ p.S)
        agree(p, h.value[ANGULAR_FIRST], np.array(data.hg))
        agree(p, h.matrix_dot[ANGULAR_FIRST], rate)
        agree(p, h.dq[ANGULAR_FIRST], p.call(pin.computeCentroidalDynamicsDerivatives, p.v, p.u)[0] @ p.S)
        varied = p.call(lambda *given: pin.computeCentroidalMomentumTimeVariation(*given).np, p.v, p.u)
        agree(p, (h.matrix @ p.u + h.matrix_dot @ p.v)[ANGULAR_FIRST], varied, terms=np.abs(h.matrix) @ np.abs(p.u))
        pin.ccrba(p.pin_model, data, p.pq, p.S @ p.v)
        agree(p, p.model.composite_inertia(p.q)[:3, :3], data.Ig.inertia)
        agree(p, p.model.mass, data.Ig.mass)
        pin.centerOfMass(p.pin_model, data, p.pq, p.S @ p.v)
        agree(p, p.model.centre_of_mass(p.q), data.com[0])
        agree(p, p.model.centre_of_mass_velocity(p.q, p.v), data.vcom[0])
        agree(p, p.model.centre_of_mass_jacobian(p.q), p.call(pin.jacobianCenterOfMass) @ p.S)


def test_jacobian_rate(pairs):
    for p in pairs:
        data = p.pin_model.createData()
        pin.computeJointJacobiansTimeVariation(p.pin_model, data, p.pq, p.S @ p.v)
        pin.updateFramePlacements(p.pin_model, data)
        for frame in p.frames():
            index = p.pin_model.getFrameId(frame, pin.FrameType.BODY)
            theirs = pin.getFrameJacobianTimeVariation(p.pin_model, data, index, pin.ReferenceFrame.LOCAL)[ANGULAR_FIRST] @ p.S
            # Ṽ times columns of 𝒥: zero on the frame's own joint, where one of the two does not round
            columns = p.model.jacobian(frame, p.q)
            agree(p, p.model.jacobian_dot(frame, p.q, p.v), theirs, terms=np.abs(columns).max() * np.abs(columns @ p.v).max())


def test_kinematic_hessian(pairs):
    """∂𝒥(i, j)/∂q_k is Pinocchio's local entry (i, j, k). Its Python array has the entries in Fortran's order with C's strides.

    Two coordinates of one ball or free joint are compared at the root only: further out Pinocchio 4.1 puts there what is not the
    derivative of its own Jacobian. See the next test.
    """
    for p in pairs:
        data = p.pin_model.createData()
        pin.computeJointKinematicHessians(p.pin_model, data, p.pq)
        compared = np.ones((p.model.nv, p.model.nv), bool)
        for hinge in p.model.hinges.values():
            if hinge.kind in ("ball", "free") and hinge.body.parent is not None:
                compared[hinge.v_slice, hinge.v_slice] = False
        for frame in p.frames():
            index = p.pin_model.getFrameId(frame, pin.FrameType.BODY)
            raw = np.asarray(pin.getFrameKinematicHessian(p.pin_model, data, index, pin.ReferenceFrame.LOCAL))
            theirs = raw.ravel().reshape(raw.shape, order="F")[ANGULAR_FIRST]
            theirs = np.einsum("aij,ik,jl->akl", theirs, p.S, p.S)
            agree(p, p.model.jacobian_derivative(frame, p.q)[:, compared], theirs[:, compared])


def test_kinematic_hessian_by_differences():
    """Central differences of Pinocchio's Jacobian along its tangent: with step h wrong by h²/6 times a third derivative, and eps/h."""
    model, twin, still = models(INSIDE, "fixed")
    state = model.random_state(3)
    p = Pair(model, twin, still, state.q, state.v, state.v)
    h = EPS ** (1 / 3)
    for frame in p.frames():

        def there(step, frame=frame):
            q = pin.integrate(p.pin_model, p.pq, p.S @ step)
            return convention.jacobian(p.pin_model, p.pin_model.createData(), q, frame) @ p.S

        theirs = np.stack([(there(h * e) - there(-h * e)) / (2 * h) for e in np.eye(model.nv)], axis=-1)
        mine = model.jacobian_derivative(frame, p.q)
        assert np.abs(mine - theirs).max() <= 100 * h**2 * np.abs(mine).max(initial=1)


def test_regressor(pairs):
    for p in pairs:
        columns = p.parameter_columns()
        theirs = p.S.T @ p.call(pin.computeJointTorqueRegressor, p.v, p.u)[:, columns]
        agree(p, p.model.inertial_regressor(p.q, p.v, p.u), theirs)
        parameters = np.concatenate([inertia.toDynamicParameters() for inertia in list(p.pin_model.inertias)[1:]])
        agree(p, p.model.inertial_parameters(), parameters[columns])


def test_log_determinant_gradients(pairs):
    """tr(ℳ⁻¹∂ℳ), with both factors Pinocchio's."""
    p = pairs[0]
    inverse = p.inverse()
    for over, slope in (("coordinates", p.mass_slope()), ("inertias", p.mass_columns())):
        mine = p.model.log_determinant_gradient(p.q, over=over).ravel()
        products = np.einsum("ij,jik->k", np.abs(inverse), np.abs(slope))
        agree(p, mine, np.einsum("ij,jik->k", inverse, slope), solved=True, terms=products)
