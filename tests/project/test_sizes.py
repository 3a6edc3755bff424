"""Files and functions that a reader takes in: no file above 600 lines, no function above a screen."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = sorted(p for pattern in ("cpp/**/*.h", "cpp/**/*.cpp", "pycraft/**/*.py") for p in ROOT.glob(pattern))
TESTS = sorted(ROOT.glob("tests/**/*.py"))
SCREEN = {".py": 66, ".cpp": 62}

NOT_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|^#[^\n]*|R"\((?:.*?)\)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.DOTALL | re.MULTILINE)
SCOPE = re.compile(r"(inline )?(namespace|class|struct|union|enum|extern)\b")


def test_files():
    long = {p.relative_to(ROOT).as_posix(): n for p in (*SOURCES, *TESTS) if (n := len(p.read_text().splitlines())) > 600}
    assert len(SOURCES) > 300 and len(TESTS) > 100 and not long


@pytest.mark.parametrize("room", sorted({p.relative_to(ROOT).parts[1] for p in SOURCES if p.suffix == ".py"}))
def test_functions(room):
    long = []
    for path in SOURCES:
        if path.suffix != ".py" or path.relative_to(ROOT).parts[1] != room:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                first = node.body[0]
                said = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
                lines = node.end_lineno - (first.end_lineno if said else node.lineno)  # a docstring is not what is taken in at a glance
                if lines > SCREEN[".py"]:
                    long.append(f"{path.relative_to(ROOT)}: {node.name}, {lines} lines")
    assert not long


def without_templates(head):
    """Return the text before a brace, on one line, without labels and `template <...>`."""
    head = re.sub(r"\b(public|private|protected):(?!:)", " ", " ".join(head.split())).strip()
    while opening := re.match(r"template ?<", head):
        depth, end = 1, opening.end()
        while depth:
            depth += {"<": 1, ">": -1}.get(head[end], 0)
            end += 1
        head = head[end:].strip()
    return head


def functions_of(text):
    """(head, lines from its first brace to its last) of every function of C++: the outermost braces that are no scope and no list."""
    code = NOT_CODE.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
    begin, opened, found = 0, [], []
    for place, sign in ((m.start(), m[0]) for m in re.finditer("[;{}]", code)):
        if sign == "{":
            head = without_templates(code[begin:place])
            of_function = not opened or opened[-1][2]
            opened.append((head, place, of_function and SCOPE.match(head) is not None))
        elif sign == "}":
            head, first, scope = opened.pop()
            if not scope and "(" in head and (not opened or opened[-1][2]):
                found.append((head, code.count("\n", first, place) + 1))
        begin = place + 1
    assert not opened
    return found


def long_functions(text):
    """The names of those above a screen. Lists of bindings may be longer."""
    names = [(head.split("(")[0].split()[-1], lines) for head, lines in functions_of(text)]
    return {name: lines for name, lines in names if lines > SCREEN[".cpp"] and not name.startswith("register_")}


def test_functions_of_cpp():
    sources = [p for p in SOURCES if p.suffix != ".py"]
    assert sum(len(functions_of(p.read_text())) for p in sources) > 1500
    assert not {p.relative_to(ROOT).as_posix(): long for p in sources if (long := long_functions(p.read_text()))}


def test_long_functions_of_cpp_are_found():
    body = "{\n" + '  if (a) { b("}"); }  // }\n' * 61 + "}"
    short = "{\n" + "  ++a;\n" * 60 + "}"
    for head in (
        "int long_one(int a) ",
        "template <template <class> class C, class F>\nvoid C<F>::long_one() const ",
        "namespace a {\nstruct B : C {\n public:\n  explicit B(int a) : c(a) {}\n  int b[2] = {1, 2};\n  int long_one() override ",
    ):
        ends = "}\n" * (head.count("{") - head.count("}"))
        assert list(long_functions(head + body + ends)) in (["long_one"], ["C<F>::long_one"])
        assert not long_functions(head + short + ends)
    assert not long_functions("void register_all(py::module_& m) " + body)
    assert not long_functions("constexpr int table[] = " + body)
