"""A scene that goes on piece by piece is the scene that runs at once; by hand, on loops, and after its effects were changed."""

import time

import numpy as np
import pytest

import pycraft as pc
from pycraft.scenes.coordinate_units import coordinate_units
from pycraft.viewer.live_scene import LiveScene, without
from pycraft.viewer.session import Session
from support.mechanisms import every_kind

TOLERANCE = 2e-5
"""Of rtol 1e-7 a step, over a second of a motion that is not chaotic: some hundred steps, and what they grow to."""


@pytest.fixture
def session():
    opened = []

    def made(*arguments, **options):
        opened.append(Session(*arguments, **options))
        return opened[-1]

    yield made
    for one in opened:
        one.close()


@pytest.mark.parametrize("seed", range(2))
def test_pieces_are_the_run(seed):
    model = every_kind(seed=seed)
    state = model.random_state(seed)
    scene = pc.Scene(model).add(pc.effects.Gravity(g=(0, 0, -9.81)), pc.effects.Damping(0.3))
    live = LiveScene(scene, state.q, 0.3 * state.v)
    for _ in range(12):
        live.advance(1 / 60)
    run = scene.simulate(0.2, state.q, 0.3 * state.v)
    assert live.t == pytest.approx(0.2)
    np.testing.assert_allclose(model.difference(run.q[-1], live.q), 0, atol=TOLERANCE)
    np.testing.assert_allclose(live.v, run.v[-1], rtol=TOLERANCE, atol=TOLERANCE * np.abs(run.v).max())
    assert live.work == pytest.approx(run.energy["work"][-1].sum(), rel=1e-4)
    np.testing.assert_allclose(live.along()["vdot"], scene.evaluate(live.q, live.v, live.t).vdot, rtol=1e-12)


@pytest.mark.parametrize("integrator", ["rk4", "rkmk4", "dop853", "rosenbrock4", "semi-implicit-euler", "variational2", "scipy:DOP853"])
def test_a_scene_goes_on_as_its_options_say(integrator):
    model = pc.tree([-1, 0], ["ball", "pin"])
    state = model.random_state(1)
    scene = pc.Scene(model).add(pc.effects.Gravity(g=(0, 0, -9.81)))
    stepped = integrator not in ("dop853", "rosenbrock4", "scipy:DOP853")
    scene.run_options = {"T": 3.0, "integrator": integrator, **({"step": 1e-3} if stepped else {"rtol": 1e-8})}
    live = LiveScene(scene, state.q, 0.1 * state.v)
    for _ in range(6):
        live.advance(1 / 60)
    run = scene.simulate(0.1, state.q, 0.1 * state.v)
    # Of the first order method half a step times the acceleration; of the others what is left of 1e-3 squared.
    np.testing.assert_allclose(model.difference(run.q[-1], live.q), 0, atol=5e-3 if "euler" in integrator else 1e-4)
    assert np.linalg.norm(live.q[:4]) == pytest.approx(1, abs=1e-9)
    assert live.options.integrator.name == integrator


def test_time_goes_on():
    """A force that changes with time is what it is at that time, not at the start of a piece."""
    scene = pc.Scene(pc.chain(1)).add(pc.effects.TorqueSource(pc.effects.Harmonic(amplitude=2.0, frequency=1.5)))
    live = LiveScene(scene, [0.0], [0.0])
    for _ in range(30):
        live.advance(1 / 30)
    run = scene.simulate(1.0, [0.0], [0.0])
    assert live.q[0] == pytest.approx(run.q[-1, 0], abs=TOLERANCE) and abs(run.q[-1, 0]) > 0.05


def test_effects_keep_their_own_states():
    """A thermostat's, when another effect is turned off beside it."""
    model = pc.chain(3)
    scene = pc.Scene(model).add(pc.effects.NoseHoover(temperature=300.0, time_constant=0.1, boltzmann=1e-3), pc.effects.Damping(0.1))
    live = LiveScene(scene, [0.1, 0.2, 0.3], [1.0, 0.0, -1.0])
    live.advance(0.3)
    own = live.own_states()
    assert len(own) and np.abs(own).max() > 0
    scene.disable("damping")
    np.testing.assert_array_equal(live.own_states(), own)
    live.advance(0.1)
    scene.disable("nose_hoover")
    assert len(live.own_states()) == 0
    live.put([0, 0, 0], [0, 0, 0])
    scene.enable("nose_hoover")
    first = scene.simulate(1e-6, [0, 0, 0], [0, 0, 0]).states[0]
    np.testing.assert_array_equal(live.own_states(), first)


