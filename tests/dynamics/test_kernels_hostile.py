"""Direct calls where numbers, models and callers are unkind: units and angles of any size, far points, what is not finite, singular states
amid a batch, shared memory, edits, threads, wide and deep trees. The oracle is a wider precision, or bits that must not change.

Not covered: four coordinates that carry one point mass (a slider, three pins, massless links) are not always refused, nor do the general
recursions refuse them.
"""

import copy
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import pycraft as pc
from support.descriptions import body, model, random_description, random_inertia, random_rotation, random_unit, sizes, subhinge
from support.kernel_cases import calls

EPS = {"double": 2.0**-52, "single": 2.0**-23}
build = pc.Multibody.from_description


def drawn(description, count=1, seed=0):
    """q, v, u of `count` states, quaternions of any length."""
    nq, nv = sizes(description)
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, nq)), rng.normal(size=(count, nv)), rng.uniform(-1, 1, (count, nv))


def assert_close(arm, given, precision="double"):
    """Forward errors: rounding of n sums of up to 6 products, 40 n eps, times the condition of what is solved, as in test_kernels."""
    exact, own = calls(arm, *given, precision="quad"), calls(arm, *given, precision=precision)
    condition = np.linalg.cond(exact["mass_matrix"]).max()
    for name, value in own.items():
        bound = 40 * arm.nv * EPS[precision] * (condition if name.startswith(("forward_dynamics", "mass_matrix_inverse")) else 1)
        # Beside a fall, gravity and gyroscopic terms may leave nothing of what they are sums of: bias forces are measured by forces.
        size = max(np.abs(exact[name]).max(), np.abs(exact["inverse_dynamics"]).max() if name == "bias_forces" else 0)
        assert np.abs(value - exact[name]).max() <= bound * size, name


@pytest.mark.parametrize("seed", range(40))
def test_any_sequence_of_subhinges(seed):
    """Two bodies on hinges of one to four subhinges of any kind, some with rotors, which kernels may not know."""
    rng = np.random.default_rng(seed)
    kinds = ["pin", "slider", "screw", "ball", "free"]
    sequences = [tuple(str(x) for x in rng.choice(kinds[: 4 + k], rng.integers(1, 4 + k))) for k in range(2)]
    description = random_description([-1, 0], sequences, seed)
    for b in description["bodies"] if seed % 3 == 0 else []:
        b["hinge"]["rotor_inertia"] = rng.choice([0, 0.4], len(b["hinge"]["rotor_inertia"]))
    arm, given = build(description), drawn(description, 3, seed)
    if np.linalg.cond(arm.mass_matrix(given[0], precision="quad")).max() < 1e10:  # else more coordinates than the bodies have freedoms
        assert_close(arm, given)


def scaled(description, mass, length):
    """The model in other units of mass and length, those of time as they are."""
    d = copy.deepcopy({**description, "gravity": description["gravity"] * length})
    for b in d["bodies"]:
        b["mass"], b["com"], b["inertia"] = b["mass"] * mass, b["com"] * length, b["inertia"] * (mass * length**2)
        b["hinge"]["placement"]["position"] = b["hinge"]["placement"]["position"] * length
        for s in b["hinge"]["subhinges"]:
            s["point"] = s["point"] * length
    return d


