"""Checkpoints: runs that go on bit for bit, pickles and files, and what does not fit."""

import copy
import json
import math
import pickle
import re

import numpy as np
import pytest

import pycraft as pc
from support.runs import CASES, FIXED

E = pc.effects
ONE_STEP = ["dopri5", "auto", "cash-karp54", "dop853", "rosenbrock4", *FIXED]


def options_of(integrator):
    return {"integrator": integrator, "step": 0.02} if integrator in FIXED else {"integrator": integrator, "rtol": 1e-8}


def same_from(whole, rest):
    """Check that `rest` is the end of `whole`, bit for bit."""
    first = int(np.searchsorted(whole.t, rest.t[0]))
    return all(np.array_equal(getattr(whole, name)[first:], getattr(rest, name)) for name in ("t", "q", "v", "states", "_work"))


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("integrator", ONE_STEP)
def test_bit_for_bit(integrator, case):
    """A run in three parts is the run in one, also where the parts end within a step."""
    scene, options = CASES[case](), options_of(integrator)
    whole = scene.simulate(1.0, **options)
    first = scene.simulate(0.3, **options)
    second = scene.resume(first.checkpoint(), 0.633)
    third = scene.resume(pickle.loads(pickle.dumps(second)), 1.0)
    assert first.t[-1] == 0.3 and second.t[-1] == 0.633 and third.t[-1] == 1.0
    assert same_from(whole, third) and third.t[0] <= 0.633
    assert third.energy["work"].shape[1] == 0 or np.array_equal(third.energy["work"][-1], whole.energy["work"][-1])


@pytest.mark.parametrize("integrator", ["bulirsch-stoer", "scipy:DOP853", "scipy:BDF"])
def test_others_go_on_to_their_tolerance(integrator):
    scene = CASES["damped"]()
    whole = scene.simulate(1.0, integrator=integrator, rtol=1e-8)
    parts = scene.resume(scene.simulate(0.4, integrator=integrator, rtol=1e-8), 1.0)
    assert np.abs(whole.q[-1] - parts.q[-1]).max() < 1e-5 and np.abs(whole._work[-1] - parts._work[-1]).max() < 1e-5


@pytest.mark.parametrize("precision", ["extended", "quad"])
@pytest.mark.parametrize("integrator", ["dop853", "rkmk4", "variational2"])
def test_bit_for_bit_in_wide_precisions(integrator, precision, tmp_path):
    """The checkpoint holds all digits, on disk too: what is lost in none of them shows in none of the doubles that come out."""
    arm = pc.tree([-1, 0], ["ball", "pin"], seed=2)
    scene = pc.Scene(arm, precision=precision).add(E.Gravity(), E.Damping(0.1))
    options = {"integrator": integrator, "step": 0.02} if integrator in FIXED else {"integrator": integrator, "rtol": 1e-15, "atol": 1e-17}
    whole = scene.simulate(0.4, **options)
    checkpoint = scene.simulate(0.2, **options).checkpoint()
    assert max(len(parts) for parts in checkpoint.state["x"]) > 1
    checkpoint.save(tmp_path / "run.json")
    assert pc.Checkpoint.load(tmp_path / "run.json") == checkpoint
    assert same_from(whole, scene.resume(tmp_path / "run.json", 0.4))


def test_controllers_hold_on():
    """A sample that was taken is not taken again, and one at the end of a run is."""
    called = []

    def control(t, state):
        called.append(t)
        return -3.0 * state.q - state.v

    scene = pc.Scene(pc.chain(2)).add(E.Gravity((0, -9.81, 0)), E.Sampled(control, 0.1))
    whole = scene.simulate(0.6, [0.3, 0.2], [0, 0])
    times = list(called)
    for stop in (0.25, 0.3):
        called.clear()
        first = scene.simulate(stop, [0.3, 0.2], [0, 0])
        rest = scene.resume(first, 0.6)
        assert called == times and same_from(whole, rest)


