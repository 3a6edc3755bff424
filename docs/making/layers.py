"""Pictures of the module layers: `PYTHONPATH=docs python -m making.layers` writes docs/static/layers_cpp.svg and layers_python.svg.

The order is read from tests/project/test_layers.py, which checks every include and import against it. A module stands above all modules
that it may use; arrows that follow from others are omitted.
"""

import ast
from collections.abc import Sequence
from html import escape

from .contents import ROOT
from .landing import GROUND, INK

FOLDER = ROOT / "docs" / "static"
ORDER = ROOT / "tests" / "project" / "test_layers.py"
PICTURES = {"layers_cpp.svg": "STANDS_ON", "layers_python.svg": "RESTS_ON"}

Order = dict[str, list[str]]
BOX, ROW, GAP, LETTER = 24, 58, 16, 7.4
"""Height of a box, distance of rows, least gap between boxes, width of a letter, in pixels."""


def order(name: str) -> Order:
    """Return the modules and what each may use directly, from the literal of this name in the test of layers."""
    for node in ast.parse(ORDER.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and node.targets[0].id == name:
            found: Order = ast.literal_eval(node.value)
            return {key: value for key, value in found.items() if key != "tests"}
    raise ValueError(f"{ORDER.name} has no {name}")


def below(uses: Order, name: str) -> set[str]:
    """Return all modules that a module may use, directly or not."""
    return set(uses[name]).union(*(below(uses, used) for used in uses[name]))


def reduced(uses: Order) -> Order:
    """Return the direct uses without those that follow from others."""
    return {n: [u for u in used if not any(u in below(uses, other) for other in used)] for n, used in uses.items()}


def heights(uses: Order) -> dict[str, int]:
    """Return the row of each module, 0 for modules that use no other: one above the highest that it uses."""
    found: dict[str, int] = {}

    def height(name: str) -> int:
        if name not in found:
            found[name] = 1 + max((height(used) for used in uses[name]), default=-1)
        return found[name]

    for name in uses:
        height(name)
    direct = reduced(uses)
    users = {name: [n for n, used in direct.items() if name in used] for name in uses}
    for name in sorted(uses, key=lambda n: -found[n]):  # near to its users, where these are more
        if len(users[name]) > len(direct[name]):
            found[name] = min(found[user] for user in users[name]) - 1
    return found


def with_bends(uses: Order) -> tuple[list[list[str]], list[list[str]]]:
    """Return the rows, bottom first, and the arrows as paths from row to row; a path bends at a place of its own in each row between."""
    at = heights(uses)
    rows: list[list[str]] = [[] for _ in range(max(at.values()) + 1)]
    for name in uses:
        rows[at[name]].append(name)
    paths = []
    for name, used in reduced(uses).items():
        for target in used:
            bends = [f"{name}>{target}@{row}" for row in range(at[name] - 1, at[target], -1)]
            for row, bend in zip(range(at[name] - 1, at[target], -1), bends, strict=True):
                rows[row].append(bend)
            paths.append([name, *bends, target])
    return rows, paths


def neighbours(rows: list[list[str]], paths: Sequence[Sequence[str]]) -> dict[str, list[str]]:
    near: dict[str, list[str]] = {name: [] for row in rows for name in row}
    for path in paths:
        for one, other in zip(path, path[1:], strict=False):
            near[one].append(other)
            near[other].append(one)
    return near


def sorted_rows(rows: list[list[str]], paths: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return the rows with neighbours near each other: each row by the mean place of its neighbours, up and down several times."""
    near = neighbours(rows, paths)
    for sweep in range(24):
        place = {name: i / max(len(row) - 1, 1) for row in rows for i, name in enumerate(row)}
        for i in range(len(rows)) if sweep % 2 else range(len(rows) - 1, -1, -1):
            beside = set(rows[i - 1] if sweep % 2 and i else rows[i + 1] if not sweep % 2 and i + 1 < len(rows) else [])
            means = {n: [place[o] for o in near[n] if o in beside] for n in rows[i]}
            rows[i] = sorted(rows[i], key=lambda n: sum(means[n]) / len(means[n]) if means[n] else place[n])
            place |= {name: k / max(len(rows[i]) - 1, 1) for k, name in enumerate(rows[i])}
    return rows


def places(rows: list[list[str]], paths: Sequence[Sequence[str]]) -> dict[str, float]:
    """Return the middle of each box and bend, from left to right: near its neighbours, and as far from others as boxes need."""
    near, x = neighbours(rows, paths), {}
    for row in rows:
        left = 0.0
        for name in row:
            x[name] = left + width(name) / 2
            left += width(name) + GAP
    for sweep in range(60):
        for row in rows if sweep % 2 else rows[::-1]:
            wanted = [sum(x[o] for o in near[n]) / len(near[n]) if near[n] else x[n] for n in row]
            least = [0.0]
            for one, other in zip(row, row[1:], strict=False):
                least.append(least[-1] + (width(one) + width(other)) / 2 + GAP)
            # both pushes keep the distances: from the left, and from the right
            free = [w - d for w, d in zip(wanted, least, strict=True)]
            pushed = [max(free[: i + 1]) for i in range(len(row))]
            pulled = [min(free[i:]) for i in range(len(row))]
            for i, name in enumerate(row):
                x[name] = (pushed[i] + pulled[i]) / 2 + least[i]
    left = min(x[n] - width(n) / 2 for n in x) - GAP
    return {name: at - left for name, at in x.items()}


def shown(name: str) -> str:
    return name or "pycraft"


def width(name: str) -> float:
    return 10.0 if ">" in name else LETTER * len(shown(name)) + 18


def svg(uses: Order) -> str:
    """Return the picture as SVG."""
    rows, paths = with_bends(uses)
    rows = sorted_rows(rows, paths)
    x = places(rows, paths)
    y = {name: ROW * (len(rows) - 1 - i) + BOX for i, row in enumerate(rows) for name in row}
    total = max(x[name] + width(name) / 2 for name in x) + GAP
    tall = ROW * (len(rows) - 1) + 2 * BOX
    view = f'viewBox="0 0 {total:.0f} {tall}" width="{total:.0f}" height="{tall}"'
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" {view} font-family="DejaVu Sans, Verdana, sans-serif" font-size="12">']
    lines += [f'<rect width="{total:.0f}" height="{tall}" fill="{GROUND}"/>', f'<g fill="none" stroke="{INK}" stroke-opacity="0.45">']
    for path in paths:
        at = [(x[name], y[name] + (0 if ">" in name else BOX / 2 if i == 0 else -BOX / 2)) for i, name in enumerate(path)]
        curve = f"M{at[0][0]:.1f} {at[0][1]:.1f}"
        for (x0, y0), (x1, y1) in zip(at, at[1:], strict=False):
            middle = (y0 + y1) / 2
            curve += f" C{x0:.1f} {middle:.1f} {x1:.1f} {middle:.1f} {x1:.1f} {y1:.1f}"
        lines.append(f'<path d="{curve}"/>')
    lines += ["</g>", f'<g text-anchor="middle" fill="{INK}">']
    for name in uses:
        w, left, top = width(name), x[name] - width(name) / 2, y[name] - BOX / 2
        lines.append(f'<rect x="{left:.1f}" y="{top:.1f}" width="{w:.1f}" height="{BOX}" rx="4" fill="white" stroke="#0072b2"/>')
        lines.append(f'<text x="{x[name]:.1f}" y="{y[name] + 4:.1f}">{escape(shown(name))}</text>')
    return "\n".join([*lines, "</g>", "</svg>"]) + "\n"


def main() -> None:
    """Write the pictures."""
    for name, variable in PICTURES.items():
        (FOLDER / name).write_text(svg(order(variable)), encoding="utf-8")


if __name__ == "__main__":
    main()
