"""Inertial parameters from logs: determined parameters, with correct errors, and bodies where least squares give none."""

import sys

import numpy as np
import pytest
from scipy.optimize import minimize

import pycraft as pc
from pycraft.dynamics.inertial_fit import distance, pseudo_inertia
from support.mechanisms import every_kind
from support.oracle import agree


def panda():
    arm = pc.robots.panda()
    arm.gravity = (0, 0, -9.81)
    return arm


def models():
    rotors = pc.tree([-1, 0, 1, 1], ["pin", "ball", "slider", "pin"], seed=3)
    rotors.hinges["hinge3"].rotor_inertia = 0.7
    rotors.gravity = (0.3, -9, 1)
    return {
        "panda": panda(),
        "chain": pc.chain(3),
        "one body": pc.chain(1),
        "rotors": rotors,
        "free": pc.tree([-1, 0, 0], ["free", "pin", "universal"], seed=2),
        "every kind": every_kind(),
    }


def log(model, count=200, seed=0):
    rng = np.random.default_rng(seed)
    q = np.array([model.random_state(rng).q for _ in range(count)])
    v, vdot = rng.uniform(-2, 2, (2, count, model.nv))
    return q, v, vdot, model.inverse_dynamics(q, v, vdot)


def spoiled(model, seed=1):
    """Another prior: masses by a third, inertias with them."""
    rng = np.random.default_rng(seed)
    for body in model.bodies.values():
        share = rng.uniform(0.7, 1.4)
        body._set(mass=body.mass * share, inertia=body.inertia * share)
    return model


@pytest.mark.parametrize("name", models())
def test_without_noise_the_dynamics_come_back(name):
    """To rounding by the condition of the base columns, whatever the prior: forces, and base parameters one by one."""
    model = models()[name]
    data, truth = log(model), model.inertial_parameters()
    elsewhere = log(model, seed=9)
    found = spoiled(model).identify(*data)
    assert np.abs(model.inertial_parameters() - truth).max() > 1e-2  # the prior is another one
    near = 100 * found.condition * np.finfo(float).eps if found.by == "least squares" else 1e-10  # rods have no extent: at the edge
    assert found.condition < 1e5 and found.consistent
    agree(found.predict(*elsewhere[:3]), elsewhere[3], near)
    agree(found.residuals, np.zeros_like(found.residuals), near * np.abs(data[3]).max())
    rank = np.linalg.matrix_rank(np.vstack(list(model.inertial_regressor(*elsewhere[:3]))), tol=1e-6)
    assert len(found.base) == rank
    model_again = found.apply()
    assert model_again is model
    agree(model.inertial_parameters(), found.parameters, 1e-12)
    agree(model.inverse_dynamics(*elsewhere[:3]), elsewhere[3], near)


def test_the_panda_has_its_number_of_base_parameters():
    """43 of an arm of seven pins whose first axis is along gravity, the inertia of its first link about that axis alone among them."""
    found = panda().identify(*log(panda()))
    assert len(found.base) == 43
    assert found.base[0].name == "panda_link1.izz + panda_link2.iyy"
    assert "43 base parameters by least squares" in str(found)


def test_of_a_pendulum_in_closed_form():
    """T = (I + m c²) θ̈ + m c g sin θ: mass by length and inertia about the pin, and nothing of the mass itself."""
    arm = pc.chain(1)
    arm.gravity = (0, -9.81, 0)
    body = arm.bodies["body0"]
    about, moment = body.inertia[2, 2] + body.mass * body.com[0] ** 2, body.mass * body.com[0]
    data = log(arm, 20)
    body.mass = 5.0
    found = arm.identify(*data)
    assert [told.name for told in found.base] == ["body0.mx", "body0.my", "body0.izz"]
    agree([told.value for told in found.base], [moment, 0.0, about], 1e-13)
    columns = np.vstack(list(arm.inertial_regressor(*data[:3])))[:, [1, 2, 9]]
    errors = 0.3 * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    agree([told.standard_error for told in arm.identify(*data, noise=0.3).base], errors, 1e-12)