def test_from_a_terminal_event():
    """The event that ended a run does not end the next one at once; it is the next zero that does."""
    scene = pc.mechanisms.pendulum()
    turn = pc.Event(lambda t, s: s.v[0], terminal=True, name="turn")
    for integrator in ("dopri5", "rkmk4", "rosenbrock4"):
        options = {"integrator": integrator, "step": 0.01} if integrator == "rkmk4" else {"integrator": integrator, "rtol": 1e-9}
        run, times = scene.simulate(10.0, events=turn, **options), []
        for _ in range(4):
            times.append(run.t[-1])
            run = scene.resume(run, 10.0, events=turn)
        assert np.array(times) == pytest.approx(np.arange(1, 5) * 2.367841947576 / 2, abs=1e-5)


def test_after_an_interrupt_or_an_error():
    """The computed part is resumed as if nothing had happened."""
    state = {"broken": True}

    def brake(t, s):
        if state["broken"] and t > 0.5:
            raise KeyboardInterrupt if state["broken"] == "stop" else RuntimeError("no power")
        return -0.3 * s.v

    scene = pc.Scene(pc.chain(2)).add(E.Gravity((0, -9.81, 0)), brake)
    for kind, error in ((True, RuntimeError), ("stop", KeyboardInterrupt)):
        state["broken"] = kind
        with pytest.raises(error) as caught:
            scene.simulate(1.0, [0.3, 0.2], [0, 0])
        partial = caught.value.run
        assert partial is scene.last_run and 0.4 < partial.t[-1] <= 0.5
        state["broken"] = False
        whole = scene.simulate(1.0, [0.3, 0.2], [0, 0])
        assert np.array_equal(partial.q, whole.q[: len(partial)])
        assert same_from(whole, scene.resume(partial, 1.0))


def test_what_does_not_fit(tmp_path):
    scene = CASES["damped"]()
    checkpoint = scene.simulate(0.1).checkpoint()
    assert repr(checkpoint) == f"<checkpoint of 'spinning' at {checkpoint.t:g} s, integrator 'auto'>"
    with pytest.raises(
        pc.ModelError, match="the checkpoint is of effects gravity, spring, damping, torque_source; this scene has gravity, spring"
    ):
        CASES["spinning"]().resume(checkpoint, 1.0)
    with pytest.raises(pc.ModelError, match="the checkpoint is of model 'spinning'; this scene has 'pendulum'"):
        pc.mechanisms.pendulum().resume(checkpoint, 1.0)
    with pytest.raises(pc.ModelError, match="the checkpoint is of precision 'double'; this scene has 'quad'"):
        pc.Scene(scene.model, precision="quad").add(*scene.effects.values()).resume(checkpoint, 1.0)
    with pytest.raises(pc.EvaluationError, match=r"T=0\.01: the checkpoint is at 0\.0\d+ s already"):
        scene.resume(checkpoint, 0.01)
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(pc.EvaluationError, match="other.json' holds no checkpoint .its format is not 'pycraft.*`run.checkpoint"):
        scene.resume(tmp_path / "other.json", 1.0)
    with pytest.raises(FileNotFoundError):
        scene.resume(tmp_path / "none.json", 1.0)


