"""Statements by block as statements of operators, if possible: statements for every body k, its parent and its children.

V(k) = φ*(℘(k),k)V(℘(k)) + H*(k)θ̇(k) is V = E_φ*V + H*θ̇. A step from body to body in a product is an operator between them: φ(k,j) of
a child j of k is a block of E_φ, ψ(k,j) of E_ψ, and φ*(℘(k),k) of E_φ*. Σ_{j∈C(k)} φ(k,j)X(j)φ*(k,j) are the blocks of
E_φXE_φ*, which is block diagonal; φ*(℘(k),k)X(℘(k))φ(℘(k),k) are the diagonal blocks of E_φ*XE_φ. ∏_k det X(k) is det X,
Σ_k tr X(k) is tr X, Σ_k ln det X(k) is ln det X, and Σ_k J(k)*X(k)J(k) of the rows J(k) of J is J*XJ.
"""

from __future__ import annotations

from collections.abc import Callable

from ..formula_nodes import Node
from ..identities.block_reading import BlockStatement, SumOver
from ..identities.formula import Call, Letter, Number, Power, Product, Star, Sum, written

_STEPS = {"phi": "E", "psi": "E_psi"}


class NotLifted(Exception):
    """The statement by block is not a statement of operators."""


Kind = Callable[[str], str]
"""Kind of a letter: "blocks" on the diagonal, "vector", "rows" from hinges to bodies, or another."""


def lifted(read: BlockStatement, kind: Kind) -> str | None:
    """Return the statement of operators, in the grammar's spelling; None if there is none."""
    if read.relations or len(read.indices) > 1:
        return None
    k = read.indices[0] if read.indices else ""
    try:
        return " = ".join(_side(side, k, kind) for side in read.formula)
    except NotLifted:
        return None


def _side(node: Node, k: str, kind: Kind) -> str:
    match node:
        case Sum(terms=terms, signs=signs):
            return " ".join(f"{'+' if s > 0 else '-'} {_side(t, k, kind)}" for t, s in zip(terms, signs, strict=True)).removeprefix("+ ")
        case SumOver(index=index, of="", inner=Call(function=function, inner=inner), multiplied=multiplied):
            if function not in (("det",) if multiplied else ("trace", "logdet")):
                raise NotLifted
            return f"{function} ({_at(inner, index, kind)})"
        case Call(function=function, inner=inner) if not k:
            return f"{function} ({_side(inner, k, kind)})"
        case SumOver(index=index, of="", inner=Product(factors=factors), multiplied=False) if not k:
            return _squared(factors, index, kind)
        case Letter(name=name, arguments=()) if not k:
            return name
    return _product(node, k, kind)


def _squared(factors: tuple[Node, ...], k: str, kind: Kind) -> str:
    """Σ_k x(k)*X(k)y(k), x and y vectors or rows."""
    numbers = [f for f in factors if isinstance(f, Number)]
    first, *middle, last = [f for f in factors if not isinstance(f, Number)]
    names = [e.name for e in (first.inner if isinstance(first, Star) else None, last) if isinstance(e, Letter) and e.arguments == (k,)]
    if len(names) < 2 or not all(kind(name) in ("vector", "rows") for name in names):
        raise NotLifted
    return " ".join([*map(written, numbers), f"({names[0]})^*", *(_at(f, k, kind) for f in middle), names[1]])


def _factors(node: Node, k: str) -> tuple[list[Node], dict[str, str]]:
    """Return the factors of a term with the sum over children of k expanded, and the letters of the child and its parent."""
    factors = list(node.factors) if isinstance(node, Product) else [node]
    opened: list[Node] = []
    children: dict[str, str] = {}
    for factor in factors:
        if isinstance(factor, SumOver):
            if factor.of != k or factor.among != "children" or factor.multiplied or children:
                raise NotLifted
            children[factor.index] = k
            opened += factor.inner.factors if isinstance(factor.inner, Product) else [factor.inner]
        else:
            opened.append(factor)
    return opened, children


def _product(node: Node, k: str, kind: Kind) -> str:
    """Return a term step by step, within blockdiag if it leads to the parent and back."""
    factors, children = _factors(node, k)
    at, up, text = k, False, []
    for factor in factors:
        step = _step(factor, at, children, k)
        if step is not None:
            name, at = step
            up = up or at == f"parent({k})"
            text.append(name)
        else:
            text.append(_at(factor, at, kind, True))
    if children and at in children and len(text) < 2:
        raise NotLifted
    joined = " ".join(text)
    return f"blockdiag({joined})" if up and at == k else joined


def _step(factor: Node, at: str, children: dict[str, str], k: str) -> tuple[str, str] | None:
    """Return the operator of a step from body to body and the body to which it leads back; None for a factor at one body."""
    starred = isinstance(factor, Star)
    letter = factor.inner if isinstance(factor, Star) else factor
    if not isinstance(letter, Letter) or len(letter.arguments) != 2:
        return None
    parent, child = letter.arguments
    related = parent == f"parent({child})" or child == f"child({parent})" or children.get(child) == parent
    here, there = (child, parent) if starred else (parent, child)
    if letter.name not in _STEPS or not related or here != at:
        raise NotLifted
    return _STEPS[letter.name] + ("^*" if starred else ""), there


def _at(node: Node, at: str, kind: Kind, last: bool = False) -> str:
    """Return a factor at one body as an operator: blocks, and with `last` also vectors, which are not transposed."""
    match node:
        case Number():
            return written(node)
        case Letter(name=("I" | "N") as name, arguments=()):
            return name
        case Letter(name=name, arguments=arguments) if (
            at and arguments == (at,) and (kind(name) == "blocks" or last and kind(name) == "vector")
        ):
            return name
        case Letter(name=name, arguments=()) if not at:
            return name
        case Star(inner=inner):
            return f"({_at(inner, at, kind)})^*"
        case Power(inner=inner, exponent=exponent):
            return f"({_at(inner, at, kind)})^{exponent}"
        case Product(factors=factors):
            return " ".join(_at(f, at, kind, last) for f in factors)
        case Sum(terms=terms, signs=signs):
            said = [f"{'+' if s > 0 else '-'} {_at(t, at, kind, last)}" for t, s in zip(terms, signs, strict=True)]
            return f"({' '.join(said)})"
    raise NotLifted
