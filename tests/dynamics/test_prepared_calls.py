"""Calls whose options were read once: what the method gives, to the last bit, and errors that say what is wrong."""

import inspect

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.plain_calls import CALLS, by_the_method, frame_first, given, panda, same, strided, taken_by_the_core


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("states", [None, 0, 4])
def test_prepared(call, states, monkeypatch):
    model = panda()
    arrays, frame = given(model, call, -1 if states is None else states), frame_first(model, call)
    wanted = by_the_method(model, call, *frame, *arrays)
    ready = model.prepare(call, batch=states, **({"frame": frame[0]} if frame else {}))
    out = np.empty_like(wanted)
    same(ready(*[a.tolist() if states != 0 else a for a in arrays]), wanted)
    same(ready(*map(strided, arrays), out=out), wanted)
    taken_by_the_core(monkeypatch, model)
    same(ready(*arrays), wanted)
    assert ready(*arrays, out=out) is out
    same(out, wanted)
    assert call in ready.__doc__


@pytest.mark.parametrize("call", ["inverse_dynamics_derivatives", "forward_dynamics_derivatives"])
def test_prepared_calls_of_three_results(call, monkeypatch):
    model = panda()
    rng = np.random.default_rng(1)
    Q, V, U = np.array([model.random_state(s).q for s in range(4)]), *rng.normal(size=(2, 4, 7))
    for arrays, batch in (((Q, V, U), 4), ((Q[0], V[0], U[0]), None), ((Q, V[0], U), 4), ((Q[:0], V[:0], U[:0]), 0)):
        wanted = by_the_method(model, call, *arrays)
        ready = model.prepare(call, batch=batch)
        lists = [a.tolist() if batch != 0 else a for a in arrays]
        with monkeypatch.context() as m:
            m.setattr(type(model), "_sensitivities", lambda self: pytest.fail("by the method"))
            found = ready(*arrays)
        for other in (found, ready(*lists)):
            assert type(other) is type(wanted)
            for a, b in zip(other, wanted, strict=True):
                same(a, b)
    wider = model.prepare(call, precision="quad")(Q[0], V[0], U[0])
    for a, b in zip(wider, by_the_method(model, call, Q[0], V[0], U[0], precision="quad"), strict=True):
        same(a, b)
    assert call in ready.__doc__ and "out" not in ready.__doc__


def test_prepared_derivatives_in_another_form(monkeypatch):
    model, rng = panda(), np.random.default_rng(2)
    q, v, u = model.random_state(1).q, *rng.normal(size=(2, 7))
    for options in ({"form": "ud"}, {"refine": 1}, {"refine": 1, "residual": "wider"}):
        for a, b in zip(
            model.prepare("forward_dynamics_derivatives", **options)(q, v, u),
            by_the_method(model, "forward_dynamics_derivatives", q, v, u, **options),
            strict=True,
        ):
            same(a, b)


@pytest.mark.parametrize("form", ["christoffel", "skew"])
def test_prepared_coriolis_matrices(form, monkeypatch):
    model, rng = panda(), np.random.default_rng(2)
    q, v = model.random_state(1).q, rng.normal(size=7)
    wanted = {p: by_the_method(model, "coriolis_matrix", q, v, form=form, precision=p) for p in ("double", "quad")}
    for precision, value in wanted.items():
        same(model.prepare("coriolis_matrix", form=form, precision=precision)(q, v), value)
    taken_by_the_core(monkeypatch, model)
    same(model.coriolis_matrix(q, v, form=form), wanted["double"])
    same(model.coriolis_matrix(q, v, form=form, precision="double"), wanted["double"])


