"""Whatever users give to a model: an error of ours that names it, and the model as it was; or a correct value.

`python tests/campaigns/arguments.py --seeds 2000`. A round draws an entry of the public interface (constructors, setters, direct calls)
and replaces some arguments by what does not belong there: text, dates, complex numbers, wrong shapes, NaN, infinities, reflections,
scalings, objects, huge integers. Accepted values are read back and the mass matrix is compared with the dense oracle.
"""

import sys
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import pycraft as pc
from campaigns.command_line import listed, seeds
from support.mechanisms import random_tree
from support.oracle import reference

ANYTHING = [
    None, True, 0, 1, -1, 3.5, -0.0, 1e300, -1e300, 5e-324, np.nan, np.inf, -np.inf, 10**400, 2**40, -(2**70), 1j, np.complex64(1 +
    2j), "", "3", "1.5", "body0", "no such", "a\x00b", "ü", b"1", [], [[]], {}, set(), object(), (1,), [1, 2], [1, 2, 3], [1, 2, 3,
    4], ["1", "2", "3"], [1, "2", 3], [1, None, 3], [1, 2j, 3], [[1, 2, 3]], [[1], [2], [3]], [1, [2, 3]],
    np.datetime64("2020-01-01"), np.timedelta64(3, "s"), np.array(["2020-01-01"] * 3, "datetime64[D]"), np.array([1, 2, 3],
    "timedelta64[s]"), np.zeros(3, bool), np.zeros((3, 3)), np.eye(3), np.eye(4), 2 * np.eye(3), 1.1 * np.eye(4), -np.eye(3),
    np.diag([1.0, 1, -1]), np.diag([1.0, 1, -1, 1]), np.full((3, 3), np.nan), np.full((4, 4), np.inf), np.eye(3, 4), np.eye(4)[:3],
    np.eye(3)[None], np.triu(np.ones((3, 3))), np.eye(4) + np.eye(4, k=-1), np.array([1, 2, 3], object), np.array(["a", 1, None],
    object), np.array([1 + 1j, 0, 0]), np.ma.masked_array([1.0, 2, 3], [0, 1, 0]), np.matrix([[1.0, 2, 3]]), np.zeros((0,)),
    np.zeros((0, 3)), np.zeros((2, 2, 2)), [{}], [{"kind": 3}], [{"kind": "pin"}], [{"kind": "pin", "axes": 3}], ["pin"], (-1, 1), (1,
    -1), (np.nan, 1), (np.inf, np.inf), (-np.inf, -np.inf), ([-1, -1], [1, 1]), ([-1], [1, 1]), lambda: 0, slice(3), "weld", "pin",
    "ball", "custom",
]  # fmt: skip

ADDED = [
    "name", "parent", "hinge", "axis", "axes", "point", "pitch", "subhinges", "position", "rotation", "placement", "mass", "com", "inertia",
    "rotor_inertia", "limits", "hinge_name",
]  # fmt: skip


def state_of(model):
    """The whole model, to compare bit for bit."""

    def plain(x):
        if isinstance(x, dict):
            return {k: plain(v) for k, v in x.items()}
        if isinstance(x, (list, tuple)):
            return [plain(v) for v in x]
        return x.tobytes() if isinstance(x, np.ndarray) else x

    return plain(model.description())


