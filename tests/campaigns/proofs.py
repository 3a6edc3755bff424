"""Proofs against a hostile stream of statements: `python tests/campaigns/proofs.py --seeds N [--each E] [--jobs J] [--to FILE]`.

For every seed a random true identity outside the catalogue (`random_identities`: axioms and lemmas applied at random to random words), said
of operators, of inverses, traces, norms or determinants, must be proved; and a statement one step from it (a letter exchanged, a sign
turned, a star dropped, a number changed, an inverse set around a part) must not be proved, unless dense NumPy finds it true on models that
meet the hypotheses of the proof. Says every minute how far it is, what was not found, and what was proved and is false; exits with 1
where anything false was. With --to, what came of each seed is a line of that file, and seeds that are there already are not run again.

A seed is 3.4 statements and 0.7 s of a core in the mean, 0.09 s in the median: the slowest twelfth takes four fifths of the time. With
`--each 12` the quick ones are perturbed more often (depending on the machine): a seed is then 9.8 statements and 0.9 s, so that
10⁵ perturbed ones are 11500 seeds and three hours of a core. Measured on a busy machine of four cores.
"""

import argparse
import contextlib
import functools
import gc
import json
import multiprocessing
import operator
import os
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import pycraft as pc
from pycraft.proofs import prove
from pycraft.proofs.values import NoValue, transferred
from support.perturbations import dense, exchanges, nodes, replaced
from support.random_identities import J0, identity_pair, meeting, tree

BOUND = 1e-7
"""Allowed error of a proved statement, relative to its sides, on small models: their condition is below 1e6."""

REDUCED = {"trace": np.trace, "norm": np.linalg.norm, "logdet": lambda X: np.linalg.slogdet(X)[1]}
"""Further subjects of a statement besides its operators, with their values in dense NumPy."""


@dataclass
class Tally:
    """Results of the statements."""

    true: int = 0
    proved: int = 0
    perturbed: int = 0
    proved_perturbed: int = 0
    seconds: float = 0.0
    unproved: list = field(default_factory=list)
    false_proofs: list = field(default_factory=list)

    def add(self, other):
        """All of it, and of another one."""
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + value)
        return self

    def __str__(self):
        rate = 1000 * self.seconds / max(self.true + self.perturbed, 1)
        return (
            f"{self.proved} of {self.true} true statements proved, not found, or under more hypotheses: {self.unproved}; "
            f"{self.perturbed} perturbed, {self.proved_perturbed} of them proved, {len(self.false_proofs)} of these false; "
            f"{rate:.0f} ms of a core each"
        )


def statement(seed):
    """(lhs, rhs, kind, hypotheses, soa) of a true statement on a small tree: kind says of what, soa are the operators of the tree."""
    rng = np.random.default_rng(seed)
    hypotheses = (J0,) if seed % 3 == 0 else ()
    soa = tree(seed % 7, rotor_inertia=not hypotheses).soa
    for _ in range(20):
        lhs, rhs = identity_pair(rng, soa, hypotheses)
        if isinstance(lhs, pc.Operator) and isinstance(rhs, pc.Operator) and np.abs(dense(lhs, {})).max(initial=0.0) > 1e-9:
            break
    kind = ["operators", "operators", "trace", "norm", "determinant"][int(rng.integers(5))]
    return lhs, rhs, kind, hypotheses, soa


def about(lhs, rhs, kind, soa):
    """(lhs, rhs, reduction): of which operators the statement is, and which of `REDUCED`; None where the kind does not fit them."""
    if kind == "trace" and lhs.domain == lhs.codomain:
        return lhs, rhs, "trace"
    if kind == "norm":
        return lhs, rhs, "norm"
    if kind == "determinant" and lhs.domain == lhs.codomain == soa.Theta:
        return soa.D + lhs.T @ lhs, soa.D + rhs.T @ rhs, "logdet"
    return lhs, rhs, None


def said(lhs, rhs, reduction):
    """Both sides of the statement."""
    return (getattr(lhs, reduction)(), getattr(rhs, reduction)()) if reduction else (lhs, rhs)


def perturbed(rng, e):
    """The expression with one thing changed; None where that makes no sense."""
    way = ["letter", "sum", "transpose", "scaled", "inverse"][int(rng.integers(5))]
    try:
        if way == "letter":
            changed = [x for _, x in exchanges(e)]
            return changed[rng.integers(len(changed))] if changed else None
        if way == "inverse":  # X X⁻¹ around a square part: true where X is regular, void where it never is
            spots = [x for x in nodes(e) if x[1].domain is not None and x[1].domain == x[1].codomain and x[1].kind != "identity"]
            path, node = spots[rng.integers(len(spots))] if spots else (None, None)
            return None if node is None else replaced(e, path, node @ node.inv())
        spots = [x for x in nodes(e) if x[1].kind == way]
        if not spots:
            return None
        path, node = spots[rng.integers(len(spots))]
        if way == "sum":
            i = rng.integers(len(node.children))
            return replaced(e, path, functools.reduce(operator.add, [-c if j == i else c for j, c in enumerate(node.children)]))
        return replaced(e, path, node.children[0] if way == "transpose" else 1.5 * node)
    except (pc.SpaceError, pc.EvaluationError):
        return None


