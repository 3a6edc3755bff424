"""Hinges locked and unlocked: motions, energies and momenta before and after, against the constrained equations."""

import copy
import pickle

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pycraft as pc
from support.locked_models import EPS, KINDS, bits, coordinates, moving, size, some_of, stopped
from support.mechanisms import build, every_kind, massless_inner_bodies, random_tree, rotors_on_some

# At rest --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(25))
def test_a_locked_model_is_the_model_without_these_coordinates(seed):
    """ℳ, T and v̇ are blocks: of inverse dynamics with nothing prescribed there, of hybrid dynamics with rest prescribed."""
    model, chosen = some_of(seed)
    _, free = coordinates(model, chosen)
    frames = {name: (model.pose(name), model.jacobian(name)[:, free]) for name in [*model.bodies, *model.nodes]}
    rng = np.random.default_rng(seed)
    vdot, tau = rng.normal(size=(2, model.nv))
    vdot[coordinates(model, chosen)[0]] = 0
    mass, forces = model.mass_matrix()[np.ix_(free, free)], model.inverse_dynamics(vdot=vdot)[free]
    found = model.hybrid_dynamics(tau=tau, prescribed=chosen).vdot[free]
    energies = model.kinetic_energy(), model.potential_energy()
    state = model.q, model.v
    condition = np.linalg.cond(mass) if len(free) else 1.0
    names = list(model.coordinate_names)

    stop = model.lock(chosen)
    assert model.coordinate_names == [names[j] for j in free]
    assert sorted(stop.hinges) == sorted(chosen) and stop.loss == 0 and stop.energy_before == stop.energy_after
    assert np.array_equal(model.v, state[1][free])
    # Placements are rounded once more: what they do to poses grows with the depth, and v̇ with the condition.
    near = 200 * EPS * len(model.bodies)
    assert np.abs(model.mass_matrix() - mass).max(initial=0) <= near * size(mass)
    assert np.abs(model.inverse_dynamics(vdot=vdot[free]) - forces).max(initial=0) <= near * size(forces)
    assert np.abs(model.forward_dynamics(tau=tau[free]) - found).max(initial=0) <= near * condition * size(found)
    assert np.allclose([model.kinetic_energy(), model.potential_energy()], energies, rtol=near, atol=near * size(mass))
    for name, (pose, jacobian) in frames.items():
        assert np.abs(model.pose(name) - pose).max() <= near * size(pose), name
        assert np.abs(model.jacobian(name) - jacobian).max(initial=0) <= near * size(jacobian), name


@pytest.mark.parametrize("seed", range(25))
def test_unlocked_it_is_what_it_was_bit_for_bit(seed):
    model, chosen = some_of(100 + seed)
    before = bits(model)
    model.lock(chosen)
    assert bits(model) != before and model.locked == sorted(chosen, key=model._hinge_index)
    assert model.unlock() == sorted(chosen, key=model._hinge_index) and model.locked == []
    assert bits(model) == before


@pytest.mark.parametrize("make", [every_kind, lambda: every_kind(rotor_inertia=True)])
def test_every_kind_of_hinge_is_locked_and_unlocked(make):
    model = make()
    for name in moving(model):
        stopped(model, [name])
        before, pose = bits(model), model.pose(list(model.bodies)[-1])
        model.lock(name)
        assert model.hinges[name].kind == "weld" and name in model.locked
        assert np.allclose(model.pose(list(model.bodies)[-1]), pose, rtol=0, atol=1e-14 * size(pose))
        model.unlock(name)
        assert bits(model) == before, name


