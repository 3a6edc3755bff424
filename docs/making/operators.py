"""A page for every letter of the symbol table, on one small model: its meaning, derivative, recursion, cost and blocks."""

import re
from functools import lru_cache
from textwrap import wrap
from typing import Any

import pycraft as pc
from pycraft import _core
from pycraft.proofs.axioms import AXIOMS, DEFINITIONS

WIDTH = 84
COORDINATE = "hinge1[0]"


@lru_cache(maxsize=1)
def example() -> Any:
    """Return the example: five bodies, a branch, hinges of one, two and three coordinates, rotors, a node, in motion under gravity."""
    model = pc.tree([-1, 0, 1, 1, 0], ["pin", "universal", "slider", "ball", "pin"], seed=0, rotor_inertia=True)
    model.add_node("tool", "body3", position=(0.3, 0, 0))
    model.gravity = (0, 0, -9.81)
    state = model.random_state(seed=0)
    model.q, model.v = state.q, state.v
    return model


def letter(symbol: Any) -> Any:
    """Return the letter on the example, called with its arguments."""
    made = getattr(example().soa, symbol.name)
    return {"nothing": lambda: made, "nodes": lambda: made(["tool"]), "coordinate": lambda: made(COORDINATE)}[symbol.takes]()


def typed(symbol: Any) -> str:
    """Return the letter as a user types it."""
    return {"nothing": "soa.{}", "nodes": 'soa.{}(["tool"])', "coordinate": 'soa.{}("' + COORDINATE + '")'}[symbol.takes].format(
        symbol.name
    )


def tokens(statement: str) -> set[str]:
    """Return the letters of a line such as "M = P − E_ψ P E_φ*"."""
    return {re.sub(r"[*()⁻¹ᵀ]+$", "", word.lstrip("(")) for word in statement.split()}


def plain(text: str) -> str:
    """Escape text for Markdown: stars are adjoints, bars are norms, and brackets are brackets."""
    return re.sub(r"[*|_\[\]<]", r"\\\g<0>", text)


def folded(text: str) -> str:
    """Wrap a formula; lines after the first are indented."""
    return "\n".join(wrap(text, WIDTH, subsequent_indent="    ", break_long_words=False))


def formula(expression: Any, name: str) -> str:
    """Return a display if the formula is short, otherwise text, because a display does not wrap."""
    text = expression.text()
    return f"$$\n{name} = {expression.latex()}\n$$" if len(text) < 90 else f"```text\n{folded(text)}\n```"


def in_theorems(symbol: Any) -> list[tuple[int, Any]]:
    """Return the theorems of the catalogue with the letter on either side, with their numbers."""

    def letters(node: Any) -> set[str]:
        return {node.letter.name if node.letter is not None else ""}.union(*map(letters, node.children))

    found = []
    for number, theorem in enumerate(example().soa.theorems()):
        if theorem.waiting or isinstance(theorem.lhs, pc.Scalar):
            continue
        if symbol.name in letters(theorem.lhs) | letters(theorem.rhs):
            found.append((number, theorem))
    return found


def page(symbol: Any) -> str:
    made = letter(symbol)
    name = made.latex()
    written = str(made.algorithm())
    kind = "a vector in" if symbol.is_vector else f"{symbol.domain} →"
    properties = [word for word, has in {"symmetric": made.is_symmetric, "block diagonal": made.is_block_diagonal}.items() if has]
    parts = [
        f"# {plain(symbol.text)}: {plain(symbol.meaning)}",
        f"`{typed(symbol)}`, {kind} {symbol.codomain}, {made.shape[0]} × {made.shape[1]} on the example below"
        + (f"; {', '.join(properties)}." if properties else "."),
    ]
    if made.definition is not None:
        parts += ["An abbreviation:", formula(made.definition, name)]
    assumed = [line for line in [*AXIOMS, *DEFINITIONS] if symbol.text in tokens(line)]
    if assumed:
        parts += ["[Proofs](../proofs.md) assume of it:", "```text\n" + "\n".join(assumed) + "\n```"]
    moved = made.diff(COORDINATE)
    parts += ["## Derivative", f"Along a coordinate i of another hinge, here {COORDINATE} ([sensitivities](../sensitivities.md)):"]
    parts += [formula(moved, rf"\partial_i {name}")]
    parts += [
        "## Recursion",
        f"`print({typed(symbol)}.algorithm())`, as [the planner](../algorithm.md) writes it:",
        f"```text\n{written.strip()}\n```",
    ]
    parts += ["## Cost", f"`print({typed(symbol)}.explain())`:", f"```text\n{str(made.explain()).strip()}\n```"]
    parts += ["## Blocks", "On five bodies, body3 and body2 on body1, body1 and body4 on body0, at a random state:"]
    parts += [f'<div class="blocks">\n{made.blocks()._repr_html_()}\n</div>']
    theorems = [f"- [{plain(theorem.name)}](#theorem-{number})" for number, theorem in in_theorems(symbol)]
    if theorems:
        parts += ["## Theorems", "\n".join(theorems)]
    parts += ["## Source", "A. Jain, *Robot and Multibody Dynamics*, Springer 2011, by its letter ([notation](../notation.md))."]
    return "\n\n".join(parts) + "\n"


def pages() -> dict[str, str]:
    """Return the pages by their names, the index first."""
    made = {f"docs/operators/{symbol.name}": page(symbol) for symbol in _core.symbols}
    rows = [f"| [{plain(s.text)}]({s.name}.md) | `{s.name}` | {s.domain} → {s.codomain} | {plain(s.meaning)} |" for s in _core.symbols]
    table = "\n".join(["| letter | in Python | maps | meaning |", "|---|---|---|---|", *rows])
    tree = "```{toctree}\n:hidden:\n\n" + "\n".join(s.name for s in _core.symbols) + "\n```"
    text = "Every letter of the algebra, from the symbol table; each page has the letter's derivative, recursion, cost and blocks."
    return {"docs/operators/index": f"# The operators\n\n{text}\n\n{table}\n\n{tree}\n", **made}
