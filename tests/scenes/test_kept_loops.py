"""Scenes on loops against closed forms and published benchmarks; energy, drift, redundant rows, singular states; what is refused.

Tolerances: unless stated otherwise, a hundred times the tolerance of the run's steps, because errors add up over the motion.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pycraft as pc
from pycraft.models import linkages
from support.linkages import close, dense

E, M = pc.effects, pc.mechanisms
MECHANISMS = {
    "n_four_bar": 5,
    "andrews": 7,
    "bricard": 5,
    "slider_crank": 3,
    "peaucellier": 7,
    "five_bar": 4,
    "stewart": 24,
    "delta": 21,
    "bicycle": 9,
}
FREE = {
    "n_four_bar": 1,
    "andrews": 1,
    "bricard": 1,
    "slider_crank": 1,
    "peaucellier": 1,
    "five_bar": 2,
    "stewart": 6,
    "delta": 3,
    "bicycle": 3,
}


by_each_method = pytest.mark.parametrize("method", ["augment", "embed"])


@by_each_method
@pytest.mark.parametrize("name", MECHANISMS)
def test_mechanisms_start_on_their_loops_and_stay_there(name, method):
    scene = getattr(M, name)(method=method)
    model = scene.model
    assert model.nv == MECHANISMS[name] and model.mobility(model.q).degrees_of_freedom == FREE[name]
    run = scene.simulate(0.01 if name == "andrews" else 0.3, rtol=1e-9, atol=1e-11, progress=False)
    size = np.abs(run.energy["kinetic"]).max() + np.abs(run.energy["potential"]).max()
    assert np.ptp(run.balance) < 1e-6 * size
    assert max(drift.max() for drift in run.drift.values()) < 1e-13
    Qv = np.array([model.loops.jacobian(q) @ v for q, v in zip(run.q, run.v, strict=True)])
    assert np.abs(Qv).max() < 1e-12 * np.abs(run.v).max()
    assert np.abs(run.q - run.q[0]).max() > 1e-3  # it moves


@by_each_method
def test_two_four_bars_pass_the_line_on_their_branch(method):
    """IFToMM A02: cranks turn as one, (N + 1)/3 + N of inertia and (N + 1)/2 + N of weight."""
    reference = solve_ivp(
        lambda t, y: [y[1], -9.81 * 3.5 / 3 * np.cos(y[0])], (0, 10), [np.pi / 2, -1.0], method="DOP853", rtol=1e-13, atol=1e-13
    )
    angle = reference.y[0, -1]
    assert np.abs([np.cos(angle) - 0.3284581115, np.sin(angle) - 0.9445185382]).max() < 1e-9  # as published
    for rtol, error in ((1e-6, 3e-3), (1e-8, 1e-5), (1e-10, 1e-6)):  # near the line the step's own error over the distance is felt
        run = M.n_four_bar(2, method).simulate(10.0, rtol=rtol, atol=rtol, progress=False)
        assert abs(run.balance[0] - 35.835) < 1e-12
        assert abs(run.q[-1, 0] - angle) < error
        assert np.ptp(run.balance) < 10 * error
        assert np.abs(run.q[:, 0] + run.q[:, 1]).max() < 10 * error  # the rod stays level


@by_each_method
def test_forty_four_bars(method):
    run = M.n_four_bar(40, method).simulate(10.0, rtol=1e-8, atol=1e-8, progress=False, energy=False)
    assert np.abs([np.cos(run.q[-1, 0]) - 0.180512227, np.sin(run.q[-1, 0]) - 0.983572741]).max() < 1e-5


@by_each_method
def test_andrews_squeezer_is_where_the_test_set_has_it(method):
    """As printed; 1.1e-9 from it is where both methods lead as tolerances shrink, what the printed digits are good to."""
    run = M.andrews(method).simulate(0.03, rtol=1e-10, atol=1e-10, progress=False)
    published = [15.81077119629904, -15.75637105984298, 0.04082224013073101, 0.5244099658805304, -0.5347301163226948, 1.048080741042263]
    assert np.abs(run.q[-1, :6] - published).max() < 3e-9
    assert abs(run.q[-1, 6] - 0.5347301163226948) < 1e-10


@by_each_method
def test_bricard_keeps_its_energy(method):
    run = M.bricard(method).simulate(10.0, rtol=1e-9, atol=1e-10, progress=False)
    assert np.ptp(run.balance) < 1e-6 * 29.43 and np.ptp(run.energy["kinetic"]) > 1


def test_a_peaucellier_draws_a_straight_line():
    run = M.peaucellier().simulate(0.4, rtol=1e-8, progress=False)
    pen = run.frame("pen").position
    assert np.abs(pen[:, 0] - (1.0 - 0.4**2) / (2 * 0.35)).max() < 1e-12
    assert np.ptp(pen[:, 1]) > 0.2


@by_each_method
@pytest.mark.parametrize("integrator", ["dopri5", "cash-karp54", "dop853", "bulirsch-stoer", "rk4", "rkmk4"])
def test_a_slider_crank_by_every_integrator_at_states(integrator, method):
    step = 1e-4 if integrator in ("rk4", "rkmk4") else None
    run = M.slider_crank(20.0, method=method).simulate(
        0.5, integrator=integrator, step=step, rtol=1e-10, atol=1e-12, t_eval=[0.1, 0.3, 0.5], progress=False
    )
    crank, _, block = run.q.T
    assert np.abs(block - (0.15 * np.cos(crank) + np.sqrt(0.2**2 - (0.15 * np.sin(crank)) ** 2))).max() < 1e-14
    # One coordinate: ½ I(t) ṫ² is constant, so time is an integral.
    reference = _crank_angles([0.1, 0.3, 0.5], 20.0)
    assert np.abs(crank - reference).max() < 1e-7


def _crank_angles(times, speed):
    """Of the slider-crank by its one equation, kinetic energy from the model's mass matrix and the closed-form rates."""
    model = linkages.slider_crank()

    def rates(t):
        bend = np.arcsin(-0.15 * np.sin(t) / 0.2)
        bend_rate = -0.15 * np.cos(t) / (0.2 * np.cos(bend))
        q = [t, bend - t, 0.15 * np.cos(t) + 0.2 * np.cos(bend)]
        J = np.array([1, bend_rate - 1, -0.15 * np.sin(t) - 0.2 * np.sin(bend) * bend_rate])
        return J @ model.mass_matrix(q) @ J

    c = rates(np.pi / 4) * speed**2
    return solve_ivp(
        lambda _, t: [np.sqrt(c / rates(t[0]))], (0, 0.5), [np.pi / 4], t_eval=times, method="DOP853", rtol=1e-11, atol=1e-12
    ).y[0]


