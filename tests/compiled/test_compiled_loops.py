"""Accelerations on loops compiled for one model: equal to the call on states of all its branches, with the same refusals."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.compiled import Compiled
from pycraft.compiled.kernels import loops_graph
from pycraft.models.linkages import bricard, n_four_bar, slider_crank
from support.graphs import evaluated

EPS = np.finfo(float).eps


@pytest.fixture(scope="module", autouse=True)
def libraries(tmp_path_factory):
    """A folder of their own: what a test compiles, it compiles."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYCRAFT_CACHE", str(tmp_path_factory.mktemp("libraries")))
        yield


@pytest.fixture
def left(monkeypatch):
    """How often the ordinary call answered."""
    calls, ordinary = [], Compiled.__call__

    def counted(self, *given, **named):
        calls.append(given)
        return ordinary(self, *given, **named)

    monkeypatch.setattr(Compiled, "__call__", counted)
    return calls


def ball_and_gear():
    """A ball and a free body, closed by a ball, and two arms in gear: coordinates of q that are more than those of v."""
    model = pc.tree([-1, 0, -1, -1, -1], ["ball", "pin", "free", "pin", "pin"], seed=5, name="ball and gear")
    model.add_loop("body1", "body2", hinge="ball", point=(0.2, 0.1, 0), position=(0.1, 0, 0.3), name="ball")
    model.add_coupling({"hinge3": 1.0, "hinge4": -3.0}, name="gear")
    model.hinges["hinge3"].rotor_inertia = 0.2
    return model


def wheel():
    model = pc.Multibody("wheel")
    model.add_body("wheel", hinge="free", mass=2.0, inertia=np.diag([0.1, 0.1, 0.2]))
    model.q = [np.cos(0.7), np.sin(0.7), 0, 0, 0, 0, 0.5]
    model.add_rolling("wheel", None, "wheel", radius=0.5, name="rolls")
    return model


def welded():
    """A chain that is closed by a weld, and a slider: quaternions of rows, one row more than freedoms, which none is redundant among."""
    model = pc.tree([-1, 0, 1, 2, 3, 4, 5], ["pin", "universal", "pin", "gimbal", "pin", "pin", "pin"], seed=2, name="welded")
    state = model.random_state(seed=1)
    end = model.pose("body6", state.q)
    model.add_loop("body6", hinge="weld", placement=end, name="weld")
    model.q = state.q
    return model


MODELS = {
    "four-bars": lambda: n_four_bar(3), "slider-crank": slider_crank, "bricard": bricard, "ball and gear": ball_and_gear, "wheel": wheel,
    "welded": welded,
}  # fmt: skip


def states(model, count, far=0.3, seed=0):
    rng = np.random.default_rng(seed)
    found = [model.assemble(model.integrate(model.q, far * rng.uniform(-1, 1, model.nv)), rng.normal(size=model.nv)) for _ in range(count)]
    return np.array([s.q for s in found]), np.array([s.v for s in found]), rng.normal(size=(count, model.nv))


def bound(model, Q):
    """Rounding of sums of nv and rows terms, times the condition of what is solved: of ℳ and of the independent rows, squared by λ."""
    worst = 1.0
    for q in Q:
        singular = np.linalg.svd(model.loops.jacobian(q), compute_uv=False)
        singular = singular[singular > 1e-6 * singular[0]]
        worst = max(worst, np.linalg.cond(model.mass_matrix(q)) * (singular[0] / singular[-1]) ** 2)
    return 100 * (model.nv + len(model.loops.rows)) * EPS * worst


@pytest.mark.parametrize("name", MODELS)
def test_what_is_written_down_is_the_call(name):
    model = MODELS[name]()
    model.gravity = (0.4, -9.0, -1.0)
    Q, V, U = states(model, 8)
    graph, results = loops_graph(model, 400_000)
    found, sound = evaluated(graph, results, {"q": Q, "v": V, "tau": U})
    wanted = model.constrained_dynamics(Q, V, U).vdot
    assert sound.mean() > 0.7  # decided as beside the model's own state
    assert np.abs(found - wanted)[sound].max() <= bound(model, Q) * np.abs(wanted).max()


