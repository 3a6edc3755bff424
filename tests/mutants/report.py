"""The table of a run: tests/mutation.md."""

from .known import reason


def table(mutants, results, seconds, options):
    """The page as text; how many survivors are not explained."""
    rows = [(m, results[m.key]) for m in mutants]
    count = lambda verdict, part: sum(r["verdict"] == verdict for m, r in rows if part(m))
    parts = [
        ("listed by hand", lambda m: bool(m.name)),
        ("drawn, C++", lambda m: not m.name and not m.python),
        ("drawn, Python", lambda m: not m.name and m.python),
    ]
    lines = ["# Mutants", ""]
    lines += [
        "Small wrong changes, and whether the everyday tests notice them. `python tests/mutation.py` writes this page; its head says",
        "how it goes about it. Mutants *listed by hand* are what a saboteur tried (tests/mutants/listed.py); the others are drawn from",
        "a seed.",
        "",
        f"Seed {options.seed}; {options.budget:.0f} s of tests for a mutant at most; {seconds / 60:.0f} min with {options.jobs} jobs."
        + " Changes of Python alone." * options.python
        + " Only tests of the areas of the tried mutants." * options.areas,
        "",
        "| | killed | survived | of them explained | executed by no test |",
        "|---|---|---|---|---|",
    ]
    for name, part in parts:
        survivors = [m for m, r in rows if part(m) and r["verdict"] != "killed"]
        explained = sum(bool(reason(m)) for m in survivors)
        counts = [count(verdict, part) for verdict in ("killed", "survived", "not executed")]
        lines.append(f"| {name} | {counts[0]} | {counts[1]} | {explained} | {counts[2]} |")
    lines += ["", "## Survivors", "", "| where | change | line | why |", "|---|---|---|---|"]
    unexplained = 0
    for m, r in rows:
        if r["verdict"] == "killed":
            continue
        why = reason(m) or ("executed by no everyday test" if r["verdict"] == "not executed" else "open")
        unexplained += not reason(m)
        lines.append(f"| {m.file}:{m.line} | {cell(m.change)} | `{cell(m.shown)}` | {why} |")
    lines += ["", "## Listed by hand", "", "| change | turned red |", "|---|---|"]
    lines += [f"| {cell(m.change)} | {cell(r['by'] or r['verdict'])} |" for m, r in rows if m.name]
    return "\n".join(lines) + "\n", unexplained


def cell(text):
    return text.replace("|", "\\|").replace("`", "'")
