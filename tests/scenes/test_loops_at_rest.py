"""Equilibria on loops, and forces that hinges carry there: closed forms, virtual work, what is refused."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.models import linkages
from support import linkages as samples
from support.linkages import close

E, M = pc.effects, pc.mechanisms
DOWN = E.Gravity((0, -9.81, 0))


def check_balanced(model, found, forces):
    """r = 0, and no virtual displacement does work: forces are a combination of the rows."""
    Q = model.loops.jacobian(found.q)
    assert np.abs(model.loops.residual(found.q)).max() < 1e-13
    total = forces + found.holding
    multipliers = np.linalg.lstsq(Q.T, -total, rcond=1e-9)[0]
    assert np.abs(total + Q.T @ multipliers).max() < 1e-8 * np.abs(forces).max()


def tree_forces(model, effects, q):
    """Return the forces of effects at rest, without the loops'."""
    said = pc.Scene(model).add(*effects).evaluate(q)
    return sum(said.forces.values())


CASES = {
    "five-bar": (linkages.five_bar, [DOWN, E.Spring(5.0, hinges=["inner0", "inner1"])]),
    "stewart": (linkages.stewart, [E.Gravity(), E.Spring(500.0, 1.0, hinges="upper*")]),
    "bricard, redundant": (linkages.bricard, [DOWN]),
    "peaucellier": (linkages.peaucellier, [DOWN, E.Spring(50.0, 0.2, hinges="crank")]),
    "slider-crank": (linkages.slider_crank, [DOWN, E.Spring(200.0, 0.25, hinges="block")]),
}


@pytest.mark.parametrize("name", CASES)
def test_what_is_found_is_balanced_and_stable(name):
    make, effects = CASES[name]
    model = make()
    scene = pc.Scene(model).add(*effects, E.Loop())
    found = scene.equilibrium(stable=True)
    assert found.stability == "stable" and len(found.modes) == model.mobility(found.q).degrees_of_freedom
    check_balanced(model, found, tree_forces(model, effects, found.q))
    # What swings about it swings as the linear model says, and rests there.
    values = np.linalg.eigvals(scene.linearize(found.q).A)
    close(np.sort(values.imag**2)[::2], np.sort([mode.eigenvalue for mode in found.modes]), 1e-7)
    assert np.abs(scene.evaluate(found.q).vdot).max() < 1e-7
    for mode in found.modes:
        assert np.abs(model.loops.jacobian(found.q) @ mode.shape).max() < 1e-10


def test_four_bars_balance_upright_and_hanging():
    scene = M.n_four_bar(3)
    upright = scene.equilibrium(scene.model.q + 0.1 * np.array([1, -1, 1, -1, 1, -1, 1]))
    assert upright.stability == "unstable"
    close(upright.q, np.pi / 2 * np.array([1, -1, 1, -1, 1, -1, 1]))
    hanging = scene.equilibrium(upright.q, stable=True)
    assert hanging.stability == "stable" and abs(np.sin(hanging.q[0]) + 1) < 1e-14


def test_held_coordinates_carry_what_is_left():
    """A crank held level: half of the weight of all rods about its hinge, and the cranks' own, by virtual work."""
    model = linkages.n_four_bar(2, 0.0 + 0.3)
    found = pc.Scene(model).add(DOWN, E.Loop()).equilibrium(hold="crank0")
    close(found.q, model.q, 1e-13)
    close(found.holding, [9.81 * (3 / 2 + 2) * np.cos(0.3), 0, 0, 0, 0], 1e-12)
    assert not found.modes
    by_model = linkages.n_four_bar(2, 0.3)
    by_model.gravity = (0, -9.81, 0)
    close(by_model.equilibrium(hold="crank0", loops=True).holding, found.holding)


def test_models_have_them_too():
    """tau balances: a slider-crank pushed by its block against a torque on its crank, T = F dx/dα."""
    model = linkages.slider_crank()
    force = 10.0
    slope = np.sin(1.0) * 0.15 * (1 + 0.15 * np.cos(1.0) / np.sqrt(0.2**2 - (0.15 * np.sin(1.0)) ** 2))
    start = model.assemble([1.02, 0, 0.2], fix="crank").q
    found = model.equilibrium([slope * force, 0, force], start, loops=True)
    close(found.q[0], 1.0)
    many = model.equilibrium([[slope * force, 0, force]] * 2, start, loops=True)
    close(many[1].q, found.q)


def test_what_is_prescribed_stays_where_it_is_told_to():
    model = linkages.five_bar()
    told = E.Prescribed("inner0", lambda t: ([2.0 + 0.3 * t], [0.3], [0.0]))
    found = pc.Scene(model).add(DOWN, told, E.Loop()).equilibrium(t=0.5)
    assert found.q[0] == 2.15
    rest = pc.Scene(model).add(DOWN, E.Prescribed("inner0", 2.15), E.Loop()).evaluate(found.q)
    assert np.abs(rest.vdot).max() < 1e-9


def test_where_forces_lead_into_a_singular_state_nothing_is_found():
    """Peaucellier's rhombus folds under its weight: what is there grows without end, and is no equilibrium."""
    model = linkages.peaucellier()
    with pytest.raises(pc.EvaluationError, match="no equilibrium was found on its loops|singular"):
        pc.Scene(model).add(DOWN, E.Spring(3.0, 0.2, hinges="crank"), E.Loop()).equilibrium(stable=True)