@pytest.mark.parametrize("seed", range(2))
def test_coordinates_are_displacements_from_neutral(seed):
    model = every_kind(seed=seed)
    live = LiveScene(pc.Scene(model), model.random_state(seed).q)
    for j in range(model.nv):
        u = live.u
        live.move(j, 0.25)
        u[j] = 0.25
        np.testing.assert_allclose(live.u, u, atol=1e-12)
        assert not live.v.any()


def test_velocities_and_forces_are_where_and_what_they_are():
    model = every_kind(seed=1)
    state = model.random_state(3)
    scene = pc.Scene(model).add(pc.effects.Gravity(g=(0, 0, -9.81)))
    live = LiveScene(scene, state.q, state.v)
    later = model.integrate(state.q, 1e-6 * state.v)
    earlier = model.integrate(state.q, -1e-6 * state.v)
    owners, places = live.skeleton.points["mass"]
    for (at, velocity), k, place in zip(live.velocities(), owners, places, strict=True):
        name = live.skeleton.bodies[k]
        there = [(X @ [*place, 1])[:3] for X in (model.pose(name, q) for q in (state.q, later, earlier))]
        np.testing.assert_allclose(at, there[0], atol=1e-12)
        np.testing.assert_allclose(velocity, (there[1] - there[2]) / 2e-6, rtol=1e-6, atol=1e-6)  # difference quotients: h², rounding / h
    forces = model.interbody_forces(state.q, state.v, scene.evaluate(state.q, state.v).forces["gravity"] * 0, axes="world")
    assert len(live.forces()) == len(forces)
    hanging = pc.chain(2)
    at_rest = pc.Scene(hanging).add(pc.effects.Gravity(g=(9.81, 0, 0)))  # along the rods: they hang
    (at, force), (_, lower) = LiveScene(at_rest, [0, 0]).forces()
    np.testing.assert_allclose(force, [-9.81 * hanging.mass, 0, 0], atol=1e-9)
    assert at == [0, 0, 0] and lower[0] == pytest.approx(-9.81 * hanging.mass / 2)


def test_loops_are_kept_by_hand_and_in_time():
    scene = pc.mechanisms.five_bar()
    model = scene.model
    live = LiveScene(scene)
    first = live.u[0]
    for to in (first - 0.3, first):
        live.move(0, to)
        assert live.u[0] == pytest.approx(to, abs=1e-12) and np.abs(model.loops.residual(live.q)).max() < 1e-10
    live.rest_at(model.random_state(4).q)
    live.advance(0.1)
    assert np.abs(model.loops.residual(live.q)).max() < 1e-6


def test_a_long_way_stays_on_its_branch():
    """A crank that is turned by three radians at once: where three hundred small turns bring it, and not to the rod's other side."""
    live = LiveScene(pc.mechanisms.slider_crank())
    model, q = live.model, live.q
    live.move(0, live.u[0] + 3.0)
    for _ in range(300):
        q = model.assemble(model.integrate(q, [0.01, 0, 0]), fix=model.coordinate_names[0], starts=1).q
    np.testing.assert_allclose(live.q, q, atol=1e-8)


def test_a_slider_stops_where_the_loops_end():
    scene = pc.mechanisms.slider_crank()
    live = LiveScene(scene)
    (slider,) = [j for j, unit in enumerate(coordinate_units(scene.model)[2]) if unit == "m"]
    first = live.u[slider]
    with pytest.raises(pc.ModelError, match="loop"):
        live.move(slider, first + 40.0)
    assert np.abs(scene.model.loops.residual(live.q)).max() < 1e-10
    assert first <= live.u[slider] < first + 20


@pytest.mark.parametrize(
    "made", [lambda: pc.Multibody("nothing"), lambda: pc.chain(1), lambda: pc.chain(3, "weld")], ids=["0", "1", "welds"]
)
def test_small_models(made, session):
    one = session(pc.Scene(made()))
    for action in ("neutral", "random", "rest", "step", "reset"):
        one.do(action)
    setup, state = one.setup(), one.state(("velocity", "force"))
    assert len(setup["coordinates"]) == len(state["u"]) == one.live.model.nv and min(setup["figure"]["half"]) > 0
    for name in setup["figure"]["bodies"]:
        assert one.body(name)["D"] is None or np.shape(one.body(name)["D"]) == (1, 1)
    assert "values" in one.blocks("M")