@pytest.mark.parametrize("given", [True, False])
def test_noise_stays_within_the_standard_errors(given):
    """χ² of 43 parameters, and every one of them within five."""
    model = panda()
    q, v, vdot, tau = log(model, 400)
    truth = {told.name: told.value for told in model.identify(q, v, vdot, tau).base}
    deviations = np.linspace(0.05, 0.2, model.nv) if given else np.full(model.nv, 0.1)
    noisy = tau + deviations * np.random.default_rng(3).normal(size=tau.shape)
    found = spoiled(model).identify(q, v, vdot, noisy, consistent=False, noise=deviations if given else None)
    off = np.array([(told.value - truth[told.name]) / told.standard_error for told in found.base])
    assert np.abs(off).max() < 5
    assert 0.5 < np.mean(off**2) < 1.6  # of 43, correlated: 1 ± 0.22 were they not
    if not given:
        assert found.noise == pytest.approx(0.1, rel=5 / np.sqrt(2 * tau.size))
    else:
        agree(found.noise, deviations)
        weighed = np.sqrt(np.mean((found.residuals / deviations) ** 2))
        assert weighed == pytest.approx(1.0, rel=0.05)


def light_hand(count=60, noise=0.4):
    """A log in which noise makes the mass of a light hand negative, as far as forces tell it."""
    arm = pc.chain(3)
    arm.gravity = (0, -9.81, 0)
    for name in ("body1", "body2"):
        arm.bodies[name]._set(mass=0.02, com=(0.1, 0, 0), inertia=np.eye(3) * 1e-4)
    q, v, vdot, tau = log(arm, count)
    return arm, (q, v, vdot), tau + noise * np.random.default_rng(6).normal(size=tau.shape)


def test_least_squares_may_give_no_body_and_the_nearest_bodies_do():
    pytest.importorskip("clarabel")
    arm, state, tau = light_hand()
    plain = arm.identify(*state, tau, consistent=False)
    assert not plain.consistent and plain.by == "least squares"
    weakest = np.linalg.eigvalsh(pseudo_inertia(plain.parameters.reshape(-1, 10)))[:, 0]
    assert weakest.min() < -1e-3
    with pytest.raises(pc.ModelError, match="not physically possible, first those of 'body0'"):
        plain.apply()
    before = arm.inertial_parameters()
    for regularizer in ("metric", "frobenius"):
        found = arm.identify(*state, tau, regularizer=regularizer)
        assert found.consistent and (found.by == "clarabel" or regularizer == "frobenius")
        assert np.linalg.eigvalsh(pseudo_inertia(found.parameters.reshape(-1, 10)))[:, 0].min() > -1e-12
        assert all(body.mass > 0 for body in found.bodies.values())
        assert np.array_equal(arm.inertial_parameters(), before)  # until it is applied
        rms = [np.sqrt((each.residuals**2).mean()) for each in (plain, found)]
        assert rms[0] <= rms[1] < 1.02 * rms[0]  # hardly worse
    found.apply()
    assert np.linalg.eigvalsh(arm.mass_matrix(state[0][0]))[0] > 0


def test_a_mass_that_is_told_may_come_out_negative():
    pytest.importorskip("clarabel")
    block = pc.Multibody("block")
    block.add_body("block", hinge="slider", axis=(1, 0, 0), mass=0.05)
    vdot = np.random.default_rng(0).uniform(-1, 1, (20, 1))
    state, tau = (np.zeros((20, 1)), np.zeros((20, 1)), vdot), -0.02 * vdot
    assert block.identify(*state, tau, consistent=False).bodies["block"].mass == pytest.approx(-0.02, rel=1e-12)
    assert 0 < block.identify(*state, tau).bodies["block"].mass < 1e-5


def test_friction_does_not_drive():
    pytest.importorskip("clarabel")
    block = pc.Multibody("block")
    block.add_body("block", hinge="slider", axis=(1, 0, 0), mass=1.0)
    v, vdot = np.random.default_rng(0).uniform(-1, 1, (2, 40, 1))
    log = np.zeros((40, 1)), v, vdot, 1.2 * vdot - 0.3 * v
    plain, found = (block.identify(*log, viscous=True, consistent=consistent) for consistent in (False, True))
    agree([plain.viscous[0], plain.bodies["block"].mass], [-0.3, 1.2], 1e-12)
    assert not plain.consistent and found.consistent and 0 <= found.viscous[0] < 1e-6
    alone = (vdot * log[3]).sum() / (vdot**2).sum()  # least squares without friction
    assert found.bodies["block"].mass == pytest.approx(alone, rel=1e-6)
    with pytest.raises(pc.ModelError, match="first those of 'a rotor or friction'"):
        plain.apply()