def test_one_state_and_batches_are_compiled(left):
    model = n_four_bar(2, angle=0.9)
    model.gravity = (0, -9.81, 0)
    compiled = model.compile("constrained_dynamics")
    Q, V, U = states(model, 21)
    wanted = model.constrained_dynamics(Q, V, U).vdot
    out = np.empty_like(wanted)
    assert compiled(Q, V, U, out=out) is out and not left
    for found in (out, compiled(Q, V, U), [compiled(*given) for given in zip(Q, V, U, strict=True)]):
        assert np.abs(found - wanted).max() <= bound(model, Q) * np.abs(wanted).max()
    assert not left and compiled.arguments == ("q", "v", "tau") and compiled.operations < 2000


def test_where_it_is_not_sure_the_call_answers(left):
    """At the flat four-bar the rank is one less: of one motion there are accelerations, another one is refused by the row's name."""
    model = pc.chain(3)
    model.add_loop("body2", hinge="pin", point=(1, 0, 0), position=(0, 0, 0), name="closure")
    model.gravity = (0, -10, 0)
    model.q = model.assemble([1.0, -1.0, -2.0], fix="hinge0").q
    compiled = model.compile("constrained_dynamics")
    flat, still = np.array([0, 0, np.pi]), np.zeros(3)
    compiled(np.array(model.q), still, still)
    assert not left
    assert compiled(flat, np.array([1.0, -1.0, 1.0]), still).round(9).tolist() == [-12.0, 12.0, -12.0] and len(left) == 1
    with pytest.raises(pc.EvaluationError, match="'closure: along x'"):
        compiled(flat, np.array([1.0, 1.0, -3.0]), still)
    with pytest.raises(pc.ModelError, match="v"):
        compiled(flat, np.full(3, np.nan), still)
    out = np.empty(3)
    assert compiled(flat, np.array([1.0, -1.0, 1.0]), still, out=out) is out and out.round(9).tolist() == [-12.0, 12.0, -12.0]
    with pytest.raises(pc.ModelError, match="out="):
        compiled(flat, np.array([1.0, -1.0, 1.0]), still, out=np.empty(4))


@pytest.mark.parametrize("masses", [(1, 1e6, 1e-6), (1e-6, 1e-6, 1e12), (1e12, 1e-6, 1), (1e-6, 1e12, 1)])
def test_heavy_and_light_rods_keep_what_the_certificates_promise(masses):
    """Against four times the digits: 64 √ε of the largest, as cpp/dynamics/constrained_dynamics.h has it."""
    model = n_four_bar(1)
    model.gravity = (0, -9.81, 0)
    for body, mass in zip(model.bodies, masses, strict=True):
        model.bodies[body].inertia = mass * np.array(model.bodies[body].inertia)
        model.bodies[body].mass *= mass
    graph, results = loops_graph(model, 400_000)
    rng = np.random.default_rng(1)
    angles, speeds = rng.uniform(0.4, 2.6, 8), rng.normal(size=8)
    Q, V = (np.column_stack([x, -x, x]) for x in (angles, speeds))
    U = rng.normal(size=(8, 3))
    found, sound = evaluated(graph, results, {"q": Q, "v": V, "tau": U})
    wanted = model.constrained_dynamics(Q, V, U, precision="quad").vdot
    assert sound.all() and np.abs(found - wanted).max() <= 64 * np.sqrt(EPS) * np.abs(wanted).max()


