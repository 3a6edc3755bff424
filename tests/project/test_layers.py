"""Dependencies point one way (architecture.md, Layout): a grep of the C++ includes, the Python imports and the build's flags."""

import ast
import functools
import importlib
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[2]
CPP, PYTHON = ROOT / "cpp", ROOT / "pycraft"

# The modules of C++, each with the modules that it may include directly; it may also include all that these may include.
STANDS_ON = {
    "runtime": [],
    "lanes": ["runtime"],
    "numerics": ["lanes"],
    "spatial": ["numerics"],
    "algebra/language": ["numerics"],
    "algebra/trees": ["algebra/language"],
    "algebra/theorems": ["algebra/trees"],
    "algebra/planning": ["algebra/theorems"],
    "algebra/engine": ["algebra/planning"],
    "model": ["spatial", "algebra/language"],
    "rigid": ["model", "algebra/trees"],
    "kernels": ["rigid"],
    "recursions": ["rigid"],
    "operators": ["recursions", "kernels", "algebra/planning"],
    "dynamics": ["recursions", "kernels"],
    "simulation": ["dynamics"],
    "bindings": ["simulation", "operators", "algebra/engine"],
    "bench": ["bindings"],
    "tests": ["simulation", "operators", "algebra/engine"],
}
CORE = [room for room in STANDS_ON if room not in ("bindings", "bench", "tests")]
# Sources that are parts of a class or a table declared elsewhere.
PARTS = {
    "lanes/lanes_baseline",  # what lanes do by an instruction set each
    "lanes/lanes_avx2",
    "lanes/lanes_avx512",
    "kernels/kernels_baseline",  # the kernels of an instruction set each
    "kernels/kernels_avx2",
    "kernels/kernels_avx512",
    "kernels/kernels_wide",
    "model/multibody_state",  # class Multibody: its state
    "algebra/trees/recorded_trees",  # sources of numbers at the recorded scalar
    "operators/recorded_values",
    "algebra/planning/plan_blocks",  # class Planner, by what is planned
    "algebra/planning/plan_diagonals",
    "algebra/planning/plan_solves",
    "algebra/planning/plan_vectors",
    "dynamics/embedded_choice",
    "dynamics/states_on_loops",  # class ConstrainedWorkspace: states taken onto loops
    "operators/calculus_theorems",  # rows of the catalogue
    "operators/mechanics_theorems",
    "operators/mechanics_symbols",
    "operators/independent_direction",  # a direction, declared with the others in directions.h
}
PEERS = {"pinocchio", "mujoco", "example_robot_data"}


@functools.cache
def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def sources(folder):
    return sorted(path for path in (CPP / folder).rglob("*") if path.suffix in (".h", ".cpp"))


def includes(path):
    """(quoted, angled) includes of a file."""
    text = path.read_text(encoding="utf-8")
    return re.findall(r'^\s*#\s*include\s+"([^"]+)"', text, re.M), re.findall(r"^\s*#\s*include\s+<([^>]+)>", text, re.M)


def modules():
    return sorted(PYTHON.rglob("*.py"))


def imports(path):
    """(absolute module of the import, the node) of every import of a module, also inside functions."""
    package = ["pycraft", *path.relative_to(PYTHON).parent.parts]
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            yield ".".join([*base, *([node.module] if node.module else [])]), node


def room_of(name):
    """Return the module of a file named from cpp/."""
    parts = name.split("/")
    return "/".join(parts[:2]) if parts[0] == "algebra" else parts[0]


@functools.cache
def below(room):
    """All that a room may include."""
    return {room}.union(*map(below, STANDS_ON[room]))


def test_there_is_something_to_look_at():
    files = [path.relative_to(CPP).as_posix() for path in CPP.rglob("*") if path.suffix in (".h", ".cpp")]
    assert {room_of(name) for name in files} == set(STANDS_ON)
    assert all(sources(folder) for folder in CORE) and len(modules()) > 15