def test_what_nobody_can_tell_goes_by_the_prior():
    """The mass of a slider and its rotor: δm/δJ = (1.01 m/J)², the prior's sizes, that of a mass without extent lifted by a hundredth."""
    block = pc.Multibody("block")
    block.add_body("block", hinge="slider", axis=(1, 0, 0), mass=2.0)
    block.hinges["block"].rotor_inertia = 0.5
    vdot = np.linspace(-1, 1, 20)[:, None]
    log = np.zeros((20, 1)), np.zeros((20, 1)), vdot, 2.6 * vdot
    found = block.identify(*log, rotors=True)
    dm, dJ = found.bodies["block"].mass - 2.0, found.rotor_inertia[0] - 0.5
    agree([dm + dJ, dm / dJ], [0.1, (1.01 * 2.0 / 0.5) ** 2], 1e-9)
    found = block.identify(*log, rotors=True, regularizer="frobenius")
    agree(found.bodies["block"].mass - 2.0, found.rotor_inertia[0] - 0.5, 1e-9)


def test_the_nearest_bodies_are_the_least_of_all():
    """Against a search over Cholesky factors of pseudo-inertias, which are those of bodies by construction."""
    pytest.importorskip("clarabel")
    arm, state, tau = light_hand()
    weight = 0.3
    found = arm.identify(*state, tau, regularization=weight)
    plain = arm.identify(*state, tau, consistent=False)
    Y, prior = np.vstack(list(arm.inertial_regressor(*state))), arm.inertial_parameters()
    W, sigma = distance(prior.reshape(-1, 10), np.zeros(0), "metric"), plain.noise[0]

    def cost(pi):
        return ((Y @ pi - tau.ravel()) ** 2).sum() / sigma**2 + weight * (pi - prior) @ W @ (pi - prior)

    lower = np.tril_indices(4)
    scale = [np.linalg.cholesky(L + 1e-6 * np.eye(4)) for L in pseudo_inertia(found.parameters.reshape(-1, 10))]

    def bodies(x):
        pi = []
        for part, C in zip(x.reshape(-1, 10), scale, strict=True):
            factor = np.zeros((4, 4))
            factor[lower] = part
            L = C @ factor @ factor.T @ C.T
            inertia = np.trace(L[:3, :3]) * np.eye(3) - L[:3, :3]
            pi += [L[3, 3], *L[:3, 3], *inertia[np.triu_indices(3)]]
        return np.array(pi)

    start = np.tile(np.eye(4)[lower], 3)
    searched = minimize(lambda x: cost(bodies(x)), start * 1.1, method="BFGS", options={"maxiter": 3000, "gtol": 1e-6})
    least = cost(found.parameters)
    assert least < searched.fun * (1 + 1e-6)  # nothing that was found is less
    assert searched.fun < least * (1 + 1e-3)  # and the search comes near
    assert least > cost(plain.parameters) or not plain.consistent


def test_the_metric_knows_no_units_and_no_axes():
    """tr(L₀⁻¹ΔL L₀⁻¹ΔL) as it stands, the same in axes that are turned, moved and measured in inches."""
    rng = np.random.default_rng(2)
    roots = rng.normal(size=(2, 4, 4))
    L0, L1 = (root @ root.T + np.eye(4) for root in roots)

    def parameters(L):
        inertia = np.trace(L[:3, :3]) * np.eye(3) - L[:3, :3]
        return np.r_[L[3, 3], L[:3, 3], inertia[np.triu_indices(3)]]

    def between(A, B):
        W, off = distance(parameters(A)[None], np.zeros(0), "metric"), parameters(B) - parameters(A)
        return off @ W @ off

    agree(pseudo_inertia(parameters(L0)), L0, 1e-14)
    lifted = L0 + 1e-2 * np.diag([np.trace(L0[:3, :3]) / 3] * 3 + [L0[3, 3]])
    relative = np.linalg.solve(lifted, L1 - L0)
    agree(between(L0, L1), np.trace(relative @ relative), 1e-12)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    to = np.eye(4)
    to[:3, :3] = 39.37 * turn
    agree(between(to @ L0 @ to.T, to @ L1 @ to.T), between(L0, L1), 1e-12)
    W, off = distance(parameters(L0)[None], np.zeros(0), "frobenius"), parameters(L1) - parameters(L0)
    agree(off @ W @ off, ((L1 - L0) ** 2).sum(), 1e-12)


