"""Batches against the states one by one: random expressions, every request, bit for bit.

An expression is drawn from the grammar of `random_formulas`, often with something in it that cancels by a theorem (X - X, 0 X,
D D⁻¹, φ⁻¹ + E, blockdiag φ, the two factors of I), so that the plan no longer depends on a state, or depends on a part of them. Whatever is
asked of it at a batch of states must be what is asked at each state, to the last bit: same plan, same steps, same order.

    python tests/campaigns/batches.py --seeds 2000
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import pycraft as pc
from campaigns.command_line import seeds, tallied
from pycraft.operators.operator_set import operator_from_parts
from support.mechanisms import random_tree, uniform_batch
from support.random_formulas import draw, seeded

STATES = 3


class Typed:
    """An operator under the names that the grammar uses."""

    def __init__(self, op):
        self.op = op

    def __matmul__(self, other):
        return Typed(self.op @ other.op)

    def __add__(self, other):
        return Typed(self.op + other.op)

    def __sub__(self, other):
        return Typed(self.op - other.op)

    def __rmul__(self, number):
        return Typed(number * self.op)

    @property
    def T(self):
        return Typed(self.op.T)

    def inv(self):
        return Typed(self.op.inv())

    def blockdiag(self):
        return Typed(pc.blockdiag(self.op))


class TypedLetters:
    """The letters of a model as the grammar takes them."""

    def __init__(self, soa):
        self.soa = soa

    def __getattr__(self, name):
        return Typed(getattr(self.soa, name))

    @property
    def MM(self):
        return self.H @ self.phi @ self.M @ self.phi.T @ self.H.T


def vanishing(rng, soa, e):
    """An expression of e's spaces in which a state may have no part."""
    phi, psi, E, E_psi, H, K, D, I = soa("phi psi E E_psi H K D I")
    return [
        lambda: e,
        lambda: 0 * e,
        lambda: e - e,
        lambda: 0 * e + pc.zero(e.domain, e.codomain),
        lambda: pc.zero(e.domain, e.codomain),
        lambda: e @ pc.identity(e.domain) - e,
        lambda: (I + H @ phi @ K) @ (I - H @ psi @ K),
        lambda: D @ D.inv(),
        lambda: psi.inv() + E_psi,
        lambda: phi.inv() + E,
        lambda: pc.blockdiag(phi),
        lambda: pc.blockdiag(psi.T),
        lambda: phi.inv() @ phi @ (I + pc.blockdiag(E)),
        lambda: pc.constant(rng.normal(size=(len(e.domain), len(e.domain))), e.domain, e.domain),
    ][int(rng.integers(14))]()


def outcome(ask):
    """Return the result of a request: an array, or the kind of its refusal."""
    try:
        return np.asarray(ask(), float)
    except (pc.Error, ZeroDivisionError) as error:
        return type(error)


def requests(e, rng, nv):
    """Names and askers of everything that can be asked of an expression: ask(bound expression, state number or None)."""
    n, m = len(e.domain), len(e.codomain)
    x, X, Y = rng.normal(size=n), rng.normal(size=(STATES, n)), rng.normal(size=(STATES, n, 2))
    i = int(rng.integers(nv)) if nv else None
    T = pc.vector("T", e.domain)
    all_of = {
        "dense": lambda b, s: b.dense(),
        "dense, as typed": lambda b, s: b.dense(rules=False),
        "applied to a vector": lambda b, s: b @ x,
        "applied to vectors": lambda b, s: b @ (X if s is None else X[s]),
        "applied to columns": lambda b, s: b @ (Y if s is None else Y[s]),
        "a named vector": lambda b, s: (b @ T).value(T=x),
        "a named vector, as typed": lambda b, s: (b @ T).value(T=x, rules=False),
        "norm": lambda b, s: b.norm(),
        "simplified": lambda b, s: b.simplify().dense(),
        "transposed": lambda b, s: b.T @ np.ones(m),
        "a copy": lambda b, s: operator_from_parts(*b._parts()).dense() if e.children == [] else b.dense(),
    }
    if e.domain.name != "R^1":
        all_of["blockdiag"] = lambda b, s: pc.blockdiag(b).dense()
    if n == m:
        all_of["diagonal"] = lambda b, s: b.diagonal()
        all_of["trace"] = lambda b, s: b.trace()
        all_of["logdet"] = lambda b, s: (b + 9 * pc.identity(b.domain)).logdet() if b.domain == b.codomain else b.logdet()
        all_of["a sum of scalars"] = lambda b, s: 2 * b.trace() + 1 - b.norm()
    if i is not None:
        all_of["diff"] = lambda b, s: b.diff(i).dense()
        if n == m:
            all_of["diff of the trace"] = lambda b, s: b.trace().diff(i)
    return all_of


def check(seed):
    """Return the number of comparisons at one seed, and the differences, as text."""
    rng = np.random.default_rng(seed)
    model = random_tree(rng, int(rng.integers(1, 5)), kinds=["pin", "slider", "ball", "universal", "screw"])
    soa = model.soa
    a, b = (str(s) for s in rng.choice(list("TVF"), 2))
    e = draw(seeded(rng), TypedLetters(soa), a, b, int(rng.integers(0, 3))).op
    if rng.integers(2):
        e = vanishing(rng, soa, e)
    if rng.integers(4) == 0:
        e = e.diff(int(rng.integers(model.nv)))
    Q, V = uniform_batch(model, STATES, seed)
    found, compared = [], 0
    for name, ask in requests(e, rng, model.nv).items():
        together = outcome(lambda: ask(e.at(Q, V), None))  # noqa: B023 - called before the next
        singly = [outcome(lambda s=s: ask(e.at(Q[s], V[s]), s)) for s in range(STATES)]  # noqa: B023 - called before the next
        compared += 1
        refused = [s for s in singly if isinstance(s, type)]
        if refused or isinstance(together, type):
            if together not in refused:
                found.append(f"seed {seed}: {name} of {e.text()}: {together} for {singly}")
            continue
        apart = np.array(singly).reshape(STATES, *singly[0].shape)
        if together.shape != apart.shape:
            found.append(f"seed {seed}: {name} of {e.text()}: shape {together.shape} for {apart.shape}")
        elif together.tobytes() != apart.tobytes() and not np.array_equal(together, apart):  # -0.0 is 0.0
            found.append(f"seed {seed}: {name} of {e.text()}: off by {np.abs(together - apart).max():.2e}")
    return compared, found


if __name__ == "__main__":
    sys.exit(tallied(seeds(__doc__, 500), check, "comparisons"))