@by_each_method
@pytest.mark.parametrize("precision", ["double", "extended", "quad"])
def test_evaluations_keep_both_equations(precision, method):
    model = linkages.stewart()
    assert not np.any(model.gravity)
    state = model.assemble(model.q, np.random.default_rng(2).normal(size=model.nv))
    others = [E.Gravity(), E.RotorInertia(0.3, hinges="upper*"), E.Damping(0.2), E.Wrench("platform", (1, 2, 3, 4, 5, 6))]
    said = pc.Scene(model, precision=precision).add(*others, E.Loop(method=method)).evaluate(state.q, state.v)
    close(sum(said.forces.values()), model.inverse_dynamics(state.q, state.v, said.vdot))  # rotors take what they take
    Q, c = model.loops.jacobian(state.q), model.loops.bias(state.q, state.v)
    assert np.abs(Q @ said.vdot + c).max() < 1e-12 * np.abs(said.vdot).max()
    multipliers = np.linalg.lstsq(Q.T, said.forces["loop"], rcond=None)[0]
    close(Q.T @ multipliers, said.forces["loop"])  # in the rows' span
    alone = pc.Scene(model).add(*others).evaluate(state.q, state.v)
    assert np.abs(alone.vdot - said.vdot).max() > 0.1
    assert said.passes["accelerations"] == 1 and "loop" not in said.passes