@pytest.mark.parametrize(("precision", "most"), [("double", 40), ("single", 12)])
@pytest.mark.parametrize("signs", [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_units_change_no_bit(precision, most, signs):
    """Masses and lengths times powers of four, which have roots without rounding, up to 10^12 (10^4 in single), of trees that turn only."""
    for seed in range(6):
        description = random_description([-1, 0, 1, 1, 0], [("pin", "universal", "gimbal", "ball")[(seed + k) % 4] for k in range(5)], seed)
        mass, length = 2.0 ** (most * signs[0]), 2.0 ** (most * signs[1])
        one, other, inertia = build(description), build(scaled(description, mass, length)), mass * length**2
        q, v, u = drawn(description, 5, seed)
        plain, there = calls(one, q, v, u, precision=precision), calls(other, q, v, u, precision=precision)
        there |= {
            name: x for name, x in calls(other, q, v, u * inertia, precision=precision).items() if name.startswith("forward_dynamics")
        }
        lengths = np.repeat([1, length], 3)  # angular, linear
        felt = inertia / np.multiply.outer(lengths, lengths)
        factors = {
            "forward_dynamics": 1,
            "mass_matrix_inverse": 1 / inertia,
            "forward_dynamics_derivatives, input": 1 / inertia,
            "operational_space_compliance": 1 / felt,
            "operational_space_inertia": felt,
        }
        for name, value in plain.items():
            factor = factors.get(name, 1 if name.startswith("forward_dynamics") else inertia)
            np.testing.assert_array_equal(there[name], value * factor, err_msg=name)


def test_velocities_and_quaternions_of_any_size():
    """Without gravity bias forces are of second degree in velocities; quaternions count by their direction."""
    description = random_description([-1, 0, 1, 0], ["free", "screw", "ball", "cylindrical"], 3)
    arm, (q, v, u) = build({**description, "gravity": np.zeros(3)}), drawn(description, 5)
    turned = calls(arm, q, v, u)
    for power in (-300, 300):
        np.testing.assert_array_equal(arm.bias_forces(q, v * 2.0**power), turned["bias_forces"] * 4.0**power)
    for power in (-20, 20, 400):
        longer = q.copy()
        longer[:, :4] *= 2.0**power
        for name, value in calls(arm, longer, v, u).items():
            np.testing.assert_array_equal(value, turned[name], err_msg=name)
    with pytest.raises(pc.EvaluationError, match="beyond the range"):
        arm.bias_forces(q, v * 1e200)


@pytest.mark.parametrize("far", [1e3, 1e6, 1e9])
def test_points_far_along_the_axis(far):
    """An axis is where it is, whichever of its points is given; this one's coordinates are the same number, so that none is rounded."""
    solid = dict(mass=1.0, com=(0.1, 0.2, 0.3), inertia=np.diag([0.3, 0.4, 0.5]), position=(0.2, 0.1, 0.3))
    pins = subhinge("pin"), subhinge("pin", (1, 1, 1), (far, far, far)), subhinge("pin", (1, 0, 1))
    description = model([body(f"b{k}", k - 1, [pin], **solid) for k, pin in enumerate(pins)], (0, 0, -9.8))
    assert_close(build(description), drawn(description, 3))


@pytest.mark.parametrize("angle", [1e5, 5.2e5, 5.3e5, 1e9, 1e22, 1e60, 1e150, 1e300, 1.7e308])
def test_angles_of_any_size(angle):
    """Beside small angles in a batch. In single the angle is rounded first."""
    description = random_description([-1, 0, 1, 0], ["pin", "pin", "ball", "universal"], 8)
    arm, (q, v, u) = build(description), drawn(description, 5)
    q[:, 0], q[1::2, 1], q[2, -1] = angle, -angle, angle * 0.77
    assert_close(arm, (q, v, u))
    if angle < 1e38:
        assert_close(arm, (np.float32(q).astype(float), v, u), "single")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused(bad):
    """Wherever it stands in the last state, and `out` is left alone."""
    description = random_description([-1, 0, 1], ["free", "screw", "universal"], 2)
    arm, given = build(description), drawn(description, 5)
    for k in range(arm.nq + 2 * arm.nv):
        last, out = np.hstack([a[-1] for a in given]), np.full((5, arm.nv), 7.0)
        last[k] = bad
        wrong = [np.vstack([a[:-1], b]) for a, b in zip(given, np.split(last, [arm.nq, arm.nq + arm.nv]), strict=True)]
        for call in (arm.forward_dynamics, arm.inverse_dynamics):
            with pytest.raises(pc.ModelError, match="entry"):
                call(*wrong, out=out)
        assert (out == 7).all()


def mass_off_an_axis():
    """A point mass that a slider carries away from the axis of a pin: at zero the pin feels nothing."""
    first = body("a", -1, [subhinge("pin")], 1.0, (0.5, 0, 0), np.eye(3) / 10)
    second = body("b", 0, [subhinge("pin", (0, 1, 0)), subhinge("pin", (1, 0, 0), (0.2, 0, 0))], 0.0, position=(1, 0, 0))
    return model([first, second, body("c", 1, [subhinge("slider", (0, 1, 0))], 1.0, (0.5, 0, 0))], (0, 0, -9.8))


WAYS = {
    "fast": {},
    "refined": {"refine": 1},
    "gathered": {"refine": 1, "residual": "gather"},
    "ud": {"form": "ud"},
    "ud, refined": {"form": "ud", "refine": "auto"},
    "square-root": {"form": "square-root"},
    "square-root, gathered": {"form": "square-root", "refine": 1, "residual": "gather"},
    "single": {"precision": "single"},
    "ud, single": {"form": "ud", "precision": "single"},
    "square-root, single": {"form": "square-root", "precision": "single"},
    "extended": {"precision": "extended"},
    "quad": {"precision": "quad"},
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("count", [3, 5, 17, 259])
def test_singular_states_in_a_batch(count, way):
    """The error names the state; states near it have the bits that they have alone, written over any of their arguments too."""
    arm, (q, v, u), how = build(mass_off_an_axis()), drawn(mass_off_an_axis(), count), WAYS[way]
    faint = 0.02 if how.get("precision") == "single" else 1e-4
    q[:, 2] = 0.6 + 0.1 * abs(q[:, 2])
    q[:, 3] = np.where(np.arange(count) % 3 == 1, faint, q[:, 3] + np.copysign(0.2, q[:, 3]))
    together, inverses = arm.forward_dynamics(q, v, u, **how), arm.mass_matrix_inverse(q, **how)
    np.testing.assert_array_equal(arm.forward_dynamics(q, v, u, threads=2, **how), together)
    for b in {0, 1, count // 2, count - 2, count - 1}:
        np.testing.assert_array_equal(together[b], arm.forward_dynamics(q[b], v[b], u[b], **how))
        np.testing.assert_array_equal(inverses[b], arm.mass_matrix_inverse(q[b], **how))
    for which in range(3):
        given = [q.copy(), v.copy(), u.copy()]
        np.testing.assert_array_equal(arm.forward_dynamics(*given, out=given[which], **how), together)
    q[count - 2, 3] = 0
    for call, given in ((arm.forward_dynamics, (q, v, u)), (arm.mass_matrix_inverse, (q,))):
        with pytest.raises(pc.SingularHingeError, match=f"state {count - 2} of"):
            call(*given, **how)


def never_regular(rng):
    """Mechanisms that some coordinate moves without moving a mass, at any state."""
    p, axis, turn = lambda: 0.3 * rng.normal(size=3), random_unit(rng), dict(rotation=random_rotation(rng))
    solid, com = dict(mass=1.0, com=p(), inertia=random_inertia(rng, 1.0)), p()
    pins = [subhinge("pin", random_unit(rng), p()) for _ in range(7)]
    yield [body("a", -1, [subhinge("ball")], 1.0, com, **turn)]
    yield [body("a", -1, [subhinge("free")], 1.0, com, **turn)]
    yield [body("a", -1, pins[:1], **solid), body("b", 0, [subhinge("pin", axis, com + 3 * axis)], 1.0, com, **turn)]
    yield [body("a", -1, [subhinge("slider", axis)], 0.0, **turn), body("b", 0, [subhinge("slider", axis)], **solid)]
    yield [body("a", -1, [subhinge("pin", random_unit(rng), axis) for _ in range(4)], **turn, **solid)]
    yield [body("a", -1, pins, **turn, **solid)]
    yield [body("a", -1, [subhinge("slider", axis)], 0.0, **turn), body("b", 0, [subhinge("free")], **solid)]


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("seed", range(10))
def test_singular_mechanisms_are_refused(seed, precision):
    for bodies in never_regular(np.random.default_rng(seed)):
        description = model(bodies, (0, 0, -9.8))
        arm, (q, v, u) = build(description), drawn(description, 3, seed)
        for form in ("fast", "ud", "square-root"):
            for call, given in ((arm.forward_dynamics, (q, v, u)), (arm.mass_matrix_inverse, (q,))):
                with pytest.raises(pc.SingularHingeError):
                    call(*given, form=form, precision=precision)


EDITS = {
    "inertia": lambda arm: setattr(arm.bodies["body1"], "inertia", 4 * np.eye(3)),
    "rotor": lambda arm: setattr(arm.hinges["hinge1"], "rotor_inertia", 3.0),
    "placement": lambda arm: setattr(arm.hinges["hinge1"], "placement", np.diag([-1.0, -1, 1, 1])),
    "one more body": lambda arm: arm.add_body("extra", "body1", "universal", mass=1, com=(0.1, 0.2, 0.3), inertia=np.eye(3)),
}


@pytest.mark.parametrize("edit", list(EDITS))
def test_after_an_edit_as_a_new_model(edit):
    """Calls of before, of both precisions and of packs, leave nothing behind."""
    description = random_description([-1, 0, 1, 1], ["pin", "screw", "pin", "universal"], 7)
    arm, new = build(description), build(description)
    for precision in ("double", "single"):
        calls(arm, *drawn(description, 5), precision=precision)
    EDITS[edit](arm), EDITS[edit](new)
    given = np.random.default_rng(0).normal(size=(3, 5, arm.nv))
    for precision in ("double", "single"):
        wanted = calls(new, *given, precision=precision)
        for name, value in calls(arm, *given, precision=precision).items():
            np.testing.assert_array_equal(value, wanted[name], err_msg=name)


def test_threads_on_one_model():
    """Batches of several sizes in two precisions: the bits of one thread, from the first call on."""
    description = random_description([-1, 0, 1, 1, 0], ["free", "pin", "screw", "ball", "universal"], 5)
    arm, alone, given = build(description), build(description), drawn(description, 65)
    wanted = {precision: calls(alone, *given, precision=precision) for precision in ("double", "single")}

    def right(seed):
        precision, count = ("double", "single")[seed // 4 % 2], (1, 3, 5, 65)[seed % 4]
        part = slice(seed % (66 - count), seed % (66 - count) + count)
        found = calls(arm, *(a[part] for a in given), precision=precision)
        return all(np.array_equal(value, wanted[precision][name][part]) for name, value in found.items())

    with ThreadPoolExecutor(8) as threads:
        assert all(threads.map(right, range(150)))


# A chain of 40 with a leaf on every link, before the rest of the chain or after it; what hangs on one body.
TREES = {
    "leaves first": lambda: pc.tree([-1] + [k // 2 * 2 for k in range(79)], "pin", seed=1),
    "leaves last": lambda: pc.tree([*range(-1, 39), *reversed(range(40))], "pin", seed=1),
    "wide": lambda: pc.tree([-1] + [0] * 120, ["free"] + ["pin"] * 120, seed=1),
}


@pytest.mark.parametrize("kind", list(TREES))
def test_wide_and_deep_trees(kind):
    s = TREES[kind]().random_state(1)
    assert_close(TREES[kind](), (s.q[None], s.v[None], 1 - s.v[None]))


def test_a_chain_of_two_thousand():
    """Even links in a crumpled chain are no harder than few: 40 n eps of the largest, without a condition."""
    arm = pc.chain(2000, seed=2)
    s, u = arm.random_state(1), np.ones(2000)
    for name, given in (("forward_dynamics", (s.q, s.v, u)), ("inverse_dynamics", (s.q, s.v, u)), ("bias_forces", (s.q, s.v))):
        exact, own = getattr(arm, name)(*given, precision="quad"), getattr(arm, name)(*given)
        assert np.abs(own - exact).max() <= 40 * 2000 * EPS["double"] * np.abs(exact).max(), name
