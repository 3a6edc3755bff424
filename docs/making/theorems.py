"""The catalogue of theorems as a page, each with its hypotheses, its source and its proof from the definitions."""

import re
from typing import Any

import pycraft as pc

from .operators import example, plain

_FACTORIZATION = (
    "G. Rodriguez and K. Kreutz-Delgado, *Spatial Operator Factorization and Inversion of the Manipulator Mass Matrix*, "
    "IEEE Transactions on Robotics and Automation 8(1), 1992"
)
_SENSITIVITY = (
    "A. Jain and G. Rodriguez, *Multibody Mass Matrix Sensitivity Analysis Using Spatial Operators*, "
    "International Journal for Multiscale Computational Engineering 1(2-3), 2003"
)
ALSO = {
    "innovations factorization": _FACTORIZATION,
    "innovations factor inverted": _FACTORIZATION,
    "mass matrix inverse": _FACTORIZATION,
    "∂ℳ, single-DOF form": _SENSITIVITY,
}
"""Public papers whose abstracts state a theorem, or what it is: by the theorem's name. Equation numbers are given of none."""
USES = {"check": "", "rewrite": "a rule of simplification", "inverse": "a rule by which the planner inverts"}


def source(said: str) -> str:
    """Return the source of a theorem, from the short form in the catalogue."""
    if said == "Jain 2011":
        return "Source: A. Jain, *Robot and Multibody Dynamics*, Springer 2011"
    if said == "general J":
        return "The form with rotor inertia J of a theorem in A. Jain, *Robot and Multibody Dynamics*, Springer 2011"
    return "Derived for PyCraft" if said.startswith("soa.md") else f"Derived for PyCraft: {plain(said)}"


def entry(number: int, theorem: Any) -> str:
    """Return the entry of one theorem: its formula, its hypotheses, and its proof."""
    where = [*theorem.hypotheses, *(["between bodies on one path from the root"] if theorem.on_one_path else [])]
    said = [f"Holds where {', '.join(where)}" if where else "No hypothesis"]
    said += [USES[theorem.use]] if USES.get(theorem.use) else []
    also = f"; {ALSO[theorem.name]}" if theorem.name in ALSO else ""
    parts = [
        f"(theorem-{number})=\n## {plain(theorem.name)}",
        f"$$\n{theorem.latex}\n$$",
        f"{'; '.join(said)}. {source(theorem.source)}{also}.",
    ]
    proof = pc.prove(theorem.lhs, theorem.rhs)
    if proof:
        parts += [f"<details><summary>Proof</summary>\n\n```text\n{str(proof).strip()}\n```\n\n</details>"]
    else:
        parts += ["`pc.prove` finds no proof of this theorem from the definitions; `soa.check()` checks it numerically."]
    return "\n\n".join(parts)


def pages() -> dict[str, str]:
    """Return a page for each group, with the list of all theorems first."""
    theorems = list(enumerate(example().soa.theorems()))
    made, listed = {}, []
    for group in dict.fromkeys(theorem.group for _, theorem in theorems):
        spelled = re.sub(r"\(.*?\)", "", group.lower().replace("φ", "phi").replace("ψ", "psi"))
        name = re.sub(r"[^a-z0-9]+", "_", spelled).strip("_")
        text, rows = [f"# {plain(group)}"], []
        for number, theorem in theorems:
            if theorem.group != group:
                continue
            waiting = f"- {plain(theorem.name)}: waits for {theorem.waiting}"
            text += [waiting if theorem.waiting else entry(number, theorem)]
            rows += [waiting if theorem.waiting else f"- [{plain(theorem.name)}](#theorem-{number})"]
        made[f"docs/theorems/{name}"] = "\n\n".join(text) + "\n"
        listed += [f"## [{plain(group)}]({name}.md)", "\n".join(rows)]
    tree = "```{toctree}\n:hidden:\n\n" + "\n".join(page.rpartition("/")[2] for page in made) + "\n```"
    first = [
        "# The theorems",
        f"The {len(theorems)} theorems of the catalogue, as used by the planner and `arm.soa.check()`. Each has its hypotheses and, "
        "if `pc.prove` finds one, its proof from the definitions ([proofs](../proofs.md)).",
    ]
    return {"docs/theorems/index": "\n\n".join([*first, *listed, tree]) + "\n", **made}