def test_gains_are_those_of_their_effects():
    """Velocities that are 1e-5 off are drawn back by 2α Qv, of each effect's loops by its own α."""
    model = linkages.n_four_bar(2, 1.0)
    on = model.assemble(model.q, [1.0, -1, 1, -1, 1])
    v = on.v + 1e-5 * np.array([0.0, 0.3, 1.0, -0.5, 0.7])
    drawn = np.repeat([1e4, 2e3], 5) * 2 * (model.loops.jacobian(on.q) @ v)
    scene = pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Loop("loop1", alpha=1e4), E.Loop("loop2", alpha=2e3))
    vdot = scene.evaluate(on.q, v).vdot
    left = model.loops.jacobian(on.q) @ vdot + model.loops.bias(on.q, v) + drawn
    assert np.abs(left).max() < 1e-11 and np.abs(drawn).max() > 0.01
    model.gravity = (0, -9.81, 0)
    close(pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Loop()).evaluate(on.q, on.v).vdot, dense(model, on.q, on.v, np.zeros(5))[0])


@by_each_method
def test_a_scene_keeps_what_it_is_told_to(method):
    model = linkages.n_four_bar(2, 1.0)
    one = pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Loop("loop2", method=method)).simulate(0.3, progress=False)
    assert one.drift["loop2"].max() < 1e-14 < 1e-2 < one.drift["loop1"].max()
    scene = pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Loop(method=method))
    both = scene.simulate(0.3, progress=False)
    assert both.drift["loop1"].max() < 1e-14
    scene.disable("loop")
    assert (
        scene.evaluate(model.q, np.zeros(5)).passes == pc.Scene(model).add(E.Gravity((0, -9.81, 0))).evaluate(model.q, np.zeros(5)).passes
    )
    free = scene.simulate(0.3, progress=False)
    assert free.drift["loop1"].max() > 1e-2
    scene.enable("loop")
    model.loops.remove("loop1")  # a scene sees what became of the loops
    assert np.array_equal(scene.simulate(0.3, progress=False).q, one.q)


@by_each_method
def test_rolling_is_kept(method):
    """A disc rolls upright around a circle, its centre at the speed ρω; what it moves along is no position's."""
    disc = pc.Multibody("disc")
    disc.add_body("disc", hinge="free", mass=2.0, inertia=np.diag([0.1, 0.1, 0.2]), position=(0, 0, 0.5))
    disc.add_rolling("disc", None, "wheel", radius=0.5, name="ground")
    tilt = np.array([np.cos(np.pi / 4), np.sin(np.pi / 4), 0, 0])  # the disc's z is horizontal
    q = np.array([*tilt, 0, 0, 0])
    state = disc.assemble(q, [0, 0.3, 2.0, 1.0, 0, 0])
    run = pc.Scene(disc).add(E.Gravity(), E.Loop(method=method)).simulate(3.0, state.q, state.v, rtol=1e-10, progress=False)
    assert np.ptp(run.balance) < 1e-7 * abs(run.balance[0])
    Qv = [disc.loops.jacobian(q) @ v for q, v in zip(run.q, run.v, strict=True)]
    assert np.abs(Qv).max() < 1e-13 * np.abs(run.v).max()
    assert np.ptp(run.q[:, 4:6], axis=0).max() > 0.5


@by_each_method
def test_events_checkpoints_and_states_between_steps_are_on_the_loops(method):
    scene = M.slider_crank(20.0, method=method)
    whole = scene.simulate(0.6, rtol=1e-9, progress=False, events={"right": lambda t, s: np.sin(s.q[0])})
    found = whole.events["right"]
    assert len(found.t) > 2 and np.abs(np.sin(found.q[:, 0])).max() < 1e-9
    assert np.abs([scene.model.loops.residual(q) for q in found.q]).max() < 1e-14
    half = scene.simulate(0.3, rtol=1e-9, progress=False)
    on = scene.resume(half, 0.6, progress=False)
    assert np.array_equal(on.q[-1], whole.q[-1]) or np.abs(on.q[-1] - whole.q[-1]).max() < 1e-9
    between = whole.at(np.linspace(0.01, 0.59, 50))
    assert np.abs([scene.model.loops.residual(q) for q in between.q]).max() < 1e-6  # interpolated, not taken back