def entries(model, rng):
    """Name and function of one strange argument, or of several."""
    any_body = lambda: model.bodies[rng.choice(list(model.bodies))]
    any_hinge = lambda: model.hinges[rng.choice(list(model.hinges))]
    q, v = np.array(model.q), np.array(model.v)

    def strange():
        return ANYTHING[int(rng.integers(len(ANYTHING)))]

    def add():
        options = {
            "name": "new",
            "mass": 1.0,
            "inertia": np.eye(3),
            "hinge": str(rng.choice(["pin", "ball", "custom", "weld", "universal", "planar"])),
        }
        if options["hinge"] == "custom":
            options["subhinges"] = [{"kind": "pin"}, {"kind": "slider", "axis": (1, 0, 0)}]
        for _ in range(int(rng.integers(1, 4))):
            options[str(rng.choice(ADDED))] = strange()
        model.add_body(options.pop("name"), **options)

    def node():
        options = {k: strange() for k in rng.choice(["position", "rotation", "placement"], int(rng.integers(3)), False)}
        model.add_node(strange() if rng.random() < 0.2 else "tip", strange() if rng.random() < 0.3 else "body0", **options)

    def set_on(target, name):
        value = strange()
        setattr(target, name, value)

    return {
        "add_body": add,
        "add_node": node,
        "remove_body": lambda: model.remove_body(strange()),
        "mass": lambda: set_on(any_body(), "mass"),
        "com": lambda: set_on(any_body(), "com"),
        "inertia": lambda: set_on(any_body(), "inertia"),
        "placement": lambda: set_on(any_hinge(), "placement"),
        "rotor_inertia": lambda: set_on(any_hinge(), "rotor_inertia"),
        "limits": lambda: set_on(any_hinge(), "limits"),
        "gravity": lambda: set_on(model, "gravity"),
        "q": lambda: set_on(model, "q"),
        "v": lambda: set_on(model, "v"),
        "body symbol": lambda: any_body().symbol(strange(), strange(), strange()),
        "hinge symbol": lambda: any_hinge().symbol(str(rng.choice(["placement", "axis", "point", "rotor_inertia"])), strange(), strange()),
        "integrate": lambda: model.integrate(*((strange(), v) if rng.random() < 0.5 else (q, strange()))),
        "difference": lambda: model.difference(*((strange(), q) if rng.random() < 0.5 else (q, strange()))),
        "forward_dynamics": lambda: model.forward_dynamics(*_one_of(rng, [q, v, v], strange)),
        "inverse_dynamics": lambda: model.inverse_dynamics(*_one_of(rng, [q, v, v], strange)),
        "bias_forces": lambda: model.bias_forces(*_one_of(rng, [q, v], strange)),
        "mass_matrix": lambda: model.mass_matrix(strange()),
        "jacobian": lambda: model.jacobian(*_one_of(rng, ["body0", q], strange)),
        "pose": lambda: model.pose(*_one_of(rng, ["body0", q], strange)),
        "kinetic_energy": lambda: model.kinetic_energy(*_one_of(rng, [q, v], strange)),
        "potential_energy": lambda: model.potential_energy(strange()),
        "configuration_rate": lambda: model.configuration_rate(*_one_of(rng, [q, v], strange)),
        "form": lambda: model.forward_dynamics(q, v, v, form=strange()),
        "refine": lambda: model.forward_dynamics(q, v, v, refine=strange()),
        "precision": lambda: model.forward_dynamics(q, v, v, precision=strange()),
        "method": lambda: model.forward_dynamics(q, v, v, method=strange()),
        "out": lambda: model.mass_matrix(q, out=strange()),
        "at": lambda: model.soa.M.at(strange(), *([strange()] if rng.random() < 0.5 else [])).trace().value(),
        "diff": lambda: model.soa.phi.diff(strange()),
        "power": lambda: model.soa.phi ** strange(),
        "Jacobian": lambda: model.soa.Jacobian(strange()),
        "Delta": lambda: model.soa.Delta(strange()),
        "euclidean": lambda: pc.euclidean(strange()),
        "constant": lambda: pc.constant(*_one_of(rng, [np.eye(3), 3, 3], strange)),
        "sko_model": lambda: pc.sko_model(*_one_of(rng, [[-1, 0], [None, np.eye(2)], [np.eye(1, 2)] * 2, [np.eye(2)] * 2], strange)),
        "chain": lambda: pc.chain(2, strange()),
        "chain of": lambda: pc.chain(*_one_of(rng, [3, "pin", 1], strange)),
        "rods": lambda: pc.chain(2, **{str(rng.choice(["mass", "length", "name"])): strange()}),
        "random_state": lambda: model.random_state(strange()),
        "tree of a seed": lambda: pc.tree([-1, 0], "pin", strange()),
        "energy about": lambda: model.potential_energy(q, datum=strange()),
        "derivatives": lambda: model.forward_dynamics_derivatives(*_one_of(rng, [q, v, v], strange)),
        "inverse derivatives": lambda: model.inverse_dynamics_derivatives(*_one_of(rng, [q, v, v], strange)),
        "hamiltonian_dynamics": lambda: model.hamiltonian_dynamics(*_one_of(rng, [q, v, v], strange)),
        "innovations": lambda: model.innovations(*_one_of(rng, [q, v, v], strange)),
        "diagonalised_dynamics": lambda: model.diagonalised_dynamics(*_one_of(rng, [q, v, v], strange)),
        "momentum": lambda: model.momentum(*_one_of(rng, [q, v], strange)),
        "coriolis_matrix": lambda: model.coriolis_matrix(*_one_of(rng, [q, v], strange)),
        "operational space": lambda: model.operational_space_compliance(*_one_of(rng, ["body0", q], strange)),
        "jacobian_dot": lambda: model.jacobian_dot(*_one_of(rng, ["body0", q, v], strange)),
        "axes": lambda: model.jacobian("body0", q, axes=strange()),
        "relative_to": lambda: model.jacobian("body0", q, relative_to=strange()),
        "realization": lambda: model.forward_dynamics(*_one_of(rng, [q, v, v], strange), method="realization"),
        "directions": lambda: model.soa.Lambda("body0", directions=strange()),
        "scalar at": lambda: model.soa.M.trace().at(strange()).value(),
        "scalar diff": lambda: model.soa.M.trace().diff(strange()),
        "x": lambda: model.soa.M @ strange(),
        "tree": lambda: pc.tree(*_one_of(rng, [[-1, 0], ["pin", "ball"]], strange)),
        "welds": lambda: pc.Multibody("m", welds=strange()),
        "name": lambda: pc.Multibody(strange()),
    }  # fmt: skip


