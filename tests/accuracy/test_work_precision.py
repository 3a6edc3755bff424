"""Work and precision: errors against closed forms, orders of convergence, energy, and a right-hand side of one's own."""

import csv
import json

import matplotlib
import numpy as np
import pytest

import pycraft as pc
from pycraft.accuracy.tables.work_precision import TOLERANCES, WorkPrecisionTable, trajectory_error, work_precision
from pycraft.dynamics.integrator_names import integrator_named

matplotlib.use("Agg")
PERIOD = 2.367841947576
"""Of a pendulum of 1 m and 1 kg, released horizontally under 9.81 m/s²: s (IFToMM benchmark problem)."""


def pendulum():
    model = pc.Multibody("pendulum")
    model.add_body("bob", axis=(0, 0, 1), mass=1.0, com=(1, 0, 0), inertia=np.zeros((3, 3)))
    model.gravity = (0, -9.81, 0)
    return model


@pytest.fixture(scope="module")
def swing():
    """One period, released horizontally: it ends where it began."""
    integrators = ["dopri5", "dop853", "rk4", "scipy:DOP853"]
    return work_precision(pendulum(), [0.0], duration=PERIOD, integrators=integrators, steps=[0.04, 0.02, 0.01], seconds=0)


def rows(table, integrator):
    return [row for row in table if row["integrator"] == integrator]


def test_the_reference_knows_its_error(swing):
    assert swing.reference_error < 1e-12 and "extended" in swing.reference
    model = pendulum()
    end = model.integrate_ode([0.0], [0.0], [0.0, PERIOD], integrator="dop853", rtol=1e-16, atol=1e-16, precision="extended").q[-1]
    assert abs(end[0]) < 1e-11  # the period is given to 13 digits


@pytest.mark.parametrize("integrator", ["dopri5", "dop853", "scipy:DOP853"])
def test_errors_fall_with_the_tolerance(swing, integrator):
    found = rows(swing, integrator)
    assert [row["tolerance"] for row in found] == list(TOLERANCES) and all(row["step"] is None and not row["refused"] for row in found)
    errors, drifts = ([row[key] for row in found] for key in ("error", "drift"))
    assert errors[-1] < 1e-8 and errors[0] > 1e3 * errors[-1] and drifts[-1] < 1e-8 and drifts[0] > 10 * drifts[-1]
    assert all(a > b for a, b in zip(errors, errors[2:], strict=False))
    evaluations = [row["evaluations"] for row in found]
    assert evaluations == sorted(evaluations) and all(row["seconds"] > 0 for row in found)


def test_errors_fall_with_the_order_of_the_method(swing):
    errors = [row["error"] for row in rows(swing, "rk4")]
    assert [row["step"] for row in rows(swing, "rk4")] == [0.04, 0.02, 0.01]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 4) < 0.5)


def test_an_error_is_measured_against_the_truth(swing):
    """Of a pendulum from the horizontal: θ(t) by the first integral, sampled at the same times."""
    from scipy.special import ellipj

    times = np.linspace(0, PERIOD, 9)
    # sin(θ'/2) = sin(π/4) sn(K - ωt), θ' from the vertical; θ from the horizontal
    from scipy.special import ellipk

    m = 0.5
    sn = ellipj(ellipk(m) - np.sqrt(9.81) * times, m)[0]
    exact = 2 * np.arcsin(np.sqrt(m) * sn) - np.pi / 2
    for row in rows(swing, "dopri5")[:3]:
        run = pendulum().integrate_ode([0.0], [0.0], times, integrator="dopri5", rtol=row["tolerance"], atol=row["tolerance"])
        assert row["error"] == pytest.approx(np.abs(run.q[:, 0] - exact).max(), rel=1e-3)


