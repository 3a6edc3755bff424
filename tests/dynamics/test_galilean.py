"""Neither how fast a system travels nor where it is counts in its dynamics: forces, accelerations and derivatives keep their digits.

The truth is computed in 50 digits at the very numbers of the state. A uniform velocity and a displacement of the whole system change no
acceleration of a joint, so that no bound below contains the speed or the distance.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft.accuracy.exact import exact_dynamics

EPS = np.finfo(float).eps
SPEED, FAR = 7.7e3, 1e8  # m/s, m
FORMS = ("fast", "ud", "square-root")
METHODS = ("cholesky", "ldl", "inverse", "conjugate-gradients", "divide-and-conquer")
LINKS = ("pin", "pin", "ball", "slider", "universal", "screw")
TURNING = [{"kind": "pin", "axis": axis} for axis in ([0, 0, 1.0], [0, 1.0, 0], [1.0, 0, 0])]
SLIDING = [{"kind": "slider", "axis": axis} for axis in ([1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0])]
# What moves a body along any line: one free subhinge, or sliders inboard of, outboard of and between other subhinges.
ROOTS = {
    "free": None,
    "sliders inboard": SLIDING + TURNING,
    "sliders outboard": TURNING + SLIDING,
    "sliders between": [TURNING[0], SLIDING[0], TURNING[1], SLIDING[1], SLIDING[2], TURNING[2]],
    "sliders after a ball": [{"kind": "ball"}, *SLIDING],
}


def bus(seed, root="free", links=LINKS, heavy=2000.0, light=0.05):
    """A heavy body that moves freely with two branches of light links, and a state and forces of a few units."""
    rng = np.random.default_rng(seed)
    model = pc.Multibody("bus")
    inertia = np.diag(rng.uniform(1, 2, 3)) * heavy
    hinge = {"hinge": "free"} if ROOTS[root] is None else {"hinge": "custom", "subhinges": ROOTS[root]}
    model.add_body("bus", mass=heavy, com=rng.normal(size=3) * 0.1, inertia=inertia, hinge_name="root", **hinge)
    for k, kind in enumerate(links):
        axes = {"universal": [[1, 0, 0], [0, 1, 0]], "ball": []}.get(kind, [list(rng.normal(size=3))])
        parent = "bus" if k % 3 == 0 else f"link{k - 1}"
        options = {"axes": axes} if len(axes) > 1 else {"axis": axes[0]} if axes else {}
        model.add_body(
            f"link{k}",
            parent,
            hinge=kind,
            position=rng.normal(size=3),
            mass=light,
            com=rng.normal(size=3) * 0.2,
            inertia=np.diag(rng.uniform(1, 2, 3)) * light * 0.05,
            **options,
        )
    state = model.random_state(seed)
    tau = rng.normal(size=model.nv)
    return model, np.array(state.q), np.array(state.v), tau


def moved(model, q, v, speed=0.0, far=0.0, seed=0):
    """The same motion with a uniform velocity in the world added, and displaced: the free root's own coordinates."""
    rng = np.random.default_rng([3, seed])
    along, to = rng.normal(size=(2, 3))
    q, v = q.copy(), v.copy()
    v[3:6] += model.pose("bus", q)[:3, :3].T @ (speed * along / np.linalg.norm(along))
    q[4:7] += far * to / np.linalg.norm(to)
    return q, v


def travels(root):
    """The velocity coordinates of the root that move it along lines."""
    sizes = [{"ball": 3}.get(s["kind"], 1) for s in ROOTS[root] or []]
    return [sum(sizes[:i]) for i, s in enumerate(ROOTS[root] or []) if s["kind"] == "slider"] or [3, 4, 5]


def joints(model):
    return slice(model.hinges["root"].v_slice.stop, None)


def exact(model, q, v, tau):
    return np.array([float(x) for x in exact_dynamics(model, q, v, tau, 50)])


def test_a_coasting_body_does_not_accelerate():
    body = pc.Multibody("coasting")
    body.add_body("body", hinge="free", mass=3.0, inertia=np.diag([1.0, 2, 3]))
    w, u = np.array([0, 0, 0.7]), np.array([7.5e3, -3.1e3, 11.0])
    for form in FORMS:
        for refine in (0, 1):
            vdot = body.forward_dynamics([1, 0, 0, 0, 1, 2, 3], [*w, *u], np.zeros(6), form=form, refine=refine)
            assert (vdot[:3] == 0).all()
            assert (np.abs(vdot[3:] + np.cross(w, u)) <= 2 * EPS * np.abs(w).max() * np.abs(u).max()).all()


