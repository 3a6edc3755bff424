"""Random formulas from a small grammar over the letters of one model, drawn by any chooser: a seeded generator or Hypothesis.

Every inverse that is drawn exists: of letters that are positive definite or unit triangular, of sums of a positive definite
letter and a square X*X, of unit triangular shifts.
"""

from support.formulas import Formula

LEAVES = {
    ("F", "F"): "phi psi E phi_tilde psi_tilde tau tau_bar E_psi",
    ("V", "F"): "M P R P_plus",
    ("F", "V"): "Upsilon Omega",
    ("F", "T"): "H",
    ("T", "F"): "G K",
    ("T", "T"): "D J",
}
DUAL = {"F": "V", "V": "F", "T": "T"}
COEFFICIENTS = [-1.0, 2.0, 0.5, -0.3, 0.01]


def leaves(letters, domain, codomain):
    """Letters, their transposes and inverses between two spaces, as functions that make them."""
    made = [lambda n=n: getattr(letters, n) for n in LEAVES.get((domain, codomain), "").split()]
    made += [lambda n=n: getattr(letters, n).T for n in LEAVES.get((DUAL[codomain], DUAL[domain]), "").split()]
    if (domain, codomain) == ("T", "T"):
        made += [lambda: letters.D.inv(), lambda: letters.MM, lambda: (letters.MM + letters.J).inv()]
    if (domain, codomain) == ("F", "V"):
        made += [lambda: letters.M.inv(), lambda: letters.P.inv(), lambda: letters.R.inv()]
    if (domain, codomain) == ("F", "F"):
        made += [lambda: letters.phi.inv(), lambda: letters.psi.inv()]
    return made


def draw(choose, letters, domain, codomain, depth) -> Formula:
    """A formula from `domain` to `codomain` ("T", "V" or "F"); `choose` picks one item of a list."""
    simple = leaves(letters, domain, codomain)
    if depth <= 0 and simple:
        return choose(simple)()
    kinds = ["product", "sum", "scaled", "transpose", "product"]
    if simple:
        kinds.append("leaf")
    if domain == codomain or DUAL[domain] == codomain:
        kinds += ["inverse", "blockdiag"]
    if domain == codomain:
        kinds.append("identity")
    if depth <= 0:
        kinds = ["product"]
    kind = choose(kinds)
    go = lambda a, b: draw(choose, letters, a, b, depth - 1)
    if kind == "leaf":
        return choose(simple)()
    if kind == "product":
        middles = [s for s in "TVF" if depth > 0 or (leaves(letters, domain, s) and leaves(letters, s, codomain))]
        middle = choose(middles)
        return go(middle, codomain) @ go(domain, middle)
    if kind == "sum":
        return go(domain, codomain) + go(domain, codomain) if choose([0, 1]) else go(domain, codomain) - go(domain, codomain)
    if kind == "scaled":
        return choose(COEFFICIENTS) * go(domain, codomain)
    if kind == "transpose":
        return go(DUAL[codomain], DUAL[domain]).T
    if kind == "identity":
        return letters.I + choose(COEFFICIENTS) * go(domain, codomain)
    if kind == "blockdiag":
        return go(domain, codomain).blockdiag()
    return inverse(choose, letters, domain, codomain, go)


def inverse(choose, letters, domain, codomain, go):
    """An inverse that exists, from `domain` to `codomain`."""
    c = choose([0.5, 2.0, 0.01])
    if (domain, codomain) == ("T", "T"):
        X = go("T", choose(["T", "V", "F"]))
        weight = {"T": letters.I, "V": letters.M, "F": letters.M.inv()}[space_letter(X.op.codomain)]
        return (choose([letters.D, letters.MM + letters.J]) + c * X.T @ weight @ X).inv()
    if (domain, codomain) == ("F", "V"):
        X = go("V", "T")
        return (choose([letters.M, letters.P, letters.R]) + c * X.T @ X).inv()
    if (domain, codomain) == ("V", "F"):
        X = go("F", "T")
        return (choose([letters.M.inv(), letters.P.inv()]) + c * X.T @ X).inv()
    shift = choose([letters.E, letters.E_psi])
    made = (letters.I - c * shift).inv()
    return made if domain == "F" else made.T


def space_letter(space):
    """T, V or F of a space of bodies or coordinates."""
    return {"Θ": "T"}.get(space.name, space.name)


def seeded(rng):
    """A chooser that draws from a NumPy generator."""
    return lambda items: items[int(rng.integers(len(items)))]
