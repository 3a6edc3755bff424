"""Forces of hinges against the reference, the free-body equations in quad, and closed forms; their axes, parts, derivatives and refusals.

Sums over ten bodies: 1e-12 of the largest entry. Differences: fourth order, step 2⁻¹⁰, of forces in extended precision, rounded to doubles
at the end: 2 eps |f| / h beside h⁴ f⁽⁵⁾/30, and a factor of 100 for the accelerations' condition.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft import reference
from support.differences import difference
from support.mechanisms import build, every_kind, massless_inner_bodies, uniform_batch
from support.rotors import gyroscopic, rotors_of

pytestmark = pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")

ROUNDING, DIFFERENCE = 1e-12, 1e-9
MODELS = {
    "every kind": lambda: every_kind(rotor_inertia=True),
    "floating": lambda: pc.tree([-1, 0, 0, 1, 1], ["free", "pin", "ball", "screw", "pin"], seed=1),
    "forest": lambda: pc.tree([-1, -1, 0, 1], ["free", "free", "universal", "slider"], seed=2),
    "massless": lambda: build(massless_inner_bodies()),
    "chain": lambda: pc.chain(5),
    "one body": lambda: pc.tree([-1], ["ball"], seed=6),
}


@pytest.fixture(scope="module", params=MODELS)
def model(request):
    mb = MODELS[request.param]()
    state = mb.random_state(3)
    mb.q, mb.v = state.q, state.v
    mb.gravity = (0.5, -9.0, 2.0)
    return mb


def drawn(model, seed=5):
    rng = np.random.default_rng(seed)
    return 3 * rng.normal(size=model.nv), {name: rng.normal(size=6) for name in list(model.bodies)[::2]}


def close(a, b, tolerance=ROUNDING):
    assert a.shape == np.shape(b)
    assert np.abs(a - b).max(initial=0) <= tolerance * (1 + np.abs(b).max(initial=0))


def test_of_the_reference(model):
    tau, _ = drawn(model)
    close(
        model.interbody_forces(tau=tau),
        reference.forward_dynamics_vectors(model.description(), model.q, model.v, tau).f.reshape(-1, 6),
        1e-11,
    )
    vdot = np.random.default_rng(1).normal(size=model.nv)
    close(
        model.interbody_forces(vdot=vdot), reference.inverse_dynamics_vectors(model.description(), model.q, model.v, vdot).f.reshape(-1, 6)
    )


def balance(model, q, v, vdot, f, wrenches):
    """Return the forces on every body less the rate of its momentum, in the world's axes about its own centre of mass."""
    left = np.zeros_like(f)
    for k, (name, body) in enumerate(model.bodies.items()):
        frame = model.frame(name)
        X, V = frame.pose(q), frame.velocity(q, v)
        A = frame.acceleration(q, v, vdot, kind="classical")
        R, omega = X[:3, :3], V[:3]
        point = A[3:] + np.cross(A[:3], body.com) + np.cross(omega, np.cross(omega, body.com))
        acting = [f[k].copy()]
        for c, child in enumerate(model.bodies.values()):
            if child.parent is not None and child.parent.name == name:
                Y = model.frame(child.name).pose(q, wrt=name)
                force = Y[:3, :3] @ f[c, 3:]
                acting.append(-np.r_[Y[:3, :3] @ f[c, :3] + np.cross(Y[:3, 3], force), force])
        if name in wrenches:
            acting.append(np.r_[R.T @ wrenches[name][:3], R.T @ wrenches[name][3:]])
        total = np.sum(acting, axis=0)
        total[3:] += body.mass * (R.T @ model.gravity)
        total[:3] += np.cross(body.com, body.mass * (R.T @ model.gravity))
        left[k, 3:] = total[3:] - body.mass * point
        about = total[:3] - np.cross(body.com, total[3:])
        left[k, :3] = about - body.inertia @ A[:3] - np.cross(omega, body.inertia @ omega)
    return left


def test_balance_of_every_body(model):
    tau, wrenches = drawn(model)
    f = model.interbody_forces(tau=tau, wrenches=wrenches)
    pushes = sum(model.jacobian(name, model.q, axes="aligned").T @ w for name, w in wrenches.items())
    vdot = model.forward_dynamics(model.q, model.v, tau + pushes)
    close(balance(model, model.q, model.v, vdot, f, wrenches), np.zeros_like(f), 1e-11 * np.abs(f).max())


@pytest.mark.parametrize(
    "how", [{}, {"form": "ud"}, {"form": "square-root"}, {"refine": 1}, {"precision": "extended"}, {"precision": "quad"}]
)
def test_along_the_hinge_is_what_drives_it(model, how):
    tau, wrenches = drawn(model)
    f = model.interbody_forces(tau=tau, wrenches=wrenches, **how)
    H = model.soa.H.dense()
    pushes = sum(model.jacobian(name, model.q, axes="aligned").T @ w for name, w in wrenches.items())
    vdot = model.forward_dynamics(model.q, model.v, tau + pushes)
    close(H @ f.ravel() + rotors_of(model) * vdot + gyroscopic(model, model.v), tau, 1e-11 * (1 + np.abs(f).max()))


