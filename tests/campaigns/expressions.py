"""A hostile campaign against expressions: does any of them crash, read what nobody wrote, or differ from dense NumPy?

    python tests/campaigns/expressions.py --seeds 2000 --jobs 4        # make campaigns

A seed draws a model (trees of all hinge kinds, arms with six coordinates to a node, closed chains), states, and expressions from all
letters: of bodies, nodes, frames, loops (Q, A), grouped bodies, free and prescribed coordinates, embedded loops, constants with and
without blocks, operators from outside. Each expression is asked for something (`REQUESTS`) in some way: at one state or at a batch in or
out of packs, in single, double, extended or quad precision, refined or not, with and without theorems, in several threads.

The oracle is NumPy on the letters' own dense values, computed one by one in quad precision, with a bound on rounding that is carried along
by the rules of tests/support/formulas.py. A letter's own error is what its values in double, in any form, differ from those in quad by (an
estimate, hence `SLACK`), and at least the roundings of a sweep.
"""

import argparse
import ctypes
import faulthandler
import functools
import os
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import pycraft as pc
from support.closed_models import MODELS as CLOSED
from support.mechanisms import random_tree

EPS = np.finfo(float).eps
SLACK = 64.0
"""Of first-order bounds whose letters' errors are estimated at the very state: one draw of rounding may be far below its bound."""
SWEEP = 200 * EPS
"""Of a letter, relative to its size: the roundings of a sweep over at most a dozen bodies, with what grows over their lengths."""
ILL = 1e5
"""Condition numbers beyond which an inverse is not drawn: above, first-order bounds say nothing in single precision."""
FORMS = ("fast", "ud", "square-root")
COARSE = {"single": 2.0**29, "double": 1.0, "extended": 1.0, "quad": 1.0}
"""Unit roundoff over that of double; wider values are compared in double, against letters and products in double."""
ELIMINATED = 1e8 * EPS
"""Relative, without theorems: an elimination over the tree is done anew where a solve loses seven digits, and its diagonal blocks, which no
residual corrects, may lose as many."""
REQUESTS = ("dense", "apply", "columns", "transposed", "diagonal", "trace", "logdet", "norm", "blockdiag", "solve", "gradient", "product")
EXPRESSIONS = 40
"""Results of each seed."""


# ---------------------------------------------------------------------- expressions with their dense values


class Tried:
    """An expression, its dense values (states, rows, columns) and bounds on their rounding, each in the Frobenius norm."""

    def __init__(self, op, value, error):
        self.op, self.value, self.error = op, value, error

    @property
    def size(self):
        return np.linalg.norm(self.value, axis=(1, 2))

    @property
    def useful(self):
        """Check that the bound is meaningful."""
        size = self.size
        return bool(np.isfinite(self.value).all() and (size < 1e9).all() and (size > 1e-9).all() and (self.error < 1e-6 * size).all())

    def __matmul__(self, other):
        inner = self.value.shape[2]
        error = self.size * other.error + self.error * other.size + inner * EPS * self.size * other.size
        return Tried(self.op @ other.op, self.value @ other.value, error)

    def __add__(self, other):
        return Tried(self.op + other.op, self.value + other.value, self.error + other.error + EPS * (self.size + other.size))

    def scaled(self, c):
        return Tried(c * self.op, c * self.value, abs(c) * self.error)

    @property
    def T(self):
        return Tried(self.op.T, self.value.transpose(0, 2, 1), self.error)

    def shifted(self, c):
        """c I + X."""
        n = self.value.shape[1]
        return Tried(c * pc._core.identity() + self.op, c * np.eye(n) + self.value, self.error + EPS * (self.size + abs(c) * np.sqrt(n)))

    def inv(self):
        inverse = np.linalg.inv(self.value)
        size = np.linalg.norm(inverse, axis=(1, 2))
        return Tried(self.op.inv(), inverse, size**2 * (self.error + len(inverse[0]) * EPS * self.size))

    def blockdiag(self):
        kept = np.zeros_like(self.value)
        for _, rows, body in self.op.codomain.blocks:
            for _, columns, other in self.op.domain.blocks:
                if body == other:
                    kept[:, rows, columns] = self.value[:, rows, columns]
        return Tried(pc.blockdiag(self.op), kept, self.error)

    @property
    def square(self):
        return self.value.shape[1] == self.value.shape[2] > 0

    def invertible(self):
        with np.errstate(all="ignore"):
            return self.square and bool((np.linalg.cond(self.value) < ILL).all())


