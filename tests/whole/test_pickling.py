"""Pickling and copying of everything that a user can hold, in every protocol; of what is stale or gone, refused by name."""

import copy
import gc
import pickle
import subprocess
import sys

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.mechanisms import every_kind

PROTOCOLS = range(pickle.HIGHEST_PROTOCOL + 1)


def held(model):
    """One of everything, by name."""
    soa = model.soa
    body, hinge = next(iter(model.bodies.values())), next(iter(model.hinges.values()))
    T = pc.vector("T", soa.Theta)
    return {
        "model": model,
        "state": model.random_state(1),
        "body": body,
        "hinge": hinge,
        "operators": soa,
        "operator": soa.H @ soa.phi,
        "bound": soa.D.at(model.q),
        "vector": soa.psi @ soa.K @ T,
        "scalar": soa.D.logdet(),
        "space": soa.Theta,
        "space of motions": soa.V,
        "space of nodes": soa.NodesF(["body1", "body2"]),
        "space of its own": pc.euclidean(4),
        "mass": body.symbol("mass"),
        "inertia": body.symbol("inertia", "x", "y"),
        "placement": hinge.symbol("placement", "rx"),
        "rotor": model.hinges["hinge3"].symbol("rotor_inertia", 0) if "hinge3" in model.hinges else hinge.symbol("axis"),
        **{f"theorem {t.name}": t for t in soa.theorems()[::9]},
    }


def same(a, b):
    """Check that a copy equals the original."""
    if isinstance(a, _core.Parameter):
        return a.name == b.name
    if isinstance(a, _core.Theorem):
        return (a.name, a.group, a.text, a.latex, a.hypotheses, a.use, a.waiting) == (
            b.name,
            b.group,
            b.text,
            b.latex,
            b.hypotheses,
            b.use,
            b.waiting,
        )
    if isinstance(a, _core.Space):
        return (a.name, a.dimension, a.blocks) == (b.name, b.dimension, b.blocks)
    if isinstance(a, pc.State):
        return np.array_equal(a.q, b.q) and np.array_equal(a.v, b.v)
    return repr(a) == repr(b)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_every_protocol(protocol):
    for name, thing in held(every_kind()).items():
        again = pickle.loads(pickle.dumps(thing, protocol))
        assert type(again) is type(thing) and same(thing, again), name


def test_copies():
    for name, thing in held(every_kind()).items():
        for again in (copy.copy(thing), copy.deepcopy(thing)):
            assert type(again) is type(thing) and same(thing, again), name


def test_parameters_are_used_again():
    """A parameter is pickled with its function, not only with its name."""
    model = every_kind()
    for name, thing in held(model).items():
        if isinstance(thing, _core.Parameter):
            MM, parameter = pickle.loads(pickle.dumps((model.soa.MM, thing), 0))
            assert np.array_equal(MM.diff(parameter).dense(), model.soa.MM.diff(thing).dense()), name


@pytest.mark.parametrize(
    "name", [n for n in dir(_core) if isinstance(getattr(_core, n), type) and not issubclass(getattr(_core, n), BaseException)]
)
def test_no_class_of_the_core_is_copied_empty(name):
    """pickle protocols 0 and 1 made an object with nothing behind it, which ended the process at its first use."""
    arm = pc.chain(2)
    things = {
        "Dynamics": arm._calls(), "Integration": arm._integration(), "Sensitivities": arm._sensitivities(), "Methods": _core.Methods(arm),
        "Plan": arm.soa.MM.plan(), "Operator": arm.soa.MM, "Scalar": arm.soa.MM.trace(), "Space": arm.soa.V, "Multibody": arm,
        "SkoSource": arm.soa._source,
        "MultibodyOperators": arm.soa._source, "Parameter": arm.bodies["body0"].symbol("mass"), "Theorem": arm.soa.theorems()[0],
        "Binding": _core._binding(arm.soa.M.at([0, 0])),
        "MatrixTree": pc.sko_model([-1], [None], [np.eye(1)], [np.eye(1)])._source,
    }  # fmt: skip
    if name == "PassCounts":
        things[name] = arm.soa.MM.plan().counts() if hasattr(arm.soa.MM.plan(), "counts") else None
    thing = things.get(name)
    if thing is None:
        pytest.skip("made by nothing here")
    for protocol in PROTOCOLS:
        try:
            data = pickle.dumps(thing, protocol)
        except TypeError as error:
            assert "cannot be pickled" in str(error) or "cannot pickle" in str(error)
        else:
            assert repr(pickle.loads(data))