def test_a_placement_is_rounded_once():
    """P S(q) by fifty digits: the weld's placement is that to half a unit of the last place of the largest entries."""
    rng = np.random.default_rng(7)
    axis, point = rng.normal(size=(2, 3))
    mb = pc.Multibody("pin")
    mb.add_body("body", axis=axis, point=point, position=rng.normal(size=3), rotation=np.linalg.qr(rng.normal(size=(3, 3)))[0], mass=1.0)
    mb.q = [1.2345]
    hinge = mb.hinges["body"]
    with mpmath.workdps(50):
        P, (a, c) = mpmath.matrix(hinge.placement.tolist()), (mpmath.matrix(hinge.subhinges[0][key].tolist()) for key in ("axis", "point"))
        a = a / mpmath.norm(a)
        skew = mpmath.matrix([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
        R = mpmath.eye(3) + mpmath.sin(mb.q[0]) * skew + (1 - mpmath.cos(mb.q[0])) * skew * skew
        exact_R, exact_p = P[:3, :3] * R, P[:3, 3] + P[:3, :3] * (c - R * c)
    mb.lock("body")
    placed = mb.hinges["body"].placement
    assert np.abs(placed[:3, :3] - np.array(exact_R.tolist(), float)).max() <= EPS / 2
    assert np.abs(placed[:3, 3] - np.array(exact_p.tolist(), float).ravel()).max() <= EPS * np.abs(placed[:3, 3]).max()


def test_turns_of_a_locked_hinge_are_kept():
    """q is where it was locked, many turns from zero, and quaternions of any length."""
    model = pc.tree([-1, 0], ["pin", "ball"], seed=2)
    model.q = [40.0, 2.0, 0.0, 0.0, 2.0]
    model.lock(list(model.hinges))
    model.unlock()
    assert list(model.q) == [40.0, 2.0, 0.0, 0.0, 2.0]


def test_a_placement_that_is_set_meanwhile_moves_the_hinge():
    """X set on the weld: unlocked, the body is where it was put, by the same coordinates."""
    arm = pc.chain(3, seed=1)
    arm.q = [0.3, -0.7, 0.4]
    arm.lock("hinge1")
    moved = arm.hinges["hinge1"].placement.copy()
    moved[:3, 3] += (0.1, 0.2, 0.0)
    arm.hinges["hinge1"].placement = moved
    pose = arm.pose("body2")
    arm.unlock("hinge1")
    assert arm.q[1] == -0.7
    assert np.allclose(arm.pose("body2"), pose, rtol=0, atol=4 * EPS)


# By an impulse --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(25))
def test_an_impulse_keeps_the_momenta_of_what_stays(seed):
    """The constrained problem, solved densely: (ℳ + J)(v⁺ - v) = impulses at locked hinges alone, v⁺ zero there."""
    rng = np.random.default_rng(seed)
    model = random_tree(rng, int(rng.integers(2, 10)), kinds=[kind for kind in KINDS if kind != "weld"])
    hinges = moving(model)
    chosen = [str(name) for name in rng.choice(hinges, int(rng.integers(1, len(hinges) + 1)), replace=False)]
    own, free = coordinates(model, chosen)
    A, v = model.mass_matrix(), np.array(model.v)  # ℳ + J
    after = np.zeros(model.nv)
    after[free] = v[free] + np.linalg.solve(A[np.ix_(free, free)], A[np.ix_(free, own)] @ v[own])
    impulses = A @ (after - v)
    near = 1e3 * EPS * np.linalg.cond(A)
    energies = 0.5 * v @ A @ v, 0.5 * after @ A @ after
    slices = {name: model.hinges[name].v_slice for name in chosen}

    stop = model.lock(chosen, impulsive=True)
    assert np.allclose(model.v, after[free], rtol=near, atol=near)
    for name, at in slices.items():
        assert np.allclose(stop.impulses[name], impulses[at], rtol=near, atol=near * size(A))
    assert np.allclose([stop.energy_before, stop.energy_after], energies, rtol=near, atol=near)
    assert stop.loss > 0 and np.isclose(stop.loss, energies[0] - energies[1], rtol=near, atol=near * energies[0])
    assert np.isclose(model.kinetic_energy(), stop.energy_after, rtol=near, atol=near)
    momentum = model.momentum().value if model.nv else np.zeros(6)
    assert np.allclose(momentum, stop.momentum_after, rtol=near, atol=near * size(A))


def test_momentum_of_a_floating_model_is_kept():
    """Whatever is locked in it; of one on the base it is not, the base takes what is missing."""
    for model in (build(rotors_on_some()), pc.tree([-1, 0, 1, 0, 3], ["free", "pin", "ball", "universal", "slider"], seed=4)):
        state = model.random_state(3)
        model.q, model.v = state.q, state.v
        root, *joints = moving(model)
        before = model.momentum().value
        stop = model.lock(joints, impulsive=True)
        assert np.allclose(stop.momentum_before, before, rtol=1e-13, atol=1e-13)
        assert np.allclose(stop.momentum_after, before, rtol=1e-12, atol=1e-12 * size(before)) and stop.loss > 0
        assert np.allclose(model.momentum().value, before, rtol=1e-12, atol=1e-12 * size(before))
    arm = pc.chain(3)
    arm.v = [1, 2, 3]
    stop = arm.lock("hinge2", impulsive=True)
    assert np.abs(stop.momentum_after - stop.momentum_before).max() > 0.05


def test_two_rods_in_closed_form():
    """A rod that turns at ω about a free pivot stops against a rod at rest: I ω is shared by both as one."""
    mb = pc.Multibody("two wheels")
    mb.add_body("table", mass=1.0, inertia=np.diag([1.0, 1.0, 3.0]))
    mb.add_body("wheel", parent="table", mass=1.0, inertia=np.diag([1.0, 1.0, 2.0]))
    mb.v = [0.0, 5.0]
    stop = mb.lock("wheel", impulsive=True)
    assert np.allclose(mb.v, [2.0]) and np.isclose(stop.loss, 25 - 10) and np.allclose(stop.impulses["wheel"], [-6.0])
    assert np.isclose(stop.energy_before, 25) and np.isclose(stop.energy_after, 10)
    assert np.allclose(stop.momentum_before, [0, 0, 10, 0, 0, 0]) and np.allclose(stop.momentum_after, [0, 0, 10, 0, 0, 0])


def test_a_rotor_stops_with_its_hinge():
    """Its momentum J v goes into no other coordinate: J is a term of its own hinge; and unlocked it is there again."""
    mb = pc.Multibody("geared")
    mb.add_body("table", mass=1.0, inertia=np.diag([1.0, 1.0, 3.0]))
    mb.add_body("wheel", parent="table", mass=1.0, inertia=np.diag([1.0, 1.0, 2.0]), rotor_inertia=7.0)
    mb.v = [0.0, 5.0]
    stop = mb.lock("wheel", impulsive=True)
    assert np.allclose(mb.v, [2.0]) and np.allclose(stop.impulses["wheel"], [-6.0 - 35.0])
    assert np.isclose(stop.loss, 15 + 0.5 * 7 * 25) and np.isclose(stop.energy_before - stop.energy_after, stop.loss)
    assert not mb.has_rotor_inertia
    mb.unlock()
    assert mb.hinges["wheel"].rotor_inertia.tolist() == [7.0]


def test_gravity_has_no_part_in_an_impulse():
    models = [pc.chain(4, seed=3) for _ in range(2)]
    models[1].gravity = (3.0, -9.81, 2.0)
    for model in models:
        model.q, model.v = [0.3, 0.1, -0.4, 0.8], [1, -2, 3, 0.5]
        model.lock(["hinge1", "hinge3"], impulsive=True)
    assert np.array_equal(models[0].v, models[1].v)


# What is refused ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda m: m.lock("hinge1"), r"hinge 'hinge1' moves \(v = 2\) and is locked at rest only; impulsive=True"),
        (lambda m: m.lock(["hinge0", "hinge3"]), "hinge 'hinge3' moves"),
        (lambda m: m.lock("elbow"), "no hinge of 'chain of 4' is called 'elbow'; there are hinge0"),
        (lambda m: m.lock("*elbow"), "no hinge of 'chain of 4' that has coordinates fits"),
        (lambda m: m.lock(["hinge2", "hinge2"]), "hinge 'hinge2' is locked already and has no coordinates"),
        (lambda m: m.lock(3), "a hinge is named by a string, not by 3"),
        (lambda m: m.lock(None), "a hinge is named by a string, not by None"),
        (lambda m: m.unlock("hinge0"), r"hinge 'hinge0' \(pin\) was not locked in this model; locked are hinge2"),
        (lambda m: m.unlock("el*"), "no locked hinge of 'chain of 4' fits 'el\\*'; locked are hinge2"),
        (lambda m: m.unlock("elbow"), "no hinge of 'chain of 4' is called 'elbow'"),
        (lambda m: m.subgraph(root="body1").lock([]), "lock hinges there, and take the part anew"),
        (lambda m: m.subgraph(root="body1").unlock(), "unlock hinges there, and take the part anew"),
        (lambda m: pc.Scene(m).add(pc.effects.Damping(1.0, hinges="hinge2")).evaluate(), "unlock it where it was locked"),
        (lambda m: (m.coalesce("body2"), m.unlock("hinge2")), "body 'body2', which is coalesced: split it off first"),
    ],
)  # fmt: skip
def test_what_is_refused_says_why_and_what_would_do(edit, words):
    model = pc.chain(4, seed=1)
    model.lock("hinge2")
    model.v = [0, 2, 1]
    before = bits(model)
    with pytest.raises(pc.ModelError, match=words):
        edit(model)
    if "coalesced" not in words:
        assert bits(model) == before and model.locked == ["hinge2"]