@pytest.mark.parametrize("root", ROOTS)
@pytest.mark.parametrize("form", FORMS)
def test_joints_keep_their_digits_at_orbital_speed(root, form):
    """2 t with links of 50 g at 7.7 km/s; errors relative to the largest acceleration of a joint."""
    for seed in range(4):
        model, q, v, tau = bus(seed, root)
        v[travels(root)] = SPEED * np.array([0.6, -0.5, 0.62])
        truth, rows = exact(model, q, v, tau), joints(model)
        for refine in (0, 1, "auto"):
            error = np.abs(model.forward_dynamics(q, v, tau, form=form, refine=refine) - truth)[rows].max()
            assert error <= 1e-13 * np.abs(truth[rows]).max()


@pytest.mark.parametrize("way", [*({"form": f, "refine": r} for f in FORMS for r in (0, 1)), *({"method": m} for m in METHODS)], ids=str)
def test_forward_dynamics_does_not_see_a_common_velocity_or_place(way):
    """Bit for bit, alone and in batches, in every form and by every method; except the root's own linear coordinates, which see ω × v."""
    for seed in range(3):
        model, q, v, tau = bus(seed)
        rows = [i for i in range(model.nv) if i not in (3, 4, 5)]
        still = model.forward_dynamics(q, v, tau, **way)
        for speed, far in ((1e4, 0.0), (0.0, FAR), (1e4, FAR)):
            Q, V = moved(model, q, v, speed, far, seed)
            there = model.forward_dynamics(Q, V, tau, **way)
            assert np.array_equal(there[rows], still[rows])
            turn = np.cross(V[:3], V[3:6]) - np.cross(v[:3], v[3:6])
            assert np.abs(there[3:6] - (still[3:6] - turn)).max() <= 8 * EPS * (np.abs(turn).max() + np.abs(still[3:6]).max())
            many = model.forward_dynamics(np.tile(Q, (9, 1)), np.tile(V, (9, 1)), tau, **way)
            assert (many == there).all()


def test_precisions_do_not_see_a_common_velocity():
    model, q, v, tau = bus(1)
    rows = [i for i in range(model.nv) if i not in (3, 4, 5)]
    _, V = moved(model, q, v, 1e4)
    for precision in ("single", "extended", "quad", 50):
        here, there = (model.forward_dynamics(q, x, tau, form="ud", precision=precision)[rows] for x in (v, V))
        assert np.array_equal(here, there)


def test_a_hinge_with_a_rotor_on_its_travels_takes_part_in_the_motion():
    """Rotor inertia does not share a change of the body's velocity, so that nothing of such a hinge's own terms is left out."""
    for seed in range(3):
        model, q, v, tau = bus(seed)
        model.hinges["root"].rotor_inertia = [0, 0, 0, 5.0, 4.0, 3.0]
        truth = exact(model, q, v, tau)
        for way in (*({"form": f} for f in FORMS), {"method": "cholesky"}):
            assert np.abs(model.forward_dynamics(q, v, tau, **way) - truth).max() <= 1e-12 * np.abs(truth).max()


def test_three_sliders_that_span_no_space_are_refused_as_ever():
    model = pc.Multibody("plane")
    sliders = [{"kind": "slider", "axis": axis} for axis in ([1.0, 0, 0], [0, 1.0, 0], [0.6, 0.8, 0])]
    model.add_body("body", hinge="custom", subhinges=[TURNING[0], *sliders, *TURNING[1:]], mass=1.0, inertia=np.eye(3))
    with pytest.raises(pc.SingularHingeError):
        model.forward_dynamics(np.zeros(6), np.ones(6), np.zeros(6))
    forces = model.inverse_dynamics(np.zeros(6), np.ones(6), np.ones(6))  # which always works
    assert np.isfinite(forces).all()


def test_minimum_norm_answers_do_not_move_along_the_null_space():
    """A massless body that flies freely: no acceleration but the least, however fast it is said to go."""
    model = pc.Multibody("ghost")
    model.add_body("ghost", hinge="free")
    vdot = model.forward_dynamics([1, 0, 0, 0, 0, 0, 0], [0.1, 0.2, 0.3, 1e3, 2e3, 3e3], np.zeros(6), on_singular="minimum-norm")
    assert np.abs(vdot).max() <= 1e-10


