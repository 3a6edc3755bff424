"""True identities outside the catalogue: a random sum of words in which axioms and lemmas are applied at random places in random
directions, written as two expressions with random brackets, transposes and inverses around them. Each is true by construction.
"""

import functools
import operator
from fractions import Fraction

import pycraft as pc
from pycraft.proofs.axioms import theory
from pycraft.proofs.words import add_to, split

J0, CHAIN, SINGLE, CONSTANT = "J = 0", "serial chain", "single-DOF hinges", "constant H"
ROUNDING = 1e-11
"""Allowed difference of a step's two sides: a few hundred roundings, amplified by the sweep of P."""


def tree(seed=1, rotor_inertia=True):
    return pc.tree([-1, 0, 0, 1], ["universal", "ball", "slider", "pin"], seed=seed, rotor_inertia=rotor_inertia)


def meeting(hypotheses, seed):
    """A random model that meets these hypotheses."""
    kinds = ["pin", "slider", "screw", "pin", "slider"] if "single-DOF hinges" in hypotheses else ["free", "pin", "ball", "slider", "pin"]
    if "constant H" not in hypotheses and "single-DOF hinges" not in hypotheses:
        kinds[3] = "universal"
    parents = [-1, 0, 1, 2, 3] if "serial chain" in hypotheses else [-1, 0, 0, 1, 1]
    return pc.tree(parents, kinds, seed=seed, rotor_inertia="J = 0" not in hypotheses)


# Letters between spaces: (codomain, domain).
SPACES = {
    **dict.fromkeys(["E_φ", "φ", "φ̃", "E_ψ", "ψ", "ψ̃", "τ", "τ̄", "φ⁻¹", "ψ⁻¹"], ("F", "F")),
    **dict.fromkeys(["M", "P", "R", "P⁺"], ("F", "V")),
    **dict.fromkeys(["D", "J", "D⁻¹"], ("Θ", "Θ")),
    **dict.fromkeys(["G", "K"], ("F", "Θ")),
    "H": ("Θ", "F"),
    "Ω": ("V", "F"),
}
DUAL = {"F": "V", "V": "F", "Θ": "Θ"}
COEFFICIENTS = [Fraction(1), Fraction(-1), Fraction(2), Fraction(1, 2), Fraction(-3)]
WORDS, LENGTH = 24, 14


def alphabet():
    return theory().alphabet


def spaces(letter):
    """(codomain, domain) of a letter with its marks."""
    if letter in SPACES:
        return SPACES[letter]
    codomain, domain = SPACES[alphabet().star(letter)]
    return DUAL[domain], DUAL[codomain]


LETTERS = sorted({*SPACES, *(alphabet().star(x) for x in SPACES)})


def equations(hypotheses):
    """Rules that may be applied: axioms, definitions, inverses, lemmas, and their transposes; Υ and vectors aside."""
    facts = theory()
    chosen = [e for e in facts._equations.values() if e.kind != "hypothesis" or e.hypothesis in hypotheses] + facts.lemmas
    fit = [e for e in dict.fromkeys(chosen) if all(x in LETTERS for w in [*e.lhs, *e.rhs] for x in w)]
    return fit + [e.transposed(alphabet()) for e in fit]


def rewrites(hypotheses):
    """(word, what it is equal to): every equation solved for every word that it holds once."""
    found = []
    for equation in equations(hypotheses):
        difference = equation.difference
        for word, c in difference.items():
            if word and abs(c) == 1:
                found.append((word, [(w, -x / c) for w, x in difference.items() if w != word]))
    return found


def random_word(rng, codomain, domain, length):
    """A word from one space to another, near this length."""
    word = []
    at = codomain
    while True:
        fitting = [x for x in LETTERS if spaces(x)[0] == at]
        closing = [x for x in fitting if spaces(x)[1] == domain]
        if len(word) + 1 >= length and closing:
            return (*word, closing[rng.integers(len(closing))])
        word.append(fitting[rng.integers(len(fitting))])
        at = spaces(word[-1])[1]


def rewritten(rng, p, rules, times):
    """p with equations applied at random places."""
    done = 0
    for _ in range(40 * times):
        if done == times:
            break
        word = list(p)[rng.integers(len(p))] if p else ()
        part, by = rules[rng.integers(len(rules))]
        places = [i for i in range(len(word) - len(part) + 1) if word[i : i + len(part)] == part]
        if not places or len(p) + len(by) > WORDS or any(len(word) + len(w) - len(part) > LENGTH for w, _ in by):
            continue
        at = places[rng.integers(len(places))]
        q = dict(p)
        c = q.pop(word)
        for w, x in by:
            add_to(q, word[:at] + w + word[at + len(part) :], c * x)
        p, done = q, done + 1
    return p


def as_expression(rng, p, soa, codomain, domain):
    """A polynomial as an expression, with random brackets, some terms written as transposes of transposes."""
    terms = []
    for word, c in p.items():
        term = product(rng, word, soa, domain)
        if rng.random() < 0.15:
            term = product(rng, alphabet().star_word(word), soa, DUAL[codomain]).T
        terms.append(float(c) * term if c != 1 else term)
    if not terms:
        return 0.0 * product(rng, random_word(rng, codomain, domain, 2), soa, domain)
    return functools.reduce(operator.add, [terms[i] for i in rng.permutation(len(terms))])


def product(rng, word, soa, domain):
    """A word as an expression, bracketed at random."""
    if not word:
        return pc.identity({"F": soa.F, "V": soa.V, "Θ": soa.Theta}[domain])
    if len(word) == 1:
        name, mark = split(word[0])
        e = getattr(soa, alphabet().letters[name].ascii)
        e = e.inv() if mark in ("⁻¹", "⁻*") else e
        return e.T if mark in ("*", "⁻*") else e
    cut = int(rng.integers(1, len(word)))
    return product(rng, word[:cut], soa, spaces(word[cut - 1])[1]) @ product(rng, word[cut:], soa, domain)


def identity_pair(rng, soa, hypotheses=()):
    """(lhs, rhs): two expressions that are equal under the hypotheses."""
    rules = rewrites(hypotheses)
    kind = rng.random()
    ends = [("F", "F"), ("F", "V"), ("Θ", "F"), ("F", "Θ"), ("V", "F"), ("Θ", "Θ")]
    codomain, domain = ends[-1] if kind < 0.2 else ends[rng.integers(6)]
    p = {}
    for _ in range(rng.integers(1, 4)):
        add_to(p, random_word(rng, codomain, domain, rng.integers(1, 6)), COEFFICIENTS[rng.integers(len(COEFFICIENTS))])
    left, right = rewritten(rng, p, rules, int(rng.integers(0, 4))), rewritten(rng, p, rules, int(rng.integers(2, 9)))
    lhs, rhs = (as_expression(rng, q, soa, codomain, domain) for q in (left, right))
    if kind < 0.1:  # inside an inverse: X⁻¹ A and X⁻¹ B
        phi, M, H, D = soa("phi M H D")
        X = H @ phi @ M @ phi.T @ H.T + D
        return X.inv() @ lhs, X.inv() @ rhs
    if kind < 0.2:  # (D + A*A)⁻¹ and (D + B*B)⁻¹
        return (soa.D + lhs.T @ lhs).inv(), (soa.D + rhs.T @ rhs).inv()
    return lhs, rhs