def test_single_precision(model):
    tau, wrenches = drawn(model)
    close(model.interbody_forces(tau=tau, wrenches=wrenches, precision="single"), model.interbody_forces(tau=tau, wrenches=wrenches), 1e-2)


def test_reaction_does_no_work(model):
    tau, _ = drawn(model)
    whole, reaction = (model.interbody_forces(tau=tau, part=part) for part in ("whole", "reaction"))
    H = model.soa.H.dense()
    close(H @ reaction.ravel(), np.zeros(model.nv), 1e-12 * np.abs(whole).max())
    for k, hinge in enumerate(model.hinges.values()):
        rows = H[hinge.v_slice, 6 * k : 6 * k + 6]
        close(reaction[k], whole[k] - np.linalg.pinv(rows) @ (rows @ whole[k]), 1e-11)


def test_reaction_at_gimbal_lock():
    mb = pc.tree([-1], ["gimbal"], seed=0)
    mb.gravity = (1, 2, 3)
    q = np.array([0.3, np.pi / 2, -0.2])  # the third axis is the first: two directions are left
    whole, reaction = (mb.interbody_forces(q, vdot=np.zeros(3), part=part)[0] for part in ("whole", "reaction"))
    rows = mb.soa.H.at(q).dense()
    close(reaction, whole - np.linalg.pinv(rows, rcond=1e-10) @ (rows @ whole), 1e-12)
    assert np.abs(reaction[:3]).max() > 1e-3


def moved(f, X, about):
    """To the world's axes about a point of the world."""
    force = X[:3, :3] @ f[3:]
    return np.r_[X[:3, :3] @ f[:3] + np.cross(X[:3, 3] - about, force), force]


def test_axes_and_points(model):
    tau, _ = drawn(model)
    mb, f, last = model, model.interbody_forces(tau=tau), list(model.bodies)[-1]
    poses = [mb.pose(name, mb.q) for name in mb.bodies]
    tip = mb.pose(last, mb.q)
    c = np.array([0.3, -2.0, 1.0])
    expected = {
        ("aligned", None): [moved(x, X, X[:3, 3]) for x, X in zip(f, poses, strict=True)],
        ("world", None): [moved(x, X, np.zeros(3)) for x, X in zip(f, poses, strict=True)],
        ("aligned", (0.3, -2.0, 1.0)): [moved(x, X, c) for x, X in zip(f, poses, strict=True)],
        ("world", last): [moved(x, X, tip[:3, 3]) for x, X in zip(f, poses, strict=True)],
        (last, None): [
            np.r_[tip[:3, :3].T @ y[:3], tip[:3, :3].T @ y[3:]] for y in (moved(x, X, tip[:3, 3]) for x, X in zip(f, poses, strict=True))
        ],
    }
    for (axes, about), values in expected.items():
        close(mb.interbody_forces(tau=tau, axes=axes, about=about), np.array(values))
    about = mb.interbody_forces(tau=tau, about=c)
    for k, X in enumerate(poses):
        y = moved(f[k], X, c)
        close(about[k], np.r_[X[:3, :3].T @ y[:3], X[:3, :3].T @ y[3:]])
    one = list(mb.hinges)[-1]
    close(mb.interbody_forces(tau=tau, hinges=one, axes="world"), mb.interbody_forces(tau=tau, axes="world")[-1])
    close(mb.interbody_forces(tau=tau, hinges=[mb.hinges[one], one]), f[[-1, -1]])
    close(mb.interbody_forces(tau=tau, hinges=one, axes=mb.bodies[last], about=mb.frame(last)), f[-1])


def test_batches_are_rows(model):
    q, v = uniform_batch(model, 3)
    rng = np.random.default_rng(2)
    tau, last = rng.normal(size=(3, model.nv)), list(model.bodies)[-1]
    wrenches = {last: rng.normal(size=(3, 6))}
    for axes in ("body", "aligned", "world", last):
        together = model.interbody_forces(q, v, tau, wrenches=wrenches, axes=axes)
        alone = [model.interbody_forces(q[b], v[b], tau[b], wrenches={last: wrenches[last][b]}, axes=axes) for b in range(3)]
        close(together, np.array(alone))
        close(model.interbody_forces(q, v, tau, wrenches=wrenches, axes=axes, hinges=list(model.hinges)[0]), np.array(alone)[:, 0])
    assert model.interbody_forces(q[:0], v[:0], tau[:0]).shape == (0, len(model.bodies), 6)
    assert model.interbody_forces(q[:0], v[:0], tau[:0], axes="world").shape == (0, len(model.bodies), 6)
    shared = model.interbody_forces(
        q[0], v[0], tau[0], wrenches=wrenches, axes=last, hinges=list(model.hinges)[-1]
    )  # wrenches alone are many
    for b in range(3):
        close(shared[b], model.interbody_forces(q[0], v[0], tau[0], wrenches={last: wrenches[last][b]}, axes=last)[-1])
    close(model.interbody_forces_derivatives(q, v, tau).q[1], model.interbody_forces_derivatives(q[1], v[1], tau[1]).q)