REFUSED = {
    "none": (
        lambda: linkages.n_four_bar(2, 1.0).equilibrium([1.0, 0, 0, 0, 0], loops=True), pc.EvaluationError, "no equilibrium.*'crank0'"
    ),
    "far off": (lambda: linkages.stewart().equilibrium(hold="nothing", loops=True), pc.ModelError, "'nothing'"),
    "held apart": (
        lambda: M.slider_crank().equilibrium([0.0, 0.0, 2.0], hold=["crank", "block"]), pc.ModelError, "loop 'wrist' cannot be closed"
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_refusals_name_what_it_is(what):
    call, error, text = REFUSED[what]
    with pytest.raises(error, match=text):
        call()


def rhombus(low, high):
    """Rods that swing as one on two cranks, hanging or upright; the first crank within limits."""
    bars = pc.chain(3)
    bars.gravity = (0, -9.81, 0)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    bars.hinges["hinge0"].limits = (low, high)
    return bars


def at(crank):
    return [crank, -crank, crank - np.pi]


@pytest.mark.parametrize("scene", [False, True])
def test_within_limits(scene):
    """The upright one alone, from inside and from outside of the limits; the hanging one is beyond them."""
    bars = rhombus(0.4, 2.9)
    by = pc.Scene(bars).add(DOWN, E.Loop()).equilibrium if scene else lambda *given, **more: bars.equilibrium(*given, loops=True, **more)
    for start in (0.5, 2.8, -1.2):
        found = by(q0=at(start), limits=True)
        close(found.q, [np.pi / 2, -np.pi / 2, -np.pi / 2])
        assert found.stability == "unstable"
    with pytest.raises(pc.EvaluationError, match="no stable equilibrium|within limits"):
        by(q0=at(1.0), limits=True, stable=True)
    assert by(q0=at(1.0), stable=True).q[0] < 0
    bars.hinges["hinge0"].limits = (0.2, 1.0)
    with pytest.raises(pc.EvaluationError, match="no equilibrium was found on its loops within limits"):
        by(q0=at(0.5), limits=True)
    bars.hinges["hinge0"].limits = (0.7, 0.7)
    stuck = by(q0=at(0.5), limits=True)
    assert stuck.q[0] == 0.7 and abs(stuck.holding[0]) > 1.0
    bars.hinges["hinge0"].limits = (0.2, 1.0)
    bars.hinges["hinge1"].limits = (0.5, 1.0)  # where the first is within its own, the second is not
    with pytest.raises(pc.EvaluationError, match="the state on the loops near q0 has 'hinge[01]' beyond its limits by 0"):
        by(q0=at(0.5), limits=True)


# ------------------------------------------------------------------ interbody forces


@pytest.mark.parametrize("make", [linkages.stewart, linkages.bricard, linkages.andrews, lambda: samples.spatial(True)[0]])
def test_hinges_carry_what_they_do_in_the_model(make):
    """By `Multibody.interbody_forces(loops=True)`, whose oracles are its own; with a wrench and a spring beside gravity."""
    model = make()
    model.gravity = (0.3, -9.81, 0.2)
    state = model.assemble(model.q, np.random.default_rng(5).normal(size=model.nv))
    name = list(model.bodies)[-1]
    scene = pc.Scene(model).add(E.Gravity(model.gravity), E.Wrench(name, (1, 2, 3, 4, 5, 6)), E.Damping(0.7), E.Loop())
    forces = scene.interbody_forces(None, state.q, state.v)
    expected = model.interbody_forces(state.q, state.v, -0.7 * state.v, wrenches={name: [1, 2, 3, 4, 5, 6]}, loops=True)
    close(forces, expected, 1e-10)
    one = scene.interbody_forces(list(model.hinges)[0], state.q, state.v, axes="world")
    on_one = {"hinges": list(model.hinges)[0], "axes": "world", "wrenches": {name: [1, 2, 3, 4, 5, 6]}, "loops": True}
    close(one, model.interbody_forces(state.q, state.v, -0.7 * state.v, **on_one), 1e-10)


def test_couplings_and_motors_are_carried_by_their_hinges():
    """Two gears of 1 to 3, the first driven: along the axes hinges carry what drives them and what the gears ask."""
    model = pc.chain(2)
    model.add_coupling({"hinge0": 1.0, "hinge1": -3.0}, name="gear")
    scene = pc.Scene(model).add(E.TorqueSource(2.0, hinges="hinge0"), E.Loop())
    state = model.assemble([0.3, 0.1], [0.6, 0.2])
    said = scene.evaluate(state.q, state.v)
    along = scene.interbody_forces(None, state.q, state.v)[:, 2]
    close(along, sum(said.forces.values()))
    assert abs(said.forces["loop"]).min() > 1e-3


def test_along_a_run_they_are_those_at_its_states():
    scene = M.stewart()
    run = scene.simulate(0.2, t_eval=[0.1, 0.2], progress=False)
    along = run.interbody_forces("lower0")
    close(along, np.array([scene.interbody_forces("lower0", q, v) for q, v in zip(run.q, run.v, strict=True)]), 1e-9)
    lower = [f"lower{i}" for i in range(6)]
    for q, v in zip(run.q, run.v, strict=True):  # what stands on the ground carries the weight, and what accelerates upward
        mass, J = scene.model.mass, scene.model.centre_of_mass_jacobian(q)[2]
        moved = (scene.model.centre_of_mass_jacobian(scene.model.integrate(q, STEP * v))[2] - J) / STEP
        lifted = mass * (9.81 + J @ scene.evaluate(q, v).vdot + moved @ v)
        carried = scene.interbody_forces(lower, q, v, axes="world")[:, 5].sum()
        assert abs(carried - lifted) < 1e-4 * lifted  # of a difference of first order


STEP = 1e-6
