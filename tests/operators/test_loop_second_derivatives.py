"""Second derivatives of rows of loops and of embedded loops, and derivatives by lengths and axes, against differences.

States are doubles: central differences over STEP = 1e-5 leave 1e-10 of third derivatives, some hundreds here, and rounding of states 1e-11;
on the loops, times the condition of Q_d, below 100: 1e-7 and 1e-6 beside the largest entry.
"""

import copy
import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pycraft as pc
from support.closed_models import MODELS, MOVING, closed_four_bar
from support.mechanisms import every_kind

STEP = 1e-5
CURVE = np.array([[-1.0, 0.3, 0.4], [-0.2, -0.3, 0.2], [0.6, 0.1, -0.2], [1.4, 0.3, 0.5]])  # beside a point, by a quarter of a metre
HINGES = ("weld", "pin", "slider", "screw", "universal", "cylindrical", "planar", "ball")


def open_pairs():
    """Loops of many kinds, off the loops, on hinges of all kinds."""
    model, rng = every_kind(seed=1), np.random.default_rng(1)
    bodies = list(model.bodies)
    for i, kind in enumerate(HINGES):
        a, b = [(bodies[5], bodies[10]), (bodies[9], bodies[0]), (None, bodies[8])][i % 3]
        X = model.frame(b).pose(wrt=a)
        X[:3, 3] += 0.2 * rng.normal(size=3)
        model.add_loop(b, a, kind, placement=X, name=f"{kind} loop", **({"pitch": 0.3} if kind == "screw" else {}))
    X = model.frame(bodies[10]).pose(wrt=bodies[5])
    X[:3, 3] += 0.1
    model.add_loop(
        bodies[10], bodies[5], "custom", subhinges=[{"kind": "pin", "axis": (1, 2, 0)}, {"kind": "slider"}], placement=X, name="slot"
    )
    model.add_rolling(bodies[8], kind="wheel", radius=0.2, name="wheel")
    model.add_surface(bodies[9], bodies[3], A=rng.normal(size=(3, 3)), b=rng.normal(size=3), name="bowl")
    model.add_curve(bodies[9], bodies[3], curve=model.frame(bodies[9]).pose(wrt=bodies[3])[:3, 3] + CURVE, name="wire")
    model.add_coupling({"hinge1": [0.0, 1.0, 0.5, 0.3], "hinge2": 1.0}, name="gear")
    return model


def difference(f, there, back):
    return (np.asarray(f(there)) - np.asarray(f(back))) / (2 * STEP)


def close(got, expected, tolerance=1e-8):
    return np.abs(got - expected).max(initial=0) <= tolerance * (1 + np.abs(expected).max(initial=0))


def test_rows_along_coordinates():
    model = open_pairs()
    q = np.array(model.random_state(3).q)
    for letter in (model.soa.Q, model.soa.A):
        for i, j in ((0, 5), (5, 0), (3, 3), (9, 2), (12, 13)):
            first = letter.diff(i)
            step = STEP * np.eye(model.nv)[j]
            there, back = model.integrate(q, step), model.integrate(q, -step)
            expected = difference(lambda at, first=first: first.at(at, precision="quad").dense(), there, back)
            for precision in ("double", "quad"):
                assert close(first.diff(j).at(q, precision=precision).dense().astype(float), expected, 1e-7), (i, j)


