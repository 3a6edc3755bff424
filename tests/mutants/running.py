"""Tests that meet each mutant, and their results."""

import concurrent.futures
import hashlib
import itertools
import json
import os
import pathlib
import pickle
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

import pytest

from . import building
from .known import AREAS, DOZEN_TESTS

SKIPPED_FILES = {"test_notebooks.py", "test_stubs.py", "test_cpp_users.py", "test_mutation.py", "test_layers.py"}
NOT_IMPORTED = 77
RUN = """
import sys
tree, not_imported, *options = sys.argv[1:]
sys.path.insert(0, tree + "/tests")
import pytest
try:
    import mutants.plugin
except Exception as error:
    print(error)
    sys.exit(int(not_imported))
sys.exit(pytest.main(options, [mutants.plugin]))
"""


def digest(*parts):
    h = hashlib.sha256()
    for part in parts:
        h.update(part if isinstance(part, bytes) else str(part).encode())
    return h.hexdigest()[:16]


def contents(root, *patterns):
    return b"".join(path.read_bytes() for pattern in patterns for path in sorted(root.glob(pattern)))


def everywhere(tree):
    """Return the sources that any test may depend on: the package, and shared test code."""
    return contents(tree, "pycraft/**/*.py", "tests/conftest.py", "tests/support/*.py", "tests/campaigns/*.py")


def kept_or_built(root, options, mutants, show):
    """The test build of these sources and mutants; Python and tests are those of now."""
    core = [
        f"cpp/{folder.name}/**/*.{kind}" for folder in sorted((root / "cpp").iterdir()) if folder.name != "tests" for kind in ("h", "cpp")
    ]
    key = digest(contents(root, *core), [m.key for m in mutants], options.optimisation)
    folder = options.folder / f"{'dozen' if options.dozen else 'build'}-{key}"
    kept = folder / "build.pickle"
    if kept.exists():
        with open(kept, "rb") as file:
            build = pickle.load(file)
        building.copy_of_tree(root, build.tree)
        build.write()
        return build
    begin = time.perf_counter()
    build = building.TestBuild(root, folder, mutants, options.jobs, options.optimisation, show)
    show(f"built in {time.perf_counter() - begin:.0f} s")
    build.show = None
    with open(kept, "wb") as file:
        pickle.dump(build, file)
    return build


@dataclass
class Run:
    status: int | None  # none where it did not end
    output: str
    lines: list  # "began name", "red name"

    def by(self):
        """Return the failure: a test, or the end of the run. None if the tests passed, or if there were none."""
        red = [line.removeprefix("red ") for line in self.lines if line.startswith("red ")]
        begun = [line.removeprefix("began ") for line in self.lines if line.startswith("began ")]
        if red or self.status in (0, pytest.ExitCode.USAGE_ERROR, pytest.ExitCode.NO_TESTS_COLLECTED):
            return red[0] if red else ""
        if self.status == NOT_IMPORTED:
            return "import pycraft"
        how = "no end" if self.status is None else "crash" if self.status < 0 else f"exit status {self.status}"
        return f"{how}: {begun[-1]}" if begun else how