@pytest.mark.parametrize("room", STANDS_ON)
def test_includes_point_one_way(room):
    for path in sources(room):
        for name in includes(path)[0]:
            if room == "tests" and (path.parent / name).exists():
                continue  # what the C++ tests share among themselves
            assert "/" in name and (CPP / name).exists(), f"{path.relative_to(ROOT)} includes {name}, which is no file named from cpp/"
            assert room_of(name) in below(room), f"{path.relative_to(ROOT)} includes {name}: {room} may not"


def test_a_source_has_the_name_of_its_header():
    """A newcomer finds what a header declares in the file of that name; sources without a header of their own say one thing each."""
    without = {path.relative_to(CPP).with_suffix("").as_posix() for room in CORE for path in sources(room) if path.suffix == ".cpp"}
    without -= {path.relative_to(CPP).with_suffix("").as_posix() for room in CORE for path in sources(room) if path.suffix == ".h"}
    assert without <= PARTS, f"no header of their name: {sorted(without - PARTS)}"


def test_no_two_headers_share_a_name():
    names = [path.name for room in CORE for path in sources(room) if path.suffix == ".h"]
    assert sorted(names) == sorted(set(names))


def test_no_header_includes_itself_by_way_of_others():
    edges = {path.relative_to(CPP).as_posix(): includes(path)[0] for folder in CORE for path in sources(folder)}
    done, open_ = set(), []

    def visit(name):
        assert name not in open_, f"a circle of includes: {' -> '.join([*open_[open_.index(name) :], name])}"
        if name in done:
            return
        open_.append(name)
        for target in edges.get(name, []):
            visit(target)
        open_.pop()
        done.add(name)

    for name in edges:
        visit(name)


def test_the_core_knows_no_python():
    for folder in CORE:
        for path in sources(folder):
            for name in includes(path)[1]:
                assert not re.match(r"pybind11|Python\.h|numpy|nanobind", name), f"{path.relative_to(ROOT)} includes <{name}>"
    cmake = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    linked = re.findall(r"target_link_libraries\(pycraft_core([^)]*)\)", cmake)
    assert linked and not any("ython" in libraries or "pybind" in libraries for libraries in linked)
    rooms = re.search(r"set\(PYCRAFT_CORE_ROOMS ([^)]*)\)", cmake).group(1).split()
    assert set(rooms) == {room.split("/")[0] for room in CORE}


def test_the_algebra_knows_no_mechanics():
    words = re.compile(r"\b(gravity|gyroscopic|coriolis|quaternion|screw|hinge_kinematics|Pose<|Vector6<|RigidInertia)\b", re.I)
    for path in sources("algebra"):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            code = line.split("//")[0]
            assert not words.search(code), f"{path.relative_to(ROOT)}:{number}: {line.strip()}"


def test_no_flag_trades_accuracy():
    flags = re.compile(r"-ffast-math|-Ofast|-funsafe-math|-fassociative-math|-freciprocal-math|-ffinite-math|/fp:fast|optimize\(")
    files = [ROOT / name for name in ("CMakeLists.txt", "pyproject.toml", "Makefile")] + [
        path for folder in STANDS_ON for path in sources(folder)
    ]
    for path in files:
        if path.exists():
            assert not flags.search(path.read_text(encoding="utf-8")), path.relative_to(ROOT)


# ---------------------------------------------------------------------- Python


def test_the_oracle_imports_nothing_of_the_package():
    sources = sorted((PYTHON / "reference").glob("*.py"))
    found = {name for path in sources for name, _ in imports(path) if not name.startswith("pycraft.reference")}
    assert len(sources) > 1 and {name.split(".")[0] for name in found} <= {"__future__", "functools", "types", "typing", "numpy", "scipy"}


def test_other_tools_are_imported_by_interop_and_peers_alone():
    for path in modules():
        if python_room(path) in ("interop", "peers"):
            continue
        for name, node in imports(path):
            assert name.split(".")[0] not in PEERS, f"{path.relative_to(ROOT)}:{node.lineno} imports {name}"


