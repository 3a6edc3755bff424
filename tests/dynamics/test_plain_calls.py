"""Contiguous float64 arrays go to the core past the Python method; they get what the method gives, to the last bit, and its errors."""

import copy
import functools
import gc
import inspect
import pickle
import pydoc
import sys
import threading

import numpy as np
import pytest

import pycraft as pc
from support.plain_calls import CALLS, by_the_method, frame_first, given, panda, same, strided, taken_by_the_core, warm

SOLVING = ("forward_dynamics", "mass_matrix_inverse")
MODELS = {
    "panda": pc.robots.panda,
    "branched, with a free base": pc.robots.g1,
    "more bodies than keep the GIL": lambda: pc.chain(80, seed=2),
    "one body": lambda: pc.chain(1),
}


def welds_only():
    model = pc.Multibody("welds", welds="keep")
    model.add_body("a", hinge="weld", mass=1.0)
    return warm(model)


@pytest.mark.parametrize("states", [-1, 0, 1, 5, 19])
@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("kind", MODELS)
def test_as_the_method_has_it(kind, call, states, monkeypatch):
    model = warm(MODELS[kind]())
    if model.nv < 6 and call == "operational_space_inertia":
        return  # singular
    arrays, frame = given(model, call, states), frame_first(model, call)
    wanted = by_the_method(model, call, *frame, *arrays)
    taken_by_the_core(monkeypatch, model)
    same(getattr(model, call)(*frame, *arrays), wanted)
    if call != "pose":
        out = np.empty_like(wanted)
        assert getattr(model, call)(*frame, *arrays, out=out) is out
        same(out, wanted)


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
@pytest.mark.parametrize("call", SOLVING)
def test_a_form_by_its_name(call, form, monkeypatch):
    model = panda()
    arrays = given(model, call, 6)
    options = {"form": form, "refine": 0, "residual": "same", "precision": "double", "on_singular": "raise"}
    wanted = by_the_method(model, call, *arrays, **options)
    taken_by_the_core(monkeypatch, model)
    same(getattr(model, call)(*arrays, **options), wanted)


@pytest.mark.parametrize(
    "options",
    [
        {"form": "ud", "refine": 2},
        {"refine": "auto"},
        {"precision": "quad"},
        {"precision": 50},
        {"residual": "gather", "refine": 1},
        {"on_singular": "minimum-norm"},
    ],
    ids=str,
)
@pytest.mark.parametrize("call", SOLVING)
def test_other_options_are_heard(call, options):
    model = warm(pc.chain(6, seed=3))
    arrays = given(model, call, 3)
    same(getattr(model, call)(*arrays, **options), by_the_method(model, call, *arrays, **options))
    same(model.prepare(call, batch=3, **options)(*arrays), by_the_method(model, call, *arrays, **options))


def test_one_state_stands_for_all():
    model = panda()
    q, v, tau = given(model, "forward_dynamics", 5)
    same(model.forward_dynamics(q, v[0].copy(), tau), by_the_method(model, "forward_dynamics", q, np.tile(v[0], (5, 1)), tau))
    same(
        model.forward_dynamics(q[0].copy(), v[0].copy(), tau),
        by_the_method(model, "forward_dynamics", np.tile(q[0], (5, 1)), np.tile(v[0], (5, 1)), tau),
    )


class Own(np.ndarray):
    pass


@pytest.mark.parametrize(
    "other",
    [
        list,
        tuple,
        strided,
        np.asfortranarray,
        lambda a: a.astype(">f8"),
        lambda a: a.astype(np.longdouble),
        lambda a: a.view(Own),
        lambda a: a[None][0],
    ],
    ids=["list", "tuple", "strided", "column by column", "other byte order", "long double", "a subclass", "a view"],
)
@pytest.mark.parametrize("states", [-1, 4])
def test_whatever_holds_the_numbers(other, states):
    model = panda()
    arrays = given(model, "forward_dynamics", states)
    same(model.forward_dynamics(*map(other, arrays)), by_the_method(model, "forward_dynamics", *arrays))


def test_of_a_state_and_of_the_present_state():
    model = panda()
    state, tau = model.random_state(3), np.ones(model.nv)
    wanted = by_the_method(model, "forward_dynamics", state.q, state.v, tau)
    same(model.forward_dynamics(state, None, tau), wanted)
    same(model.forward_dynamics(tau=tau, v=state.v, q=state.q), wanted)
    model.q, model.v = state.q, state.v
    same(model.forward_dynamics(None, None, tau), wanted)
    same(model.forward_dynamics(tau=tau), wanted)


