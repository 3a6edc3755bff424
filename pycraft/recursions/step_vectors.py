"""Steps that give vectors: letters and blocks applied, resolvents by sweeps, the fused kernels, dense matrices."""

from __future__ import annotations

from typing import Any

from .formulas import Assembled, At, Cut, DiagonalPart, Function, Inverse, Node, Product, Quantity, Transposed, product, star
from .passes import CompositeAssembly, Equation, Term
from .steps import Recursion, Step, writer

_GROUPS = {"kinematics": 1, "articulated": 2, "composite": 4, "compliance": 8, "velocities": 16, "inverse": 32}


# ---------------------------------------------------------------------- values
@writer("values")
def _values(r: Recursion, step: Step) -> None:
    """The recursions behind a group of letters; the given blocks E, H, M, J need none, velocities are written where they are first read."""
    model, groups = r.models[step["context"]], step["groups"]
    if groups & (_GROUPS["articulated"] | _GROUPS["inverse"]):
        model.articulated_inertia()
    if groups & _GROUPS["composite"]:
        model.letter("R")
    if groups & _GROUPS["compliance"]:
        model.letter("Upsilon")


# ---------------------------------------------------------------------- vectors
@writer("gather")
def _gather(r: Recursion, step: Step) -> None:
    """y = φ x: y(k) = x(k) + Σ E(k,c) y(c); y = ψ x: the same with y⁺ = τ̄ y carried on."""
    model = r.models[step["context"]]
    E = model.at("E", "c")
    x = r.term(step["in"][0])
    if step["symbol"]["name"] == "phi":
        y = r.target(step["out"])
        r.sweep(-1, Equation(y, (x, Term(product(E, At(y, "c")), over="c"))))
        return
    G, H = model.at("G"), model.at("H")
    y = r.target(step["out"])
    plus = r.book.new("z_plus", tree=y.tree, rows=y.rows, columns=y.columns)
    r.sweep(
        -1,
        Equation(y, (x, Term(product(E, At(plus, "c")), over="c"))),
        Equation(plus, (Term(At(y)), Term(product(G, H, At(y)), -1.0))),
    )


@writer("scatter")
def _scatter(r: Recursion, step: Step) -> None:
    """y = φ* x: y(k) = x(k) + E*(p,k) y(p); y = ψ* x: the same with τ̄* E*(p,k) y(p)."""
    model = r.models[step["context"]]
    E = model.at("E")
    x = r.term(step["in"][0])
    if step["symbol"]["name"] == "phi":
        y = r.target(step["out"])
        r.sweep(1, Equation(y, (x, Term(product(star(E), At(y, "p")), over="p"))))
        return
    G, H = model.at("G"), model.at("H")
    y = r.target(step["out"])
    plus = r.book.new("alpha_plus", tree=y.tree, rows=y.rows, columns=y.columns)
    r.sweep(
        1,
        Equation(plus, (Term(product(star(E), At(y, "p")), over="p"),)),
        Equation(y, (x, Term(At(plus)), Term(product(star(H), star(G), At(plus)), -1.0))),
    )


@writer("apply_symbol")
def _apply_symbol(r: Recursion, step: Step) -> None:
    """y = A x, A* x, D⁻¹ x of a block-diagonal letter; E x and E* x move one edge."""
    model = r.models[step["context"]]
    if step["symbol"]["name"] == "E":
        over = "p" if step["transposed"] else "c"
        E = star(model.at("E")) if step["transposed"] else model.at("E", "c")
        term = r.term(step["in"][0], E, over=over)
        if isinstance(r.values[step["in"][0]], Quantity) or over == "c":
            r.sweep(1 if step["transposed"] else -1, Equation(r.target(step["out"]), (term,)))
        else:
            x = r.stored(step["in"][0])
            r.sweep(1, Equation(r.target(step["out"]), (Term(product(E, At(x, "p")), over="p"),)))
        return
    A: Node = At(r.symbol(step))
    A = Inverse(A) if step["inverted"] else star(A) if step["transposed"] else A
    term = r.term(step["in"][0], A)
    if not r.inline(step, term.node, term.coefficient):
        r.define(r.target(step["out"]), term)


