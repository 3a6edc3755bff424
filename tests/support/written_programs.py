"""Programs that plans are written out as: run without pycraft, against dense values; and what is written in every language."""

import ast

import numpy as np

import pycraft as pc
from support.formulas import EPS, SLACK, norm
from support.spellings import letters_and_constants

EXECUTED = set()  # kinds of steps whose emitted source ran in this run


def kinds_of(program):
    """The kinds of a plan's steps, those of its operands included."""
    found = set()
    for step in program["steps"]:
        found.add(step["kind"])
        if step["operand"]:
            found |= kinds_of(step["operand"])
    return found


def compiled(algorithm):
    """The function of an algorithm's Python source, run in a namespace that knows nothing of pycraft."""
    source = algorithm.python()
    imported = {alias.name for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Import) for alias in node.names}
    assert imported == {"numpy"} and "pycraft" not in source
    assert not any(isinstance(node, ast.ImportFrom) for node in ast.walk(ast.parse(source)))
    names = {"__name__": "written"}
    exec(compile(source, "written.py", "exec"), names)
    for plan in algorithm._plans:
        EXECUTED.update(kinds_of(plan.program))
    return names["algorithm"]


def run(algorithm, *arguments, **state):
    """The number, vector or matrix that the emitted source computes."""
    return compiled(algorithm)(algorithm.data(**state), *arguments)


def logdet_bound(formula):
    """Return the effect of rounding on ln|det| (formulas.Formula.assert_logdet)."""
    n, inverse = len(formula.value), norm(np.linalg.inv(formula.value)) if len(formula.value) else 0.0
    return SLACK * inverse * (formula.error + n * EPS * norm(formula.value)) * np.sqrt(max(n, 1)) + n * EPS


def assert_runs(formula, rng, requests=("apply", "dense", "norm", "diagonal", "trace", "logdet")):
    """Every request of a formula that has it, as emitted Python, against the dense value."""
    op, value = formula.op, formula.value
    rows, n = value.shape
    square = op.domain == op.codomain or op.domain == op.codomain.dual
    for request in requests:
        if request in ("diagonal", "trace", "logdet") and not square:
            continue
        if request == "logdet" and rows and not (np.linalg.cond(value) < 1e12 and logdet_bound(formula) < 1):
            continue  # singular to working precision
        written = op.algorithm("python", request)
        assert written.text and written.latex
        if request == "apply":
            x = rng.uniform(-1, 1, (n, 2))
            formula.assert_close(run(written, x), value @ x, np.sqrt(2 * n))
            formula.assert_close(run(written, x[:, 0]), value @ x[:, 0], np.sqrt(n))
        elif request == "dense":
            formula.assert_close(run(written))
        elif request == "norm":
            formula.assert_close(run(written), norm(value), np.sqrt(rows * n))
        elif request == "diagonal":
            formula.assert_close(run(written), np.diag(value))
        elif request == "trace":
            formula.assert_close(run(written), np.trace(value), n)
        else:
            off = abs(run(written) - np.linalg.slogdet(value)[1])
            assert off <= logdet_bound(formula), f"ln|det({op.text()})|: off by {off:.2e}"


MECHANICS = {
    "θ̇": lambda o: o.theta_dot,
    "V": lambda o: o.velocity,
    "a": lambda o: o.a,
    "b": lambda o: o.b,
    "γ": lambda o: o.gravity_field,
    "a₀": lambda o: o.gravity_base,
    "bias": lambda o: o.H @ o.phi @ (o.M @ o.phi.T @ o.a + o.b),
    "gravity": lambda o: o.H @ o.phi @ o.M @ o.gravity_field,
    "Ṽa": lambda o: o.V_tilde @ o.a,
    "𝓑V": lambda o: o.momentum_cross @ o.velocity + o.V_bar @ o.b,
    "X*a": lambda o: o.X_world.T.inv() @ o.a,
    "Δb": lambda o: o.Delta(3) @ o.b + o.Delta_theta_dot @ o.b,
    "Ḣ*θ̇": lambda o: o.H_dot.T @ o.theta_dot,
}


def constants_alone(soa, rng):
    """Expressions without a letter of a model."""
    n = len(soa.Theta)
    C = pc.constant(rng.normal(size=(n, n)), soa.Theta, soa.Theta, "C")
    d = pc.constant(rng.uniform(1, 2, n), soa.Theta, soa.Theta, "d")
    U = pc.constant(rng.normal(size=(n, 2)), 2, soa.Theta, "U")
    yield from (C, 2 * C.T @ C, C + d, d.inv() @ d, U, U.T @ U, pc.identity(soa.Theta), pc.zero(soa.Theta, soa.F))
    yield from (pc.identity(pc.euclidean(1)), 3 * pc.identity(pc.euclidean(1)), (U.T @ U).inv(), C.inv())


def dense_expressions():
    """Expressions whose plans have dense steps."""
    o, c = letters_and_constants(True)
    full = c.full()
    return {
        "inverse": (o.MM + full).inv(),
        "inverse of inverse": ((o.MM + full).inv() + 0.1 * o.I).inv(),
        "blocks": (o.MM + full).inv().blockdiag(),
        "product": full @ o.MM,
    }


def scalars(o):
    """Scalars made of operators."""
    MM = o.MM.op
    yield from (MM.trace(), 2 * MM.trace() - o.D.op.logdet() + 1.5, (MM + o.J.op).logdet() + MM.norm(), -(3 * (MM.trace() - 2)))
    yield from (o.D.op.logdet(), o.phi.op.logdet(), pc._core.scalar(2.5), o.soa.H.norm() - 2 * o.MM.op.norm())


DERIVATIVES = {
    "∂ℳ": lambda o, d: o.MM.op.diff(d),
    "∂ℳ⁻¹": lambda o, d: (o.MM + o.J).inv().op.diff(d),
    "∂φ": lambda o, d: o.phi.op.diff(d),
    "∂D": lambda o, d: o.D.op.diff(d),
    "∂∂ℳ": lambda o, d: o.MM.op.diff(d).diff(1),
    "∂D^½": lambda o, d: o.D.op.sqrt().diff(d),
    "∂b": lambda o, d: o.soa.b.diff(d),
    "∂a": lambda o, d: o.soa.a.diff(d),
    "∂V̄": lambda o, d: o.soa.V_bar.diff(d),
    "∂𝓑": lambda o, d: o.soa.momentum_cross.diff(d),
    "∂Υ": lambda o, d: o.Upsilon.op.diff(d),
    "∂ℳ, world": lambda o, d: o.MM.op.diff(d, frame="world"),
    "ℳ̇": lambda o, d: o.MM.op.dot(),
    "ḃ": lambda o, d: o.soa.b.dot(vdot=np.linspace(-1, 1, len(o.soa.Theta))),
    "V̄̇": lambda o, d: o.soa.V_bar.dot(vdot=np.linspace(-1, 1, len(o.soa.Theta))),
}


def assert_is_the_operator(op):
    """The emitted source applies the operator, to rounding at the size of what it maps to, cancellation within it allowed."""
    written = op.algorithm("python")
    assert written.text and written.latex
    x = np.random.default_rng(11).normal(size=(op.shape[1], 2))
    vector = op.shape[1] == 1 and not written._program.inputs
    got, expected = (run(written), op.value()) if vector else (run(written, x), op @ x)
    assert np.abs(got - expected).max(initial=0.0) <= 1e-9 * (1 + np.abs(expected).max(initial=0.0)), op.text()