def test_along_time():
    """∂ₜ∂ᵢ, ∂ᵢ∂ₜ at v that stays, and ∂ₜ∂ₜ along accelerations; on ball hinges they do not commute."""
    model = open_pairs()
    state = model.random_state(4)
    q, v, vdot = np.array(state.q), np.array(state.v), np.random.default_rng(2).normal(size=model.nv)
    Q = model.soa.Q
    there, back = model.integrate(q, STEP * v), model.integrate(q, -STEP * v)
    assert close(Q.diff(4).dot().at(q, v).dense(), difference(lambda at: Q.diff(4).at(at).dense(), there, back), 1e-7)
    step = STEP * np.eye(model.nv)[4]
    moved = difference(lambda at: Q.dot().at(at, v).dense(), model.integrate(q, step), model.integrate(q, -step))
    assert close(Q.dot().diff(4).at(q, v).dense(), moved, 1e-7)
    # q(t) with velocity v + t v̇: its second order in t is that of integrate along (v + t v̇/2) t, to third
    along = difference(lambda t: Q.dot().at(model.integrate(q, t * (v + t * vdot / 2)), v + t * vdot).dense(), STEP, -STEP)
    assert close(Q.dot().dot(vdot=vdot).at(q, v).dense(), along, 1e-7)
    with pytest.raises(pc.EvaluationError, match="needs the accelerations"):
        Q.dot().dot()
    with pytest.raises(pc.EvaluationError, match="accelerations that are numbers"):
        Q.dot().dot(vdot=pc.vector("a", model.soa.Theta))
    with pytest.raises(pc.EvaluationError, match="differentiated twice"):
        Q.diff(0).diff(1).diff(2)


def with_hinge_moved(model, name, kind, component, subhinge, amount):
    """The model with a hinge's placement, axis or point moved, as `Hinge.symbol` has it, at its own state."""
    described = copy.deepcopy(model.description())
    hinge = next(body["hinge"] for body in described["bodies"] if body["hinge"]["name"] == name)
    unit = np.eye(6)[component]
    if kind == "placement":
        R = np.asarray(hinge["placement"]["rotation"])
        hinge["placement"]["rotation"] = R @ Rotation.from_rotvec(amount * unit[:3]).as_matrix()
        hinge["placement"]["position"] = hinge["placement"]["position"] + R @ (amount * unit[3:])
    else:
        one = hinge["subhinges"][subhinge]
        if kind == "axis":
            one["axis"] = Rotation.from_rotvec(amount * unit[:3]).as_matrix() @ one["axis"]
        else:
            one["point"] = one["point"] + amount * unit[:3]
    other = pc.Multibody.from_description(described)
    other.q, other.v = model.q, model.v
    return other


def parameters(model):
    """(name, kind, component, subhinge) of placements everywhere, and of axes and points of pins, universals and screws."""
    for number, hinge in enumerate(model.hinges.values()):
        yield hinge.name, "placement", number % 6, 0
        yield hinge.name, "placement", (number + 3) % 6, 0
        if hinge.kind in ("pin", "screw", "universal", "custom"):
            for subhinge in range(len(hinge.subhinges)):
                if hinge.subhinges[subhinge]["kind"] in ("pin", "screw"):
                    yield hinge.name, "axis", number % 3, subhinge
                    yield hinge.name, "point", (number + 1) % 3, subhinge


def test_rows_by_lengths_and_axes():
    """Against the rows of models that have a hinge moved."""
    model = open_pairs()
    q = np.array(model.q)
    for name, kind, component, subhinge in parameters(model):
        parameter = model.hinges[name].symbol(kind, component, subhinge)
        there, back = (with_hinge_moved(model, name, kind, component, subhinge, t) for t in (STEP, -STEP))
        for letter in ("Q", "A"):
            expected = difference(lambda m, letter=letter: getattr(m.soa, letter).at(q).dense(), there, back)
            got = getattr(model.soa, letter).diff(parameter)
            assert close(got.at(q).dense(), expected, 1e-7), (name, kind, component, subhinge, letter)
            both = difference(lambda m, letter=letter: getattr(m.soa, letter).diff(5).at(q).dense(), there, back)
            assert close(got.diff(5).at(q).dense(), both, 1e-7), (name, kind, component, subhinge, letter)
            assert close(getattr(model.soa, letter).diff(5).diff(parameter).at(q).dense(), both, 1e-7)


# ------------------------------------------------------------------ embedded loops


def letters(soa):
    return (soa.X_r, soa.H, soa.E, soa.J, (soa.MM + soa.J).inv())


def on_the_loops(model, along, rolls):
    moved = model.integrate(model.q, along)
    return moved if rolls else model.assemble(moved, starts=1).q