def test_what_leaves_the_range_of_its_certificates_is_left_to_the_call(left):
    """Squares of what has cancelled are no numbers there: they would say yes to anything."""
    model = slider_crank()
    compiled, q, still = model.compile("constrained_dynamics"), np.array(model.q), np.zeros(model.nv)
    moving = model.assemble(model.q, np.ones(model.nv)).v
    cases = [(1e78 * moving, still, 1e-100), (still, 1e155 * np.arange(1.0, model.nv + 1), 1e-120)]
    for count, (v, tau, scale) in enumerate(cases, 1):
        wanted = model.constrained_dynamics(q, v, tau).vdot
        assert np.array_equal(compiled(q, v, tau), wanted) and len(left) == count
        near = compiled(q, np.sqrt(scale) * v, scale * tau)  # accelerations below 2^200
        assert np.abs(near - scale * wanted).max() <= scale * bound(model, [q]) * np.abs(wanted).max() and len(left) == count


def test_a_state_that_misses_its_rows_is_refused_as_by_the_call(left):
    """Rows that ask different accelerations of one motion: two gears of one pair that disagree at speed."""
    model = pc.chain(2)
    model.add_coupling({"hinge0": 1.0, "hinge1": -1.0}, name="gear")
    model.add_coupling({"hinge0": [0, 1.0, 0.5], "hinge1": -1.0}, name="cam")
    with pytest.raises(pc.EvaluationError, match="gear|cam"):
        model.constrained_dynamics([0, 0], [1.0, 1.0])
    model.loops.remove("cam")
    compiled = model.compile("constrained_dynamics")
    rest = np.zeros(2)
    assert compiled(rest, np.ones(2), np.array([1.0, 0.0])).shape == (2,) and not left


def test_it_is_of_the_loops_as_they_were(left):
    model = n_four_bar(1)
    compiled = model.compile("constrained_dynamics")
    q, v, tau = np.array(model.q), np.zeros(3), np.ones(3)
    before = compiled(q, v, tau)
    model.loops.remove("loop1")
    assert np.array_equal(compiled(q, v, tau), before) and not left
    tree = model.compile("constrained_dynamics")
    assert np.abs(tree(q, v, tau) - model.forward_dynamics(q, v, tau)).max() < 1e-13


def test_what_cannot_be_compiled_says_so():
    screw = pc.chain(6)
    screw.add_loop("body5", hinge="screw", pitch=0.1, position=(5.0, 0, 0), name="screw")
    with pytest.raises(pc.ModelError, match="loop 'screw' cannot be compiled: a screw counts its turns; the call itself"):
        screw.compile("constrained_dynamics")
    arm = pc.chain(6)
    rail = [{"kind": "pin", "axis": (0, 0, 1)}, {"kind": "slider", "axis": (1, 0, 0)}]
    arm.add_loop("body5", hinge="custom", subhinges=rail, position=(5.0, 0, 0), name="rail")
    with pytest.raises(pc.ModelError, match="loop 'rail' cannot be compiled: the nearest place of its hinge is sought"):
        arm.compile("constrained_dynamics")
    cam = pc.chain(2)
    cam.add_coupling(["hinge0", "hinge1"], function=lambda q: (q[0] - q[1], [1.0, -1.0], np.zeros((2, 2))), name="cam")
    with pytest.raises(pc.ModelError, match="loop 'cam' cannot be compiled: it is a function of Python's"):
        cam.compile("constrained_dynamics")
    apart = pc.chain(1)
    apart.add_loop("body0", hinge="ball", position=(0, 0, 2), name="off")
    with pytest.raises(pc.ModelError, match="cannot be assembled"):
        apart.compile("constrained_dynamics")


def test_what_is_too_large_says_so():
    with pytest.raises(pc.EvaluationError, match="dynamics on the loops of .* more than 400000 operations.*constrained_dynamics"):
        n_four_bar(600).compile("constrained_dynamics")


def test_no_coordinates_and_no_bodies():
    empty = pc.Multibody("empty")
    assert empty.compile("constrained_dynamics")(np.zeros(0), np.zeros(0), np.zeros(0)).shape == (0,)
