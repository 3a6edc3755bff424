"""The direct calls on arrays against the dense oracle: every hinge kind, gravity, batches, out=, wrong arguments by their text.

Tolerances: forces and ℳ are sums over a sweep of products of the sizes in `force_size`; what is behind an inverse is allowed
that times the condition number of the mass matrix and the amplification of the Riccati sweep.
"""

import warnings

import numpy as np
import pytest

import pycraft as pc
from support.descriptions import KINDS, random_description
from support.formulas import EPS, amplification, norm
from support.mechanisms import SEQUENCES, build, every_kind, nodes_of, random_tree, uniform_batch, with_hinges
from support.oracle import reference
from support.sizes_of_calls import force_size, roundings

rotors = pytest.mark.parametrize("rotor_inertia", [False, True], ids=["no rotors", "rotors"])
each_hinge = pytest.mark.parametrize("kind", [*KINDS, *SEQUENCES])


def close(actual, expected, bound):
    assert np.shape(actual) == np.shape(expected)
    off = np.abs(np.asarray(actual) - expected).max(initial=0.0)
    assert off <= bound, f"off by {off:.2e}, bound {bound:.2e}"


def check_all(model, q, v, vdot, calls):
    """Every direct call at one state; `calls` maps names to results."""
    description = model.description()
    o = reference.operators(description, q, v)
    size, eps = force_size(o, description, vdot), roundings(o)
    tau = reference.inverse_dynamics(description, q, v, vdot)
    MM = reference.mass_matrix(description, q)
    inverse = np.linalg.inv(MM)
    behind = norm(inverse) * amplification(o) * eps
    close(calls["mass_matrix"], MM, eps * norm(MM))
    assert np.array_equal(calls["mass_matrix"], calls["mass_matrix"].T)
    close(calls["mass_matrix_inverse"], inverse, behind * norm(inverse) * norm(MM))
    assert np.array_equal(calls["mass_matrix_inverse"], calls["mass_matrix_inverse"].T)
    close(calls["inverse_dynamics"], tau, eps * size)
    close(calls["bias_forces"], reference.bias_forces(description, q, v), eps * size)
    close(calls["forward_dynamics"], reference.forward_dynamics(description, q, v, vdot), behind * (size + norm(vdot)))
    close(
        calls["kinetic_energy"],
        reference.kinetic_energy(description, q, v),
        eps * (norm(o.M) * norm(o.V) ** 2 + norm(o.J) * norm(v) ** 2),
    )
    masses = sum(b["mass"] for b in description["bodies"])
    reach = 1 + max([norm(o.world_pose(k)[:3, 3]) for k in range(len(o.parents))])
    close(calls["potential_energy"], reference.potential_energy(description, q), eps * masses * norm(model.gravity) * reach)
    for name in [*nodes_of(model), "body0"]:
        close(calls["jacobian", name], reference.node_jacobian(description, name, q), eps * (1 + norm(o.Jacobian([name]))))
        close(calls["pose", name], reference.node_pose(description, name, q), eps * (1 + reach))


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
@pytest.mark.parametrize("seed", range(-2, 12))
def test_the_inverse_on_forests(seed, form):
    """Bodies that wait for their siblings keep their accelerations; one size after another; hinges of eight coordinates."""
    rng = np.random.default_rng(abs(seed))
    eight = random_description([-1, 0, 0], [("slider", "free", "pin"), "pin", ("free", "slider", "pin")], 7, rotor_inertia=True)
    model = build(eight) if seed < 0 else random_tree(rng, int(rng.integers(1, 25)))
    description = model.description()
    for edit in range(2):
        state = model.random_state(rng)
        MM = reference.mass_matrix(description, state.q)
        inverse = np.linalg.inv(MM)
        found = model.mass_matrix_inverse(state.q, form=form)
        o = reference.operators(description, state.q, state.v)
        close(found, inverse, norm(inverse) ** 2 * norm(MM) * amplification(o) * roundings(o))
        assert np.array_equal(found, found.T)
        model.add_body(f"more {edit}", parent=list(model.bodies)[-1], mass=1.0, com=(0.3, 0, 0), rotor_inertia=0.1)
        description = model.description()


