"""A model's tree as text: one line per body, with its hinge and its places in q and v."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from ..arguments import switch, whole

if TYPE_CHECKING:
    from .multibody import Multibody

WIDTH = 80
_INDENT = 36
"""Columns of indentation; a deeper tree does not indent only children."""
_LEGIBLE = 16
"""Least columns for names of hinges that are longer; with fewer they are omitted."""


class TreeDiagram:
    """A model's tree, drawn when it is printed: `str(arm.tree())`."""

    def __init__(self, text: str):
        self._text = text

    def __str__(self) -> str:
        return self._text

    __repr__ = __str__


class _Line(NamedTuple):
    """The text before a name, and the data of a body or node."""

    before: str
    name: str
    kind: str
    hinge: str
    coordinates: str


def tree_diagram(model: Multibody, most: int | None = 200, nodes: bool = False) -> TreeDiagram:
    """`Multibody.tree`."""
    nodes = switch(nodes, "nodes")
    most = None if most is None else max(whole(most, "the most lines of a tree"), 1)
    described = model.description()
    bodies = described["bodies"]
    count = f"{model.name}: {len(bodies)} bod{'y' if len(bodies) == 1 else 'ies'}, {model.nv} degree{'s' * (model.nv != 1)} of freedom"
    held = len(described["nodes"])
    lines, folded = _lines(model, described, nodes, 3)
    if _width(lines) > WIDTH:
        lines, folded = _lines(model, described, nodes, 2)
    title = [_cut(count + (f", {held} node{'s' * (held != 1)}" if held else ""), WIDTH)]
    title += ["(an only child stands below the body that carries it)"] * folded
    return TreeDiagram("\n".join([*title, "base", *_columns(lines, most)]))


def _width(lines: list[_Line]) -> int:
    """Return the columns that the lines take in full."""
    parts = zip(*((len(line.before + line.name), len(line.kind), len(line.hinge), len(line.coordinates)) for line in lines), strict=True)
    widths = [max(part) for part in parts]
    return sum(widths) + 2 * (sum(width > 0 for width in widths) - 1)


def _lines(model: Multibody, described: dict[str, Any], nodes: bool, step: int) -> tuple[list[_Line], bool]:
    """Return a line per body, and per node if requested, in the model's order; and whether only children are not indented."""
    bodies = described["bodies"]
    on: dict[int, list[tuple[str, int]]] = {k: [] for k in range(-1, len(bodies))}
    for i, node in enumerate(described["nodes"] if nodes else ()):
        on[node["body"]].append(("node", i))
    for k, body in enumerate(bodies):
        on[body["parent"]].append(("body", k))
    depth = {-1: 0}
    for k, body in enumerate(bodies):
        depth[k] = depth[body["parent"]] + 1
    folded = 3 * max(depth.values()) > _INDENT
    branch, end, along, blank = (part[: step - 1] + " " for part in ("├─", "└─", "│ ", "  "))
    both = model.nq != model.nv
    lines: list[_Line] = []
    stack = [(*item, "", last) for item, last in _with_last(on[-1])]
    while stack:
        what, k, before, last = stack.pop()
        only = folded and last is None
        head = before if only else before + (branch if last is False else end)
        inner = before if only else before + (along if last is False else blank)
        if what == "node":
            lines.append(_Line(_fitting(head, step), _printable(described["nodes"][k]["name"]), "node", "", ""))
            continue
        body, hinge = bodies[k]["name"], bodies[k]["hinge"]["name"]
        q, v = model._slices(k)
        places = f"q{_range(q)}" + (f" v{_range(v)}" if both else "") if v.stop > v.start else ""
        lines.append(
            _Line(_fitting(head, step), _printable(body), bodies[k]["hinge"]["kind"], _printable(hinge) if hinge != body else "", places)
        )
        stack += [(*item, inner, last) for item, last in _with_last(on[k])]
    return lines, folded


def _with_last(items: list[tuple[str, int]]) -> list[tuple[tuple[str, int], bool | None]]:
    """Return the children of a body, the last first, each with whether it is the last; None for an only child."""
    if len(items) == 1:
        return [(items[0], None)]
    return [(item, i == len(items) - 1) for i, item in reversed(list(enumerate(items)))]


def _fitting(before: str, step: int) -> str:
    """Return the indentation within its columns: for a deeper one, its depth."""
    return before if len(before) <= _INDENT else f"⋯{len(before) // step}{before[-step:]}".rjust(_INDENT)


def _columns(lines: list[_Line], most: int | None) -> list[str]:
    """Return the lines in columns that fit the width, without those in the middle of a long tree."""
    dropped = 0 if most is None or len(lines) <= most else len(lines) - most
    first = len(lines) - dropped - (most or 0) // 3 if dropped else len(lines)
    shown = [*lines[:first], *lines[first + dropped :]]
    kind = max((len(line.kind) for line in shown), default=0)
    places = max((len(line.coordinates) for line in shown), default=0)
    hinge = max((len(line.hinge) for line in shown), default=0)
    room = WIDTH - kind - places - 4
    name = min(max((len(line.before + line.name) for line in shown), default=0), room)
    left = room - 2 - name
    hinge = min(hinge, left) if left >= min(hinge, _LEGIBLE) else 0
    text = []
    for line in shown:
        parts = [_cut(line.before + line.name, name).ljust(name), line.kind.ljust(kind)]
        parts += [_cut(line.hinge, hinge).ljust(hinge)] * bool(hinge) + [line.coordinates]
        text.append("  ".join(parts).rstrip())
    if dropped:
        text.insert(first, f"⋮  {dropped} more; tree(most=None) shows all")
    return text


def _range(part: slice) -> str:
    return f"[{part.start}]" if part.stop == part.start + 1 else f"[{part.start}:{part.stop}]"


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else text[: width - 1] + "…"


def _printable(name: str) -> str:
    return name if name.isprintable() else repr(name)[1:-1]