def pytest_run(build, files, seconds, tests=None, first=False, **environment):
    """A run of all everyday tests of these files, or of those that are named, in their order; of the first that fails with `first`."""
    values = {k: v for k, v in os.environ.items() if not k.startswith("PYCRAFT_MUTANT")}
    values |= {"PYCRAFT_MUTANT_TREE": str(build.tree), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    values |= {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", **environment}  # hypothesis takes a second, where no test asks for it
    options = ["-q", "-p", "no:cacheprovider", "--tb=no", "--assert=plain", "-rfE", "--import-mode=prepend", *["-x"] * first]
    options += ["-m", "not slow and not peers"]
    with tempfile.TemporaryDirectory() as folder:
        red = pathlib.Path(folder, "red")
        red.touch()
        values["PYCRAFT_MUTANT_RED"] = str(red)
        if tests is not None:
            named = pathlib.Path(folder, "tests")
            named.write_text("\n".join(tests), encoding="utf-8")
            values["PYCRAFT_MUTANT_TESTS"] = str(named)
        program = [sys.executable, "-c", RUN, str(build.tree), str(NOT_IMPORTED), *options, *files]
        try:
            run = subprocess.run(
                program, cwd=build.tree, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=seconds, env=values
            )
            status, output = run.returncode, run.stdout
        except subprocess.TimeoutExpired:
            status, output = None, "no end"
        return Run(status, output, red.read_text(encoding="utf-8").splitlines())


def noted(build, mutants, options, show):
    """Return the code that every everyday test touches, with its seconds; tests that already fail are excluded."""
    begin, files = time.perf_counter(), sorted(p for p in (build.tree / "tests").rglob("test_*.py") if p.name not in SKIPPED_FILES)
    if options.dozen or options.areas:
        wanted = DOZEN_TESTS if options.dozen else {name for m in mutants for name in AREAS.get(m.file, ())}
        files = [p for p in files if p.relative_to(build.tree / "tests").as_posix() in wanted]
    shared = everywhere(build.tree)

    def one(path):
        note = build.folder / f"{path.stem}.{digest(shared, path.read_bytes())}.json"
        if not note.exists():
            for gone in build.folder.glob(f"{path.stem}.*.json"):
                gone.unlink()
            run = pytest_run(build, [str(path.relative_to(build.tree))], 900, PYCRAFT_MUTANT_NOTES=str(note))
            if not note.exists():
                show(f"{path.name} does not run in the copy: {run.output[-300:]}")
                return {}
        return json.loads(note.read_text(encoding="utf-8"))

    notes = {}
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for found in pool.map(one, files):
            notes |= found
    red = [name for name, t in notes.items() if not t["passed"]]
    for name in red:
        show(f"red without any mutant, left out: {name}")
    show(f"{len(notes)} tests noted in {time.perf_counter() - begin:.0f} s")
    return {name: t for name, t in notes.items() if t["passed"]}


def touching(mutant, number, touched):
    """The tests that execute a mutant."""
    if not mutant.python:
        return touched.get(str(number), [])
    if mutant.functions and (found := touched.get(str((mutant.file, mutant.functions[0])), [])):
        return found
    of_file = {name for place, names in touched.items() if place.startswith(f"('{mutant.file}',") for name in names}
    return list(of_file) or touched["everything"]


def passes(program, **environment):
    try:
        return subprocess.run([program], env=os.environ | environment, capture_output=True, timeout=60).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def tried(build, mutants, numbers, notes, options, show):
    """Mutant's key -> verdict, the test that killed it, tests that ran, seconds. C++ meets the tests of its kernels first."""
    kernels = building.kernels(build) if build.mutants else None
    if kernels and not passes(kernels):
        show(f"red without any mutant: {building.KERNELS}")
        kernels = None
    shared = everywhere(build.tree)
    touched = {"everything": list(notes)}
    for name, t in notes.items():
        for place in t["touched"]:
            touched.setdefault(place, []).append(name)
    # A test that touches little is about what it touches.
    price = {name: (t["seconds"] + 0.02) * len(t["touched"]) for name, t in notes.items()}
    kills, results = {}, {}
    kept = build.folder / "killed.json"
    killed = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}

    def digest_of(by):
        """Of the source and of the file of the test that killed: while they stay a mutant is not tried again."""
        test = build.tree / by.split("::")[0].split(": ")[-1]
        return digest(shared, test.read_bytes() if test.is_file() else b"")

    def one(mutant):
        before = killed.get(mutant.key)
        if before and before["digest"] == digest_of(before["by"]):
            return before
        found = attempt(mutant)
        if found["verdict"] == "killed" and not found["by"].startswith("no end"):  # the machine may have been busy
            killed[mutant.key] = found | {"digest": digest_of(found["by"])}
        return found

    def affordable(tests):
        """As many as the budget takes, from the first on."""
        seconds = list(itertools.accumulate(notes[name]["seconds"] for name in tests))
        return tests[: max(1, sum(t <= options.budget for t in seconds))]

    def attempt(mutant):
        if kernels and not mutant.python and not passes(kernels, PYCRAFT_MUTANT=str(numbers[mutant.key])):
            return {"verdict": "killed", "by": building.KERNELS, "tests": 1, "seconds": 0.1}
        tests = touching(mutant, numbers.get(mutant.key), touched)
        if not tests:
            return {"verdict": "not executed", "by": "", "tests": 0, "seconds": 0.0}
        tests = sorted(tests, key=lambda name: price[name] / (1 + kills.get(name, 0)))
        area = {f"tests/{name}" for name in AREAS.get(mutant.file, ())}
        own = affordable([name for name in tests if name.split("::")[0] in area])
        others = affordable([name for name in tests if name not in own])
        within = own + others
        environment = (
            {"PYCRAFT_MUTANT_SOURCE": f"{mutant.file}:{mutant.begin}:{mutant.end}:{mutant.after}"}
            if mutant.python
            else {"PYCRAFT_MUTANT": str(numbers[mutant.key])}
        )
        begin = time.perf_counter()
        for part in (own, others):
            if not part:
                continue
            files = list(dict.fromkeys(name.split("::")[0] for name in part))
            if by := pytest_run(build, files, 6 * options.budget + 240, part, first=True, **environment).by():
                if by in notes:
                    kills[by] = kills.get(by, 0) + 1
                return {"verdict": "killed", "by": by, "tests": len(within), "seconds": time.perf_counter() - begin}
        return {"verdict": "survived", "by": "", "tests": len(within), "of": len(tests), "seconds": time.perf_counter() - begin}

    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for mutant, result in zip(mutants, pool.map(one, mutants), strict=True):
            results[mutant.key] = result
            kept.write_text(json.dumps(dict(killed)), encoding="utf-8")
            show(f"{result['verdict']:<13} {mutant.file}:{mutant.line} {mutant.change}  [{result['by']}] ({result['seconds']:.0f} s)")
    return results