@by_each_method
def test_files_and_sweeps_have_the_effect(tmp_path, method):
    scene = M.n_four_bar(2, method)
    scene.save(tmp_path / "bars.toml")
    again = pc.load_scene(tmp_path / "bars.toml")
    a, b = (s.simulate(1.0, progress=False) for s in (scene, again))
    assert np.array_equal(a.q, b.q)
    assert repr(E.Loop("loop1", beta=2.0)) == "Loop(loops='loop1', beta=2.0)"


@by_each_method
def test_steps_that_leave_the_loops_are_refused(method):
    """A third of a turn a step, by steps of one size: Newton's steps reach no loop that the state is surely on."""
    with pytest.raises(pc.EvaluationError, match=r"a state has left its loops, off are rows of 'slider-crank': 'wrist: along .*, at t = "):
        pc.mechanisms.slider_crank(20.0, method=method).simulate(3.0, integrator="rk4", step=0.05, progress=False)


def test_both_methods_agree_at_a_state():
    """Every mechanism, moving, under forces that are drawn: θ̈ does not depend on the method, nor does λ of independent rows."""
    for name in MECHANISMS:
        scene = getattr(M, name)()
        model, rng = scene.model, np.random.default_rng(5)
        state = model.assemble(model.q, rng.normal(size=model.nv))
        tau = E.TorqueSource(rng.normal(size=model.nv))
        said = [pc.Scene(model).add(E.Gravity((1, -2, -9)), tau, E.Loop(method=m)).evaluate(state.q, state.v) for m in ("augment", "embed")]
        close(said[1].vdot, said[0].vdot)
        close(said[1].forces["loop"], said[0].forces["loop"])


def by_what_is_free(model, q, v, gravity, rotors=0.0):
    """θ̈ by a basis N of what Q leaves free: N*(ℳ + J)N y = N*(-𝒞 - (ℳ + J)θ̈₀), Q θ̈₀ = -Q̇θ̇."""
    Q, c = model.loops.jacobian(q), model.loops.bias(q, v)
    model.gravity = gravity
    M, h = model.mass_matrix(q) + rotors * np.eye(model.nv), model.inverse_dynamics(q, v, np.zeros(model.nv))
    model.gravity = (0, 0, 0)
    U, s, V = np.linalg.svd(Q)
    rank = int((s > 1e-9 * s[0]).sum())
    particular, N = -V[:rank].T @ ((U.T @ c)[:rank] / s[:rank]), V[rank:].T
    return particular + N @ np.linalg.solve(N.T @ M @ N, N.T @ (-h - M @ particular))


def test_embedded_loops_carry_bodies_without_mass():
    """A crank and a rocker without mass, which a tree refuses: on the loop the coupler moves with them."""
    bars = pc.Multibody("bars")
    bars.add_body("crank", hinge="pin", axis=(0, 0, 1))
    bars.add_body("coupler", parent="crank", hinge="pin", axis=(0, 0, 1), position=(1, 0, 0), mass=2.0, inertia=0.1 * np.eye(3))
    bars.add_body("rocker", parent="coupler", hinge="pin", axis=(0, 0, 1), position=(1, 0, 0))
    bars.add_loop("rocker", hinge="pin", axis=(0, 0, 1), point=(1, 0, 0))
    on = bars.assemble([1.0, -1.4, -1.5], [0.7, 0, 0], fix="crank")
    said = pc.Scene(bars).add(E.Gravity((0, -9.81, 0)), E.Loop(method="embed")).evaluate(on.q, on.v)
    close(said.vdot, by_what_is_free(bars, on.q, on.v, (0, -9.81, 0)))
    nothing = pc.Multibody("nothing")
    for name, carrier in (("crank", None), ("coupler", "crank"), ("rocker", "coupler")):
        nothing.add_body(name, parent=carrier, hinge="pin", axis=(0, 0, 1), position=(1, 0, 0) if carrier else (0, 0, 0))
    nothing.add_loop("rocker", hinge="pin", axis=(0, 0, 1), point=(1, 0, 0))
    with pytest.raises(pc.SingularHingeError, match="nothing with mass moves along coordinate '(crank|coupler|rocker)'"):
        pc.Scene(nothing).add(E.Loop(method="embed")).evaluate(on.q, on.v)


