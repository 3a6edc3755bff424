"""Steps that give blocks and numbers: block-diagonal operators body by body, diagonal blocks, traces, determinants, norms."""

from __future__ import annotations

from .. import _core
from .formulas import At, Function, Identity, Inverse, Product, moved, product, star
from .passes import Equation, Term
from .steps import Formula, Recursion, Step, writer


# ---------------------------------------------------------------------- blocks
@writer("load_blocks")
def _load_blocks(r: Recursion, step: Step) -> None:
    """The blocks of a letter or of a block-diagonal constant, read where needed."""
    if step["constant"] is None:
        r.values[step["out"]] = r.symbol(step)
    else:
        shape = r._block_shape(r.plan["registers"][step["out"]])
        r.values[step["out"]] = r.book.constant(step["constant"], shape["rows"], shape["columns"])


@writer("identity_blocks")
def _identity_blocks(r: Recursion, step: Step) -> None:
    """I, body by body."""
    r.values[step["out"]] = Formula(Identity(r._block_shape(r.plan["registers"][step["out"]])["rows"]))


@writer("multiply_blocks")
def _multiply_blocks(r: Recursion, step: Step) -> None:
    """B(k) = B1(k) B2(k)."""
    a, b = (r.value(i) for i in step["in"])
    node = product(a.node, b.node)
    if not r.inline(step, node, a.coefficient * b.coefficient):
        r.define(r.target(step["out"]), Term(node, a.coefficient * b.coefficient))


@writer("combine_blocks")
def _combine_blocks(r: Recursion, step: Step) -> None:
    """B(k) = Σ c_i B_i(k)."""
    terms = [r.term(b, coefficient=c) for b, c in zip(step["in"], step["coefficients"], strict=True)]
    r.define(r.target(step["out"]), *terms)


@writer("transpose_blocks")
def _transpose_blocks(r: Recursion, step: Step) -> None:
    """B*(k), read where needed."""
    value = r.value(step["in"][0])
    if isinstance(value.node, Product):
        value = Formula(At(r.stored(step["in"][0])))
    r.values[step["out"]] = Formula(star(value.node), value.coefficient)


@writer("invert_blocks")
def _invert_blocks(r: Recursion, step: Step) -> None:
    """B⁻¹(k), body by body."""
    value = r.value(step["in"][0])
    r.define(r.target(step["out"]), Term(Inverse(value.node), 1 / value.coefficient))


@writer("root_blocks")
def _root_blocks(r: Recursion, step: Step) -> None:
    """L(k) with B(k) = L(k) L*(k)."""
    value = r.value(step["in"][0])
    inner = value.node if value.coefficient == 1 else At(r.stored(step["in"][0]))
    r.define(r.target(step["out"], "L"), Term(Function("root", inner)))


@writer("function_blocks")
def _function_blocks(r: Recursion, step: Step) -> None:
    """crm(x(k)), crf(x(k)), ... of a vector; the lower triangle of B(k) with half its diagonal."""
    name = step["symbol"]["name"]
    inner = r.stored(step["in"][0])
    names = {"crm": "crm", "crf": "crf", "mcross": "cross_of_momentum"}
    if name in names and r.models[step["context"]].source.groups is not None:
        raise _core.EvaluationError(
            f"{name} of a vector acts body by body within a group, which a recursion over groups cannot express; "
            "write out the operators of the model itself"
        )
    r.define(r.target(step["out"]), Term(Function(names.get(name, "lower_half"), At(inner))))


@writer("congruence_blocks")
def _congruence_blocks(r: Recursion, step: Step) -> None:
    """blockdiag(E B E*): Σ E(k,c) B(c) E*(k,c); transposed, blockdiag(E* B E): E*(p,k) B(p) E(p,k)."""
    model, B = r.models[step["context"]], r.value(step["in"][0])
    over = "p" if step["transposed"] else "c"
    E = model.at("E") if step["transposed"] else model.at("E", "c")
    inner = moved(B.node, {"k": over})
    carried = product(star(E), inner, E) if step["transposed"] else product(E, inner, star(E))
    r.sweep(1 if step["transposed"] else -1, Equation(r.target(step["out"]), (Term(carried, B.coefficient, over=over),)))


@writer("lyapunov_blocks")
def _lyapunov_blocks(r: Recursion, step: Step) -> None:
    """The diagonal blocks of φBφ*, ψBψ* (tip to base), of φ*Bφ, ψ*Bψ (base to tip)."""
    model = r.models[step["context"]]
    articulated = step["symbol"]["name"] == "psi"
    B = r.term(step["in"][0])
    if not step["transposed"]:
        edge = product(model.at("E", "c"), model.at("tau_bar", "c")) if articulated else model.at("E", "c")
        back = product(star(model.at("tau_bar", "c")), star(model.at("E", "c"))) if articulated else star(edge)
        Y = r.target(step["out"])
        r.sweep(-1, Equation(Y, (B, Term(product(edge, At(Y, "c"), back), over="c"))))
    else:
        edge = product(model.at("E"), model.at("tau_bar")) if articulated else model.at("E")
        back = product(star(model.at("tau_bar")), star(model.at("E"))) if articulated else star(edge)
        Y = r.target(step["out"])
        r.sweep(1, Equation(Y, (B, Term(product(back, At(Y, "p"), edge), over="p"))))


# ---------------------------------------------------------------------- reductions
@writer("diagonal_of_blocks")
def _diagonal_of_blocks(r: Recursion, step: Step) -> None:
    """y(k) = the diagonal of B(k)."""
    B = r.value(step["in"][0])
    r.define(r.target(step["out"], r.result_letter), Term(Function("diagonal", B.node), B.coefficient))


@writer("trace_of_blocks", "root_of_trace")
def _trace_of_blocks(r: Recursion, step: Step) -> None:
    """Σ tr B(k), or its root: the Frobenius norm from tr(X*X)."""
    B = r.value(step["in"][0])
    term = Term(Function("trace", B.node), B.coefficient, over="bodies")
    if step["kind"] == "trace_of_blocks":
        r.once(r.target(step["out"]), term)
        return
    trace = r.book.new("s", "scalar")
    r.once(trace, term)
    r.once(r.target(step["out"]), Term(Function("square_root", At(trace, ""))))


@writer("logdet_of_blocks")
def _logdet_of_blocks(r: Recursion, step: Step) -> None:
    """Σ ln|det B(k)|."""
    B = r.value(step["in"][0])
    node = B.node if B.coefficient == 1 else At(r.stored(step["in"][0]))
    r.once(r.target(step["out"]), Term(Function("logdet", node), over="bodies"))


@writer("logdet_of_D")
def _logdet_of_D(r: Recursion, step: Step) -> None:
    """Σ ln det D(k)."""
    r.once(r.target(step["out"]), Term(Function("logdet", r.models[step["context"]].at("D")), over="bodies"))


@writer("norm_of_vector")
def _norm_of_vector(r: Recursion, step: Step) -> None:
    """The root of the sum of squares of all columns."""
    r.once(r.target(step["out"]), Term(Function("norm", At(r.stored(step["in"][0]), ""))))


@writer("combine_scalars")
def _combine_scalars(r: Recursion, step: Step) -> None:
    """Σ c_i s_i + c."""
    *coefficients, constant = step["coefficients"]
    terms = [Term(At(r.stored(s), ""), c) for s, c in zip(step["in"], coefficients, strict=True)]
    if constant or not terms:
        terms.append(Term(Product(()), constant))
    r.once(r.target(step["out"]), *terms)