# ---- every direct call, at 1e4 m/s and 1e8 m away. Parts of each result are judged by their own largest entry: rows of joints separately
# from rows of the root, whose forces and accelerations are as large as the speed makes them.


def parts(model, result):
    """Rows of the root and rows of joints, of arrays with a leading axis of coordinates."""
    result = np.asarray(result)
    return [result[:6], result[6:]]


CALLS = {
    "forward_dynamics": lambda m, q, v, u, p: parts(m, m.forward_dynamics(q, v, u, precision=p)),
    "inverse_dynamics": lambda m, q, v, u, p: parts(m, m.inverse_dynamics(q, v, u, precision=p)),
    "bias_forces": lambda m, q, v, u, p: parts(m, m.bias_forces(q, v, precision=p)),
    "mass_matrix": lambda m, q, v, u, p: parts(m, m.mass_matrix(q, precision=p)),
    "mass_matrix_inverse": lambda m, q, v, u, p: parts(m, m.mass_matrix_inverse(q, precision=p)),
    "jacobian": lambda m, q, v, u, p: [m.jacobian("link4", q, precision=p)],
    "inverse_dynamics_derivatives, q": lambda m, q, v, u, p: parts(m, m.inverse_dynamics_derivatives(q, v, u, precision=p).q),
    "inverse_dynamics_derivatives, v": lambda m, q, v, u, p: parts(m, m.inverse_dynamics_derivatives(q, v, u, precision=p).v),
    "forward_dynamics_derivatives, q": lambda m, q, v, u, p: parts(m, m.forward_dynamics_derivatives(q, v, u, precision=p).q),
    "forward_dynamics_derivatives, v": lambda m, q, v, u, p: parts(m, m.forward_dynamics_derivatives(q, v, u, precision=p).v),
    "mass_matrix_derivative": lambda m, q, v, u, p: parts(m, m.mass_matrix_derivative(q, precision=p)),
    "christoffel": lambda m, q, v, u, p: parts(m, m.christoffel(q, precision=p)),
    "coriolis_matrix": lambda m, q, v, u, p: [m.coriolis_matrix(q, v, precision=p)],
    "coriolis_matrix, skew": lambda m, q, v, u, p: [m.coriolis_matrix(q, v, form="skew", precision=p)],
    "kinetic_energy_derivatives, q": lambda m, q, v, u, p: [m.kinetic_energy_derivatives(q, v, precision=p)[0][6:]],
    "kinetic_energy_derivatives, v": lambda m, q, v, u, p: parts(m, m.kinetic_energy_derivatives(q, v, precision=p)[1]),
    "hamiltonian_dynamics": lambda m, q, v, u, p: [m.hamiltonian_dynamics(q, v, u, precision=p)[1][6:]],
    "momentum, q": lambda m, q, v, u, p: [m.momentum(q, v, precision=p).dq[3:, 6:]],
    "momentum": lambda m, q, v, u, p: [m.momentum(q, v, precision=p).value[3:], m.momentum(q, v, precision=p).value[:3]],
    "jacobian_dot": lambda m, q, v, u, p: [m.jacobian_dot("link4", q, v, precision=p)],
    "jacobian_derivative": lambda m, q, v, u, p: [m.jacobian_derivative("link4", q, precision=p)],
    "inertial_regressor": lambda m, q, v, u, p: parts(m, m.inertial_regressor(q, v, u, precision=p)),
    "log_determinant_gradient": lambda m, q, v, u, p: [m.log_determinant_gradient(q, precision=p)],
    "innovations": lambda m, q, v, u, p: [x for y in m.innovations(q, v, u, precision=p) for x in parts(m, y)],
}


def error(model, call, q, v, tau):
    """Of a call in double, in units of eps and of each part's largest entry, against quad precision."""
    both = zip(*(CALLS[call](model, q, v, tau, precision) for precision in ("double", "quad")), strict=True)
    return max(np.abs(got - truth).max() / max(np.abs(truth).max(), 1e-300) for got, truth in both) / EPS


def test_no_direct_call_loses_digits_to_speed_or_distance():
    """At most 20 times the error of the same call at rest and near, or 20 eps of each part's largest entry."""
    for seed in range(3):
        model, q, v, tau = bus(seed, heavy=20.0, light=0.5)
        Q, V = moved(model, q, v, 1e4, FAR, seed)
        for call in CALLS:
            assert error(model, call, Q, V, tau) <= max(20, 20 * error(model, call, q, v, tau)), call