def test_a_name_that_was_taken_meanwhile():
    model = pc.tree([-1, 0], ["pin", "universal"], seed=1)
    model.lock("hinge1")
    model.add_body("other", parent="body0", hinge_name="hinge1[0]", mass=1.0)
    before = bits(model)
    with pytest.raises(pc.ModelError, match="a coordinate of hinge 'hinge1' would be called 'hinge1\\[0\\]'"):
        model.unlock()
    assert bits(model) == before and model.locked == ["hinge1"]


def test_a_coordinate_that_feels_no_inertia():
    model = pc.chain(2)
    model.add_body("feather", parent="body1")
    model.v = [1, 1, 1]
    before = bits(model)
    with pytest.raises(pc.SingularHingeError, match="feather"):
        model.lock("hinge0", impulsive=True)
    assert bits(model) == before and model.locked == []
    model.lock(["hinge0", "feather"], impulsive=True)
    assert model.nv == 1


# What goes with it ----------------------------------------------------------------------------------------------------


def test_patterns_handles_and_lists():
    model = pc.chain(4)
    assert model.lock(["hinge[23]", model.hinges["hinge0"]]).hinges == ("hinge0", "hinge2", "hinge3")
    assert model.lock([]).hinges == () and model.unlock([]) == []
    assert model.lock("*").hinges == ("hinge1",) and model.nv == 0
    assert model.unlock("hinge?") == ["hinge0", "hinge2", "hinge3", "hinge1"]