def changed(data, path, value):
    """The data with one entry changed; `None` takes it away."""
    data = copy.deepcopy(data)
    *way, last = path
    at = data
    for key in way:
        at = at[key]
    if value is None:
        del at[last]
    else:
        at[last] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (("format",), "pycraft run 1", "its format is not 'pycraft checkpoint 2'"),
        (("state",), None, "a checkpoint takes t, model, effects, coordinates, precision, integrator, options, state"),
        (("more",), 1, "a checkpoint takes t, model, effects, coordinates"),
        (("model",), 3, "model is a name, not 3"),
        (("effects",), "gravity", "effects is a list of names"),
        (("options", "rtol"), None, "options takes rtol, atol, step, max_step, normalise, energy"),
        (("options", "rtol"), "small", "rtol is a positive number or zero, not 'small'"),
        (("options", "atol"), -1e-9, "atol is a positive number or zero, not -1e-09"),
        (("options", "step"), math.nan, "step is a positive number or zero, not nan"),
        (("options", "energy"), 1, "energy is true or false, not 1"),
        (("state", "x"), None, "state takes t, x, size, origin, taken, signs, lengths"),
        (("state", "x"), [[0.0], []], "x of the state is a list of lists of finite numbers"),
        (("state", "x"), [[0.0], [math.inf]], "x of the state is a list of lists of finite numbers"),
        (("state", "lengths"), 0, "lengths of the state is a list of lists of finite numbers"),
        (("state", "size"), [], "size of the state is a list of finite numbers that are added up, not []"),
        (("state", "size"), [-0.01], "size of the state is -0.01; a step is a positive number of seconds"),
        (("state", "size"), [0.0], "size of the state is 0; a step"),
        (("state", "origin"), [None], "origin of the state is a list of finite numbers"),
        (("state", "taken"), -1, "taken of the state is a count of steps, not -1"),
        (("state", "taken"), 2**70, "taken of the state is a count of steps"),
        (("state", "signs"), [2], "signs of the state are -1, 0 or 1"),
        (("state", "t"), [5.0], "t is "),
        (("t",), 5.0, "t is 5.0, but the state has"),
        (("t",), True, "t is True"),
    ],
)
def test_files_whose_numbers_make_no_sense(tmp_path, path, value, text):
    scene, file = CASES["damped"](), tmp_path / "run.json"
    scene.simulate(0.3).checkpoint().save(file)
    file.write_text(json.dumps(changed(json.loads(file.read_text()), path, value)))
    with pytest.raises(pc.EvaluationError, match=re.escape(f"{str(file)!r} holds no checkpoint (") + ".*" + re.escape(text)):
        scene.resume(file, 1.0)


def test_a_checkpoint_with_other_numbers_of_a_state(tmp_path):
    scene, file = CASES["damped"](), tmp_path / "run.json"
    scene.simulate(0.3).checkpoint().save(file)
    data = json.loads(file.read_text())
    data["state"]["x"].append([0.0])
    file.write_text(json.dumps(data))
    with pytest.raises(pc.ModelError, match=f"the checkpoint has {len(data['state']['x'])} numbers of a state; the scene"):
        scene.resume(file, 1.0)


@pytest.mark.parametrize("saved", [False, True])
def test_a_state_is_not_taken_for_one_of_other_coordinates(tmp_path, saved):
    """Edits of the structure may leave as many coordinates, in another order or of another body."""
    edits = {
        "hinge1 of body1' where this model has 'hinge2 of body2": lambda m: m.reattach(
            "body1", "body3", "pin", placement="here", velocity="impulse"
        ),
        "hinge0[0] of body0' where this model has 'hinge0[0] of body2": lambda m: m.reroot("body2"),
        "10, and there are 9": lambda m: m.lock("hinge3", impulsive=True),
    }
    for words, edit in edits.items():
        parents = [-1, 0, 0, 0, 2] if "10" in words else [-1, 0, 0, 0] if "hinge1" in words else [-1, 0, 1, 2]
        model = pc.tree(parents, ["free", *["pin"] * (len(parents) - 1)], seed=1)
        state = model.random_state(0)
        scene = pc.Scene(model).add(pc.effects.Gravity(g=(0, 0, -9.81)))
        run = scene.simulate(0.1, state.q, state.v, progress=False)
        model.bodies["body1"].mass = 2.0  # other numbers are the user's business
        assert scene.resume(run, 0.15, progress=False).t[-1] == 0.15
        checkpoint = run.checkpoint()
        if saved:
            checkpoint.save(tmp_path / "run.json")
            checkpoint = tmp_path / "run.json"
        model.q, model.v = state.q, state.v
        edit(model)
        with pytest.raises(pc.ModelError, match="before an edit of its structure: among the coordinates .*" + re.escape(words)):
            scene.resume(checkpoint, 0.2)