def _one_of(rng, arguments, strange):
    arguments = list(arguments)
    arguments[int(rng.integers(len(arguments)))] = strange()
    return arguments


def one_round(model, rng, name):
    """None, or what is wrong with one entry given something strange."""
    before = state_of(model)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pc.ModelWarning)
            entries(model, rng)[name]()
    except pc.Error:
        return None if state_of(model) == before else f"{name}: the model changed and an error was raised"
    except TypeError as error:
        # Of Python's own: an argument too many; or of ours: an operator of something else.
        if "incompatible function arguments" in str(error) or not str(error):
            return f"{name}: {type(error).__name__}: {str(error)[:200]}"
        return None if state_of(model) == before else f"{name}: the model changed and an error was raised"
    except Exception as error:  # whatever it is: it is not one of ours
        return f"{name}: {type(error).__name__}: {str(error)[:200]}"
    after = model.description()
    for body in after["bodies"]:
        R = np.asarray(body["hinge"]["placement"]["rotation"])
        if np.abs(R.T @ R - np.eye(3)).max() > 1e-13 or np.linalg.det(R) < 0:
            return f"{name}: a placement is no pose"
    for node in after["nodes"]:
        R = np.asarray(node["rotation"])
        if np.abs(R.T @ R - np.eye(3)).max() > 1e-13 or np.linalg.det(R) < 0:
            return f"{name}: the frame of a node is no pose"
    if len(set(model.coordinate_names)) != model.nv:
        return f"{name}: two coordinates of one name: {model.coordinate_names}"
    state = model.random_state(rng)
    if not (np.isfinite(state.q).all() and np.isfinite(state.v).all()):
        return f"{name}: a random state is not finite"
    sizes = [
        abs(x)
        for body in after["bodies"]
        for x in (body["mass"], *np.ravel(body["com"]), *np.ravel(body["hinge"]["placement"]["position"]))
    ]
    points = [abs(x) for body in after["bodies"] for s in body["hinge"]["subhinges"] for x in (*np.ravel(s["point"]), s["pitch"])]
    if max([0.0, *sizes, *points, *np.ravel(after["q"])]) < 1e8:  # beyond, overflow is refused, and tested elsewhere
        found, expected = model.mass_matrix(state.q), reference.mass_matrix(after, state.q)
        if np.abs(found - expected).max(initial=0) > 1e-9 * np.abs(expected).max(initial=1):
            return f"{name}: the mass matrix is not the oracle's"
    return None


def run(seeds, rounds=90):
    """Return the errors, one line each, without repetition."""
    wrong = {}
    for seed in seeds:
        rng = np.random.default_rng(seed)
        model = random_tree(rng, int(rng.integers(2, 5)))
        names = list(entries(model, rng))
        for i in range(rounds):
            if model._size > 8 or not model._size:
                model = random_tree(rng, int(rng.integers(2, 5)))
            text = one_round(model, rng, names[(i + seed * rounds) % len(names)])
            if text:
                wrong.setdefault(text, seed)
    return [f"seed {seed}: {text}" for text, seed in wrong.items()]


if __name__ == "__main__":
    sys.exit(listed(run(seeds(__doc__, 200, first=False))))
