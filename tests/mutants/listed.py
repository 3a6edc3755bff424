"""Small wrong changes that a saboteur thought of, one by one: caches, thresholds, bounds, verdicts, options. Each once survived the tests.

An expression of C++ becomes `(switch ? wrong : right)`, a statement `if (switch) { wrong } else { right }`.
"""

import ast
import pathlib
from dataclasses import dataclass

from .mutant import Mutant, line_of, shown_line


@dataclass(frozen=True)
class Change:
    name: str
    file: str
    before: str
    after: str
    statement: bool = False


CPP = [
    Change(
        "a comparison of packs holds where any lane holds",
        "cpp/spatial/pack.h",
        "all &= f(a.v[i], b.v[i]);",
        "{ if (i == 0) all = false; all |= f(a.v[i], b.v[i]); }",
        True,
    ),
    Change("stale numbers of the present state", "cpp/algebra/source.cpp", "c.parameters != version", "false"),
    Change("stale numbers of a bound state", "cpp/algebra/source.cpp", "e.parameters != source->parameters()", "false"),
    Change("stale workspaces of direct calls", "cpp/dynamics/workspace_pool.h", "version_ != model.parameters()", "version_ == 0"),
    Change(
        "plans for J = 0 kept",
        "cpp/algebra/engine.cpp",
        "plan_->contexts[c].source->traits().hinge_diagonal != plan_->hinge_diagonal[c]",
        "false",
    ),
    Change(
        "only the first model of a plan is looked at",
        "cpp/algebra/engine.cpp",
        "plan_->contexts[c].source->check_current();",
        "if (c > 0) return true;",
        True,
    ),
    Change("∂P without G ∂J G*", "cpp/algebra/differentiate.cpp", "times({o.G, run(o.J), o.G.T()})", "zero(o.M.domain(), o.M.codomain())"),
    Change(
        "∂ blockdiag(AXA*) as if X were symmetric",
        "cpp/algebra/differentiate.cpp",
        "times({bar, e, star(F)})",
        "star(times({F, e, star(bar)}))",
    ),
    Change("a coordinate moves its own twist", "cpp/operators/directions.cpp", "own.slot < at.slot) terms", "own.slot <= at.slot) terms"),
    Change(
        "minimum norm refined without the added inertia",
        "cpp/dynamics/rigid_dynamics.cpp",
        "r[j] += inertia * x[j];",
        "(void)inertia;",
        True,
    ),
    Change("projected once", "cpp/dynamics/rigid_dynamics.cpp", "pass < 2", "pass < 1"),
    Change("refinement refuses at 0.9", "cpp/algebra/refinement.h", "S(0.3)", "S(0.9)"),
    Change("refinement goes on while corrections shrink", "cpp/algebra/refinement.h", "worst < last / S(2)", "worst < last"),
    Change(
        "refinement goes on while corrections shrink", "cpp/algebra/refinement.h", "length < work.last[c] / S(2)", "length < work.last[c]"
    ),
    Change("stale numbers of a bound state", "cpp/algebra/source.cpp", "entry->parameters != source->parameters()", "false"),
    Change("what cancelled is not counted", "cpp/algebra/refinement.h", "S(S(1e3) * epsilon<S>() * largest)", "S(0)"),
    Change("pivot bound without its (j + 1)", "cpp/algebra/sweeps/singular_pivot.h", "return S(j + 1) * sum;", "return sum;", True),
    Change("pivot bound without its J", "cpp/operators/rigid_blocks.h", "dot(H[j], X_[k] * H[j]) + J[j]", "dot(H[j], X_[k] * H[j])"),
    Change(
        "the wider residual rounded first",
        "cpp/dynamics/rigid_dynamics.cpp",
        "wider_->residual(tau, wide_x_.data(), wide_r_.data());",
        "residual(tau, x, r); for (int i = 0; i < n; ++i) wide_r_[i] = Wider<S>(r[i]);",
        True,
    ),
    Change("elimination with one refinement", "cpp/algebra/elimination_solve.h", "step < std::max(asked, 4)", "step < 1"),
    Change("digits lost by the elimination ignored", "cpp/algebra/elimination_solve.h", "growth_ <= tolerated", "true"),
    Change(
        "conjugate gradients never refuse",
        "cpp/dynamics/methods.cpp",
        "gradients_.residual < sqrt(epsilon<S>()) && gradients_.condition < widest",
        "true",
    ),
    Change(
        "quaternions lose their length in a move", "cpp/recursions/configuration_rate.h", "scale = sqrt(S(had / has));", "scale = S(1);"
    ),
    Change("the step after a cut step is the cut one", "cpp/dynamics/trajectory.cpp", "cut && abs(tried) < abs(h) ? h : tried", "tried"),
    Change("a batch returns its first state's rows", "cpp/dynamics/packed_dynamics.cpp", "from[b * stride + i]", "from[i]"),
]

