"""Mutation check (ruling 24): one sign flipped, or one transpose swapped, in a block rule or a theorem; some test must turn red.

    python tests/mutation.py                         every mutation: hours
    python tests/mutation.py --sample 20 --seed 0    twenty of them, a minute or so each
    python tests/mutation.py --list                  what there is to mutate
    python tests/mutation.py --one-per-rule          one mutation of every function and theorem

Each mutation is built in a copy of the tree in a temporary folder; the tree itself is never touched. Results are kept, one file a
mutation, under build/mutation (or --results), so that a run can be stopped and taken up again, and several can run side by side:
each claims its mutations by a file. Tests that are red without any mutation are left out. Exit status 1 if a mutation survives.
"""

import argparse
import functools
import hashlib
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass

ROOT = pathlib.Path(__file__).resolve().parents[1]
TARGETS = [
    "cpp/operators/rigid_blocks.h", "cpp/algebra/dense_blocks.h", "cpp/spatial/*.h", "cpp/recursions/*.h",
    "cpp/algebra/sweeps/*.h", "cpp/model/hinge_kinematics.h", "cpp/algebra/theorems.cpp",
]  # fmt: skip
# In the order in which a wrong rule shows soonest.
TESTS = [
    "tests/test_operators_oracle.py", "tests/test_direct_calls.py", "tests/test_sko_random.py", "tests/test_properties.py",
    "tests/test_plans.py", "tests/test_operators_algebra.py", "tests/test_singular_hinges.py", "tests/test_checker.py",
    "tests/test_statements.py",
]  # fmt: skip
TEST_SECONDS = 600
RUN_TESTS = """
import sys
sys.meta_path[:] = [f for f in sys.meta_path if "Scikit" not in type(f).__name__]  # the editable install is of another tree
sys.path.insert(0, sys.argv[1])
import pycraft
assert pycraft.__file__.startswith(sys.argv[1]), pycraft.__file__
import pytest
sys.exit(pytest.main(sys.argv[2:]))
"""


@dataclass(frozen=True)
class Mutation:
    """One change of one file: the text from `begin` to `end` is replaced."""

    file: str
    line: int
    column: int
    rule: str
    begin: int
    end: int
    before: str
    after: str
    shown: str

    @property
    def key(self):
        """A name that stays the same while the line and its rule do."""
        text = f"{self.file}|{self.rule}|{self.shown}|{self.column}|{self.before}|{self.after}"
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def apply(self, text):
        assert text[self.begin : self.end] == self.before
        return text[: self.begin] + self.after + text[self.end :]


# ---------------------------------------------------------------------- where to mutate


