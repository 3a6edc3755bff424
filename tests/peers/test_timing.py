"""Measurements of `pycraft bench --peers`: ratios, exponents, clocks, models, and that a wrong result is refused."""

import json
import os

import numpy as np
import pytest

import pycraft as pc
from pycraft.peers import clock, speed, timed_models
from pycraft.peers.clock import Time
from pycraft.peers.peer_calls import Call


def row(call="forward_dynamics", model="chain of 100", nv=100, kernel=2.0, theirs=7.0, **peers):
    others = {"Pinocchio": Time(theirs, theirs), **{name: Time(t, t) for name, t in peers.items()}}
    return speed.Row(model, nv, call, Time(kernel / 2, kernel), Time(kernel, kernel + 1), others, Time(1.0, theirs - 1))


def test_ratios_are_the_others_over_ours():
    one = row()
    assert (one.ratio, one.python_ratio, one.met) == (3.0, 7.0 / 3.0, (True, True))
    one.peers["MuJoCo"] = Time(4.5, 4.5)
    assert one.python_ratio == 1.5 and one.met == (True, False), "the fastest package counts"
    alone = speed.Row("m", 1, "mass_matrix", Time(1, 1), Time(1, 1))
    assert alone.ratio is None and alone.python_ratio is None and alone.met == (None, None)
    assert row("mass_matrix_inverse_product").met == (None, None), "there is no goal"


def test_exponents_are_those_of_powers():
    rows = [
        row(call, f"chain of {n}", n, 1e-3 * n**p, 1 + 1e-3 * n ** (p + 0.5))
        for call, p in (("mass_matrix", 2.0), ("inverse_dynamics", 1.0))
        for n in (30, 100, 300, 1000)
    ]
    rows += [row("inverse_dynamics", "chain of 10", 10, 1e9), row("inverse_dynamics", "UR5", 300, 1e9)]
    assert speed.exponents(rows) == pytest.approx({"mass_matrix": 2.0, "inverse_dynamics": 1.0})
    assert speed.exponents(rows, peer=True) == pytest.approx({"mass_matrix": 2.5, "inverse_dynamics": 1.5})
    assert speed.exponents(rows[:1]) == {}, "one point has no slope"


def test_times_are_taken():
    found = clock.elapsed(lambda: sum(range(100)), 0.01)
    assert 0 < found["minimum"] <= found["median"] < 1e-2
    assert clock.in_turn(1.0, *[lambda s, t=t: {"minimum": t * s, "median": 2 * t * s} for t in (1.0, 3.0)], rounds=4) == [
        (0.25e6, 0.5e6),
        (0.75e6, 1.5e6),
    ]
    assert Time(3.0, 4.0).less(3.5) == (1e-3, 0.5) and Time(3.0, 4.0).shared(2) == (1.5, 2.0)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system pins no process")
def test_one_core_is_pinned():
    before = os.sched_getaffinity(0)
    try:
        assert clock.pin_to_one_core() == "one, pinned" and len(os.sched_getaffinity(0)) == 1
    finally:
        os.sched_setaffinity(0, before)


def test_a_robot_that_is_not_there_is_said(monkeypatch):
    def missing():
        raise pc.ModelError("example-robot-data is not installed: pip install 'pycraft-soa[peers]'")

    said = []
    monkeypatch.setattr(timed_models, "robot_files", missing)
    monkeypatch.setattr(timed_models, "CHAINS", (3,))
    monkeypatch.setattr(timed_models, "LONGEST", ())
    models = dict(timed_models.timed_models(False, said.append))
    assert list(models) == ["UR5", "Panda", "G1", "chain of 3"] and [text.split(":")[0] for text in said] == ["ANYmal", "Talos"]
    assert all("pip install 'pycraft-soa[peers]'" in text for text in said)
    monkeypatch.setattr(timed_models, "robot_files", list)
    said.clear()
    list(timed_models.timed_models(False, said.append))
    assert said[1] == "Talos: the installed example-robot-data has no talos_data/talos_full_v2.urdf"