def test_states_and_the_present_one(model):
    state, (tau, _) = model.random_state(9), drawn(model)
    close(model.interbody_forces(state, tau=tau), model.interbody_forces(state.q, state.v, tau))
    close(model.interbody_forces(), model.interbody_forces(model.q, model.v, np.zeros(model.nv)))
    close(model.interbody_forces(state.q), model.interbody_forces(state.q, np.zeros(model.nv), np.zeros(model.nv)))


def test_wrenches_in_both_axes(model):
    tau, wrenches = drawn(model)
    own = {}
    for name, w in wrenches.items():
        R = model.pose(name, model.q)[:3, :3]
        own[name] = np.r_[R.T @ w[:3], R.T @ w[3:]]
    close(model.interbody_forces(tau=tau, wrenches=own, wrench_axes="body"), model.interbody_forces(tau=tau, wrenches=wrenches), 1e-11)


def test_wrenches_on_nodes():
    mb = pc.chain(2)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    mb.add_node("hook", "body1", position=(0.5, 0.25, 0), rotation=turn)
    f = mb.interbody_forces([0, 0], vdot=[0, 0], wrenches={"hook": (0, 0, 1, 0, 2, 0)})
    close(f, -np.array([[0, 0, 1 + 2 * 1.5, 0, 2, 0], [0, 0, 1 + 2 * 0.5, 0, 2, 0]]))
    own = mb.interbody_forces([0, 0], vdot=[0, 0], wrenches={mb.nodes["hook"]: (0, 0, 1, 2, 0, 0)}, wrench_axes="body")
    close(own, f)


@pytest.mark.parametrize("wrench_axes", ["world", "body"])
@pytest.mark.parametrize("given", ["tau", "vdot"])
def test_derivatives(model, given, wrench_axes):
    mb, (x, wrenches) = model, drawn(model)
    options = {"wrenches": wrenches, "wrench_axes": wrench_axes}
    d = mb.interbody_forces_derivatives(**{given: x}, **options)
    at = lambda q, v, x: mb.interbody_forces(q, v, precision="extended", **{given: x}, **options)
    for i in range(0, mb.nv, 2):
        e = np.eye(mb.nv)[i]
        close(d.q[..., i], difference(lambda h, e=e: at(mb.integrate(mb.q, h * e), mb.v, x)), DIFFERENCE)
        close(d.v[..., i], difference(lambda h, e=e: at(mb.q, mb.v + h * e, x)), DIFFERENCE)
        close(d.input[..., i], difference(lambda h, e=e: at(mb.q, mb.v, x + h * e)), DIFFERENCE)


def test_base_reaction():
    mb = MODELS["every kind"]()
    mb.gravity = (0.5, -9.0, 2.0)
    held = mb.base_reaction(mb.q, vdot=np.zeros(mb.nv))  # nothing moves: it carries the weight, at the centre of mass
    weight = -mb.mass * np.array(mb.gravity)
    close(held, np.r_[np.cross(mb.centre_of_mass(mb.q), weight), weight], 1e-11)
    close(mb.base_reaction(mb.q, vdot=np.zeros(mb.nv), about=mb.centre_of_mass(mb.q))[:3], np.zeros(3), 1e-10)
    flying = MODELS["floating"]()
    flying.gravity = (0, 0, -9.81)
    close(flying.base_reaction(flying.q, flying.v, np.zeros(flying.nv)), np.zeros(6), 1e-11)


def test_models_without_coordinates():
    mb = pc.Multibody("welded", welds="keep")
    mb.gravity = (0, 0, -10)
    mb.add_body("post", hinge="weld", mass=2.0, com=(0, 0, 1))
    mb.add_body("lamp", parent="post", hinge="weld", position=(1, 0, 2), mass=3.0)
    close(mb.interbody_forces(), np.array([[0, -30, 0, 0, 0, 50], [0, 0, 0, 0, 0, 30.0]]))
    close(mb.interbody_forces(part="reaction"), mb.interbody_forces())
    assert mb.interbody_forces_derivatives().q.shape == (2, 6, 0)
    assert pc.Multibody().interbody_forces().shape == (0, 6)
    close(pc.Multibody().base_reaction(), np.zeros(6))


