"""Mutation check (ruling 24): small wrong changes, each of which must turn some test red.

    python tests/mutation.py                      120 mutants drawn from a seed and all that are listed by hand; writes tests/mutation.md
    python tests/mutation.py --all                every mutant there is: hours
    python tests/mutation.py --dozen              the twelve that every `make test-peers` tries: minutes, most of them one build
    python tests/mutation.py --only sweeps        those whose file, rule or change has this in its name
    python tests/mutation.py --python             those of Python alone, with the core as it is; --areas: and the tests of their own areas
    python tests/mutation.py --list               what there is

All mutants of C++ are switches of one build in a copy of the tree, those of Python spans replaced as a module is read: the tree itself is
never touched. A first run notes what each everyday test touches and how long it takes; then each mutant meets tests that touch it, quick
ones that touch little else first and those that have killed before, until one is red or --budget seconds are spent; what is killed is
tried again only where its source or the test has changed. Mutants of C++ meet cpp/tests/test_kernels.cpp before. Tests that are red
without any mutant are left out. The copy and what was found are kept under build/mutation (or --folder) and taken up again while the
sources stay as they are.
Exit status 1 where a mutant survives that tests/mutants/known.py does not explain.
"""

import argparse
import functools
import os
import pathlib
import random
import sys
import time

from mutants import cpp_places, listed, python_places, report, running
from mutants.known import DOZEN

ROOT = pathlib.Path(__file__).resolve().parents[1]
show = functools.partial(print, flush=True)


def chosen(options, drawn):
    """The mutants asked for: those listed by hand, and so many of the others."""
    if options.dozen:
        return [m for m in drawn if m.name in DOZEN]
    wanted = [m for m in drawn if options.only in f"{m.file} {m.rule} {m.change}"]
    if options.all or options.only:
        return wanted
    by_hand, others = [m for m in wanted if m.name], [m for m in wanted if not m.name]
    draw = random.Random(options.seed)
    cpp, python = [m for m in others if not m.python], [m for m in others if m.python]
    half = options.sample // 2
    if options.python:
        half = 0
    return by_hand + draw.sample(cpp, min(half, len(cpp))) + draw.sample(python, min(options.sample - half, len(python)))


def main():
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sample", type=int, default=120, help="so many of what is not listed by hand, half of them C++")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--dozen", action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument("--python", action="store_true")
    parser.add_argument("--areas", action="store_true", help="only the tests of the areas of what is tried: less is noted")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--budget", type=float, default=60, help="seconds of tests for one mutant")
    parser.add_argument("--optimisation", default="1", help="the compiler's level: 0 builds sooner and tests later")
    parser.add_argument("--folder", type=pathlib.Path, default=ROOT / "build" / "mutation")
    parser.add_argument("--output", type=pathlib.Path, default=None, help="the table; tests/mutation.md for a run of the default sample")
    options = parser.parse_args()
    begin = time.perf_counter()

    by_hand, stale = [], []
    for changes in (listed.CPP, listed.PYTHON):
        mutants, gone = listed.found(ROOT, changes)
        by_hand += mutants
        stale += gone
    for name in stale:
        show(f"its text is not there, or not there once (tests/mutants/listed.py): {name}")
    everything = [*by_hand, *cpp_places.everything(ROOT), *python_places.everything(ROOT)]
    if options.python:
        everything = [m for m in everything if m.python]
    if options.dozen:  # the rest of the build is taken as it is
        everything = [m for m in everything if m.name in DOZEN]
    if options.list:
        for m in chosen(options, everything):
            show(f"{m.key}  {m.file}:{m.line}  {m.change}   {m.shown[:90]}")
        python = sum(m.python for m in everything)
        show(f"{len(everything) - python} of C++, {python} of Python, {len(by_hand)} of them listed by hand")
        return 0

    wanted = chosen(options, everything)
    build = running.kept_or_built(ROOT, options, [m for m in everything if not m.python] if any(not m.python for m in wanted) else [], show)
    left = {(m.file, m.begin, m.change): i for i, m in enumerate(build.mutants) if m not in build.dropped}
    numbers = {m.key: left[m.file, m.begin, m.change] for m in everything if not m.python and (m.file, m.begin, m.change) in left}
    mutants = [m for m in wanted if m.python or m.key in numbers]
    notes = running.noted(build, mutants, options, show)
    results = running.tried(build, mutants, numbers, notes, options, show)
    text, unexplained = report.table(mutants, results, time.perf_counter() - begin, options)
    output = options.output or (ROOT / "tests" / "mutation.md" if not (options.dozen or options.only or options.all) else None)
    if output:
        output.write_text(text, encoding="utf-8")
    show(text)
    return 1 if unexplained or stale else 0


if __name__ == "__main__":
    sys.exit(main())