def test_friction_and_rotors_beside_inertias():
    model = panda()
    q, v, vdot, tau = log(model)
    J, c, F = np.linspace(0.1, 0.5, 7), np.linspace(0.5, 2, 7), np.linspace(1, 0.2, 7)
    given = tau + J * vdot + c * v + F * np.sign(v)
    found = spoiled(model).identify(q, v, vdot, given, rotors=True, viscous=True, coulomb=True)
    agree(found.viscous, c, 1e-10)
    agree(found.coulomb, F, 1e-10)
    agree(found.rotor_inertia[2:], J[2:], 1e-10)  # those of links 1 and 2 turn as the links do
    agree(found.predict(q, v, vdot), given, 1e-11)
    assert found.base[-1].name == "coulomb.panda_joint7"
    some = model.identify(q, v, vdot, tau + F * np.sign(v) * np.eye(7)[3], coulomb="panda_joint4", viscous=["panda_joint[3-4]"])
    agree(some.coulomb, F * np.eye(7)[3], 1e-10)
    agree(some.viscous, np.zeros(7), 1e-10)
    plain = pc.chain(2)
    plain.gravity = (0, -9.81, 0)
    plain.hinges["hinge0"].rotor_inertia = 0.4
    data = log(plain)
    agree(plain.identify(*data).rotor_inertia, [0.4, 0])
    plain.hinges["hinge0"].rotor_inertia = 0.1
    assert plain.identify(*data, rotors="hinge0", bodies=["body1"], apply=True).model is plain
    agree(plain.hinges["hinge0"].rotor_inertia, [0.4], 1e-10)


def test_some_bodies_alone():
    model = panda()
    data, truth = log(model), model.inertial_parameters()
    model.bodies["panda_link7"].mass = 3.0
    prior = model.inertial_parameters()
    found = model.identify(*data, bodies=model.bodies["panda_link7"])
    assert np.array_equal(found.parameters[:60], prior[:60])
    agree(found.parameters[60:], truth[60:], 1e-10)  # all ten of a hand are determined
    assert len(found.base) == 10 and found.base[0].name == "panda_link7.mass"


def test_of_runs_and_their_tables():
    pytest.importorskip("pandas")
    scene = pc.mechanisms.double_pendulum().add(
        pc.effects.TorqueSource(pc.effects.Harmonic(3.0, 0.9), hinges="upper"),
        pc.effects.TorqueSource(pc.effects.Harmonic(2.0, 1.7, phase=1.0), hinges="lower"),
    )
    model = scene.model
    model.gravity = (0, 0, -9.81)
    run = scene.simulate(8.0, [0.3, 0.2], t_eval=np.linspace(0, 8, 200))
    table, measured = run.to_dataframe(), ["torque_source", "torque_source_2"]
    assert set(measured) < set(run.effects)
    of_run, of_table = model.identify(run, tau=measured), model.identify(table, tau=measured)
    for name in ("parameters", "residuals"):
        assert np.array_equal(getattr(of_run, name), getattr(of_table, name))
    assert np.array_equal(model.identify(table[table.columns[::-1]], tau=measured).parameters, of_table.parameters)  # in any order
    with pytest.raises(pc.ModelError, match="the table has no column 'q.lower'"):
        model.identify(table.drop(columns="q.lower"), tau=measured)
    with pytest.raises(pc.ModelError, match="v.upper is not an array of numbers"):
        model.identify(table.astype({"v.upper": object}).replace({"v.upper": {0.0: "fast"}}), tau=measured)
    first = next(iter(model.bodies.values()))
    first.mass *= 1.4
    again = model.identify(table, tau=measured)
    agree([told.value for told in again.base], [told.value for told in of_run.base], 1e-10)  # accelerations of a run are the scene's own
    assert np.abs(again.residuals).max() < 1e-10
    run = scene.simulate(1.0)
    named = table.rename(columns=lambda name: name.replace("force.torque_source_2.", "tau.") if name.endswith("lower") else name)
    with pytest.raises(pc.ModelError, match="the table has no column 'tau.upper'"):
        model.identify(named)
    with pytest.raises(pc.ModelError, match="for a run, tau= names the effects with measured forces, among gravity"):
        model.identify(run)
    with pytest.raises(pc.ModelError, match="the run has no effect 'motor'; there are gravity"):
        model.identify(run, tau="motor")