@writer("apply_blocks")
def _apply_blocks(r: Recursion, step: Step) -> None:
    """y(k) = B(k) x(k) or B*(k) x(k)."""
    B = r.value(step["in"][0])
    term = r.term(step["in"][1], star(B.node) if step["transposed"] else B.node, coefficient=B.coefficient)
    if not r.inline(step, term.node, term.coefficient):
        r.define(r.target(step["out"]), term)


@writer("apply_constant")
def _apply_constant(r: Recursion, step: Step) -> None:
    """y = C x or C* x, C a dense matrix."""
    x = r.stored(step["in"][0])
    rows, columns = r.book.cut(r.plan["registers"][step["out"]]["space"]), x.rows
    assert not isinstance(columns, str)
    C = At(r.book.constant(step["constant"], *((columns, rows) if step["transposed"] else (rows, columns))), "")
    r.once(r.target(step["out"]), Term(product(star(C) if step["transposed"] else C, At(x, ""))))


@writer("apply_column")
def _apply_column(r: Recursion, step: Step) -> None:
    """y = v x with x in R^1, or y = v* x."""
    v = r.stored(step["in"][0])
    if step["transposed"]:
        x = r.stored(step["in"][1])
        where = "k" if v.kind == "blocks" else ""
        over = "bodies" if v.kind == "blocks" else ""
        r.once(r.target(step["out"]), Term(product(star(At(v, where)), At(x, where)), over=over))
    elif r.unit_input and step["in"][1] == r.plan["input"]:
        r.values[step["out"]] = v
    else:
        x = r.stored(step["in"][1])
        r.define(r.target(step["out"]), Term(product(At(v, "k" if v.kind == "blocks" else ""), At(x, ""))))


@writer("apply_external")
def _apply_external(r: Recursion, step: Step) -> None:
    """y = L x of an operator from outside."""
    x = r.stored(step["in"][0])
    rows = r.book.cut(r.plan["registers"][step["out"]]["space"])
    assert not isinstance(x.rows, str)
    L = r.book.external(step["external"], step["transposed"], rows, x.rows)
    r.once(r.target(step["out"]), Term(Product((At(L, ""), At(x, "")))))


@writer("combine")
def _combine(r: Recursion, step: Step) -> None:
    """y = Σ c_i x_i."""
    terms = [r.term(x, coefficient=c) for x, c in zip(step["in"], step["coefficients"], strict=True)]
    if len(terms) == 1 and r.inline(step, terms[0].node, terms[0].coefficient):
        return
    r.define(r.target(step["out"]), *terms)


@writer("vector_symbol")
def _vector_symbol(r: Recursion, step: Step) -> None:
    """A vector of the model: given, or by the recursion of velocities, accelerations, gravity; or a constant one."""
    if step["constant"] is None:
        r.values[step["out"]] = r.symbol(step)
    else:
        rows = r.book.cut(r.plan["registers"][step["out"]]["space"])
        r.values[step["out"]] = r.book.constant_vector(step["constant"], rows)


@writer("zero")
def _zero(r: Recursion, step: Step) -> None:
    """y = 0."""
    r.define(r.target(step["out"]))


# ---------------------------------------------------------------------- recognised kernels
@writer("mass_matrix")
def _mass_matrix(r: Recursion, step: Step) -> None:
    """y = HφMφ*H* x (+ J x): accelerations base to tip, forces tip to base."""
    model = r.models[step["context"]]
    H, M, E, E_child = model.at("H"), model.at("M"), model.at("E"), model.at("E", "c")
    if step["flag"]:
        r.stored(step["in"][0])
    columns = r.columns_of(step["out"])
    alpha = r.book.new("alpha", tree=model.tree, rows=model.bodies, columns=columns)
    f = r.book.new("f", tree=model.tree, rows=model.bodies, columns=columns)
    terms = (Term(product(star(E), At(alpha, "p")), over="p"), r.term(step["in"][0], star(H)))
    J = (r.term(step["in"][0], model.at("J")),) if step["flag"] else ()
    y = r.target(step["out"])
    r.sweep(1, Equation(alpha, terms))
    r.sweep(
        -1,
        Equation(f, (Term(product(M, At(alpha))), Term(product(E_child, At(f, "c")), over="c"))),
        Equation(y, (Term(product(H, At(f))), *J)),
    )