def test_embedded_loops_at_a_singular_state_beside_rotors_and_a_coupling():
    """At the flat four-bars, where a row depends on others, and with hinges coupled by gears."""
    bars = linkages.n_four_bar(2)
    flat, v = np.zeros(5), np.array([1.0, -1, 1, -1, 1])
    said = pc.Scene(bars).add(E.Gravity((0, -9.81, 0)), E.RotorInertia(0.2), E.Loop(method="embed")).evaluate(flat, v)
    close(said.vdot, by_what_is_free(bars, flat, v, (0, -9.81, 0), rotors=0.2))
    tree = pc.tree([-1, 0, 0, 2, 3], ["free", "ball", "pin", "universal", "slider"], seed=3)
    tree.gravity = (0, 0, 0)
    tree.add_coupling({tree.coordinate_names[9]: 1.0, tree.coordinate_names[12]: -2.5}, name="rack")
    on = tree.assemble(tree.random_state(seed=4).q, np.linspace(-1, 1, tree.nv))
    said = pc.Scene(tree).add(E.Gravity((1, -2, -9)), E.Loop(method="embed")).evaluate(on.q, on.v)
    close(said.vdot, by_what_is_free(tree, on.q, on.v, (1, -2, -9)))


def test_implicit_terms_are_in_the_embedded_inertia():
    """h C beside ℳ in a step that is taken implicitly: one trajectory by both methods."""
    runs = []
    for method in ("augment", "embed"):
        scene = M.slider_crank(20.0, method=method).add(E.ImplicitDamping(0.5, hinges="crank"))
        runs.append(scene.simulate(0.05, integrator="semi-implicit-euler", step=1e-3, progress=False))
    assert np.abs(runs[1].v - runs[0].v).max() < 5e-3 * np.abs(runs[0].v).max()  # steps of first order, a tenth of 4 % each
    free = M.slider_crank(20.0, method="embed").simulate(0.05, integrator="semi-implicit-euler", step=1e-3, progress=False)
    assert np.abs(free.v[-1] - runs[0].v[-1]).max() > 0.05 * np.abs(runs[0].v[-1]).max()


def test_prescribed_motion_beside_embedded_loops():
    """A crank that turns ever faster: the other coordinates follow, and what it needs is what augmentation says."""
    ends = []
    for method in ("augment", "embed"):
        model = linkages.slider_crank()
        v0 = model.assemble(model.q, [3.0, 0, 0], fix="crank").v
        scene = pc.Scene(model).add(
            E.Gravity((0, -9.81, 0)), E.Prescribed("crank", lambda t: np.pi / 4 + 3.0 * t + 4.0 * t * t), E.Loop(method=method)
        )
        run = scene.simulate(0.5, model.q, v0, rtol=1e-10, progress=False)
        assert abs(run.q[-1, 0] - (np.pi / 4 + 2.5)) < 1e-14 and run.drift["wrist"].max() < 1e-14
        ends.append((run.q[-1], run.v[-1], scene.evaluate(run.q[-1], run.v[-1], t=0.5).forces))
    close(ends[1][0], ends[0][0])
    for name in ends[0][2]:
        np.testing.assert_allclose(ends[1][2][name], ends[0][2][name], atol=1e-6)  # a hundred times rtol of states, times 100 N


def test_what_loops_cost_and_buy_is_measured_on_them():
    scene = M.five_bar().add(E.Damping(0.05))
    assert "loop" in str(scene.cost())
    assert all("damping" in str(said) for said in (scene.compare(without=["damping"]), scene.needed(1e-6)))


