"""A run of the hard cases as Markdown: the committed table. The JSON and CSV files hold every row with its three statistics."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from .case import EVERY_DOUBLE, REFINED_WIDER
from .stability_table import Stability, number

Row = dict[str, Any]


def markdown(results: Stability) -> str:
    """Return the whole run: violated bounds first; then, family by family, the cases with their bounds, and the errors side by side."""
    cases, seeds, steps = _of(results, "case"), results.about.get("seeds"), results.about.get("steps")
    lines = [
        "# Hard cases",
        "",
        f"{len(cases)} cases, {seeds} random instances of each where there is something to draw; free tumbling over {steps:,} steps.",
        "Errors are relative, in the 2-norm, against quad precision unless a reference is named: 95 % of the instances are at or below the",
        "first number, all below the one in parentheses. Bold: a bound does not hold. Refused: the number of instances, where not all.",
        "Made by `pycraft stability`.",
        "",
    ]
    if results.failures:
        lines += ["## Bounds that do not hold", ""]
        failed = _together(((row["case"], row["failed"]), row["method"]) for row in results.failures)
        lines += [f"- {case}, {', '.join(methods)}: {text}" for (case, text), methods in failed.items()] + [""]
    else:
        lines += ["Every bound holds.", ""]
    for family in _of(results, "family"):
        lines += _family(family, [row for row in results if row["family"] == family])
    return "\n".join(lines).rstrip() + "\n"


def _of(rows: Any, key: str) -> list[Any]:
    """Return the different values of a column, in order."""
    return list(dict.fromkeys(row[key] for row in rows))


def _together(pairs: Iterable[tuple[Any, str]]) -> dict[Any, list[str]]:
    """Return the different second entries of each first one, in order."""
    found: dict[Any, list[str]] = {}
    for key, value in pairs:
        if value not in found.setdefault(key, []):
            found[key].append(value)
    return found


def _family(family: str, rows: list[Row]) -> list[str]:
    lines = [f"## {family.capitalize()}", "", "| cases | what is hard | bounds |", "|---|---|---|"]
    by_case = {case: [row for row in rows if row["case"] == case] for case in _of(rows, "case")}
    alike = _together(((_sentence(own[0]), _bounds(own)), case) for case, own in by_case.items())
    lines += [f"| {'; '.join(cases)} | {sentence} | {bounds} |" for (sentence, bounds), cases in alike.items()] + [""]
    dynamics = [row for row in rows if row["reference"] == "quad"]
    double = [row for row in dynamics if row["precision"] == "double"]
    lines += _side_by_side([row for row in double if not row["peer"]] + [row for row in double if row["peer"]])
    lines += _side_by_side([row for row in dynamics if row["precision"] != "double"])
    lines += _listed([row for row in rows if row["reference"] != "quad"])
    return lines + _texts(rows)


def _sentence(row: Row) -> str:
    return row["hard"] + (f" ({row['source']})" if row["source"] else "")


def _bounds(rows: list[Row]) -> str:
    """Return each bound with its methods."""
    methods = _together((bound, row["method"]) for row in rows for bound in filter(None, row["bound"].split("; ")))
    grouped = _together(((_group(own), bound.split(" ≤ ")[1]), bound.split(" ≤ ")[0]) for bound, own in methods.items())
    return (
        "; ".join(f"{who}: {' and '.join(statistics)} ≤ {formula}" for (who, formula), statistics in grouped.items()) or "refused, by name"
    )


def _group(methods: list[str]) -> str:
    """Return the methods by a common name, if they have one."""
    if set(EVERY_DOUBLE) <= set(methods) or len(methods) > 4:
        return "all"
    return "refined by a wider residual" if set(methods) == set(REFINED_WIDER.values()) else ", ".join(methods)


def _side_by_side(rows: list[Row]) -> list[str]:
    """Return a table with cases down and methods across."""
    if not rows:
        return []
    methods = _of(rows, "method")
    lines = ["| case | " + " | ".join(methods) + " |", "|" + "---|" * (1 + len(methods))]
    found = {(row["case"], row["method"]): row for row in rows}
    for case in _of(rows, "case"):
        lines.append(f"| {case} | " + " | ".join(_cell(found.get((case, method))) for method in methods) + " |")
    return [*lines, ""]


def _cell(row: Row | None) -> str:
    if row is None:
        return ""
    if row["refused"] == row["seeds"]:
        text = "refused"
    else:
        text = f"{number(row['p95'])} ({number(row['worst'])})"
        if row["refused"]:
            text += f", {row['refused']} refused"
    return text if row["passed"] else f"**{text}**"


def _listed(rows: list[Row]) -> list[str]:
    """Return cases with their own methods: a line each."""
    if not rows:
        return []
    lines = ["| case | quantity | reference | method | 95 % (worst) |", "|---|---|---|---|---|"]
    for row in rows:
        lines.append(f"| {row['case']} | {row['quantity']} | {row['reference']} | {row['method']} | {_cell(row)} |")
    return [*lines, ""]


def _texts(rows: list[Row]) -> list[str]:
    """Return messages with their cases: refusals, warnings of other packages, and values returned instead of refusals."""
    said = _together(((row["case"], _shortened(row)), row["method"]) for row in rows if _speaks(row))
    speakers = _together(((_speaker(methods), text), case) for (case, text), methods in said.items())
    lines = [f"- {who}: {text} — {'; '.join(cases)}" for (who, text), cases in speakers.items()]
    return [*lines, ""] if lines else []


def _speaks(row: Row) -> bool:
    return bool(row["text"]) and (row["peer"] or row["refused"] == row["seeds"] or not np.isfinite(row["worst"] or 0.0))


def _speaker(methods: list[str]) -> str:
    return "all of ours" if len(methods) > 8 else ", ".join(methods)


def _shortened(row: Row) -> str:
    """Return a text without parts that differ between instances: pivots, places in a file, and the hinge if none had to be named."""
    text = re.sub(r" \((D|pivot) [^)]*\)", "", row["text"].split(" Element name")[0])
    if not row["fault"]:
        text = re.sub(r"(SingularHingeError: )hinge '[^']*' of body '[^']*' feels no inertia along coordinate '[^']*'.*", r"\1", text)
        text = re.sub(r" of 'chain of [^']*'.*| at coordinate '[^']*'.*| at DOF .*", "", text).removesuffix(": ")
    return text