def test_operators_and_parts_are_stale_and_new_ones_follow():
    model = pc.chain(4, seed=1)
    operator, part = model.soa.MM, model.subgraph(root="body2")
    model.lock("hinge1")
    for ask in (operator.dense, part.mass_matrix, lambda: part.nv):
        with pytest.raises(pc.StaleOperatorError, match="hinge 'hinge1' was locked"):
            ask()
    assert np.allclose(model.soa.MM.dense(), model.mass_matrix()) and model.subgraph(root="body0").locked == ["hinge1"]
    operator = model.soa.MM
    model.unlock()
    with pytest.raises(pc.StaleOperatorError, match="was unlocked"):
        operator.dense()
    assert model.soa.MM.dense().shape == (4, 4)


def test_copies_and_pickles_can_be_unlocked():
    model = pc.tree([-1, 0, 1, 0], ["free", "pin", "ball", "slider"], seed=3)
    before = bits(model)
    model.lock(["hinge1", "hinge2"])
    again = [copy.copy(model), copy.deepcopy(model), pickle.loads(pickle.dumps(model)), pc.Multibody.from_description(model.description())]
    for other in again:
        assert other.locked == ["hinge1", "hinge2"] and bits(other) == bits(model)
        assert other.unlock() == ["hinge1", "hinge2"] and bits(other) == before
    part = copy.copy(model.subgraph(root="body0"))
    assert part.locked == ["hinge1", "hinge2"] and part.unlock("hinge2") == ["hinge2"]
    assert model.locked == ["hinge1", "hinge2"]