def test_on_the_group():
    """A free body turns and flies: quaternions compare by the rotation between them, whatever their sign."""
    top = pc.tree([-1], ["free"], seed=3)
    state = top.random_state(1)
    table = work_precision(
        top, state, duration=1.0, integrators=["dopri5", "rkmk4", "scipy:RK45"], tolerances=[1e-6], steps=[0.01], seconds=0
    )
    assert all(0 < row["error"] < 1e-3 and row["drift"] < 1e-3 for row in table)
    q = np.array([state.q, top.integrate(state.q, 0.3 * np.ones(6))])
    flipped = q.copy()
    flipped[:, :4] *= -1
    assert trajectory_error(top, q, flipped) < 1e-14
    assert trajectory_error(top, q[:1], top.integrate(q[0], 0.1 * np.ones(6))[None]) == pytest.approx(0.1)


def test_a_right_hand_side_of_ones_own():
    """A damped pendulum passed as a callable: the energy is not conserved, and a scene's own may be given."""
    model = pendulum()

    def damped(t, q, v):
        return model.forward_dynamics(q, v, -0.3 * v)

    options = dict(duration=1.0, integrators=["scipy:RK45", "dopri5", "rosenbrock4"], tolerances=[1e-4, 1e-8], seconds=0)
    table = work_precision(model, [0.2], right_hand_side=damped, **options)
    answered = [row for row in table if not row["refused"]]
    assert [row["integrator"] for row in answered] == ["scipy:RK45"] * 2 + ["dopri5"] * 2
    assert all(row["drift"] is None for row in answered) and answered[1]["error"] < 1e-2 * answered[0]["error"]
    assert all("'rosenbrock4': takes more than accelerations at states" in row["refused"] for row in rows(table, "rosenbrock4"))
    run = model.integrate_ode([0.2], [0.0], np.linspace(0, 1, 9), damping=[0.3], integrator="dop853", rtol=1e-13, atol=1e-13)
    own = work_precision(model, [0.2], right_hand_side=damped, energy=lambda q, v: 1.0, **options)
    assert [row["drift"] for row in own if not row["refused"]] == [0.0] * 4
    for name in ("scipy:DOP853", "dop853", "rk4"):
        by_hand = model._trajectory(integrator_named(name), [0.2], [0.0], run.t, rtol=1e-12, atol=1e-12, step=1e-3, right_hand_side=damped)
        assert np.abs(by_hand.q - run.q).max() < 1e-10 and by_hand.evaluations > 20


def test_forces_do_work():
    table = work_precision(pendulum(), [0.0], tau=[1.0], duration=0.5, integrators=["dopri5"], tolerances=[1e-6], seconds=0)
    assert table[0]["drift"] is None and table[0]["error"] < 1e-4
    assert "not conserved" in table.plot()[1].texts[0].get_text()


def resting(t, q, v):
    return np.zeros(1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (dict(duration=0.0), "duration=0"),
        (dict(duration=np.inf), "duration=inf: give a positive, finite number of seconds"),
        (dict(duration="1"), "duration='1'"),
        (dict(integrators=["euler"]), "integrator 'euler' is not there; there are 'dopri5'.*'scipy:RK45'"),
        (dict(integrators="scipy:RK9"), "integrator 'scipy:RK9' is not there"),
        (dict(integrators=[]), "integrators is empty"),
        (dict(tolerances=[]), "tolerances is empty"),
        (dict(tolerances=0.0), "tolerances: 0.0 is not a positive, finite tolerance"),
        (dict(tolerances=[1e-3, np.nan]), "tolerances: nan is not"),
        (dict(steps=[-0.1]), "steps: -0.1 is not a positive"),
        (dict(seconds=-1), "seconds=-1"),
        (dict(form="slow"), "form 'slow' is not there"),
        (dict(refine=-1), "refine=-1"),
        (dict(q=[np.nan]), "q of hinge 'bob': entry 0 is nan"),
        (dict(q=[0.0, 1.0]), "q of 'pendulum' takes 1 numbers"),
        (dict(q=[[0.0], [1.0]]), "from one state of 'pendulum', not from a batch"),
        (dict(tau=[1.0, 2.0]), "tau of 'pendulum' takes 1 numbers"),
        (dict(right_hand_side=3), "right_hand_side must be a function, not 3"),
        (dict(right_hand_side=lambda t, q, v: np.zeros(2)), r"right_hand_side\(0, q, v\) has shape \(2,\)"),
        (dict(right_hand_side=lambda t, q, v: np.array([np.nan])), "is nan at coordinate 'bob'"),
        (dict(energy=lambda q, v: np.nan), "energy.* is nan at the initial state"),
        (dict(energy=1.0), "energy must be a function, not 1.0"),
    ],
)
def test_wrong_arguments(options, words):
    """Before anything is measured."""
    with pytest.raises(pc.Error, match=words):
        work_precision(pendulum(), **{"q": [0.0], "progress": lambda _: pytest.fail("measured"), **options})