def wrong(model):
    q, v, tau = given(model, "forward_dynamics", -1)
    bad = v.copy()
    bad[1] = np.nan
    out = np.empty(model.nv)
    out.flags.writeable = False
    return {
        "too long": ((np.zeros(8), v, tau), {}),
        "not finite": ((q, bad, tau), {}),
        "three axes": ((q[None, None], v, tau), {}),
        "no axis": ((np.array(1.0), v, tau), {}),
        "two batches": ((np.tile(q, (2, 1)), np.tile(v, (3, 1)), tau), {}),
        "not writeable": ((q, v, tau), {"out": out}),
        "another shape": ((q, v, tau), {"out": np.empty(3)}),
        "another type": ((q, v, tau), {"out": np.empty(model.nv, np.float32)}),
        "whole numbers": ((q, v, tau), {"out": np.empty(model.nv, int)}),
        "no form": ((q, v, tau), {"form": "udu"}),
        "form 3": ((q, v, tau), {"form": 3}),
        "no option": ((q, v, tau), {"fom": "ud"}),
        "no method": ((q, v, tau), {"method": "magic"}),
        "too many": ((q, v, tau, tau), {}),
        "refine -1": ((q, v, tau), {"refine": -1}),
        "refine 10^30": ((q, v, tau), {"refine": 10**30}),
        "complex": ((q + 0j, v, tau), {}),
    }


@pytest.mark.parametrize("case", wrong(pc.robots.panda()))
def test_errors_are_the_methods(case):
    model = panda()
    arrays, options = wrong(model)[case]
    with pytest.raises(Exception) as said:
        model.forward_dynamics(*arrays, **options)
    with pytest.raises(type(said.value)) as wanted:
        by_the_method(model, "forward_dynamics", *arrays, **options)
    assert str(said.value) == str(wanted.value)


def test_a_result_in_the_memory_of_an_argument():
    model = panda()
    for i in range(3):
        arrays = given(model, "forward_dynamics", 20)
        wanted = by_the_method(model, "forward_dynamics", *arrays)
        for ahead in (0, 1):
            memory = np.zeros((21, model.nv))
            memory[1 - ahead : 21 - ahead] = given(model, "forward_dynamics", 20)[i]
            arrays[i] = memory[1 - ahead : 21 - ahead]
            same(model.forward_dynamics(*arrays, out=memory[ahead : 20 + ahead]), wanted)


def test_singular_hinges_are_named():
    model = pc.Multibody("light")
    model.add_body("feather")
    warm(model)
    with pytest.raises(pc.SingularHingeError, match="feather"):
        model.forward_dynamics(np.zeros(1), np.zeros(1), np.ones(1))


@pytest.mark.parametrize("states", [-1, 0, 3])
@pytest.mark.parametrize("call", [call for call in CALLS if not call.startswith("operational_space")])
def test_no_coordinates(call, states, monkeypatch):
    model, batch = welds_only(), () if states < 0 else (states,)
    arrays, frame = given(model, call, states), frame_first(model, call)
    wanted = by_the_method(model, call, *frame, *arrays)
    taken_by_the_core(monkeypatch, model)
    found = getattr(model, call)(*frame, *arrays)
    same(found, wanted)
    matrices = {"mass_matrix": (0, 0), "mass_matrix_inverse": (0, 0), "coriolis_matrix": (0, 0), "jacobian": (6, 0), "pose": (4, 4)}
    assert found.shape == batch + matrices.get(call, (0,))


def test_lengths_that_no_int_holds():
    model = welds_only()
    with pytest.raises(pc.ModelError, match=f"q of 'welds' has {2**31} states; one call takes at most {2**31 - 1}"):
        model.mass_matrix(np.zeros((2**31, 0)))
    with pytest.raises(pc.ModelError, match=f"vdot of 'welds' has {2**32} states"):
        model.inverse_dynamics(np.zeros(0), np.zeros(0), np.zeros((2**32, 0)))
    with pytest.raises(pc.ModelError, match="q of 'panda' takes 7 numbers"):
        panda().mass_matrix(np.zeros((0, 2**32 + 7)))


