"""ℳ + J by its innovations factors, as in the book: A D A*, A = I + HφK, and A⁻¹ = I - HψK."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .. import _core
from .axioms import replaced_everywhere, solved, theory
from .equations import Equation, Step, Use, joined, marked, numbered
from .words import ONE, Alphabet, Letter, Number, Polynomial, Word, inverse_of, monomial, of_model, parse, ratio

FACTOR, INVERSE = parse("I + H φ K"), parse("I − H ψ K")
PRODUCT = parse("D + H φ K D + D K* φ* H* + H φ K D K* φ* H*")
Reduction = Callable[[Polynomial], tuple[Polynomial, list[Step]]]


@dataclass
class Factor:
    """The letter A of one model, with `definition` A = I + HφK and `inverse` A⁻¹ = I - HψK."""

    name: str
    definition: Equation
    inverse: Equation

    @property
    def premises(self) -> list[Equation]:
        """Equations that show that A has an inverse."""
        return [self.inverse.steps[0].uses[0].equation, *self.inverse.uses]


def name_of(mark: str) -> str:
    """The letter A of one model."""
    return f"⟨A⟩{mark}"


def letter(alphabet: Alphabet, mark: str, base: str, context: tuple[Any, Any] | None) -> tuple[str, Equation]:
    """Add A of a model to the alphabet; return it with its definition."""
    name = name_of(mark)
    if name not in alphabet.letters:
        expression = None
        if context is not None:
            H, phi, K = (s if context[1] is None else s._bound(context[1]) for s in map(context[0].symbol, ("H", "phi", "K")))
            expression = _core.identity(H.codomain) + H @ phi @ K
        shown = f"[I + H{mark} φ{base} K{mark}]"
        alphabet.add(Letter(name, shown, f"[I + H{mark} \\phi{base} \\mathcal{{K}}{mark}]", False, "full", None, expression))
    inner = of(FACTOR, mark, base)
    return name, Equation("definition", f"{alphabet.letters[name].text} = {alphabet.text(inner)}", monomial(name), inner)


def of(p: Polynomial, mark: str, base: str) -> Polynomial:
    """Return a polynomial in the first model's letters for another model."""
    return {marked(word, mark, base): c for word, c in p.items()}


def factorization(
    X: str, c: Number, definition: Equation, factor: Factor, mark: str, alphabet: Alphabet, reduce: Reduction
) -> Equation | None:
    """Return the lemma X = c A D A*, with both sides reduced to one form; None if their forms differ."""
    D, A, star = of_model("D", mark), factor.name, alphabet.star(factor.name)
    word = monomial(A, D, star, c=c)
    opened = word
    right: list[Step] = []
    for equation, at in ((factor.definition, (A,)), (factor.definition.transposed(alphabet), (star,))):
        step = replaced_everywhere(opened, *solved(equation, at), alphabet)
        if step is not None:
            right, opened = [*right, step], step.after
    left = [Step(monomial(X), definition.rhs, [Use(ONE, (), definition, (), (X,))], alphabet)]
    left += reduce(definition.rhs)[1]
    right += reduce(opened)[1]
    steps = joined(left, right, monomial(X), word, alphabet)
    return (
        None if steps is None else Equation("lemma", f"{alphabet.letter_text(X)} = {alphabet.text(word)}", monomial(X), word, steps=steps)
    )


def inverse_of_product(
    X: str, c: Number, product: Equation, factor: Factor, mark: str, alphabet: Alphabet, pair: Callable[..., Equation]
) -> Equation:
    """The lemma X⁻¹ = c⁻¹ A⁻* D⁻¹ A⁻¹ of X = c A D A*."""
    D, A, Y = of_model("D", mark), factor.name, inverse_of(X)
    star, Z, Z_star = alphabet.star(A), inverse_of(A), inverse_of(alphabet.star(A))
    between = theory()("D D⁻¹ = I").copied(mark)
    inserted: list[tuple[Word, Equation, Word]] = [
        ((Y,), pair(A, Z), ()),
        ((Y, A), between, (Z,)),
        ((Y, A, D), pair(star, Z_star), (inverse_of(D), Z)),
    ]
    steps, at = [], monomial(Y)
    for left, equation, right in inserted:
        (word,) = equation.lhs
        steps.append(Step(at, monomial(*left, *word, *right), [Use(-ONE, left, equation, right, (), False)], alphabet))
        at = steps[-1].after
    scale, rest = ratio(1, c), (Z_star, inverse_of(D), Z)
    steps.append(Step(at, monomial(Y, X, *rest, c=scale), [Use(-scale, (Y,), product, rest, (), False)], alphabet))
    after = monomial(*rest, c=scale)
    steps.append(Step(steps[-1].after, after, [Use(scale, (), pair(Y, X), rest, (Y, X))], alphabet))
    text = f"{alphabet.letter_text(Y)} = {alphabet.text(after)}"
    note = f"of {product.text}, whose factors have inverses"
    return Equation("lemma", text, monomial(Y), after, steps=numbered(steps), uses=factor.premises, note=note)
