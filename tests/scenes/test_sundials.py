"""SUNDIALS' CVODE by scikit-sundae (extra [sundials])."""

import builtins

import numpy as np
import pytest

import pycraft as pc
from support.runs import CASES, SUNDIALS, apart, exact

E = pc.effects


def test_where_it_is_missing(monkeypatch):
    imported = builtins.__import__

    def without(name, *rest):
        if name.startswith("sksundae"):
            raise ImportError(name)
        return imported(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ImportError, match="integrator 'sundials:BDF' needs scikit-sundae: pip install 'pycraft-soa.sundials.'"):
        pc.mechanisms.pendulum().simulate(0.1, integrator="cvode")


@pytest.mark.parametrize("integrator", SUNDIALS)
def test_tolerances_are_followed(integrator):
    pytest.importorskip("sksundae", reason="extra [sundials]")
    scene, end, errors = CASES["damped"](), exact("damped", 0.5), []
    for rtol in (1e-4, 1e-7, 1e-10):
        run = scene.simulate(0.5, integrator=integrator, rtol=rtol, atol=rtol)
        errors.append(apart(scene.model, run.q[-1], run.v[-1], end))
        assert errors[-1] < 3000 * rtol and np.ptp(run.balance) < 1e4 * rtol
    assert errors[2] < 1e-3 * errors[0]


@pytest.mark.parametrize("integrator", SUNDIALS)
def test_times_events_and_controllers(integrator):
    pytest.importorskip("sksundae", reason="extra [sundials]")
    scene = pc.Scene(pc.chain(2)).add(E.Gravity((0, -9.81, 0)), E.Sampled(lambda t, s: -0.5 * s.v, 0.1))
    times, found = np.linspace(0.03, 0.97, 20), []
    for name in (integrator, "dop853"):
        found.append(
            scene.simulate(
                1.0, [0.3, 0.2], [0, 0], integrator=name, rtol=1e-10, atol=1e-12, t_eval=times, events={"down": lambda t, s: s.q[0]}
            )
        )
    assert np.abs(found[0].q - found[1].q).max() < 1e-6
    assert found[0].events["down"].t == pytest.approx(found[1].events["down"].t, abs=1e-7) and len(found[0].events["down"]) == 1


def test_stiff_motion():
    pytest.importorskip("sksundae", reason="extra [sundials]")
    model = pc.Multibody("wheel")
    model.add_body("w", mass=1.0, inertia=np.diag([1.0, 1, 0.5]))
    scene = pc.Scene(model).add(E.Damping(5e5), E.TorqueSource(0.25))
    run = scene.simulate(1.0, [0.0], [2.0], integrator="cvode", rtol=1e-8, atol=1e-12)
    assert run.v[-1, 0] == pytest.approx(5e-7, rel=1e-4) and run.statistics["steps"] < 1000


def test_errors_come_through():
    pytest.importorskip("sksundae", reason="extra [sundials]")

    def wrong(t, state):
        return [np.nan if t > 0.1 else 0.0]

    for integrator in (*SUNDIALS, "scipy:RK45"):
        with pytest.raises(pc.EvaluationError, match=r"effect 'wrong': its force on coordinate 'hinge0' is nan at t = 0\.\d+ s"):
            pc.Scene(pc.chain(1)).add(wrong).simulate(1.0, [0.0], [1.0], integrator=integrator)