# ---------------------------------------------------------------------- models, states, letters


def six_to_a_node(rng):
    """A model whose node Jacobians are square."""
    kinds = (["pin"] * 6, ["free"], ["ball", "ball"], ["pin", "gimbal", "universal"], ["slider", "ball", "pin", "pin"], ["free", "free"])
    chosen = kinds[int(rng.integers(len(kinds)))]
    parents = [int(rng.integers(-1, k)) if k and rng.random() < 0.3 else k - 1 for k in range(len(chosen))]
    return pc.tree(parents, chosen, seed=int(rng.integers(2**31)), rotor_inertia=bool(rng.integers(2)))


def any_tree(rng):
    return random_tree(rng, int(rng.integers(1, 6)))


def closed(rng):
    names = list(CLOSED)
    return CLOSED[names[int(rng.integers(len(names)))]]()


FAMILIES = (six_to_a_node, any_tree, closed)


def drawn_states(model, rng, count):
    """q and v of so many states, on the loops where there are some."""
    q, v = [], []
    for _ in range(count):
        if len(model.loops):
            near = model.integrate(model.q, 0.05 * rng.normal(size=model.nv))
            s = model.assemble(near, rng.normal(size=model.nv), starts=1)
        else:
            s = model.random_state(rng)
        q.append(s.q), v.append(s.v)
    return np.array(q).reshape(count, model.nq), np.array(v).reshape(count, model.nv)


def attempted(make):
    """Return its value, or None where the package refuses by name."""
    try:
        return make()
    except (pc.Error, ArithmeticError, AttributeError):
        return None


PLAIN = (
    "E phi phi_tilde H M J R P P_plus D G K tau tau_bar E_psi psi psi_tilde Upsilon Omega X_world Delta_theta_dot V_tilde V_bar H_dot"
).split()


def letters_of(soa, nodes, rng, some=1.0):
    """The operators of a set, some of them."""
    for name in PLAIN:
        if rng.random() < some:
            yield attempted(lambda name=name: getattr(soa, name))
    for name in ("MM", "MM_inv", "X_r", "phi_S", "H_S", "Q", "A"):
        yield attempted(lambda name=name: getattr(soa, name))
    for chosen in nodes:
        for name in ("B", "Jacobian", "Lambda"):
            yield attempted(lambda name=name, chosen=chosen: getattr(soa, name)(chosen))
    count = soa.Theta.dimension
    if count:
        yield attempted(lambda: soa.Delta(int(rng.integers(count))))
        yield attempted(lambda: soa.MM.diff(int(rng.integers(count))))