def test_parts_carry_what_the_whole_does():
    mb = pc.tree([-1, 0, 1, 0, 3, 0, 5], ["free", "pin", "ball", "pin", "ball", "universal", "pin"], seed=1)
    mb.gravity = (0.5, -9.0, 2.0)
    state, vdot = mb.random_state(2), np.random.default_rng(3).normal(size=mb.nv)
    leg = mb.subgraph(root="body3", base="moving")
    own = leg.interbody_forces(
        leg.state_of(state.q, state.v), vdot=leg.accelerations_of(vdot, state.q, state.v), hinges=["hinge3", "hinge4"]
    )
    close(own, mb.interbody_forces(state, vdot=vdot, hinges=["hinge3", "hinge4"]))


def test_closed_loops_by_their_multipliers():
    """A four-bar that moves: with the closing pin's force nothing drives the hinges, and the ground gives what the whole gains."""
    bars = pc.chain(3)
    bars.gravity = (0.5, -9.81, 0)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), position=(0.3, 0, 0))
    bars.add_node("end", "body2", position=(1, 0, 0))
    state = bars.assemble([1.0, -1.4, -1.5], [1.0, 0, 0], fix="hinge0")
    Q, inverse = bars.loops.jacobian(state), bars.mass_matrix_inverse(state.q)
    free = bars.forward_dynamics(state, tau=np.zeros(3))
    rows = np.linalg.lstsq(Q @ inverse @ Q.T, -(Q @ free + bars.loops.bias(state)), rcond=1e-10)[0]
    vdot, end = free + inverse @ Q.T @ rows, {"end": np.r_[0, 0, 0, rows[2:]]}
    f = bars.interbody_forces(state, vdot=vdot, wrenches=end)
    close(bars.soa.H.at(state.q).dense() @ f.ravel(), np.zeros(3), 1e-11 * np.abs(f).max())
    ground = bars.base_reaction(state, vdot=vdot, wrenches=end)[3:] + rows[2:]
    momentum = lambda h: bars.mass * bars.centre_of_mass_jacobian(state.q + h * state.v) @ (state.v + h * vdot)
    close(ground + bars.mass * np.array(bars.gravity), difference(momentum), DIFFERENCE)
    assert np.abs(rows[2:4]).min() > 1 and np.abs(state.v).min() > 0.1


def test_refusals():
    mb = pc.chain(2)
    refused = [
        ({"tau": [0, 0], "vdot": [0, 0]}, pc.ModelError, "give one of them"),
        ({"hinges": "elbow"}, pc.ModelError, "elbow"),
        ({"hinges": 3}, pc.ModelError, "a hinge"),
        ({"axes": "wrold"}, pc.EvaluationError, "'aligned'"),
        ({"about": (0, 0)}, pc.ModelError, "three"),
        ({"about": "nowhere"}, pc.ModelError, "nowhere"),
        ({"about": (0, np.nan, 0)}, pc.ModelError, "finite"),
        ({"part": "half"}, pc.EvaluationError, "'reaction'"),
        ({"wrench_axes": "aligned"}, pc.EvaluationError, "'world' and 'body'"),
        ({"wrenches": [1, 2]}, pc.ModelError, "dictionary"),
        ({"wrenches": {"body9": np.zeros(6)}}, pc.ModelError, "body9"),
        ({"wrenches": {"body1": np.zeros(3)}}, pc.ModelError, "body1"),
        ({"wrenches": {"body1": np.zeros((2, 6)), "body0": np.zeros((3, 6))}}, pc.ModelError, "2 and 3"),
        ({"wrenches": {"body1": [0, 0, np.inf, 0, 0, 0]}}, pc.ModelError, "body1.*not finite"),
        ({"wrenches": {"body1": "heavy"}}, pc.ModelError, "body1"),
        ({"tau": [0, 0, 0]}, pc.ModelError, "tau"),
        ({"tau": [0, np.nan]}, pc.ModelError, "tau"),
        ({"precision": 50}, pc.EvaluationError, "quad"),
        ({"vdot": [1e308, 1e308]}, pc.EvaluationError, "range"),
    ]
    for options, error, message in refused:
        with pytest.raises(error, match=message):
            mb.interbody_forces(**options)
    for options in ({"axes": "body"}, {"hinges": "hinge0"}):
        with pytest.raises(pc.EvaluationError):
            mb.base_reaction(**options)
    mb.add_node("floor")
    with pytest.raises(pc.ModelError, match="floor"):
        mb.interbody_forces(wrenches={"floor": np.zeros(6)})
    mb.add_body("feather", parent="body1")
    with pytest.raises(pc.SingularHingeError, match="feather"):
        mb.interbody_forces(tau=np.zeros(3))