def all_calls(model, q, v, vdot):
    """Every direct call by name, at a state or a batch."""
    calls = {
        "mass_matrix": model.mass_matrix(q),
        "mass_matrix_inverse": model.mass_matrix_inverse(q),
        "inverse_dynamics": model.inverse_dynamics(q, v, vdot),
        "bias_forces": model.bias_forces(q, v),
        "forward_dynamics": model.forward_dynamics(q, v, vdot),
        "kinetic_energy": model.kinetic_energy(q, v),
        "potential_energy": model.potential_energy(q),
    }
    for name in [*nodes_of(model), "body0"]:
        calls["jacobian", name], calls["pose", name] = model.jacobian(name, q), model.pose(name, q)
    return calls


@rotors
@pytest.mark.parametrize("shape", ["chain", "forest"])
@each_hinge
def test_direct_calls_are_the_oracles(kind, shape, rotor_inertia):
    model = with_hinges(kind, shape, rotor_inertia, seed=11)
    assert norm(model.gravity) > 1  # the descriptions have one
    vdot = np.random.default_rng(4).uniform(-2, 2, model.nv)
    check_all(model, model.q, model.v, vdot, all_calls(model, model.q, model.v, vdot))


@rotors
def test_batches_are_their_states(rotor_inertia):
    model = every_kind(rotor_inertia, seed=2)
    Q, V = uniform_batch(model, 4, 1)
    A = np.random.default_rng(5).uniform(-2, 2, V.shape)
    whole = all_calls(model, Q, V, A)
    for i in range(len(Q)):
        one = {name: result[i] for name, result in whole.items()}
        check_all(model, Q[i], V[i], A[i], one)
        assert all(np.array_equal(result, one[name]) for name, result in all_calls(model, Q[i], V[i], A[i]).items())
    # one of the arguments may be shared by all states
    shared = model.forward_dynamics(Q, V[0], A)
    assert all(np.array_equal(shared[i], model.forward_dynamics(Q[i], V[0], A[i])) for i in range(4))
    shared = model.inverse_dynamics(Q[0], V, A[0])
    assert all(np.array_equal(shared[i], model.inverse_dynamics(Q[0], V[i], A[0])) for i in range(4))


def test_a_batch_of_none():
    model = every_kind()
    Q, V = np.zeros((0, model.nq)), np.zeros((0, model.nv))
    calls = all_calls(model, Q, V, V)
    n = model.nv
    shapes = {"mass_matrix": (0, n, n), "mass_matrix_inverse": (0, n, n), "kinetic_energy": (0,), "potential_energy": (0,)}
    for name, result in calls.items():
        expected = {"jacobian": (0, 6, n), "pose": (0, 4, 4)}[name[0]] if isinstance(name, tuple) else shapes.get(name, (0, n))
        assert result.shape == expected, name


def test_inputs_of_any_layout_and_type():
    model = every_kind()
    q, v = np.array(model.q), np.array(model.v)
    expected = model.forward_dynamics(q, v, v)
    wide = np.zeros((2 * model.nv,))
    wide[::2] = v
    assert np.array_equal(model.forward_dynamics(q, wide[::2], list(v)), expected)
    Q, V = uniform_batch(model, 3)
    assert np.array_equal(model.inverse_dynamics(np.asfortranarray(Q), V, V), model.inverse_dynamics(Q, V, V))
    whole = np.round(v)
    assert np.array_equal(model.bias_forces(q, whole.astype(int)), model.bias_forces(q, whole))