def all_letters(model, rng):
    """Operators of a model and of what is derived from it."""
    bodies, soa = list(model.bodies), model.soa
    moving = [name for name, node in model.nodes.items() if node.body is not None]
    places = [*bodies, *moving]
    nodes = [[places[-1]], [str(x) for x in rng.choice(places, min(2, len(places)), replace=False)]]
    yield from letters_of(soa, nodes, rng)
    sets = []
    if len(bodies) > 1:
        k = int(rng.integers(1, len(bodies)))
        parent = model.bodies[bodies[k]].parent
        if parent is not None:
            sets.append(attempted(lambda: soa.grouped([[getattr(parent, "name", parent), bodies[k]]])))
    if model.nv > 1:
        held = [str(x) for x in rng.choice(model.coordinate_names, int(rng.integers(1, model.nv)), replace=False)]
        sets += [attempted(lambda: soa.free(held)), attempted(lambda: soa.prescribed(held))]
    if len(model.loops):
        sets.append(attempted(soa.embedded))
    for made in sets:
        if made is not None:
            yield from letters_of(made, nodes[:1], rng, 0.5)
    for axes in ("body", "aligned", "world"):
        frame, wrt = (str(x) for x in rng.choice(places, 2))
        yield attempted(lambda frame=frame, axes=axes: model.frame(frame).jacobian_operator(axes=axes))
        yield attempted(lambda frame=frame, wrt=wrt, axes=axes: model.frame(frame).jacobian_operator(wrt=wrt, axes=axes))
    spaces = [soa.Theta, soa.V, soa.F, soa.NodesV(nodes[0])]
    for _ in range(6):
        a, b = (spaces[int(i)] for i in rng.integers(len(spaces), size=2))
        yield attempted(lambda a=a, b=b: pc.constant(rng.normal(size=(b.dimension, a.dimension)), a, b, "C"))
    for a, b in ((soa.Theta, soa.Theta), (soa.V, soa.F), (soa.Theta, soa.NodesV(nodes[0]))):
        blocks = attempted(lambda a=a, b=b: pc.constant(_blocks(rng, a, b), a, b, "B"))
        yield blocks
    yield pc.constant(rng.normal(size=(3, model.nv)), soa.Theta, pc.euclidean(3), "R")
    outside = rng.normal(size=(model.nv, model.nv))
    yield pc._core.external(lambda x: outside @ x, lambda x: outside.T @ x, soa.Theta, soa.Theta, "L")


def _blocks(rng, a, b):
    """A block for each body, of what both spaces have there."""
    sizes = [[0] * a.bodies, [0] * a.bodies]
    for at, space in enumerate((a, b)):
        for _, where, body in space.blocks:
            sizes[at][body] += where.stop - where.start
    return [rng.normal(size=(r, c)) for c, r in zip(*sizes, strict=True)]


def leaf(op, q, v):
    """A letter with its values at these states; nothing where it has none."""
    if op is None or 0 in op.shape:
        return None
    try:
        exact = op.at(q, v, precision="double" if op.kind == "external" else "quad").dense()
        rough = [op.at(q, v, form=form).dense() for form in FORMS]
    except (pc.Error, ArithmeticError):
        return None
    if exact.ndim == 2:  # of no state
        exact, *rough = (np.broadcast_to(x, (len(q), *x.shape)) for x in (exact, *rough))
    size = np.linalg.norm(exact, axis=(1, 2))
    off = np.max([np.linalg.norm(exact - x, axis=(1, 2)) for x in rough], axis=0)
    made = Tried(op, exact, np.maximum(4 * off, SWEEP * size))
    return made if made.useful else None


def grown(pool, rng):
    """An expression made of those that are there, or nothing."""
    x = pool[int(rng.integers(len(pool)))]
    kind = rng.choice(
        ["product", "sum", "scaled", "transpose", "shifted", "inverse", "blockdiag", "gram"],
        p=[0.3, 0.22, 0.05, 0.05, 0.06, 0.16, 0.08, 0.08],
    )
    if kind == "product":
        fitting = [y for y in pool if y.op.codomain == x.op.domain]
        return x @ fitting[int(rng.integers(len(fitting)))] if fitting else None
    if kind == "sum":
        fitting = [y for y in pool if y.op.codomain == x.op.codomain and y.op.domain == x.op.domain]
        return x + fitting[int(rng.integers(len(fitting)))]
    if kind == "scaled":
        return x.scaled(float(rng.choice([-1.0, 2.0, 0.5, -0.3])))
    if kind == "transpose":
        return x.T
    if kind == "shifted":
        return x.shifted(float(rng.choice([1.0, 0.5, -2.0]))) if x.op.domain == x.op.codomain else None
    if kind == "inverse":
        return x.inv() if x.invertible() else None
    if kind == "blockdiag":
        return x.blockdiag()
    return x.T @ x if x.op.codomain == x.op.domain.dual or x.op.codomain.dual == x.op.codomain else None


# ---------------------------------------------------------------------- requests