def blanked(text):
    """The text with comments, strings, subscripts and the heads of loops as blanks: what is left is arithmetic. Same length."""
    hide = lambda m: re.sub(r"[^\n]", " ", m.group())  # noqa: E731
    text = re.sub(r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|^\s*#[^\n]*", hide, text, flags=re.S | re.M)
    chars = list(text)
    for opening, closing, starts in (
        ("(", ")", [m.end() - 1 for m in re.finditer(r"\b(?:for|while)\s*\(", text)]),
        ("[", "]", [m.start() for m in re.finditer(r"(?<=[\w\])])\[", text)]),
        ("<", ">", [m.end() - 1 for m in re.finditer(r"\btemplate\s*<", text)]),
    ):
        for start in starts:
            for i in range(start + 1, matching(text, start, opening, closing)):
                if chars[i] != "\n":
                    chars[i] = " "
    return "".join(chars)


def matching(text, start, opening, closing):
    """Where the bracket that opens at `start` closes."""
    depth = 0
    for i in range(start, len(text)):
        depth += (text[i] == opening) - (text[i] == closing)
        if depth == 0:
            return i
    return len(text) - 1


def arguments(text, start):
    """(begin, end) of each argument of the call whose parenthesis opens at `start`."""
    end, depth, begin, found = matching(text, start, "(", ")"), 0, start + 1, []
    for i in range(start + 1, end):
        depth += text[i] in "([{"
        depth -= text[i] in ")]}"
        if text[i] == "," and depth == 0:
            found.append((begin, i))
            begin = i + 1
    return [*found, (begin, end)]


def rule_names(text):
    """(offset, name) of every function, in order."""
    pattern = r"^[ \t]*(?:[\w:<>&*,\[\]]+[ \t]+)+(operator[^\s(]+|\w+)\([^;{}]*\)[ \t]*(?:const)?[ \t]*\{"
    return [(m.start(), m.group(1)) for m in re.finditer(pattern, text, re.M) if m.group(1) not in ("if", "switch", "return")]


POINTERS = re.compile(r"\s*(?:tree\w*\.|model\.\w+_offset|at_|d_\b|f\b|first\b|size_t|1\b|static_cast)")  # steps of pointers and indices
BOOKKEEPING = {"DenseBlocks", "RigidBlocks", "resize", "throw_singular_hinge"}
PAIRS = [
    ("force_to_parent", "motion_to_child"), ("cross_motion", "cross_force"), ("shift_add", "shift_transposed_add"),
    ("articulated_shift_add", "articulated_shift_transposed_add"),
]  # fmt: skip
SWAPPED = {**dict(PAIRS), **{b: a for a, b in PAIRS}}


def sites(file):
    """Every mutation of a header of block rules."""
    text = (ROOT / file).read_text(encoding="utf-8")
    code, names = blanked(text), rule_names(text)
    found = []

    def add(begin, end, after):
        line, column = text.count("\n", 0, begin) + 1, begin - text.rfind("\n", 0, begin)
        rule = next((name for at, name in reversed(names) if at <= begin), "")
        if rule and rule not in BOOKKEEPING:
            found.append(Mutation(file, line, column, rule, begin, end, text[begin:end], after, text.splitlines()[line - 1].strip()))

    for m in re.finditer(r"(?<=[\w)\]] )([+-])(?= [\w(*~])", code):  # a + b
        if not POINTERS.match(code, m.end()) and not code[: m.start()].rstrip().endswith(("data()", "begin()")):
            add(m.start(), m.end(), "-" if m.group() == "+" else "+")
    for m in re.finditer(r"([+-])=(?!=)", code):
        add(m.start(), m.start() + 1, "-" if m.group(1) == "+" else "+")
    for m in re.finditer(r"(?<=[({,=?:] )-(?=[\w(])|(?<=[({])-(?=[\w(])|(?<=return )-(?=[\w(])", code):  # a lone minus
        add(m.start(), m.end(), "")
    for m in re.finditer(r"S\(-1\)", code):
        add(m.start(), m.end(), "S(1)")
    for m in re.finditer(r"\b(transposed_multiply_add|multiply_add|multiply_transposed_add)\(", code):
        parts = arguments(text, m.end() - 1)
        if "S(-1)" not in text[slice(*parts[-1])] and len(parts) == 6:
            add(parts[-1][1], parts[-1][1], ", S(-1)")
    for name, other in SWAPPED.items():
        for m in re.finditer(rf"\b{name}\((?!const |int )", code):
            add(m.start(), m.start() + len(name), other)
    for m in re.finditer(r"\btranspose\((?!const )", code):
        add(m.start(), m.end(), "(")
    for m in re.finditer(r"\btranspose_times\((?!const )", code):
        a, b = (text[slice(*part)].strip() for part in arguments(text, m.end() - 1))
        add(m.start(), matching(text, m.end() - 1, "(", ")") + 1, f"({a} * ({b}))")
    for m in re.finditer(r"\bcross\((?!const )", code):
        parts = [text[slice(*part)].strip() for part in arguments(text, m.end() - 1)]
        if len(parts) == 2:
            add(m.start(), matching(text, m.end() - 1, "(", ")") + 1, f"cross({parts[1]}, {parts[0]})")
    return found


def theorem_sites(file):
    """Mutations of the theorems that rewrite or invert: a sign, a transpose, or the whole right side."""
    text = (ROOT / file).read_text(encoding="utf-8")
    found = []
    for m in re.finditer(r"\bstate\(\"", text):
        parts = arguments(text, m.end() - 2)
        if len(parts) < 4 or not any(text[slice(*part)].strip() in ("rewrite", "inverse") for part in parts):
            continue
        name, (begin, end) = text[slice(*parts[0])].strip(' "'), parts[2]
        line = text.count("\n", 0, m.start()) + 1

        def add(at, to, after, name=name, line=line):
            column = at - text.rfind("\n", 0, at)
            found.append(Mutation(file, line, column, name, at, to, text[at:to], after, text.splitlines()[line - 1].strip()))

        right = text[begin:end]
        for sign in re.finditer(r"(?<= )[+-](?= )", right):
            add(begin + sign.start(), begin + sign.end(), "-" if sign.group() == "+" else "+")
        for star in re.finditer(r"\.T\(\)", right):
            add(begin + star.start(), begin + star.end(), "")
        if not re.search(r" [+-] |\.T\(\)", right):
            add(begin, end, f" -1.0 * ({right.strip()})")
    return found


def everything():
    """All mutations, file by file."""
    found = []
    for pattern in TARGETS:
        for path in sorted(ROOT.glob(pattern)):
            file = path.relative_to(ROOT).as_posix()
            found += theorem_sites(file) if file.endswith("theorems.cpp") else sites(file)
    return list({m.key: m for m in found}.values())


# ---------------------------------------------------------------------- building and testing in a copy


class Copy:
    """A copy of the tree in a temporary folder, built once and rebuilt for every mutation."""

    def __init__(self, folder, jobs, optimisation):
        self.folder, self.jobs = pathlib.Path(folder) / "tree", jobs
        listed = ["git", "-C", str(ROOT), "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
        for name in subprocess.run(listed, check=True, capture_output=True, text=True).stdout.split("\0"):
            if name and (ROOT / name).is_file():
                target = self.folder / name
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, target)
        self.build = self.folder / "build"
        program = [self.tool("cmake"), "-S", str(self.folder), "-B", str(self.build), "-G", "Ninja"]
        program += [
            f"-DPython_EXECUTABLE={sys.executable}",
            f"-DCMAKE_CXX_FLAGS_RELEASE=-O{optimisation}",
            "-DCMAKE_BUILD_TYPE=Release",
        ]
        subprocess.run([*program, f"-DCMAKE_MAKE_PROGRAM={self.tool('ninja')}"], check=True, capture_output=True, text=True)
        made = self.make()
        if made.returncode:
            raise SystemExit(f"the tree does not build:\n{made.stdout[-2000:]}")

    @staticmethod
    def tool(name):
        """A program beside this Python, or on the path."""
        return shutil.which(name, path=os.pathsep.join([str(pathlib.Path(sys.executable).parent), os.environ["PATH"]])) or name

    def make(self):
        made = subprocess.run([self.tool("cmake"), "--build", str(self.build), "--target", "_core", "-j", str(self.jobs)],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)  # fmt: skip
        if made.returncode == 0:
            for library in self.build.glob("_core*.so"):
                shutil.copy2(library, self.folder / "pycraft")
        return made

    def test(self, left_out, tests, stop=True):
        """(passed, output) of the tests; a crash or an endless loop is a failure."""
        options = ["-q", "-m", "not slow and not peers", "-p", "no:cacheprovider", "--tb=no", "-rfE", *(["-x"] if stop else [])]
        options += [x for name in left_out for x in ("--deselect", name)]
        program = [sys.executable, "-c", RUN_TESTS, str(self.folder), *options, *tests]
        try:
            run = subprocess.run(
                program, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=TEST_SECONDS
            )
        except subprocess.TimeoutExpired:
            return False, "FAILED (no end)"
        return run.returncode == 0, run.stdout if run.returncode in (0, 1) else f"FAILED (exit {run.returncode})\n{run.stdout}"

    def try_one(self, mutation, left_out, tests):
        """The verdict on one mutation: killed (and by what), survived, or does not compile."""
        path = self.folder / mutation.file
        original = path.read_text(encoding="utf-8")
        begin = time.perf_counter()
        try:
            path.write_text(mutation.apply(original), encoding="utf-8")
            made = self.make()
            if made.returncode:
                return {"verdict": "does not compile", "by": made.stdout[-300:], "seconds": time.perf_counter() - begin}
            passed, output = self.test(left_out, tests)
        finally:
            path.write_text(original, encoding="utf-8")
        red = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", output, re.M)
        verdict = {"verdict": "survived", "by": ""} if passed else {"verdict": "killed", "by": red.group(1) if red else output[-200:]}
        return verdict | {"seconds": time.perf_counter() - begin}


def failing_already(copy, tests):
    """Tests that are red without any mutation."""
    passed, output = copy.test([], tests, stop=False)
    return [] if passed else re.findall(r"^(?:FAILED|ERROR) (tests/\S+?::.*?)(?: - .*)?$", output, re.M)


# ---------------------------------------------------------------------- results


def claim(results, mutation):
    """Whether this process may take the mutation: nobody has a result, nobody alive is at it."""
    if (results / f"{mutation.key}.json").exists():
        return False
    path = results / f"{mutation.key}.claim"
    try:
        with open(path, "x") as file:
            file.write(str(os.getpid()))
        return True
    except FileExistsError:
        try:
            os.kill(int(path.read_text() or 0) or os.getpid() + 10**9, 0)
            return False
        except (ProcessLookupError, OverflowError, ValueError):
            path.write_text(str(os.getpid()))
            return True


def known(results, mutation):
    path = results / f"{mutation.key}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def table(mutations, results):
    """The results as text, survivors last; the number of survivors."""
    done = [(m, r) for m in mutations if (r := known(results, m))]
    lines = [f"{'verdict':<17} {'where':<46} {'rule':<34} change"]
    for m, r in sorted(done, key=lambda pair: (pair[1]["verdict"] == "survived", pair[0].file, pair[0].line)):
        change = f"{m.before.strip()!r} -> {m.after.strip()!r} in  {m.shown[:70]}"
        lines.append(f"{r['verdict']:<17} {m.file.removeprefix('cpp/') + ':' + str(m.line):<46} {m.rule[:33]:<34} {change}")
        if r["verdict"] == "killed":
            lines.append(f"{'':<17} by {r['by']}")
    counts = {v: sum(r["verdict"] == v for _, r in done) for v in ("killed", "survived", "does not compile")}
    lines.append(", ".join(f"{n} {v}" for v, n in counts.items()) + f" of {len(mutations)} chosen; {len(everything())} in all")
    return "\n".join(lines), counts["survived"]


def chosen(arguments_):
    """The mutations asked for, in an order that changes one file after another."""
    found = [m for m in everything() if arguments_.only in m.file or arguments_.only in m.rule]
    draw = random.Random(arguments_.seed)
    if arguments_.one_per_rule:
        rules = {}
        for m in found:
            rules.setdefault((m.file, m.rule), []).append(m)
        found = [draw.choice(group) for group in rules.values()]
    if arguments_.sample:
        found = draw.sample(found, min(arguments_.sample, len(found)))
    return sorted(found, key=lambda m: (m.file, m.begin))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sample", type=int, help="so many mutations, drawn from the seed")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--one-per-rule", action="store_true", help="one mutation of every function and theorem, drawn from the seed")
    parser.add_argument("--only", default="", help="mutations whose file or rule has this in its name")
    parser.add_argument("--list", action="store_true", help="show the mutations and stop")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="compilers at once")
    parser.add_argument("--optimisation", default="1", help="the compiler's level: 0 builds sooner and tests later")
    parser.add_argument("--results", type=pathlib.Path, default=ROOT / "build" / "mutation")
    parser.add_argument("--tests", nargs="*", default=TESTS)
    options = parser.parse_args()
    mutations = chosen(options)
    show = functools.partial(print, flush=True)
    if options.list:
        for m in mutations:
            show(f"{m.file}:{m.line}  {m.rule}: {m.before.strip()!r} -> {m.after.strip()!r}   {m.shown[:90]}")
        show(f"{len(mutations)} mutations of {len({(m.file, m.rule) for m in mutations})} rules")
        return 0
    options.results.mkdir(parents=True, exist_ok=True)
    if any(known(options.results, m) is None for m in mutations):
        with tempfile.TemporaryDirectory(prefix="pycraft-mutation-") as folder:
            copy = Copy(folder, options.jobs, options.optimisation)
            left_out = failing_already(copy, options.tests)
            show(f"{len(mutations)} mutations; {len(left_out)} tests are red without any and are left out")
            for m in mutations:
                if not claim(options.results, m):
                    continue
                try:
                    result = copy.try_one(m, left_out, options.tests)
                    (options.results / f"{m.key}.json").write_text(json.dumps(asdict(m) | result, ensure_ascii=False), encoding="utf-8")
                    show(f"{result['verdict']:<17} {m.file}:{m.line} {m.rule}: {m.shown[:60]} ({result['seconds']:.0f} s)")
                finally:
                    (options.results / f"{m.key}.claim").unlink(missing_ok=True)
    text, survivors = table(mutations, options.results)
    show(text)
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