@pytest.mark.parametrize("name", MODELS)
def test_embedded_along_coordinates(name):
    model = MODELS[name]()
    soa, names = model.soa.embedded(), None
    names, X = soa._source.coordinate_names, soa.X_r.dense()
    rolls = not model.loops.of_positions.all()
    count = len(names)
    for i, j in {(0, 0), (0, count - 1), (count - 1, 0), (count // 2, count - 1)}:
        there, back = (on_the_loops(model, t * X[:, j], rolls) for t in (STEP, -STEP))
        for op in letters(soa):
            expected = difference(lambda at, op=op, i=i: op.diff(names[i]).at(at).dense(), there, back)
            assert close(op.diff(names[i], names[j]).dense(), expected, 1e-6), (op, i, j)
    assert soa.X_r.diff(names[0], names[0]).at(model.q, precision="quad").dense().shape == X.shape


@pytest.mark.parametrize("name", MODELS)
def test_embedded_along_time(name):
    """Quantities that depend on v: θ̇_r is fixed along coordinates, and changes with θ̈_r along time."""
    model = MODELS[name]()
    soa = model.soa.embedded()
    names, X, v = soa._source.coordinate_names, soa.X_r.dense(), np.array(model.v)
    rolls = not model.loops.of_positions.all()
    rates = v[soa.independent]
    vdot_r = np.random.default_rng(3).normal(size=len(rates))
    vdot = X @ vdot_r + soa.X_r_dot.dense() @ rates

    def of(op, q, rates):
        return op.at(q, soa.X_r.at(q).dense() @ rates).dense()

    for i in {0, len(names) - 1}:
        there, back = (on_the_loops(model, t * X[:, i], rolls) for t in (STEP, -STEP))
        for op in (soa.X_r_dot, soa.a, soa.theta_dot, soa.H.dot(), soa.H @ soa.phi @ soa.b):
            expected = difference(lambda at, op=op: of(op, at, rates), there, back)
            assert close(op.diff(names[i]).dense(), expected, 1e-6), (op, i)
        there, back = (on_the_loops(model, t * v, rolls) for t in (STEP, -STEP))
        expected = difference(lambda at, i=i: soa.X_r.diff(names[i]).at(at).dense(), there, back)
        assert close(soa.X_r.diff(names[i]).dot().dense(), expected, 1e-6)
    path = [(t, on_the_loops(model, t * v + t * t / 2 * vdot, rolls)) for t in (STEP, -STEP)]
    for op in (soa.X_r_dot, soa.a, soa.theta_dot, soa.H @ soa.phi @ soa.b):
        ends = [of(op, q, rates + t * vdot_r) for t, q in path]
        assert close(op.dot(vdot=vdot_r).dense(), (ends[0] - ends[1]) / (2 * STEP), 1e-6), op
    with pytest.raises(pc.EvaluationError, match="needs the accelerations"):
        soa.a.dot()
    with pytest.raises(pc.ModelError, match=f"takes {len(names)} numbers"):
        soa.a.dot(vdot=np.zeros(len(names) + 1))


@pytest.mark.parametrize("name", ["four-bar", "spatial", "gears"])
def test_embedded_by_lengths_and_axes(name):
    """Independent coordinates stay, dependent ones keep the loops: against models with a hinge moved, assembled anew."""
    model = MODELS[name]()
    soa = model.soa.embedded()
    held = [model.coordinate_names[i] for i in soa.independent]
    done = 0
    for hinge, kind, component, subhinge in parameters(model):
        parameter = model.hinges[hinge].symbol(kind, component, subhinge)
        try:
            closed = [with_hinge_moved(model, hinge, kind, component, subhinge, t) for t in (STEP, -STEP)]
            for other in closed:
                other.q = other.assemble(other.q, fix=held, starts=1).q
        except pc.ModelError:
            with pytest.raises(pc.EvaluationError, match="hangs on the others, and is broken where the parameter changes"):
                soa.X_r.diff(parameter).dense()
            continue
        embedded = [other.soa.embedded(held) for other in closed]
        for pick in (lambda s: s.X_r, lambda s: s.H, lambda s: s.E, lambda s: (s.MM + s.J).inv(), lambda s: s.X_r.diff(0)):
            ends = [pick(one).dense() for one in embedded]
            assert close(pick(soa).diff(parameter).dense(), (ends[0] - ends[1]) / (2 * STEP), 1e-6), (hinge, kind, component, subhinge)
        done += 1
    assert done > 4
    with pytest.raises(pc.EvaluationError, match="by parameters last"):
        soa.X_r.diff(parameter).diff(0)
    mass = model.bodies[list(model.bodies)[1]].symbol("mass")
    assert not soa.X_r.diff(mass).dense().any() and not soa.X_r.diff(0).diff(mass).dense().any()
    assert np.allclose(soa.MM.diff(mass).dense(), (soa.X_r.T @ model.soa.MM.diff(mass) @ soa.X_r).dense(), atol=1e-12)


def test_a_length_out_of_the_plane_breaks_a_planar_loop():
    model = closed_four_bar()
    soa = model.soa.embedded()
    along, across = (model.hinges["coupler"].symbol("placement", c) for c in ("x", "z"))
    assert soa.MM.diff(along).dense().any()
    with pytest.raises(pc.EvaluationError, match="row 'closure: along z' hangs on the others, and is broken where the parameter changes"):
        soa.MM.diff(across).dense()
    rover = MODELS["rover"]()
    with pytest.raises(pc.EvaluationError, match="row 'edge: sideways' is of velocities"):
        rover.soa.embedded().MM.diff(rover.hinges["arm"].symbol("placement", "x")).dense()
    with pytest.raises(pc.EvaluationError, match="another model"):
        soa.MM.diff(rover.hinges["arm"].symbol("placement", "x"))


def test_third_derivatives_of_functions():
    """Rows twice along coordinates and time, of r = x² y³ with all its derivatives, against the polynomial's differences."""
    model, (x, y) = pc.chain(3, seed=2), (0.7, -0.4)

    def product(q):
        x, y = q
        gradient = [2 * x * y**3, 3 * x**2 * y**2]
        second = [[2 * y**3, 6 * x * y**2], [6 * x * y**2, 6 * x**2 * y]]
        xxy, xyy = 6 * y**2, 12 * x * y
        return x**2 * y**3, gradient, second, [[[0, xxy], [xxy, xyy]], [[xxy, xyy], [xyy, 6 * x**2]]]

    model.add_coupling(["hinge2", "hinge0"], function=product, name="product")
    model.q, model.v = [y, 0.3, x], [2.0, -1.0, 0.5]
    xxx, xxy, xyy, yyy = 0.0, 6 * y**2, 12 * x * y, 6 * x**2
    expected = {(2, 2): [xxy, 0, xxx], (0, 2): [xyy, 0, xxy], (2, 0): [xyy, 0, xxy], (0, 0): [yyy, 0, xyy], (0, 1): [0, 0, 0]}
    for (i, j), row in expected.items():
        assert close(model.soa.Q.diff(i, j).dense(), np.array([row])), (i, j)
    vy, vx = model.v[0], model.v[2]
    along = np.array([[xyy * vx + yyy * vy, 0, xxy * vx + xyy * vy]])
    assert close(model.soa.Q.diff(0).dot().dense(), along)


def test_functions_without_third_derivatives():
    model = MOVING["function"]()
    at = model.coordinate_names.index("hinge3")
    model.soa.Q.diff(at).dense()
    with pytest.raises(pc.EvaluationError, match="coupling 'product' is a function, which has no third derivatives"):
        model.soa.Q.diff(at, at).dense()
    assert not model.soa.Q.diff(at, 0).dense().any()


def test_pickled_with_their_model():
    q = [0.1, 0.2, 0.3]
    bars = pc.chain(3)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    for made in (
        bars.soa.Q.diff(0, 1),
        bars.soa.A.diff(1, 1),
        bars.soa.Q.dot().diff(2),
        bars.soa.Q.diff(bars.hinges["hinge1"].symbol("placement", "x")),
    ):
        assert np.array_equal(pickle.loads(pickle.dumps(made)).at(q, q).dense(), made.at(q, q).dense())
    soa = closed_four_bar().soa.embedded()
    for made in (soa.X_r.diff(0, 0), soa.X_r.diff(0).dot(), soa.a.diff(0)):
        assert np.array_equal(pickle.loads(pickle.dumps(made)).dense(), made.dense())