@pytest.fixture
def own():
    model = timed_models.chain_of_machines(14)  # long enough that two of its nodes move in every direction
    model.gravity = (0, 0, -9.81)
    return speed.OwnCalls(model, speed.states_of(model))


@pytest.mark.parametrize("call", speed.GOALS)
def test_every_call_is_checked_and_timed(own, call):
    found = speed.measured_row("fourteen", own, call, {}, 0.001)
    assert 0 < found.kernel.minimum <= found.kernel.median and 0 < found.python.minimum <= found.python.median
    assert found.errors["alone"] < 1e-12 and found.peer_kernel is None and not found.peers


@pytest.mark.parametrize("call", speed.GOALS)
def test_a_wrong_result_is_not_timed(own, call):
    true = own.run(call)
    arrays = tuple(np.array(a) for a in (true if isinstance(true, tuple) else (true,)))
    found = speed.measured_row("fourteen", own, call, {"Other": Call(lambda: None, lambda: arrays)}, 0.001)
    assert found.errors == {"Other": 0.0} and found.peers["Other"].median > 0
    for wrong in (1 + 1e-5, float("nan")):
        off = (*arrays[:-1], arrays[-1] * wrong)
        with pytest.raises(pc.EvaluationError, match=f"{call} of fourteen is not Other's in the run that times it"):
            speed.measured_row("fourteen", own, call, {"Other": Call(lambda: None, lambda off=off: off)}, 0.001)


@pytest.mark.parametrize("call", speed.GOALS)
def test_a_wrong_result_is_not_timed_where_no_peer_goes(own, call, monkeypatch):
    if call.endswith("derivatives"):
        true = type(own.model).inverse_dynamics_derivatives
        monkeypatch.setattr(type(own.model), "inverse_dynamics_derivatives", lambda *given: tuple(1.001 * a for a in true(*given)))
    else:
        value = np.array(own.run(call))
        monkeypatch.setattr(own, "run", lambda _: 1.001 * value)
    with pytest.raises(pc.EvaluationError, match="of fourteen"):
        speed.measured_row("fourteen", own, call, {}, 0.001)


def test_a_chain_beyond_a_dense_matrix():
    model = timed_models.chain_of_machines(max(timed_models.CHAINS) + 1)
    own = speed.OwnCalls(model, speed.states_of(model))
    for call in speed.LINEAR:
        found = speed.measured_row(model.name, own, call, {}, 0.001)
        assert found.kernel.median > 0 and found.errors["alone"] < 1e-9


@pytest.mark.peers
def test_a_quick_run(monkeypatch):
    pytest.importorskip("pinocchio")
    monkeypatch.setattr(speed, "pin_to_one_core", lambda: "not pinned")
    said = []
    found = speed.measure(0.001, quick=True, progress=said.append)
    assert {r.model for r in found.rows} == {"UR5", "Panda", "chain of 10", "chain of 30"} and len(found.rows) == 4 * len(speed.GOALS) - 3
    assert [r.model for r in found.rows if r.call == "operational_space_inertia_of_two"] == ["chain of 30"]  # the others are too short
    for r in found.rows:
        assert r.kernel.median > 0 and r.python.median > 0 and r.peers["Pinocchio"].median > 0 and r.peer_kernel.median > 0
        assert set(r.errors) == set(r.peers) and max(r.errors.values()) < 1e-9
    assert all(r.double.median > 0 and r.single.median > 0 and min(r.ratios) > 0 for r in found.batches)
    assert {r.model for r in found.compiled} == {"UR5", "Panda", "chain of 10"}
    assert all(r.kernel.median > 0 and r.python.median > 0 and r.ratio > 0 for r in found.compiled)
    assert json.loads(json.dumps(found.as_json()))["rows"][0]["ratio"] > 0
    assert "UR5: forward dynamics" in said and any(text.startswith("CasADi") for text in found.left_out)
