"""Expressions as straight-line code: the recursion that `algorithm("python")` writes, run once on numbers that record their operations.

Decisions by value (pivots, residuals) become guards: where a guard fails, the expression is evaluated in the ordinary way.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import _core
from ..models.multibody import describe
from ..recursions import Algorithm
from ..state import random_state
from .kinematics import Kinematics, force_transform
from .trace import Graph

REQUESTS = ("apply", "dense", "diagonal", "trace", "logdet", "norm")
_FAINT = 1e-11  # ratio of a pivot to its scale: far above the rounding error of a zero, far below pivots of robots


class _TracedNumpy:
    """The part of NumPy that the source of recursions uses, on arrays of objects."""

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)

    @staticmethod
    def asarray(x: Any, *_: Any) -> np.ndarray:
        return np.asarray(x, object)

    @staticmethod
    def zeros(shape: Any, *_: Any) -> np.ndarray:
        return np.full(shape, 0.0, object)

    @staticmethod
    def zeros_like(x: np.ndarray) -> np.ndarray:
        return np.full(np.shape(x), 0.0, object)

    @staticmethod
    def eye(n: int) -> np.ndarray:
        return np.array(np.eye(n).tolist(), object).reshape(n, n)

    @staticmethod
    def ones(n: int) -> np.ndarray:
        return np.full(n, 1.0, object)


class _Functions:
    """The functions that decide by value, with guards instead of decisions. `scale`: largest inertia that a hinge can feel."""

    def __init__(self, graph: Graph, scale: float):
        self.graph, self.scale = graph, scale

    def symmetric(self, A: np.ndarray) -> np.ndarray:
        """Return a matrix that is symmetric except for rounding, with its upper triangle on both sides."""
        made = A.copy()
        for i in range(len(A)):
            made[i + 1 :, i] = A[i, i + 1 :]
        return made

    def _factors(self, A: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[Any]]:
        """Return L, U and the pivots of A = L diag(pivots) U with unit triangles; each pivot is guarded."""
        n, graph = len(A), self.graph
        U, pivots = np.array([[graph.number(x) for x in row] for row in A], object).reshape(n, n), []
        L = _TracedNumpy.eye(n)
        own = [abs(x) for x in np.diag(U)]
        mirrored = all(U[i, j].index == U[j, i].index for i in range(n) for j in range(i))
        for j in range(n):
            pivot = U[j, j]
            graph.guard(pivot if mirrored else abs(pivot), _FAINT * self.scale)
            if j:
                graph.guard(abs(pivot), _FAINT * own[j])
            pivots.append(pivot)
            reciprocal = 1.0 / pivot
            for i in range(j + 1, n):
                L[i, j] = U[i, j] * reciprocal
                for k in range(i if mirrored else j + 1, n):
                    U[i, k] = U[i, k] - L[i, j] * U[j, k]
                    if mirrored:
                        U[k, i] = U[i, k]
            U[j, j + 1 :] = [x * reciprocal for x in U[j, j + 1 :]]
        return L, U, pivots

    def solve(self, A: np.ndarray, b: np.ndarray) -> np.ndarray:
        """A⁻¹ b by elimination in order."""
        n = len(A)
        if n == 0:
            return b
        L, U, pivots = self._factors(A)
        x = np.array(b, object)
        for i in range(n):
            for j in range(i):
                x[i] = x[i] - x[j] * L[i, j]
        for i in range(n):
            x[i] = x[i] * (1.0 / pivots[i])
        for i in reversed(range(n)):
            for j in range(i + 1, n):
                x[i] = x[i] - x[j] * U[i, j]
        return x

    def inverse(self, A: np.ndarray) -> np.ndarray:
        return self.solve(A, _TracedNumpy.eye(len(A)))

    def logdet(self, A: np.ndarray) -> Any:
        if not len(A):
            return self.graph.number(0.0)
        return sum(abs(pivot).function("log") for pivot in self._factors(A)[2])

    def root(self, A: np.ndarray) -> np.ndarray:
        """L, lower triangular, A = L L*."""
        n = len(A)
        L = np.full((n, n), 0.0, object)
        for j in range(n):
            pivot = self.graph.number(A[j, j] - sum(L[j, i] * L[j, i] for i in range(j)))
            self.graph.guard(pivot, _FAINT * abs(self.graph.number(A[j, j])))
            L[j, j] = pivot.function("sqrt")
            for i in range(j + 1, n):
                L[i, j] = (A[i, j] - sum(L[i, k] * L[j, k] for k in range(j))) / L[j, j]
        return L

    def trace(self, A: np.ndarray) -> Any:
        return sum(np.diag(A), start=self.graph.number(0.0))

    def norm(self, A: np.ndarray) -> Any:
        return self.graph.number(sum(x * x for x in np.ravel(A))).function("sqrt")

    def square_root(self, x: Any) -> Any:
        x = self.graph.number(x)
        self.graph.guard(x, 0.0)
        return x.function("sqrt")

    def names(self) -> dict[str, Any]:
        """Return the functions by their names in the source."""
        offered = ("symmetric", "solve", "inverse", "logdet", "root", "trace", "norm", "square_root")
        return {name: getattr(self, name) for name in offered}


def _traced_system(TreeSystem: type, graph: Graph, functions: _Functions) -> type:
    """Return the elimination along a tree, with its check against a known solution as guards."""

    class TracedTreeSystem(TreeSystem):  # type: ignore[misc]  # defined when the source has run
        factored: bool

        def factor(self) -> None:
            if self.factored:
                return
            self.factored = True
            A, U, X, Y = self.pivots = tuple([np.empty((0, 0), object)] * self.n for _ in range(4))
            scale, functions.scale = functions.scale, 0.0  # these pivots are not pivots of hinges
            for k in reversed(range(self.n)):
                c_k = self.children[k]
                A[k] = self.T_own[k] - sum(self.T_up[c] @ U[c] for c in c_k)
                U[k] = functions.solve(A[k], self.T_down[k])
                X[k] = functions.solve(A[k], self.T_right[k] - sum(self.T_up[c] @ X[c] for c in c_k))
                Y[k] = self.T_below[k] - sum(Y[c] @ U[c] for c in c_k)
            self.S = self.T_corner - sum(Y[k] @ X[k] for k in range(self.n))
            known = [np.where(np.arange(a[-1])[:, None] % 3 == 1, -1.0, 1.0).astype(object) for a in self.start]
            for f, g in zip(self.sweep(self.times(known)), known, strict=True):
                for x, y in zip(np.ravel(f), np.ravel(g), strict=True):
                    graph.guard(1e-9, abs(x - y))
            functions.scale = scale

    return TracedTreeSystem


_DERIVED = {
    "hinge subset": "the tree of free or of prescribed coordinates",
    "world frame": "the tree in world axes",
    "cut tree": "the tree cut at a hinge",
    "another root": "the tree with another root",
    "loops": "the rows of loops",
    "groups of bodies": "the tree of grouped bodies",
    "embedded loops": "the tree of embedded loops",
}


def _check_recordable(source: Any, expression: Any) -> None:
    """Raise EvaluationError if the letters of a tree are known only as values at one state, which the code would freeze."""
    if isinstance(source, (_core.MultibodyOperators, _core.MatrixTree)):
        return
    made = source.derived_from
    if made is None and isinstance(source.__reduce__()[1][0], _core.MatrixTree):  # bodies in pairs, in a tree that does not move
        return
    what = _DERIVED[made[0]] if made is not None else "the tree of bodies in pairs"
    raise _core.EvaluationError(
        f"compile() cannot record {expression.text()}: its letters of {source.name!r}, {what}, are not available as "
        "functions of q, so the code would freeze their values at the model's present state. Evaluate it by at(q), which takes "
        "batches, or compile it at one state: at(q).compile()"
    )


def _scale(model: Any) -> float:
    """Return the largest inertia that a hinge can feel: all masses at the total length of the tree, and their own inertias."""
    bodies = describe(model)["bodies"]
    mass = sum(b["mass"] for b in bodies)
    way = sum(np.abs(b["hinge"]["placement"]["position"]).sum() + np.abs(b["com"]).sum() for b in bodies)
    return float(max(mass, 4 * (mass * way * way + sum(np.trace(b["inertia"]) for b in bodies))))


class ExpressionGraph:
    """The graph of a request of an expression.

    Attributes
    ----------
    graph, results : the nodes of the result, in its shape
    arguments : names and widths of the arguments: q and v of a model whose letters are not bound, and x
    model : that model; None if everything is bound
    vectors : the names of named vectors by those of their arguments
    """

    def __init__(self, expression: Any, request: str):
        if request not in REQUESTS:
            raise _core.EvaluationError(f"compile() supports {', '.join(map(repr, REQUESTS))}, not {request!r}")
        algorithm = Algorithm(expression, "python", request)
        for model in algorithm._book.models:
            if not model.binding:
                _check_recordable(model.source, expression)
        self.graph = Graph()
        free = [m for m in algorithm._book.models if not m.binding and isinstance(m.source, _core.MultibodyOperators)]
        if len(free) > 1:
            raise _core.EvaluationError("compile() takes expressions of one model in one ordering of its bodies; bind the others by at(q)")
        self.model = free[0].source.model if free else None
        data = algorithm.data()
        reads_v = False
        if self.model is not None:
            moving = self._moving(algorithm, free[0], data)
            data |= moving
            reads_v = any(leaf.symbol in ("theta_dot", "H_dot") for leaf in algorithm._book.leaves if leaf.quantity.name in moving)
        takes = [q for q in algorithm._arguments() if not algorithm._program.identity_columns or q not in algorithm._program.inputs]
        widths = [q.rows if isinstance(q.rows, int) else q.rows.total for q in takes]
        self.arguments: list[tuple[str, int]] = []
        if self.model is not None:
            self.arguments = [("q", self.model.nq), *([("v", self.model.nv)] if reads_v else [])]
        self.vectors = {q.name: name for name, q in algorithm._recursions[0].vectors.items()}
        given = [np.array(self.graph.inputs(q.name, n), object) for q, n in zip(takes, widths, strict=True)]
        self.arguments += [(q.name, n) for q, n in zip(takes, widths, strict=True)]
        names = [name for name, _ in self.arguments]
        for name in names:
            if names.count(name) > 1:
                raise _core.EvaluationError(f"the vector {name!r} has the name of another argument of the compiled function; rename it")
        results = self._run(str(algorithm), data, given)
        found = np.array(results, object)
        nodes = [self.graph.number(x).index for x in found.ravel()]
        self.results = np.array(nodes, int).reshape(found.shape)

    def _run(self, source: str, data: dict[str, Any], given: Sequence[np.ndarray]) -> Any:
        names: dict[str, Any] = {"np": _TracedNumpy(), "float": lambda x: x}
        exec(source.replace("\nimport numpy as np\n", "\n"), names)  # noqa: S102 - the library's own source
        functions = _Functions(self.graph, _scale(self.model) if self.model is not None else 0.0)
        names |= {name: f for name, f in functions.names().items() if name in names}
        if "TreeSystem" in names:
            names["TreeSystem"] = _traced_system(names["TreeSystem"], self.graph, functions)
        return names["algorithm"](data, *given)

    def _moving(self, algorithm: Algorithm, model: Any, data: dict[str, Any]) -> dict[str, Any]:
        """Return the given letters that depend on the state, as functions of the state."""
        source = self.model
        assert source is not None
        samples = [algorithm.data(s.q, s.v) for s in (random_state(source, k) for k in (1, 2))]
        at = Kinematics(source, self.graph)
        roots = [p < 0 for p in model.source.parents]
        made: dict[str, Any] = {}
        for leaf in algorithm._book.leaves:
            name = leaf.quantity.name
            if leaf.source == "external":
                raise _core.EvaluationError(f"compile() cannot see into {name!r}, an external operator")
            if name not in data or leaf.context != model.index or all(_equal(data[name], s[name]) for s in samples):
                continue
            match leaf.symbol:
                case "E":
                    made[name] = [None if root else force_transform(x) for x, root in zip(at.poses, roots, strict=True)]
                case "H":
                    made[name] = at.H
                case "H_dot":
                    made[name] = at.H_dot
                case "theta_dot":
                    made[name] = np.array([x for body in at.theta_dot for x in body], object).reshape(-1, 1)
                case "X_world":
                    none = np.full((6, 6), 0.0, object)
                    made[name] = [force_transform(x) if root else none for x, root in zip(at.poses, roots, strict=True)]
                case "gravity_base":
                    field = np.array([0.0, 0.0, 0.0, *(-describe(source)["gravity"]).tolist()], object)
                    parts = [force_transform(x).T @ field if root else 0.0 * field for x, root in zip(at.poses, roots, strict=True)]
                    made[name] = np.concatenate(parts).reshape(-1, 1)
                case _:
                    raise _core.EvaluationError(
                        f"compile() has no formula for {leaf.symbol} as a function of the coordinates; bind it to a state by at(q)"
                    )
        return made


def _equal(a: Any, b: Any) -> bool:
    """Return True if two values of a leaf are equal bit for bit."""
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(_equal(x, y) for x, y in zip(a, b, strict=True))
    return a is b if a is None or b is None else bool(np.array_equal(a, b))