def test_a_file_holds_the_welds_and_says_what_it_does_not_hold(tmp_path):
    model = pc.chain(3, seed=1)
    model.q = [0.1, 0.2, 0.3]
    model.lock("hinge1")
    with pytest.warns(pc.ModelWarning, match="no file holds what unlocks hinges and splits bodies, and these were not written: hinge1"):
        model.save(tmp_path / "arm.toml")
    read = pc.load(tmp_path / "arm.toml")
    assert bits(read) == bits(model) and read.locked == []
    with pytest.raises(pc.ModelError, match="'hinge1' \\(weld\\) was not locked in this model; locked are none"):
        read.unlock("hinge1")


def test_bodies_that_are_removed_take_their_locks_along():
    model = pc.chain(4)
    model.lock(["hinge1", "hinge3"])
    model.remove_body("body2")
    assert model.locked == ["hinge1"]
    model.add_body("body3", parent="body1", hinge="weld", hinge_name="hinge3")
    assert "hinge3" not in model.locked


def test_frames_and_scenes_go_on():
    model = pc.chain(3, seed=1)
    model.gravity = (0, -9.81, 0)
    model.add_frame("lens", on="body2", position=(1, 0, 0))
    model.q = [0.1, 0.2, 0.3]
    pose = model.frame("lens").pose()
    scene = pc.Scene(model).add(pc.effects.Gravity(), pc.effects.Damping(0.1))
    before = scene.evaluate().vdot
    model.lock("hinge2")
    assert np.allclose(model.frame("lens").pose(), pose, rtol=0, atol=1e-15)
    assert before.shape == (3,) and scene.evaluate().vdot.shape == (2,)
    assert scene.simulate(0.1, progress=False).q.shape[1] == 2


def test_what_the_file_said_of_a_locked_hinge_comes_back():
    model = pc.robots.panda()
    left, actuators = {key: np.array(values) for key, values in model.left_aside.items()}, model.actuators
    hinge = list(model.hinges)[2]
    model.lock(hinge)
    assert all(len(values) == model.nv for key, values in model.left_aside.items() if key not in ("gravity", "spring rest"))
    model.unlock()
    assert left.keys() == model.left_aside.keys() and left
    assert all(np.array_equal(values, model.left_aside[key], equal_nan=True) for key, values in left.items())
    assert sorted(map(repr, model.actuators)) == sorted(map(repr, actuators))


def test_batches_of_the_locked_model():
    model = pc.chain(3, seed=1)
    model.lock("hinge1")
    for size_of_batch in (0, 3):
        Q = np.zeros((size_of_batch, 2))
        assert model.mass_matrix(Q).shape == (size_of_batch, 2, 2)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_any_sequence_of_locks_ends_where_it_began(data):
    model = random_tree(np.random.default_rng(data.draw(st.integers(0, 10**6))), data.draw(st.integers(1, 8)), kinds=KINDS)
    model.v = np.zeros(model.nv)
    before = bits(model)
    for _ in range(data.draw(st.integers(1, 6))):
        if data.draw(st.booleans()) and (hinges := moving(model)):
            model.lock(data.draw(st.lists(st.sampled_from(hinges), min_size=1, unique=True)))
        elif model.locked:
            model.unlock(data.draw(st.sampled_from(model.locked)))
    model.unlock()
    assert bits(model) == before


def test_massless_inner_bodies_are_locked_like_any():
    model = stopped(build(massless_inner_bodies()), ["yaw_hinge", "pitch_hinge"])
    before = bits(model)
    model.lock(["yaw_hinge", "pitch_hinge"])
    assert model.forward_dynamics(tau=np.ones(model.nv)).shape == (model.nv,)
    model.unlock()
    assert bits(model) == before