def test_what_is_said_of_coordinates(session):
    model = every_kind(seed=0)
    names, units = model.coordinate_names, coordinate_units(model)[2]
    said = session(pc.Scene(model)).setup()["coordinates"]
    assert [one["name"] for one in said] == names and [one["unit"] for one in said] == units
    panda = session(pc.Scene(pc.robots.panda())).setup()["coordinates"]
    assert panda[3]["bounded"] and (panda[3]["low"], panda[3]["high"]) == pytest.approx((-3.0718, -0.0698), abs=1e-4)
    assert all(one["low"] < one["high"] for one in (*said, *panda))


# What is asked and done -----------------------------------------------------------------------------------------------


def test_effects_change_while_it_goes_on(session):
    scene = pc.Scene(pc.chain(2)).add(pc.effects.Gravity(g=(0, -9.81, 0)), pc.effects.Damping(0.1))
    one = session(scene, q=[0.3, 0.2])
    one.do("step")
    at = one.live.q.copy()
    edits = one.state()["edits"]
    one.do("effect", name="gravity", on=False)
    one.do("parameter", effect="damping", field="coefficient", value=5.0)
    assert one.state()["edits"] == edits + 2 and not scene.is_on("gravity") and scene.effects["damping"].coefficient == 5.0
    np.testing.assert_array_equal(one.live.q, at)
    np.testing.assert_allclose(one.state()["vdot"], scene.evaluate(one.live.q, one.live.v).vdot)
    one.do("parameter", effect="gravity", field="g", value=[0, 0, -1])
    assert list(scene.effects["gravity"].g) == [0, 0, -1]


def test_a_ghost_is_the_scene_without_one_effect(session):
    one = session(pc.mechanisms.double_pendulum(), q=[1.0, 2.0])
    assert one.setup()["ghosts"] == ["without gravity"] and one.state()["ghost"] is None
    one.do("step")
    one.do("ghost", name="without gravity")
    np.testing.assert_array_equal(one.ghost.q, one.live.q)
    q, v = one.live.q, one.live.v
    one.do("step")
    assert one.ghost.t == one.live.t
    free = pc.Scene(one.live.model).simulate(1 / 30, q, v)
    np.testing.assert_allclose(one.ghost.q, free.q[-1], atol=1e-6)
    assert np.abs(one.ghost.q - one.live.q).max() > 1e-3
    one.do("random")
    np.testing.assert_array_equal(one.ghost.q, one.live.q)
    one.do("ghost", name="")
    assert one.setup()["ghost"] is None


def test_a_second_scene_goes_beside(session):
    scene = pc.mechanisms.double_pendulum()
    other = pc.Scene(scene.model).add(pc.effects.Gravity(g=(0, 0, -1.62)))
    one = session(scene, other, q=[0.5, 0.0])
    one.do("step")
    assert one.setup()["ghost_name"] == "beside" and one.ghost.scene is other
    np.testing.assert_allclose(one.ghost.q, other.simulate(1 / 30, [0.5, 0.0], [0, 0]).q[-1], atol=1e-6)
    unlike = session(scene, pc.mechanisms.cart_pole(), q=[0.5, 0.0])
    unlike.do("step")
    assert len(unlike.ghost.q) == 2 and unlike.setup()["ghost"]["name"] == "cart-pole"


def test_without_leaves_the_scene_as_it_is():
    scene = pc.Scene(pc.chain(2), precision="extended").add(pc.effects.Gravity(g=(0, -1, 0)), pc.effects.Damping(0.2))
    scene.disable("damping")
    other = without(scene, "gravity")
    assert [other.is_on(name) for name in other.effects] == [False, False] and scene.is_on("gravity")
    scene.effects["damping"].coefficient = 3.0
    assert other.effects["damping"].coefficient == 3.0 and other._how == scene._how


def test_it_plays_in_real_time_and_pauses_when_nobody_looks(session, monkeypatch):
    one = session(pc.mechanisms.pendulum())
    one.do("scale", to=2.0)
    one.do("play")
    began = time.monotonic()
    while one.state()["t"] < 0.5:
        time.sleep(0.02)
        assert time.monotonic() - began < 20
    assert time.monotonic() - began > 0.2  # twice as fast as the clock, no faster
    monkeypatch.setattr("pycraft.viewer.session.UNSEEN", 0.05)
    time.sleep(0.4)
    assert not one.playing and "no page has asked" in one.message
    one.do("pause")
    t = one.live.t
    time.sleep(0.1)
    assert one.live.t == t