def test_peers_are_not_needed_to_import_the_package():
    """Other tools are optional: they are imported inside functions."""
    for path in modules():
        tree = parsed(path)
        for node in tree.body:
            if isinstance(node, ast.Import | ast.ImportFrom):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
                absolute = isinstance(node, ast.Import) or node.level == 0
                assert not absolute or not any(name.split(".")[0] in PEERS for name in names), f"{path.relative_to(ROOT)}:{node.lineno}"


def test_what_takes_long_to_import_is_imported_where_it_is_used():
    """SciPy, SymPy and Matplotlib are as long in coming as all of the package; every command would wait for them."""
    for path in modules():
        if python_room(path) in ("reference", "proofs", "closed_forms", "sympy_bridge"):
            continue
        tree = parsed(path)
        for node in tree.body:
            named = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            named += [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level else []
            slow = {name.split(".")[0] for name in named} & {"scipy", "sympy", "matplotlib"}
            assert not slow, f"{path.relative_to(ROOT)}:{node.lineno}"


# The modules of Python, each with the modules that it may import directly, at the top of a file, inside a function or only for types; it
# may also import all that these may import. A file beside the folders is a module.
RESTS_ON = {
    "_core": [],
    "closed": ["_core"],
    "other_names": [],
    "arguments": ["_core"],
    "formula_nodes": [],
    "tidy": ["_core"],
    "file_targets": ["_core"],
    "progress_bar": [],
    "state": ["arguments", "closed"],
    "reference": [],
    "operators": ["arguments", "closed"],
    "linear": ["arguments", "tidy"],
    "dynamics": ["state", "linear"],
    "interop": ["_core"],
    "models": ["operators", "dynamics", "interop", "other_names"],
    "kalman": ["models"],
    "kinematics": ["models"],
    "recursions": ["models", "formula_nodes"],
    "identities": ["models", "formula_nodes", "reference", "file_targets", "progress_bar"],
    "peers": ["models"],
    "proofs": ["identities"],
    "closed_forms": ["proofs"],
    "sympy_bridge": ["compiled", "proofs"],
    "accuracy": ["identities", "peers", "tidy"],
    "scenes": ["view"],
    "ensembles": ["scenes"],
    "compiled": ["recursions"],
    "view": ["accuracy", "recursions", "file_targets"],
    "viewer": ["scenes"],
    "face": ["accuracy", "compiled", "identities", "kinematics", "viewer"],
    "": ["face", "kalman", "closed_forms", "ensembles", "sympy_bridge"],  # pycraft itself
    "cli": [""],
}


@functools.cache
def resting_on(room):
    """All that a room may import."""
    return {room}.union(*map(resting_on, RESTS_ON[room]))


def targets(path):
    """(room, node) of every import of the package's own modules in a module."""
    for name, node in imports(path):
        parts = name.split(".")
        if parts[0] != "pycraft":
            continue
        if len(parts) > 1:
            yield parts[1], node
        elif isinstance(node, ast.ImportFrom):  # from pycraft import x: a room, or a name of the package's own
            yield from ((alias.name if alias.name in RESTS_ON else "", node) for alias in node.names)
        else:
            yield "", node


def python_room(path):
    first = path.relative_to(PYTHON).parts[0].removesuffix(".py")
    return "" if first == "__init__" else first


def printed(code):
    """Return the output of a separate process."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_importing_the_package_imports_little_but_numpy():
    slow = [
        "scipy",
        "sympy",
        "matplotlib",
        "lark",
        "rich",
        "typer",
        "lxml",
        "mpmath",
        "pycraft.identities",
        "pycraft.proofs",
        "pycraft.cli",
    ]
    assert printed(f"import sys, pycraft; print([name for name in {slow} if name in sys.modules])") == "[]"


def test_what_is_imported_later_is_what_types_see():
    import pycraft

    blocks = [node for node in parsed(PYTHON / "__init__.py").body if isinstance(node, ast.If) and isinstance(node.test, ast.Name)]
    (block,) = blocks  # if _TYPE_CHECKING
    seen = {alias.name: node.module for node in block.body for alias in node.names}
    later = {name: room for room, names in pycraft._LATER.items() for name in names}
    assert seen == {name: "models" if name == "robots" else room for name, room in later.items()}
    assert set(later) <= set(pycraft.__all__)
    for name in later:
        assert getattr(pycraft, name).__name__.split(".")[-1] == name
    # a room has the name of a function
    assert printed("import pycraft as pc; pc.chain(2).certify(); print(callable(pc.accuracy), callable(pc.kalman))") == "True True"


def test_what_is_attached_later_is_there():
    """`pycraft/face.py` names modules that its types do not see."""
    from pycraft import face

    for module, name in face.LATER.values():
        assert module.split(".")[0] in resting_on("face") and callable(getattr(importlib.import_module(f"pycraft.{module}"), name)), module


def test_every_module_is_in_a_room():
    assert {python_room(path) for path in modules()} | {"_core"} == set(RESTS_ON)


@pytest.mark.parametrize("room", [room for room in RESTS_ON if room != "_core"])
def test_python_imports_point_one_way(room):
    for path in (path for path in modules() if python_room(path) == room):
        for target, node in targets(path):
            assert target in resting_on(room), f"{path.relative_to(ROOT)}:{node.lineno} imports pycraft.{target}: {room} may not"


def test_the_core_imports_none_of_the_package():
    """pycraft/face.py attaches the functions that the core calls; `pycraft._core` is the core itself."""
    for path in sources("bindings") + sources("bench"):
        for name in re.findall(r'(?:import_?|module_::import)\("(pycraft[^"]*)"\)', path.read_text(encoding="utf-8")):
            assert name == "pycraft._core", f"{path.relative_to(ROOT)} imports {name}"


def test_no_two_modules_share_a_name():
    """A name finds one thing."""
    names = [path.stem for path in modules() if path.stem not in ("__init__", path.parent.name)]
    assert sorted(names) == sorted(set(names))


def test_tests_have_the_folders_of_the_package():
    folders = {path.parent.relative_to(ROOT / "tests").as_posix() for path in (ROOT / "tests").rglob("test_*.py")}
    assert folders <= set(RESTS_ON) | {"algebra", "sweeps", "whole", "project"}
    assert all((ROOT / "tests" / folder / "__init__.py").is_file() for folder in folders)


def test_what_tests_share_is_in_support():
    """No test imports another: what both need is in tests/support."""
    for path in sorted((ROOT / "tests").rglob("*.py")):
        named = re.findall(r"^\s*(?:from|import) +([\w.]+)", path.read_text(encoding="utf-8"), re.M)
        assert not [name for name in named if re.search(r"(^|\.)test_", name)], path.relative_to(ROOT)


def test_no_two_test_files_share_a_name():
    """The everyday subset excludes tests by the name of their file."""
    names = [path.stem for path in (ROOT / "tests").rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))


def test_no_command_hides_that_it_failed():
    for name in ("Makefile", ".ci/run"):
        for number, line in enumerate((ROOT / name).read_text(encoding="utf-8").splitlines(), 1):
            assert not re.search(r"\|\| *(true|:)(\s|$)|^\t@?-", line), f"{name}:{number}: {line.strip()}"


def test_nothing_prints_but_the_command_line():
    for path in modules():
        if python_room(path) == "cli":
            continue
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                assert node.func.id != "print", f"{path.relative_to(ROOT)}:{node.lineno} prints"


def test_every_exception_to_a_check_says_why():
    """`noqa: code - why`, `type: ignore[code]  # why`; calls that skip tests give the reason themselves."""
    exception = re.compile(r"# (noqa|type: ignore|pragma)\b(?P<rest>.*)")
    reasoned = re.compile(r"(: [A-Z]+\d+(, [A-Z]+\d+)* - \w+|\[[\w-]+\]  # \w+)")
    paths = [path for folder in ("pycraft", "tests", "cpp") for path in sorted((ROOT / folder).rglob("*.py"))]
    without, made = [], 0
    for path in paths:
        for line in path.read_text(encoding="utf-8").splitlines() if path.name != "test_layers.py" else ():
            for m in exception.finditer(line):
                made += 1
                without += [] if reasoned.match(m["rest"]) else [f"{path.relative_to(ROOT)}: {line.strip()}"]
    assert made > 20 and without == []