@pytest.mark.parametrize("copied", [copy.deepcopy, pickle.dumps, lambda x: pickle.dumps(x, 0)])
def test_what_is_stale_is_not_copied_as_something_else(copied):
    """A deep copy was an operator of the model as it had become."""
    model = pc.chain(3)
    soa = model.soa
    things = {
        "operator": soa.phi, "bound": soa.D.at(model.q), "scalar": soa.D.logdet(), "space": soa.Theta, "operators": soa,
        "theorem": soa.theorems()[0],
        "parameter": model.bodies["body1"].symbol("mass"), "vector": pc.vector("x", soa.V), "derivative": soa.MM.diff(0),
        "zero": pc.zero(soa.V, soa.V), "several": [soa.phi],
    }  # fmt: skip
    model.add_body("more", "body2", mass=1.0)
    for name, thing in things.items():
        with pytest.raises(pc.StaleOperatorError, match="before 'chain of 3 rods' changed"):
            copied(thing)
            pytest.fail(name)


def test_a_space_whose_model_is_gone():
    space = pc.chain(2).soa.Theta
    gc.collect()
    with pytest.raises(pc.StaleOperatorError, match="the model of .* is gone"):
        pickle.dumps(space, 0)


def test_gradients_outlive_the_name_of_their_model():
    def of(model):
        scalar = (model.soa.MM + model.soa.J).logdet()
        return scalar, scalar.at(model.random_state(1).q), scalar + 2 * model.soa.M.trace()

    model = pc.chain(4, seed=1)
    expected = [s.gradient() for s in of(model)]
    over = {name: of(model)[0].gradient(name) for name in ("inertias", "geometry", "axes")}
    gone = of(pc.chain(4, seed=1))
    for found, wanted in zip(gone, expected, strict=True):
        assert np.array_equal(found.gradient(), wanted)
    for name, wanted in over.items():
        assert np.array_equal(gone[0].gradient(name), wanted)


@pytest.mark.parametrize("exponent", [2**40, -(2**31), 2**31, -(2**31) - 1, 2**64, -(2**70), 1001])
def test_powers_that_are_too_many_factors(exponent):
    phi = pc.chain(2).soa.phi
    with pytest.raises(pc.EvaluationError, match=r"exponents go to 1000"):
        phi**exponent


def test_powers():
    phi = pc.chain(3).soa.phi
    assert np.allclose((phi ** np.int64(3)).dense(), np.linalg.matrix_power(phi.dense(), 3))
    assert np.allclose((phi**-2).dense(), np.linalg.matrix_power(np.linalg.inv(phi.dense()), 2))
    for exponent in (0.5, "2", None):
        with pytest.raises(TypeError):
            phi**exponent


@pytest.mark.parametrize("number", [2**40, -(2**40), 2**70, 3, -4])
def test_coordinates_that_are_not_there(number):
    soa = pc.chain(3).soa
    for e in (soa.phi, soa.D.logdet()):
        with pytest.raises(pc.ModelError, match="coordinate .* of 'chain of 3 rods', which has 3"):
            e.diff(number)


def test_protocol_0_does_not_end_the_process():
    """In a process of its own: it used to abort."""
    things = "(a.soa.Theta, a.soa.theorems()[0], a.bodies['body0'].symbol('mass'))"
    code = f"import pickle, pycraft as pc; a = pc.chain(2); print([repr(pickle.loads(pickle.dumps(x, 0))) for x in {things}])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, timeout=120).returncode == 0