@pytest.mark.parametrize("prescribed", [(), "panda_joint2", ["panda_joint1", "panda_joint4"], ["panda_joint*"]])
@pytest.mark.parametrize("how", [{}, {"form": "ud"}, {"refine": 1}, {"precision": "quad"}])
def test_prepared_hybrid_dynamics(prescribed, how, monkeypatch):
    model, rng = panda(), np.random.default_rng(3)
    Q, (V, U, A) = np.array([model.random_state(s).q for s in range(4)]), rng.normal(size=(3, 4, 7))
    for arrays, batch in (((Q, V, U, A), 4), ((Q[0], V[0], U[0], A[0]), None), ((Q, V[0], U, A[0]), 4), ((Q[:0], V[:0], U[:0], A[:0]), 0)):
        wanted = model.hybrid_dynamics(*arrays, prescribed, **how)
        ready = model.prepare("hybrid_dynamics", batch=batch, prescribed=prescribed, **how)
        lists = [a.tolist() if batch != 0 else a for a in arrays]
        by_the_method = ready(*lists), ready(*map(strided, arrays))
        with monkeypatch.context() as m:
            m.setattr(type(model), "hybrid_dynamics", lambda *_, **__: pytest.fail("by the method"))
            found = ready(*arrays)
        for other in (found, *by_the_method):
            assert type(other) is type(wanted)
            for a, b in zip(other, wanted, strict=True):
                same(a, b)
    assert "hybrid_dynamics" in ready.__doc__


def test_prepared_hybrid_dynamics_follows_edits(monkeypatch):
    model, rng = pc.chain(3), np.random.default_rng(4)
    q, v, tau, vdot = rng.normal(size=(4, 3))
    ready = model.prepare("hybrid_dynamics", prescribed=(name for name in ["hinge1"]))
    before = ready(q, v, tau, vdot)
    model.bodies["body2"].mass = 5.0
    after, wanted = ready(q, v, tau, vdot), model.hybrid_dynamics(q, v, tau, vdot, "hinge1")
    assert np.array_equal(after.tau, wanted.tau) and not np.array_equal(after.tau, before.tau)
    model.add_body("tip", parent="body2", position=(1, 0, 0), mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0, 0.1, 0.1]))
    with pytest.raises(pc.ModelError, match="q .*takes 4"):
        ready(q, v, tau, vdot)
    q, v, tau, vdot = rng.normal(size=(4, 4))
    wanted = model.hybrid_dynamics(q, v, tau, vdot, "hinge1")
    assert np.array_equal(ready(q, v, tau, vdot).vdot, wanted.vdot)
    with monkeypatch.context() as m:  # and from then on without the method again
        m.setattr(type(model), "hybrid_dynamics", lambda *_, **__: pytest.fail("by the method"))
        assert np.array_equal(ready(q, v, tau, vdot).vdot, wanted.vdot)
    model.remove_body("body1")
    with pytest.raises(pc.ModelError, match="hinge1"):
        ready(q[:1], v[:1], tau[:1], vdot[:1])