def number_of(operand, reduction, operators):
    """The value of a side on a model: an array, or a number, by dense NumPy."""
    X = dense(transferred(operand, operators), {})
    return np.array([REDUCED[reduction](X)]) if reduction else X


def is_false(proof, lhs, rhs, reduction):
    """Check for a failure of a proved statement on a model that meets its hypotheses and on which every inverse in it exists."""
    for seed in (1, 2):
        model = meeting(proof.hypotheses, seed)
        model.q = model.random_state(seed).q
        try:
            left, right = (number_of(side, reduction, model.soa) for side in (lhs, rhs))
        except (np.linalg.LinAlgError, NoValue, pc.Error):
            continue
        size = max(np.abs(left).max(initial=0.0), np.abs(right).max(initial=0.0), 1.0)
        if np.isfinite(size) and size < 1e8 and not np.abs(left - right).max(initial=0.0) <= BOUND * size:
            return True
    return False


AT_LEAST, QUICK = 3, 0.1
"""How often a statement is perturbed however long its own proof takes; up to how many seconds it may take to be so more often."""


def tried(seed, each=AT_LEAST):
    """Return the results of one seed."""
    tally, begin = Tally(), time.process_time()
    lhs, rhs, kind, hypotheses, soa = statement(seed)
    proof_begin = time.process_time()
    proof = prove(*said(*about(lhs, rhs, kind, soa)))
    times = each if time.process_time() - proof_begin < QUICK else AT_LEAST
    tally.true += 1
    tally.proved += bool(proof)
    if not proof or not {*proof.hypotheses} <= {*hypotheses}:
        tally.unproved.append(seed)
    rng = np.random.default_rng([seed, 1])
    for _ in range(times):
        other = perturbed(rng, rhs)
        if other is None or (other.domain, other.codomain) != (lhs.domain, lhs.codomain):
            continue
        claim = about(lhs, other, kind, soa)
        proof = prove(*said(*claim))
        tally.perturbed += 1
        tally.proved_perturbed += bool(proof)
        if proof and is_false(proof, *claim):
            tally.false_proofs.append((seed, str(proof)))
    tally.seconds = time.process_time() - begin
    return tally


def run(seeds):
    """Return the results of these seeds together."""
    return functools.reduce(Tally.add, map(tried, seeds), Tally())


def _numbered(seed, each):
    return seed, tried(seed, each)


def _seldom_collected():
    """Proofs make words by the million, all of which are in use: to look among them for garbage takes a fifth of the time."""
    gc.set_threshold(200_000, 50, 100)


def known(path):
    """Return the seeds in a file, one per line; the last line may be cut off."""
    found = {}
    for line in path.read_text().splitlines() if path is not None and path.exists() else ():
        try:
            seed, values = json.loads(line)
        except json.JSONDecodeError:
            continue
        found[seed] = Tally(**values)
    return found


def results(seeds, jobs, path, each):
    """The tally of each seed, as they come; those that the file has first."""
    one = functools.partial(_numbered, each=each)
    found = known(path)
    yield from (tally for seed, tally in found.items() if seed in seeds)
    left = [seed for seed in seeds if seed not in found]
    with contextlib.ExitStack() as open_here:
        lines = open_here.enter_context(open(path or os.devnull, "a"))
        if jobs > 1:
            pool = open_here.enter_context(multiprocessing.get_context("spawn").Pool(jobs, _seldom_collected))
        for seed, tally in pool.imap_unordered(one, left) if jobs > 1 else map(one, left):
            lines.write("\n" * (seed == left[0]) + json.dumps([seed, vars(tally)]) + "\n")
            lines.flush()
            yield tally


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--each", type=int, default=AT_LEAST, help=f"perturbations of a statement whose own proof takes below {QUICK} s")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="of wall time, after which no further seed is begun")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--to", type=Path, help="a file of results: what it has is not run again")
    parser.add_argument("--every", type=float, default=60.0, help="seconds between lines that say how far it is")
    given = parser.parse_args(arguments)
    total, begin = Tally(), time.perf_counter()
    said_at = begin
    for tally in results(range(given.first, given.first + given.seeds), given.jobs, given.to, given.each):
        total.add(tally)
        for seed, text in tally.false_proofs:
            print(f"FALSE, seed {seed}: {text}", flush=True)
        now = time.perf_counter()
        if now - said_at > given.every:
            said_at = now
            print(f"{now - begin:.0f} s, {total.true} of {given.seeds} seeds: {total}", flush=True)
        if now - begin > given.seconds:
            break
    print(total, flush=True)
    return 1 if total.false_proofs else 0


if __name__ == "__main__":
    sys.exit(main())
