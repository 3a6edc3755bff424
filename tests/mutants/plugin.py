"""A pytest plugin of test builds: turns on a mutant of Python, and notes what each test touched.

PYCRAFT_MUTANT_SOURCE=file:begin:end:text   that span of a module of pycraft is read as the text (an import hook; nothing is written)
PYCRAFT_MUTANT_NOTES=path                   tests, their outcomes and seconds, the switches and functions they touched, as JSON
PYCRAFT_MUTANT_TESTS=path                   only the tests named there, line by line, in that order; others of their files are left out
PYCRAFT_MUTANT_RED=path                     a line "began name" or "red name" for each test that begins or fails, as they do
"""

import ctypes
import importlib.machinery
import json
import os
import pathlib
import sys
import time

import pytest

TREE = pathlib.Path(os.environ["PYCRAFT_MUTANT_TREE"])


class MutatedLoader(importlib.machinery.SourceFileLoader):
    """Reads one module with a span replaced; its compiled form is neither read nor written."""

    def __init__(self, name, path, begin, end, text):
        super().__init__(name, path)
        self.begin, self.end, self.text = begin, end, text

    def get_code(self, name):
        text = pathlib.Path(self.path).read_text(encoding="utf-8")
        return compile(text[: self.begin] + self.text + text[self.end :], self.path, "exec", dont_inherit=True)


class MutatedFinder:
    def __init__(self, given):
        file, begin, end, self.text = given.split(":", 3)
        self.path, self.begin, self.end = TREE / file, int(begin), int(end)

    def find_spec(self, name, path=None, target=None):
        if not name.startswith("pycraft"):
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path, target)
        if spec is None or not spec.origin or pathlib.Path(spec.origin) != self.path:
            return None
        spec.loader = MutatedLoader(name, spec.origin, self.begin, self.end, self.text)
        return spec


sys.meta_path[:] = [f for f in sys.meta_path if "Scikit" not in type(f).__name__]  # the editable install is of another tree
sys.path.insert(0, str(TREE))
if os.environ.get("PYCRAFT_MUTANT_SOURCE"):
    sys.meta_path.insert(0, MutatedFinder(os.environ["PYCRAFT_MUTANT_SOURCE"]))

import pycraft  # noqa: E402 - after the finders

assert pycraft.__file__.startswith(str(TREE)), pycraft.__file__


class Notes:
    """Record the code that every test touches; setup counts for all tests of the file, because fixtures are shared."""

    def __init__(self, path):
        self.path, self.tests, self.setup, self.before = path, {}, {}, time.process_time()
        library = ctypes.CDLL(pycraft._core.__file__)
        self.count, self.flags = 0, (ctypes.c_ubyte * 1)()
        if hasattr(library, "pycraft_mutants_count"):  # not where only Python is mutated
            library.pycraft_mutants_touched.restype = ctypes.POINTER(ctypes.c_ubyte)
            self.count, self.flags = library.pycraft_mutants_count(), library.pycraft_mutants_touched()
        self.functions = set()
        self.prefix = str(TREE / "pycraft")

    def called(self, frame, event, _):
        if event == "call":
            code = frame.f_code
            if code.co_filename.startswith(self.prefix):
                self.functions.add((code.co_filename, code.co_firstlineno))

    def take(self):
        size = self.count + 1
        touched = {i for i, flag in enumerate(bytes(self.flags[:size])) if flag}
        ctypes.memset(self.flags, 0, size)
        functions, self.functions = self.functions, set()
        return touched | {(str(pathlib.Path(f).relative_to(TREE)), line) for f, line in functions}

    def pytest_collection_finish(self, session):
        self.setup["collection"] = self.take()
        sys.settrace(self.called)

    def pytest_runtest_logreport(self, report):
        known = self.tests.setdefault(report.nodeid, {"seconds": 0.0, "passed": True, "touched": set()})
        now = time.process_time()  # what it costs, however busy the machine is
        known["seconds"] += now - self.before
        self.before = now
        known["passed"] &= report.passed
        touched = self.take()
        if report.when == "setup":
            self.setup.setdefault("setup", set()).update(touched)
        known["touched"] |= touched

    def pytest_sessionfinish(self):
        sys.settrace(None)
        shared = set().union(*self.setup.values())
        data = {
            name: {"seconds": t["seconds"], "passed": t["passed"], "touched": sorted(map(str, (t["touched"] | shared)))}
            for name, t in self.tests.items()
        }
        pathlib.Path(self.path).write_text(json.dumps(data), encoding="utf-8")


class Named:
    """Some tests of the files that are given. One that is no longer there is passed over: its absence says nothing of a mutant."""

    def __init__(self, path):
        self.places = {name: i for i, name in enumerate(pathlib.Path(path).read_text(encoding="utf-8").splitlines())}

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config, items):
        there = sorted((item for item in items if item.nodeid in self.places), key=lambda item: self.places[item.nodeid])
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in self.places])
        items[:] = there


class Red:
    """Write failures at once: a test that ends the process is the last that has begun."""

    def __init__(self, path):
        self.path = pathlib.Path(path)

    def write(self, what, name):
        with open(self.path, "a", encoding="utf-8") as file:
            file.write(f"{what} {name}\n")

    def pytest_runtest_logstart(self, nodeid):
        self.write("began", nodeid)

    def pytest_collectreport(self, report):
        if report.failed:
            self.write("red", report.nodeid)

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self.write("red", report.nodeid)


def pytest_configure(config):
    for name, plugin in (("NOTES", Notes), ("TESTS", Named), ("RED", Red)):
        if os.environ.get(f"PYCRAFT_MUTANT_{name}"):
            config.pluginmanager.register(plugin(os.environ[f"PYCRAFT_MUTANT_{name}"]))