PYTHON = [
    Change(
        "a report counts what fails as passed",
        "pycraft/identities/report.py",
        'self.verdict in ("holds", ',
        'self.verdict in ("fails", "holds", ',
    ),
    Change("a report is always true", "pycraft/identities/report.py", "return all(f.passed for f in self.findings)", "return True"),
    Change("a report counts what fails as passed", "pycraft/identities/report.py", 'PASSED = ("holds", ', 'PASSED = ("fails", "holds", '),
    Change("a report is always true", "pycraft/identities/report.py", "        return not self.failed\n", "        return True\n"),
    Change("undecided at a bound of 1", "pycraft/identities/judge.py", "DECIDES = 1e-12", "DECIDES = 1.0"),
    Change("the residual need not fall", "pycraft/identities/judge.py", " and falls[-1] and (", " and ("),
    Change(
        "check --json without its seed",
        "pycraft/cli.py",
        "states=states, seed=seed, precision=wide, progress",
        "states=states, precision=wide, progress",
    ),
    Change("bench exits with 0", "pycraft/cli.py", "raise typer.Exit(1 if missed else 0)", "raise typer.Exit(0)"),
    Change("bench loses its bounds", "pycraft/bench.py", "self.bound is None or self.value <= self.bound", "True"),
    Change(
        "check --json without its seed", "pycraft/cli.py", "states=states, seed=seed, precision=wide)\n", "states=states, precision=wide)\n"
    ),
    Change("--mimic ignored", "pycraft/cli.py", 'root=root or "fixed", mimic=mimic', 'root=root or "fixed", mimic="lock"'),
    Change("--root ignored", "pycraft/cli.py", 'root=root or "fixed", mimic=mimic', 'root="fixed", mimic=mimic'),
    Change("stability --no-peers ignored", "pycraft/cli.py", "cases=chosen, peers=peers", "cases=chosen, peers=True"),
    Change("stability --seeds ignored", "pycraft/cli.py", "hard.run(seeds, steps", "hard.run(1, steps"),
    Change("peers --seed ignored", "pycraft/cli.py", "compare_all(states, seed,", "compare_all(states, 0,"),
    Change("accuracy --seed ignored", "pycraft/cli.py", "                    seed=seed,\n", "                    seed=0,\n"),
    Change("a divisor as a factor", "pycraft/identities/book.py", "value / divisor", "value * divisor"),
    Change(
        "a sign bound to the whole sum",
        "pycraft/identities/book.py",
        "negative = False\n        return total",
        "pass\n        return total",
    ),
    Change(
        "a fraction read upside down",
        "pycraft/identities/book.py",
        "float(parts[0]) / float(parts[1])",
        "float(parts[1]) / float(parts[0])",
    ),
    Change("a star that does not transpose", "pycraft/identities/book.py", "return lambda x: x.T", "return lambda x: x"),
    Change("undecided at a bound of 1", "pycraft/identities/checker.py", "UNDECIDED = 1e-6", "UNDECIDED = 1.0"),
    Change("the residual need not fall", "pycraft/identities/checker.py", " and falls else", " else"),
    Change(
        "a quaternion's rotation with a sign wrong", "pycraft/models/rotations.py", "[1 - 2 * (y * y + z * z)", "[1 + 2 * (y * y + z * z)"
    ),
    Change(
        "an inertia turned the other way",
        "pycraft/models/rotations.py",
        "rotation @ inertia @ rotation.T",
        "rotation.T @ inertia @ rotation",
    ),
]


def found(root, changes):
    """(mutants, names of changes whose text is no longer there exactly once). A name may have several texts, of which one is there."""
    mutants, stale = [], []
    for c in changes:
        path = pathlib.Path(root) / c.file
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        if text.count(c.before) != 1:
            stale.append(c.name)
            continue
        begin = text.index(c.before)
        after, functions = c.after, ()
        if c.file.endswith((".h", ".cpp")):
            after = f"if (PYCRAFT_MUTANT({{i}})) {{ {c.after} }} else {{ {c.before} }}" if c.statement else switched(c.before, c.after)
        else:
            functions = function_around(text, line_of(text, begin))
        mutants.append(
            Mutant(
                c.file,
                line_of(text, begin),
                c.name,
                begin,
                begin + len(c.before),
                c.before,
                after,
                shown_line(text, begin),
                c.name,
                c.name,
                functions,
            )
        )
    there = {m.name for m in mutants}
    return mutants, [name for name in stale if name not in there]


def function_around(text, line):
    """(first, last) line of the innermost function of Python there, as its code object counts them."""
    found = ()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and node.lineno <= line <= node.end_lineno:
            found = max(found, (min([node.lineno, *(d.lineno for d in node.decorator_list)]), node.end_lineno))
    return found


def switched(before, after):
    """Text that is one expression on either side, or an expression inside a common frame (`name = expression;`)."""
    head = 0
    while head < min(len(before), len(after)) and before[head] == after[head]:
        head += 1
    while head and before[head - 1] not in "=(":  # whole operands
        head -= 1
    prefix, right, wrong = before[:head], before[head:], after[head:]
    end = ";" if right.endswith(";") else ""
    if right.count("(") != right.count(")") or wrong.count("(") != wrong.count(")"):
        prefix, right, wrong, end = "", before, after, ""
    right, wrong = right.removesuffix(";"), wrong.removesuffix(";")
    tail = ""
    for suffix in (") terms",):
        if right.endswith(suffix):
            right, wrong, tail = right.removesuffix(suffix), wrong.removesuffix(suffix), suffix
    return f"{prefix} (PYCRAFT_MUTANT({{i}}) ? ({wrong.strip()}) : ({right.strip()})){tail}{end}"
