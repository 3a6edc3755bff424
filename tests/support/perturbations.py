"""Statements one step from a true one: a letter exchanged for another between the same spaces; and an evaluator of expressions
by dense NumPy that says whether such a statement is false indeed.
"""

import functools

import numpy as np

import pycraft as pc
from pycraft.proofs import values
from support.formulas import blocks_only

EXCHANGED = {
    "E": "E_psi",
    "E_psi": "E",
    "phi": "psi",
    "psi": "phi",
    "phi_tilde": "psi_tilde",
    "psi_tilde": "phi_tilde",
    "tau": "tau_bar",
    "tau_bar": "tau",
    "M": "R",
    "P": "R",
    "P_plus": "P",
    "R": "P",
    "G": "K",
    "K": "G",
    "Upsilon": "Omega",
    "Omega": "Upsilon",
    "D": "J",
    "J": "D",
    "V_bar": "Delta_theta_dot",
    "Delta_theta_dot": "V_bar",
}


def rebuilt(op, children):
    """The same node over other children."""
    made = op._with_operand(children[0]) if op.kind == "function" else values.rebuilt(op, children)
    assert made is not None, op.kind
    return made


def nodes(e, path=()):
    """(path, node) of every node."""
    yield path, e
    for i, child in enumerate(e.children):
        yield from nodes(child, (*path, i))


def replaced(e, path, by):
    """The expression with another node at a path."""
    if not path:
        return by
    children = list(e.children)
    children[path[0]] = replaced(children[path[0]], path[1:], by)
    return rebuilt(e, children)


def exchanges(op):
    """(what was done, the expression) with one letter exchanged; what makes no sense then is left out."""
    if op.kind == "symbol":
        source = op.sources[0]
        if op.name in EXCHANGED:
            yield f"{op.name} -> {EXCHANGED[op.name]}", source.symbol(EXCHANGED[op.name])
        elif op.name in (
            "H",
            "H_dot",
            "V_tilde",
            "momentum_cross",
            "X_world",
            "theta_dot",
            "velocity",
            "a",
            "b",
            "gravity_base",
            "gravity_field",
        ):
            yield f"{op.name} -> 1.25 {op.name}", 1.25 * op
    for i, child in enumerate(op.children):
        for what, changed in exchanges(child):
            try:
                yield what, rebuilt(op, [*op.children[:i], changed, *op.children[i + 1 :]])
            except pc.SpaceError:
                continue


def dense(op, vectors):
    """The value of an expression by NumPy's own products, sums and inverses, from the entries of its letters."""
    parts = [dense(child, vectors) for child in op.children]
    match op.kind:
        case "symbol" | "constant":
            return op.dense()
        case "vector":
            return vectors[op.name][:, None]
        case "identity":
            return np.eye(op.shape[0])
        case "zero":
            return np.zeros(op.shape)
        case "sum":
            return sum(parts)
        case "product":
            return functools.reduce(np.matmul, parts)
        case "scaled":
            return op.coefficient * parts[0]
        case "transpose":
            return parts[0].T
        case "inverse":
            return np.linalg.inv(parts[0])
        case "blockdiag":
            return blocks_only(parts[0], op.codomain.blocks, op.domain.blocks)
        case "sqrt":
            root = np.zeros_like(parts[0])
            for _, s, _ in op.codomain.blocks:
                root[s, s] = np.linalg.cholesky(parts[0][s, s])
            return root
        case "function":
            value = np.zeros(op.shape)
            for (_, rows, _), (_, columns, _) in zip(op.codomain.blocks, op.domain.blocks, strict=True):
                value[rows, columns] = FUNCTIONS[op.name](parts[0][rows] if parts[0].shape[1] == 1 else parts[0][rows, columns])
            return value
    raise AssertionError(op.kind)


def _cross(x):
    return np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])


def _six(x, upper, lower, corner):
    """[[ã, upper b̃], [lower b̃, corner ã]] of x = (a; b)."""
    a, b = _cross(x[:3, 0]), _cross(x[3:, 0])
    return np.block([[a, upper * b], [lower * b, corner * a]])


FUNCTIONS = {
    "crm": lambda x: _six(x, 0, 1, 1),
    "crf": lambda x: _six(x, 1, 0, 1),
    "mcross": lambda x: -_six(x, 1, 1, 0),
    "lower_half": lambda X: np.tril(X, -1) + np.diag(np.diag(X)) / 2,
}


def named_vectors(op):
    """Names and sizes of the vectors of an expression."""
    found = {op.name: len(op.codomain)} if op.kind == "vector" else {}
    for child in op.children:
        found |= named_vectors(child)
    return found


def difference(lhs, rhs, seed=0):
    """How far two expressions are apart, relative to the larger, at random vectors: dense NumPy's word on a statement."""
    rng = np.random.default_rng(seed)
    names = named_vectors(lhs) | named_vectors(rhs)
    vectors = {name: rng.uniform(-1, 1, size) for name, size in sorted(names.items())}
    left, right = dense(lhs, vectors), dense(rhs, vectors)
    return np.abs(left - right).max(initial=0.0) / max(np.abs(left).max(initial=0.0), np.abs(right).max(initial=0.0), 1e-300)