def test_wider_precisions_agree_to_double_rounding():
    model = every_kind(rotor_inertia=True)
    q, v, vdot = model.q, model.v, np.random.default_rng(8).uniform(-1, 1, model.nv)
    for precision in ("extended", "quad"):
        calls = all_calls(model, q, v, vdot)
        calls |= {
            "mass_matrix": model.mass_matrix(q, precision=precision),
            "mass_matrix_inverse": model.mass_matrix_inverse(q, precision=precision),
            "inverse_dynamics": model.inverse_dynamics(q, v, vdot, precision=precision),
            "bias_forces": model.bias_forces(q, v, precision=precision),
            "forward_dynamics": model.forward_dynamics(q, v, vdot, precision=precision),
            ("jacobian", "node10"): model.jacobian("node10", q, precision=precision),
        }
        check_all(model, q, v, vdot, calls)


# ---------------------------------------------------------------------- out=


def test_out_is_filled_and_returned():
    model = every_kind()
    Q, V = uniform_batch(model, 3)
    n = model.nv
    for call, shape in [
        (lambda out: model.mass_matrix(Q, out=out), (3, n, n)),
        (lambda out: model.mass_matrix_inverse(Q[0], out=out), (n, n)),
        (lambda out: model.forward_dynamics(Q, V, V, out=out), (3, n)),
        (lambda out: model.inverse_dynamics(Q, V, V, out=out), (3, n)),
        (lambda out: model.bias_forces(Q[1], V[1], out=out), (n,)),
        (lambda out: model.jacobian("body3", Q, out=out), (3, 6, n)),
    ]:
        out = np.full(shape, np.nan)
        returned = call(out)
        assert np.shares_memory(returned, out) and np.array_equal(out, call(None))
        readonly = np.empty(shape)
        readonly.setflags(write=False)
        for wrong in (np.empty((*shape, 1)), np.empty(shape, np.float32), np.empty(shape, order="F")[..., ::-1], readonly, [0.0]):
            with pytest.raises(pc.ModelError, match="out= takes a writeable C-ordered float64 array of shape"):
                call(wrong)


# ---------------------------------------------------------------------- errors


def test_wrong_arguments_by_their_text():
    model = every_kind()
    q, v = np.array(model.q), np.array(model.v)
    nq, nv = model.nq, model.nv
    Q, V = uniform_batch(model, 2)
    for error, call in [
        (f"q of .* takes {nq} numbers, or \\(B, {nq}\\) for a batch", lambda: model.mass_matrix(q[1:])),
        (f"v of .* takes {nv} numbers", lambda: model.forward_dynamics(q, v[1:], v)),
        (f"tau of .* takes {nv} numbers", lambda: model.forward_dynamics(q, v, np.zeros((2, 2, nv)))),
        ("vdot of ", lambda: model.inverse_dynamics(q, v, 3.0)),
        ("batches of 2 and 3 states in one call", lambda: model.bias_forces(Q, np.zeros((3, nv)))),
        ("is not an array of numbers", lambda: model.mass_matrix("q")),
        ("no node or body of .* is called 'gripper'; there are", lambda: model.jacobian("gripper", q)),
        ("no form .* is called 'slow'", lambda: model.forward_dynamics(q, v, v, form="slow")),
        ("refine=-1: a number of corrections", lambda: model.forward_dynamics(q, v, v, refine=-1)),
        ("no precision is called 'half'", lambda: model.mass_matrix(q, precision="half")),
    ]:
        with pytest.raises(ValueError, match=error) as caught:
            call()
        assert isinstance(caught.value, pc.Error)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_is_named(bad):
    model = every_kind()
    v = np.array(model.v)
    at = model.hinges["hinge3"].q_slice.start
    q = np.array(model.q)
    q[at] = bad
    for call in (
        lambda: model.mass_matrix(q),
        lambda: model.forward_dynamics(np.array([model.q, q]), v, v),
        lambda: model.jacobian("body1", q),
        lambda: model.pose("body1", q),
        lambda: model.kinetic_energy(q, v),
        lambda: model.soa.M.at(q),
        lambda: setattr(model, "q", q),
    ):
        with pytest.raises(pc.ModelError, match="'hinge3': entry 0 is"):
            call()
    w = v.copy()
    w[model.hinges["hinge7"].v_slice.start + 1] = bad
    for call in (
        lambda: model.bias_forces(model.q, w),
        lambda: model.forward_dynamics(model.q, v, w),
        lambda: model.inverse_dynamics(model.q, v, w),
        lambda: setattr(model, "v", w),
        lambda: model.soa.V_bar.at(model.q, w),
        lambda: model.integrate(model.q, w),
    ):
        with pytest.raises(pc.ModelError, match="'hinge7': entry 1 is"):
            call()