REFUSED = {
    "twice": (lambda m: pc.Scene(m).add(E.Loop(), E.Loop()), pc.ModelError, "'loop' and 'loop_2' both keep loop 'wrist'"),
    "named twice": (lambda m: pc.Scene(m).add(E.Loop(["wrist", "wrist"])), pc.ModelError, "named twice"),
    "unknown": (lambda m: pc.Scene(m).add(E.Loop("wirst")), pc.ModelError, "no loop called 'wirst'"),
    "empty": (lambda m: pc.Scene(m).add(E.Loop([])), pc.ModelError, r"loops=\[\] keeps none"),
    "no loops": (lambda m: pc.Scene(pc.chain(2)).add(E.Loop()), pc.ModelError, "has no loops"),
    "method": (lambda m: pc.Scene(m).add(E.Loop(method="springs")), pc.EvaluationError, "method='springs'"),
    "gains": (lambda m: pc.Scene(m).add(E.Loop(alpha=-1.0)), pc.ModelError, "alpha and beta are finite numbers"),
    "gains of what is embedded": (lambda m: pc.Scene(m).add(E.Loop(method="embed", beta=1.0)), pc.ModelError, "'augment'"),
    "form": (lambda m: _embedded(m, form="ud"), pc.EvaluationError, "by form 'fast'.*method='augment'"),
    "what loops and motions ask": (lambda m: _two_motions(m), pc.EvaluationError, "ask for different accelerations.*'wrist: along"),
    "two methods": (lambda m: _two_methods(), pc.EvaluationError, "by one method"),
    "impulses": (lambda m: pc.Scene(m).add(E.Langevin(1.0, 0.1, 0.01), E.Loop()), pc.ModelError, "'langevin' acts by impulses"),
    "off": (lambda m: _run(m, q=[0, 0, 0.3]), pc.ModelError, "is off row 'wrist: along x'.*assemble"),
    "moves off": (lambda m: _run(m, q=m.q, v=[1, 0, 0]), pc.ModelError, "moves off row 'wrist"),
    "momenta": (lambda m: _run(m, integrator="variational2"), pc.EvaluationError, "'variational2' steps by momenta, and effect 'loop'"),
    "derivatives": (lambda m: _run(m, integrator="rosenbrock4"), pc.EvaluationError, "solves by derivatives.*effect 'loop'"),
    "foreign": (lambda m: _run(m, integrator="DOP853"), pc.EvaluationError, "outside of the core, and effect 'loop'"),
}


def _embedded(model, **how):
    return pc.Scene(model, **how).add(E.Loop(method="embed")).evaluate(model.q, np.zeros(model.nv))


def _two_motions(model):
    """Of the crank and of the block, which it determines."""
    moves = [E.Prescribed("crank", lambda t: (np.pi / 4, 0.0, 3.0)), E.Prescribed("block", lambda t: (model.q[2], 0.0, 5.0))]
    return pc.Scene(model).add(*moves, E.Loop(method="embed")).evaluate(model.q, np.zeros(3))


def _two_methods():
    model = linkages.n_four_bar(2)
    return pc.Scene(model).add(E.Loop("loop1"), E.Loop("loop2", method="embed")).evaluate(model.q, np.zeros(model.nv))


def _run(model, **options):
    return pc.Scene(model).add(E.Loop()).simulate(0.1, progress=False, **options)


@pytest.mark.parametrize("what", REFUSED)
def test_refusals_name_what_it_is(what):
    call, error, text = REFUSED[what]
    with pytest.raises(error, match=text):
        call(linkages.slider_crank())


@pytest.mark.parametrize(
    "call",
    [
        lambda: linkages.n_four_bar(0),
        lambda: linkages.n_four_bar("two"),
        lambda: linkages.n_four_bar(None),
        lambda: M.n_four_bar(2.5),
        lambda: linkages.n_four_bar(2, np.nan),
        lambda: linkages.slider_crank(slider="heavy"),
        lambda: linkages.five_bar(angles=(1.0,)),
        lambda: linkages.peaucellier(angle=np.nan),
        lambda: linkages.slider_crank(0.3, 0.2),
        lambda: linkages.peaucellier(crank=2.0),
        lambda: linkages.five_bar(base=3.0),
        lambda: linkages.stewart(height=-1.0),
        lambda: linkages.delta(position=(0, 0, -2)),
        lambda: linkages.delta(position=(0, 0)),
        lambda: linkages.delta(upper=np.nan),
    ],
)
def test_linkages_that_do_not_close_are_refused(call):
    with pytest.raises(pc.ModelError):
        call()