def test_edits_are_followed():
    model = warm(pc.chain(2))
    call, state = model.prepare("forward_dynamics"), (np.zeros(2), np.zeros(2), np.ones(2))
    before = call(*state)
    model.gravity = (0, -9.81, 0)
    same(call(*state), by_the_method(model, "forward_dynamics", *state))
    assert not np.array_equal(call(*state), before)
    tip, place = model.prepare("jacobian", frame="body1"), np.zeros(3)
    model.add_body("more", parent="body1", mass=1.0, com=(0.5, 0, 0))
    three = np.zeros(3), np.zeros(3), np.ones(3)
    same(call(*three), by_the_method(model, "forward_dynamics", *three))
    same(tip(place), by_the_method(model, "jacobian", "body1", place))
    with pytest.raises(pc.ModelError, match="takes 3 numbers"):
        call(*state)


def test_looks_like_a_method():
    call = pc.Multibody.forward_dynamics
    assert list(inspect.signature(call).parameters)[:4] == ["self", "q", "v", "tau"]
    assert list(inspect.signature(pc.chain(1).forward_dynamics).parameters)[:3] == ["q", "v", "tau"]
    assert inspect.getdoc(call).startswith("Return accelerations v̇") and inspect.isroutine(call)
    assert call.__name__ == "forward_dynamics" and "forward_dynamics" in repr(pc.chain(1).forward_dynamics)
    assert call.__module__ == "pycraft.dynamics.direct_calls" and call.__qualname__ == "DirectCalls.forward_dynamics"
    parameters = inspect.signature(call).parameters
    assert parameters["form"].default == "fast" and parameters["q"].default is None and call.__kwdefaults__ == {"threads": 1}
    for text in (pydoc.render_doc(call), pydoc.render_doc(pc.Multibody)):
        assert "on_singular: 'str' = 'raise'" in text and "Return accelerations v̇ under generalized forces" in text
    with pytest.raises(TypeError):
        type(call)()


def test_is_no_function():
    call = pc.Multibody.forward_dynamics
    for name in ("__code__", "__globals__", "__closure__", "__dict__", "nothing"):
        with pytest.raises(AttributeError, match=f"DirectCall' object has no attribute '{name}'"):
            getattr(call, name)
    with pytest.raises(AttributeError):
        call.__name__ = "other"


def test_can_be_wrapped_and_pickled():
    model = warm(pc.chain(2))
    state = np.zeros(2), np.zeros(2), np.ones(2)

    @functools.wraps(pc.Multibody.forward_dynamics)
    def louder(*given):
        return 2 * model.forward_dynamics(*given)

    assert louder.__name__ == "forward_dynamics" and louder.__doc__ == pc.Multibody.forward_dynamics.__doc__
    assert list(inspect.signature(louder).parameters)[:4] == ["self", "q", "v", "tau"]
    again = pickle.loads(pickle.dumps(model.forward_dynamics))
    same(2 * again(*state), louder(*state))


def test_is_overridden_and_called_by_super():
    class Louder(pc.Multibody):
        def forward_dynamics(self, *arrays, **options):
            return 2 * super().forward_dynamics(*arrays, **options)

    louder = Louder("louder")
    louder.add_body("a", mass=1.0, com=(1, 0, 0))
    assert louder.forward_dynamics(np.zeros(1), np.zeros(1), np.ones(1)) == 2.0


def test_models_are_still_copied():
    model = warm(pc.chain(3))
    state = np.zeros(3), np.zeros(3), np.ones(3)
    wanted = model.forward_dynamics(*state)
    for again in (copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        again.gravity = (0, -9.81, 0)
        assert not np.array_equal(again.forward_dynamics(*state), wanted)
    same(model.forward_dynamics(*state), wanted)


def test_nothing_is_left_over():
    model = panda()
    arrays, out = given(model, "forward_dynamics", -1), np.empty(model.nv)
    call = model.prepare("forward_dynamics")

    def use():
        for _ in range(200):
            call(*arrays)
            call(*arrays, out=out)
            model.forward_dynamics(*arrays, form="ud")
            with pytest.raises(pc.ModelError):
                call(*arrays[:2], np.full(model.nv, np.nan))

    use()
    gc.collect()
    before = [sys.getrefcount(x) for x in (*arrays, out, np.dtype(np.float64), model)]
    use()
    gc.collect()
    assert [sys.getrefcount(x) for x in (*arrays, out, np.dtype(np.float64), model)] == before


def test_threads_do_not_share():
    model = pc.chain(70, seed=1)  # large enough for the GIL to be let go
    states = [given(model, "forward_dynamics", -1, seed) for seed in range(4)]
    wanted = [by_the_method(model, "forward_dynamics", *s) for s in states]
    call, wrong_ones = model.prepare("forward_dynamics"), []

    def work(i):
        for _ in range(200):
            if not np.array_equal(call(*states[i]), wanted[i]):
                wrong_ones.append(i)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert not wrong_ones