def test_what_is_no_model():
    with pytest.raises(TypeError, match="work_precision takes a model"):
        work_precision("panda", [0.0])
    with pytest.raises(pc.ModelError, match="'nothing' has no coordinates"):
        work_precision(pc.Multibody("nothing"), [])


def test_energy_that_is_lost_on_the_way_is_told():
    energies = iter([1.0, 1.0, np.nan, *[1.0] * 20])
    table = work_precision(
        pendulum(), [0.0], duration=0.2, energy=lambda q, v: next(energies), integrators="dopri5", tolerances=1e-4, seconds=0
    )
    assert len(table) == 1 and "energy(q, v) is nan along the motion" in table[0]["refused"]
    with pytest.raises(ValueError, match="every row is refused"):
        table.fastest(1)


def test_the_picture_of_nothing():
    table = work_precision(pendulum(), [0.0], right_hand_side=resting, duration=0.2, integrators="rosenbrock4", tolerances=1e-4, seconds=0)
    left, right = table.plot()
    assert not left.axison and not right.axison and "takes more than accelerations at states" in left.texts[0].get_text()
    assert "rosenbrock4 at 1e-04" in sum(table.refusals.values(), [])


def test_the_title_and_what_is_kept_with_it(swing):
    assert swing.title == f"Integration of pendulum, {PERIOD:g} s, gravity (0, -9.81, 0) m/s², from rest"
    assert swing.about["gravity"] == [0, -9.81, 0] and swing.about["q"] == [0] and swing.about["v"] == [0]


def test_ways_out(swing, tmp_path):
    swing.to_csv(tmp_path / "w.csv")
    with open(tmp_path / "w.csv", newline="", encoding="utf-8") as file:
        read = list(csv.DictReader(file))
    assert [list(r) for r in read] == [list(WorkPrecisionTable.columns)] * len(swing)
    assert [float(r["error"]) for r in read] == [row["error"] for row in swing]
    data = json.loads(swing.to_json())
    assert data["rows"] == swing.rows and data["reference_error"] == swing.reference_error and data["model"] == "pendulum"
    for word in ("Integration of pendulum", "dop853", "energy drift", "0.02 s", "1e-09"):
        assert word in repr(swing) and word in swing._repr_html_()
    best = swing.fastest(1e-6)
    assert best["error"] <= 1e-6 and all(row["seconds"] >= best["seconds"] for row in swing if row["error"] <= 1e-6)
    with pytest.raises(ValueError, match="at most 1e-30"):
        swing.fastest(1e-30)


def test_the_plot(swing):
    import matplotlib.pyplot as plt

    left, right = swing.plot()
    for ax in (left, right):
        assert ax.get_xscale() == ax.get_yscale() == "log" and ax.get_xlabel() and ax.get_ylabel()
        assert {line.get_label() for line in ax.lines} == {"dopri5", "dop853", "rk4", "scipy:DOP853"}
    low, high = left.get_ylim()
    assert low < swing.reference_error and high > max(row["error"] for row in swing)
    plt.close(left.figure)