@writer("mass_matrix_solve")
def _mass_matrix_solve(r: Recursion, step: Step) -> None:
    """y = [I-HψK]* D⁻¹ [I-HψK] x: the innovations tip to base, accelerations base to tip."""
    model = r.models[step["context"]]
    H, G, D, E, E_child = model.at("H"), model.at("G"), model.at("D"), model.at("E"), model.at("E", "c")
    forces: dict[str, Any] = {"tree": model.tree, "rows": model.bodies, "columns": r.columns_of(step["out"])}
    coordinates = forces | {"rows": model.theta}
    z, z_plus = r.book.new("z", **forces), r.book.new("z_plus", **forces)
    eps, nu = r.book.new("eps", **coordinates), r.book.new("nu", **coordinates)
    alpha, plus = r.book.new("alpha", **forces), r.book.new("alpha_plus", **forces)
    x = r.term(step["in"][0])
    y = r.target(step["out"])
    r.sweep(
        -1,
        Equation(z, (Term(product(E_child, At(z_plus, "c")), over="c"),)),
        Equation(eps, (x, Term(product(H, At(z)), -1.0))),
        Equation(nu, (Term(product(Inverse(D), At(eps))),)),
        Equation(z_plus, (Term(At(z)), Term(product(G, At(eps))))),
    )
    r.sweep(
        1,
        Equation(plus, (Term(product(star(E), At(alpha, "p")), over="p"),)),
        Equation(y, (Term(At(nu)), Term(product(star(G), At(plus)), -1.0))),
        Equation(alpha, (Term(At(plus)), Term(product(star(H), At(y))))),
    )


@writer("mass_matrix_solve_tangent")
def _mass_matrix_solve_tangent(r: Recursion, step: Step) -> None:
    """∂(ℳ + J)⁻¹ x as −(ℳ + J)⁻¹ (∂ℳ) (ℳ + J)⁻¹ x: the core differentiates the sweep itself, which keeps more digits."""
    r.inlined(step)


@writer("mass_matrix_dense")
def _mass_matrix_dense(r: Recursion, step: Step) -> None:
    """ℳ (+ J) as a matrix, from the composite-body inertias."""
    model = r.models[step["context"]]
    J = model.letter("J") if step["flag"] else None
    H, R, E = model.letter("H"), model.letter("R"), model.letter("E")
    r.program.items.append(CompositeAssembly(r.target(step["out"]), model.tree, H, R, E, J, model.theta))


# ---------------------------------------------------------------------- dense matrices
@writer("dense_factor")
def _dense_factor(r: Recursion, step: Step) -> None:
    """A, the operand X made dense column by column, or X*X; solves with A factor it."""
    X = r.operator(step)
    if not step["flag"]:
        r.values[step["out"]] = X
        return
    A = r.book.new("A", "matrix", rows=X.columns, columns=X.columns)
    r.once(A, Term(product(Transposed(At(X, "")), At(X, ""))))
    r.values[step["out"]] = A


@writer("dense_solve")
def _dense_solve(r: Recursion, step: Step) -> None:
    """y = A⁻¹ x."""
    A, x = r.stored(step["in"][0]), r.stored(step["in"][1])
    r.once(r.target(step["out"]), Term(product(Inverse(At(A, "")), At(x, ""))))


@writer("logdet_of_dense")
def _logdet_of_dense(r: Recursion, step: Step) -> None:
    """ln|det A|."""
    A = r.stored(step["in"][0])
    r.once(r.target(step["out"]), Term(Function("logdet", At(A, ""))))


@writer("blocks_of_dense")
def _blocks_of_dense(r: Recursion, step: Step) -> None:
    """B(k) = A(k,k), A an operator formed as a dense matrix."""
    A = r.operator(step)
    shape = r._block_shape(r.plan["registers"][step["out"]])
    r.define(r.target(step["out"]), Term(DiagonalPart(A, shape["rows"], shape["columns"])))


@writer("gather_blocks")
def _gather_blocks(r: Recursion, step: Step) -> None:
    """A block-diagonal operator as a dense matrix."""
    B = r.stored(step["in"][0])
    assert isinstance(B.rows, Cut) and isinstance(B.columns, Cut)
    r.once(r.target(step["out"]), Term(Assembled(B, B.rows, B.columns)))