def test_seconds_of_the_scene_are_those_of_the_clock_times_the_scale(session):
    one = session(pc.mechanisms.pendulum())
    one.scale = 2.0
    one._go_on(0.03)
    assert one.live.t == pytest.approx(0.06) and one.rate == pytest.approx(2.0)
    one._go_on(5.0)  # too late: a tenth of a second of the clock is made up for, and the rate falls
    assert one.live.t == pytest.approx(0.26) and one.rate < 2.0


def test_what_stops_a_scene_is_said(session):
    def wrong(t, state):
        return [float("nan")] if t > 0.05 else [0.0]

    one = session(pc.Scene(pc.chain(1)).add(wrong))
    one.do("play")
    began = time.monotonic()
    while one.playing and time.monotonic() - began < 20:
        time.sleep(0.02)
    assert "stopped at" in one.message and "effect 'wrong'" in one.message and one.live.t <= 0.06
    assert one.live.q.tolist() == [0.0]


def test_refusals(session):
    scene = pc.mechanisms.double_pendulum().add(pc.effects.Damping(0.1))
    one = session(scene)
    for action, given, words in (
        ("jump", {}, "no action 'jump'; choose from play"),
        ("move", {"coordinate": 7, "to": 0.0}, "coordinate 7"),
        ("move", {"coordinate": 0, "to": float("inf")}, "finite"),
        ("move", {"coordinate": 0}, "move: "),
        ("scale", {"to": 0}, "scale=0"),
        ("effect", {"name": "wind", "on": False}, "no effect 'wind'"),
        ("parameter", {"effect": "damping", "field": "hinges", "value": 1.0}, "no numeric parameter 'hinges'"),
        ("parameter", {"effect": "damping", "field": "coefficient", "value": [1.0, 2.0]}, "shape"),
        ("parameter", {"effect": "damping", "field": "coefficient", "value": float("nan")}, "finite"),
        ("ghost", {"name": "of Banquo"}, "no ghost is called 'of Banquo'"),
    ):
        before = one.live.q.copy(), scene.effects["damping"].coefficient
        with pytest.raises((pc.ModelError, pc.EvaluationError), match=words):
            one.do(action, **given)
        np.testing.assert_array_equal(one.live.q, before[0])
        assert scene.effects["damping"].coefficient == before[1]
    with pytest.raises(pc.ModelError, match="no body 'hand'"):
        one.body("hand")
    with pytest.raises(pc.EvaluationError, match="blocks of 'Z' are not shown"):
        one.blocks("Z")


def test_a_parameter_that_cannot_be_is_as_it_was(session):
    scene = pc.Scene(pc.chain(2)).add(pc.effects.NoseHoover(temperature=1.0, time_constant=0.1))
    one = session(scene)
    with pytest.raises(pc.ModelError, match="time_constant"):
        one.do("parameter", effect="nose_hoover", field="time_constant", value=-1.0)
    assert scene.effects["nose_hoover"].time_constant == 0.1
    one.do("step")
    one.do("parameter", effect="nose_hoover", field="chain", value=5)
    assert scene.effects["nose_hoover"].chain == 5 and type(scene.effects["nose_hoover"].chain) is int
    one.do("step")
    assert len(one.live.own_states()) == sum(scene._calls().states)


def test_numbers_of_a_body(session):
    panda = pc.robots.panda()
    state = panda.random_state(1)
    one = session(pc.Scene(panda), q=state.q, v=state.v)
    body = one.body("panda_link4")
    soa, at = panda.soa, one.live.q
    np.testing.assert_allclose(body["P"], soa.P.at(at).blocks()["panda_link4", "panda_link4"])
    np.testing.assert_allclose(body["M"], soa.M.at(at).blocks()["panda_link4", "panda_link4"])
    np.testing.assert_allclose(body["D"], soa.D.at(at).blocks()["panda_joint4", "panda_joint4"])
    np.testing.assert_allclose(body["pose"], panda.pose("panda_link4", at))
    np.testing.assert_allclose(body["twist"], panda.jacobian("panda_link4", at) @ one.live.v)
    assert body["parent"] == "panda_link3" and body["kind"] == "pin"
    np.testing.assert_allclose(np.abs(one.blocks("ℳ")["values"]), np.abs(panda.mass_matrix(at)))