def test_what_does_not_excite_is_named():
    model = panda()
    q, v, vdot, _ = log(model)
    still = np.zeros_like(v)
    still[:, 0], faster = v[:, 0], np.zeros_like(vdot)
    tau = model.inverse_dynamics(0 * q, still, faster)
    with pytest.raises(pc.EvaluationError, match=r"200 states of 'panda' determine \d+ of 43 base parameters, and not .*panda_link"):
        model.identify(0 * q, still, faster, tau)
    arm = pc.chain(1)
    arm.gravity = (0, -9.81, 0)
    with pytest.raises(pc.EvaluationError, match=r"determine 2 of 3 base parameters, and not body0\.izz: log motion"):
        arm.identify(np.linspace(-1, 1, 9)[:, None], np.zeros((9, 1)), np.zeros((9, 1)), np.zeros((9, 1)))
    with pytest.raises(pc.EvaluationError, match="1 states of 'panda' determine 7 of 43"):
        model.identify(*(x[0] for x in log(model)))
    with pytest.raises(pc.EvaluationError, match="0 states of 'panda' determine 0 of 43"):
        model.identify(*(x[:0] for x in log(model)))


def test_nothing_to_look_for():
    nothing = pc.Multibody("nothing")
    found = nothing.identify(*np.zeros((4, 3, 0)))
    assert found.parameters.shape == (0,) and found.base == () and found.consistent and found.condition == 1
    welded = pc.Multibody("welded", welds="keep")
    welded.add_body("post", hinge="weld", mass=2.0)
    assert welded.identify(*np.zeros((4, 3, 0))).bodies["post"].mass == 2.0
    arm = pc.chain(2)
    data = log(arm)
    arm.bodies["body1"].mass = 3.0
    alone = arm.identify(*data, bodies=[])
    agree(alone.residuals, data[3] - arm.inverse_dynamics(*data[:3]), 1e-12)


def test_refusals():
    arm = pc.chain(2)
    q, v, vdot, tau = log(arm, 30)
    spoilt = tau.copy()
    spoilt[17, 1] = np.nan
    for arguments, message in [
        ((q, v, vdot, spoilt), r"row 17 of tau is nan at 'hinge1'; leave such rows out \(1 of 30\)"),
        ((q, v, vdot), "tau of 'chain of 2 rods' is missing; a log has q, v, vdot and tau"),
        ((q, v, vdot[:, :1], tau), r"vdot of 'chain of 2 rods' has the shape \(30, 1\); it takes \(K, 2\)"),
        ((q[:9], v, vdot, tau), "q, v, vdot and tau have 9, 30, 30, 30 rows"),
    ]:
        with pytest.raises(pc.ModelError, match=message):
            arm.identify(*arguments)
    for options, message in [
        (dict(bodies="hand"), "hand"),
        (dict(viscous="elbow"), "elbow"),
        (dict(noise=-1.0), "noise must be a positive standard deviation"),
        (dict(noise=[1, 2, 3]), "one for each of 2 coordinates"),
    ]:
        with pytest.raises(pc.ModelError, match=message):
            arm.identify(q, v, vdot, tau, **options)
    found = arm.identify(q, v, vdot, tau)
    with pytest.raises(pc.ModelError, match="vdot is not an array of numbers"):
        found.predict(q[0], v[0], "fast")
    for large in ((q, v, vdot, 1e200 * tau), (q, v, vdot, 1e-200 * tau), (q, v, 1e200 * vdot, tau)):
        with pytest.raises(pc.EvaluationError, match="squares of the log of 'chain of 2 rods' are beyond the range of numbers"):
            arm.identify(*large)
    for options, message in [
        (dict(regularizer="entropy"), "regularizer='entropy': there are 'metric' and 'frobenius'"),
        (dict(regularization=0.0), "regularization=0: it is a positive number"),
    ]:
        with pytest.raises(pc.EvaluationError, match=message):
            arm.identify(q, v, vdot, tau, **options)


def test_without_the_solver(monkeypatch):
    monkeypatch.setitem(sys.modules, "clarabel", None)
    arm, state, tau = light_hand()
    with pytest.raises(ImportError, match=r"need clarabel: pip install 'pycraft-soa\[identify\]'; or take consistent=False"):
        arm.identify(*state, tau)
    assert arm.identify(*state, tau, consistent=False).by == "least squares"
    data = log(pc.chain(2))
    assert pc.chain(2).identify(*data).consistent  # and where least squares give bodies nobody asks for it