@pytest.mark.parametrize(
    "ask, error, words",
    [
        (lambda m: m.prepare("dynamics"), pc.EvaluationError, "'forward_dynamics'.*'pose'.*, not 'dynamics'"),
        (lambda m: m.prepare(["pose"]), pc.EvaluationError, r"'forward_dynamics'.*'pose'.*, not \['pose'\]"),
        (lambda m: m.prepare(None), pc.EvaluationError, "'forward_dynamics'.*'pose'.*, not None"),
        (lambda m: m.prepare(3), pc.EvaluationError, "'forward_dynamics'.*'pose'.*, not 3"),
        (lambda m: m.prepare("mass_matrix", form="ud"), pc.EvaluationError, "no option 'form'"),
        (lambda m: m.prepare("forward_dynamics", form="udu"), pc.EvaluationError, "udu"),
        (lambda m: m.prepare("forward_dynamics", batch=-1), pc.EvaluationError, "batch=-1"),
        (lambda m: m.prepare("forward_dynamics", batch=2.0), pc.EvaluationError, "batch=2.0"),
        (lambda m: m.prepare("forward_dynamics", batch=True), pc.EvaluationError, "batch=True"),
        (lambda m: m.prepare("forward_dynamics", batch=np.True_), pc.EvaluationError, "batch="),
        (lambda m: m.prepare("forward_dynamics", batch=[2]), pc.EvaluationError, "batch=.2."),
        (lambda m: m.prepare("forward_dynamics", batch=2**31), pc.EvaluationError, f"up to {2**31 - 1}"),
        (lambda m: m.prepare("jacobian"), pc.EvaluationError, "frame="),
        (lambda m: m.prepare("operational_space_inertia"), pc.EvaluationError, "frame="),
        (lambda m: m.prepare("coriolis_matrix", form="ud"), pc.EvaluationError, "'ud' of the Coriolis matrix.*'christoffel' and 'skew'"),
        (lambda m: m.prepare("inverse_dynamics_derivatives", form="ud"), pc.EvaluationError, "no option 'form'"),
        (lambda m: m.prepare("forward_dynamics_derivatives", on_singular="raise"), pc.EvaluationError, "no option 'on_singular'"),
        (lambda m: m.prepare("inverse_dynamics_derivatives")(m.q, m.v), TypeError, "takes q, v, vdot; it was given 2"),
        (lambda m: m.prepare("inverse_dynamics_derivatives")(m.q, m.v, m.v, out=m.v), TypeError, "no out="),
        (lambda m: m.prepare("pose", frame="nose"), pc.ModelError, "nose"),
        (lambda m: m.prepare("pose", frame=3), pc.ModelError, "string, not by 3"),
        (lambda m: m.prepare("pose", frame="panda_link7")(m.q, out=np.empty((2, 4, 4))), pc.ModelError, r"shape \(4, 4\)"),
        (lambda m: m.pose("panda_link7", m.q, precision="double"), TypeError, "precision"),
        (lambda m: m.mass_matrix(m.q, form="ud"), TypeError, "form"),
        (lambda m: m.mass_matrix_inverse(m.q, method="articulated"), TypeError, "method"),
        (lambda m: m.prepare("bias_forces")(m.q), TypeError, "q, v"),
        (lambda m: m.prepare("mass_matrix", batch=3)(m.q), pc.ModelError, "3 states but got one state"),
        (lambda m: m.prepare("mass_matrix")(np.tile(m.q, (2, 1))), pc.ModelError, "one state but got 2 states"),
        (lambda m: m.prepare("mass_matrix", batch=3)(np.tile(m.q, (2, 1))), pc.ModelError, "3 states but got 2 states"),
        (lambda m: m.prepare("forward_dynamics")(m.q, m.v, m.v, form="ud"), TypeError, "form"),
        (lambda m: m.prepare("hybrid_dynamics", prescribed="elbow"), pc.ModelError, "elbow"),
        (lambda m: m.prepare("hybrid_dynamics", prescribed=["panda_joint1"] * 2), pc.ModelError, "twice"),
        (lambda m: m.prepare("hybrid_dynamics", form="udu"), pc.EvaluationError, "udu"),
        (lambda m: m.prepare("hybrid_dynamics", refine=-1), pc.EvaluationError, "refine"),
        (lambda m: m.prepare("hybrid_dynamics", frame="panda_link7"), pc.EvaluationError, "no option 'frame'; there are prescribed"),
        (lambda m: m.prepare("hybrid_dynamics", batch=-1), pc.EvaluationError, "batch=-1"),
        (lambda m: m.prepare("hybrid_dynamics")(m.q, m.v), TypeError, "takes q, v, tau, vdot; it was given 2"),
        (lambda m: m.prepare("hybrid_dynamics", batch=3)(m.q, m.v, m.v, m.v), pc.ModelError, "3 states but got one state"),
        (lambda m: m.prepare("hybrid_dynamics")(m.q, np.full(7, np.nan), m.v, m.v), pc.ModelError, "v"),
    ],
)
def test_prepared_says_what_is_wrong(ask, error, words):
    with pytest.raises(error, match=words):
        ask(panda())


def test_batches_are_counted_by_any_whole_number():
    model = panda()
    (q,) = given(model, "mass_matrix", 3)
    for batch in (3, np.int64(3), np.uint8(3)):
        same(model.prepare("mass_matrix", batch=batch)(q), by_the_method(model, "mass_matrix", q))


@pytest.mark.parametrize("call", CALLS)
def test_the_core_takes_what_the_method_takes(call):
    """Except out= and threads=, and options that lead to other computations."""
    arrays, options = _core.direct_calls()[call]
    method = inspect.signature(getattr(pc.Multibody, call)).parameters
    assert [name for name in method if name in arrays] == list(arrays)
    other = {"self", "out", "threads", "method", "axes", "relative_to"}
    other |= {"form", "on_singular", "damping"} - set(options)  # in other forms by operators, at singular states by task spaces
    assert set(method) - other == {*arrays, *options}
    defaults = {name: method[name].default for name in options if name != "frame"}
    model = panda()
    frame = {"frame": "panda_link7"} if "frame" in options else {}
    states = given(model, call, 2)
    same(model.prepare(call, batch=2, **frame)(*states), model.prepare(call, batch=2, **frame, **defaults)(*states))