def check(kind, tried, bound, options, rng, batch):
    """Return the package's value beside NumPy's: (difference, allowed), both arrays or numbers, or nothing where it does not apply.

    `bound`: the expression at the states, those of `tried` first; `batch`: how many, None where there is one.
    """
    value, error = tried.value, tried.error * SLACK * options["coarse"] + 4 * EPS * options["coarse"] * max(value_shape(tried)) * tried.size
    if not options["rules"]:
        error = np.maximum(error, ELIMINATED * tried.size)
    states, rows, columns = value.shape
    pick = (lambda y: np.asarray(y)[:states]) if batch else (lambda y: np.asarray(y)[None])
    rules = options["rules"]
    if kind in ("dense", "product"):
        return pick(bound.dense(rules=rules)) - value, error
    if kind in ("apply", "columns"):
        if kind == "apply" or batch is None:
            x = rng.normal(size=columns) if kind == "apply" else rng.normal(size=(columns, 3))
            return pick(bound @ x) - value @ x, error * np.linalg.norm(x)
        x = rng.normal(size=(batch, columns, 3))
        return pick(bound @ x) - value @ x[:states], error * np.linalg.norm(x[:states])
    if kind == "transposed":
        x = rng.normal(size=rows)
        return pick(bound.T @ x) - value.transpose(0, 2, 1) @ x, error * np.linalg.norm(x)
    if kind == "norm":
        return pick(bound.norm().value()) - tried.size, error
    if kind == "blockdiag":
        made = tried.blockdiag()
        return pick(pc.blockdiag(bound).dense(rules=rules)) - made.value, error
    if not tried.square:
        return None
    if kind == "diagonal":
        return pick(bound.diagonal()) - np.diagonal(value, axis1=1, axis2=2), error
    if kind == "trace":
        return pick(bound.trace().value()) - np.trace(value, axis1=1, axis2=2), error * np.sqrt(rows)
    if kind == "gradient":
        gradient = np.atleast_2d(pick(bound.trace().gradient()))
        wanted = np.zeros_like(gradient)
        for i in range(gradient.shape[-1]):
            wanted[:, i] = np.trace(pick(bound.diff(i).dense()), axis1=1, axis2=2)
        size = max(1.0, np.abs(wanted).max(initial=0.0))
        return gradient - wanted, 1e-6 * options["coarse"] * size * np.ones(states)
    if not tried.invertible():
        return None
    inverse = np.linalg.inv(value)
    grown = np.linalg.norm(inverse, axis=(1, 2)) * (error + rows * EPS * options["coarse"] * tried.size)
    if (grown > 0.1).any():
        return None
    if kind == "logdet":
        return pick(bound.logdet().value()) - np.linalg.slogdet(value)[1], grown * np.sqrt(rows)
    x = rng.normal(size=rows)
    return pick(bound.inv() @ x) - np.einsum("sij,j->si", inverse, x), grown * np.linalg.norm(inverse, axis=(1, 2)) * np.linalg.norm(x)


def value_shape(tried):
    return tried.value.shape[1:]


def way(rng):
    """How an expression is bound."""
    precision = str(rng.choice(["double", "double", "double", "single", "extended", "quad"]))
    refine = [0, 0, 1, 2, "auto"][int(rng.integers(5))]
    return dict(
        precision=precision,
        refine=refine,
        residual=str(rng.choice(["same", "gather", "wider"])),
        form=str(rng.choice(["fast", *FORMS])),
    )