@pytest.mark.parametrize("kind", ["ball", "free", "screw-ball-pin"])
def test_quaternions_without_direction_are_refused_by_hinge(kind):
    model = with_hinges(kind, "chain")
    at = model.hinges["hinge2"].q_slice.start + (1 if kind == "screw-ball-pin" else 0)
    for length in (0.0, 9e-9):
        q = np.array(model.q)
        q[at : at + 4] = [0, length, 0, 0]
        for call in (
            lambda q=q: model.mass_matrix(q),
            lambda q=q: model.soa.phi.at(q),
            lambda q=q: setattr(model, "q", q),
            lambda q=q: model.difference(model.q, q),
        ):
            with pytest.raises(pc.ModelError, match="'hinge2': its quaternion has length .* and no direction"):
                call()
    q = np.array(model.q)
    q[at : at + 4] *= 1e-7 / norm(q[at : at + 4])  # short, but with a direction: used as q/|q|, not rewritten
    before = q.copy()
    expected = model.mass_matrix(model.q)
    close(model.mass_matrix(q), expected, 200 * 4 * EPS * norm(expected))
    model.q = q
    assert np.array_equal(model.q, before) and np.array_equal(q, before)


COMPLEX = {
    "mass_matrix": lambda m, q, v: m.mass_matrix(q + 1e-30j),
    "inverse_dynamics": lambda m, q, v: m.inverse_dynamics(q, v + 0j, v),
    "forward_dynamics": lambda m, q, v: m.forward_dynamics(q, v, 1j * v),
    "q": lambda m, q, v: setattr(m, "q", q + 0j),
    "integrate": lambda m, q, v: m.integrate(q, v + 0j),
    "difference": lambda m, q, v: m.difference(q, q + 0j),
    "at": lambda m, q, v: m.soa.M.at(q + 0j),
    "gravity": lambda m, q, v: setattr(m, "gravity", [0, 0, 1j]),
}


@pytest.mark.parametrize("call", COMPLEX)
def test_complex_arrays_are_refused(call):
    """Casting to real would drop the imaginary part: a complex step would come back as zero."""
    model = every_kind()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # NumPy's own word on the cast is no refusal
        with pytest.raises((TypeError, ValueError)):
            COMPLEX[call](model, np.array(model.q), np.array(model.v))


def test_singular_hinges_are_named_by_direct_calls():
    arm = pc.Multibody("arm")
    arm.add_body("link", mass=1.0, com=(1, 0, 0))
    arm.add_body("tip", "link", axis=(1, 0, 0), position=(1, 0, 0), hinge_name="wrist")
    with pytest.warns(pc.ModelWarning, match="'tip' on hinge 'wrist' has no mass"):
        D = arm.soa.D
    q = np.zeros(2)
    for call in (
        lambda: arm.forward_dynamics(q, q, q),
        lambda: arm.mass_matrix_inverse(q),
        lambda: D.dense(),
        lambda: arm.soa.K @ q,
        lambda: arm.soa.psi.dense(),
    ):
        with pytest.raises(pc.SingularHingeError, match="hinge 'wrist' of body 'tip' feels no inertia along coordinate 'wrist'"):
            call()
        with pytest.raises(ArithmeticError):
            call()
    assert np.isfinite(arm.mass_matrix(q)).all() and np.isfinite(arm.inverse_dynamics(q, q, q)).all()
    assert np.isfinite(arm.soa.phi.dense()).all()
    arm.hinges["wrist"].rotor_inertia = 0.3
    assert np.isfinite(arm.forward_dynamics(q, q, q)).all()
