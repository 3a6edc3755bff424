"""Dependencies point one way (architecture.md, Layout): a grep of the C++ includes, the Python imports and the build's flags."""

import ast
import functools
import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).parents[1]
CPP, PYTHON = ROOT / "cpp", ROOT / "pycraft"

# The rooms of C++, each with what it may include besides itself; what that may include, it may, too.
STANDS_ON = {
    "runtime": [],
    "numerics": ["runtime"],
    "spatial": ["numerics"],
    "algebra/language": ["numerics"],
    "algebra/trees": ["algebra/language"],
    "algebra/theorems": ["algebra/trees"],
    "algebra/planning": ["algebra/theorems"],
    "algebra/engine": ["algebra/planning"],
    "model": ["spatial", "algebra/language"],
    "rigid": ["model", "algebra/trees"],
    "recursions": ["rigid"],
    "operators": ["recursions", "algebra/planning"],
    "dynamics": ["recursions"],
    "simulation": ["dynamics"],
    "bindings": ["simulation", "operators", "algebra/engine"],
    "bench": ["bindings"],
    "tests": ["simulation", "operators", "algebra/engine"],
}
CORE = [room for room in STANDS_ON if room not in ("bindings", "bench", "tests")]
# Sources that are parts of a class or a table declared elsewhere.
PARTS = {
    "algebra/planning/plan_blocks",  # class Planner, by what is planned
    "algebra/planning/plan_diagonals",
    "algebra/planning/plan_vectors",
    "operators/calculus_theorems",  # rows of the catalogue
    "operators/mechanics_theorems",
    "operators/mechanics_symbols",
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
    """The room of a file named from cpp/."""
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
    sources = sorted(PYTHON.glob("reference*.py"))
    found = {name for path in sources for name, _ in imports(path)} - {f"pycraft.{path.stem}" for path in sources}
    assert len(sources) > 1 and {name.split(".")[0] for name in found} <= {"__future__", "functools", "types", "typing", "numpy", "scipy"}


def test_other_tools_are_imported_by_interop_alone():
    for path in modules():
        if path.relative_to(PYTHON).parts[0] == "interop":
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
        if path.name.startswith("reference") or path.relative_to(PYTHON).parts[0] == "symbolic":
            continue
        tree = parsed(path)
        for node in tree.body:
            named = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            named += [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level else []
            slow = {name.split(".")[0] for name in named} & {"scipy", "sympy", "matplotlib"}
            assert not slow, f"{path.relative_to(ROOT)}:{node.lineno}"


def test_python_imports_point_one_way():
    """models, operators ← identities, and nobody needs the command line."""
    above = {
        "models": {"identities", "cli", "symbolic", "accuracy", "scenes", "view"},
        "operators.py": {"identities", "cli", "models"},
    }
    for path in modules():
        first = path.relative_to(PYTHON).parts[0]
        tree = parsed(path)
        top = {id(node) for node in tree.body}
        for name, node in imports(path):
            target = name.split(".")[1] if name.startswith("pycraft.") else ""
            if id(node) in top and first in above:
                assert target not in above[first], f"{path.relative_to(ROOT)}:{node.lineno} imports {name}"
            assert first == "cli.py" or target != "cli" or first == "__main__.py", f"{path.relative_to(ROOT)} imports the command line"


def test_nothing_prints_but_the_command_line():
    for path in modules():
        if path.name in ("cli.py", "__main__.py") or path.relative_to(PYTHON).parts[0] == "cli":
            continue
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                assert node.func.id != "print", f"{path.relative_to(ROOT)}:{node.lineno} prints"


def test_every_exception_to_a_check_says_why():
    """`noqa: code - why`, `type: ignore[code]  # why`; what is skipped is told by the call itself."""
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