def seed_run(seed, expressions=EXPRESSIONS, note=None):
    """(how many requests were compared, by kind; faults as texts) of a seed."""
    rng = np.random.default_rng([57, seed])
    model = FAMILIES[seed % len(FAMILIES)](rng)
    model.take_warnings()
    states = 2
    q, v = drawn_states(model, rng, states)
    pool = [x for op in all_letters(model, rng) if (x := leaf(op, q, v)) is not None]
    leaves = len(pool)
    done, faults = Counter(), []
    many = None
    for _ in range(expressions * 20):
        if len(pool) >= leaves + expressions:
            break
        with np.errstate(all="ignore"):
            made = attempted(lambda: grown(pool, rng))
            if made is not None and made.useful and len(made.op.text()) < 2000:
                pool.append(made)
    for number, tried in enumerate(pool):
        for kind in rng.choice(REQUESTS, 3 if number >= leaves else 2, replace=False):
            kind = str(kind)
            if kind == "blockdiag" and attempted(functools.partial(pc.blockdiag, tried.op)) is None:
                continue
            options = way(rng)
            shape = str(rng.choice(["one", "batch", "packs"], p=[0.45, 0.45, 0.1]))
            if kind == "gradient":  # a derivative along each coordinate, and its trace
                shape = "one" if shape == "packs" else shape
                options |= dict(refine=0, precision="double")
            if shape == "packs" and many is None:
                more = drawn_states(model, rng, 6)
                repeats = [np.concatenate([mine, np.tile(theirs, (12, 1))]) for mine, theirs in zip((q, v), more, strict=True)]
                many = repeats
            at = {"one": (q[0], v[0]), "batch": (q, v), "packs": many}[shape]
            shown = Tried(tried.op, tried.value[:1], tried.error[:1]) if shape == "one" else tried
            threads = int(rng.choice([1, 1, 2])) if shape != "one" else 1
            what = f"seed {seed}: {kind} of {tried.op.text()} : {tried.op.domain.name} → {tried.op.codomain.name}, {shape}, {options}"
            if note is not None:
                note(what)
            told = dict(coarse=COARSE[options["precision"]], rules=bool(rng.integers(2)))
            try:
                bound = tried.op.at(*at, threads=threads, **options)
                found = check(kind, shown, bound, told, rng, None if shape == "one" or bound.batch is None else len(at[0]))
            except (pc.RefinementError, pc.SingularOperatorError, pc.SingularHingeError) as error:
                done["refused by numbers"] += 1
                if options["precision"] != "single" and not options["refine"]:
                    faults.append(f"{what}\n    {type(error).__name__}: {error}")
                continue
            except pc.EvaluationError as error:
                done["refused"] += 1
                if not any(reason in str(error) for reason in REFUSED):
                    faults.append(f"{what}\n    {type(error).__name__}: {error}")
                continue
            if found is None:
                continue
            done[kind] += 1
            off, allowed = (np.asarray(x, float) for x in found)
            off = np.abs(off).reshape(len(off), -1).max(axis=1, initial=0.0)
            if not (off <= allowed).all():
                faults.append(f"{what}\n    off by {off.max():.1e}, allowed {allowed.max():.1e}, size {tried.size.max():.1e}")
    return done, faults


REFUSED = ("comes from outside and computes in double precision only", "have no derivative here")
"""Messages that refuse a way for a reason of its own."""


@functools.cache
def guard_memory():
    """Guard the memory of the core where guarded_memory.cpp is preloaded, once a process."""
    if "guarded_memory" in os.environ.get("LD_PRELOAD", ""):
        ctypes.CDLL(None).guarded_memory_begin()


def noted_run(seed, folder, expressions):
    """`seed_run`, with what it is at in a file, so that a crash says where it was."""
    faulthandler.enable()
    guard_memory()
    path = Path(folder, f"expressions_{os.getpid()}.txt")

    def note(text):
        path.write_text(text)

    found = seed_run(seed, expressions, note)
    path.unlink(missing_ok=True)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--expressions", type=int, default=EXPRESSIONS)
    parser.add_argument("--notes", default="/tmp", help="folder of files that say what was running when a process died")
    options = parser.parse_args()
    counts: Counter[str] = Counter()
    faults = 0
    seeds = range(options.first, options.first + options.seeds)
    with ProcessPoolExecutor(options.jobs) as pool:
        running = [pool.submit(noted_run, seed, options.notes, options.expressions) for seed in seeds]
        for seed, each in zip(seeds, running, strict=True):
            try:
                done, found = each.result()
            except BrokenProcessPool:
                notes = [path.read_text() for path in Path(options.notes).glob("expressions_*.txt")]
                print(f"a process died at seed {seed} or near it; what was running:", *notes, sep="\n", flush=True)
                return True
            counts += done
            faults += len(found)
            for text in found:
                print(text, flush=True)
    print(f"{sum(counts.values())} requests of {options.seeds} seeds, {faults} faults: {dict(counts)}")
    return faults > 0


if __name__ == "__main__":
    sys.exit(main())
