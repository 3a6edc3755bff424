"""Where C++ is mutated: signs, transposes and exchanged functions of the block rules, the sweeps, the spatial algebra and the theorems.

Each place becomes a switch (see switches.py), so that all mutants are in one build: `+ x` becomes `+ SIGN(i) * x`, a function its name or
another's, as the environment says.
"""

import pathlib
import re

from .mutant import Mutant, line_of, shown_line

TARGETS = [
    "cpp/rigid/rigid_blocks.h",
    "cpp/rigid/rigid_elimination.h",
    "cpp/rigid/rigid_residuals.h",
    "cpp/algebra/trees/dense_blocks.h",
    "cpp/algebra/trees/dense_elimination.h",
    "cpp/numerics/tangent.h",
    "cpp/numerics/orthogonalisation.h",
    "cpp/numerics/semidefinite_factors.h",
    "cpp/numerics/rank_factors.h",
    "cpp/algebra/language/residual_sizes.h",
    "cpp/model/configuration.h",
    "cpp/model/subhinge_kinds.h",
    "cpp/spatial/*.h",
    "cpp/recursions/*.h",
    "cpp/algebra/trees/sweeps/*.h",
    "cpp/model/hinge_kinematics.h",
    "cpp/algebra/theorems/theorems.cpp",
    "cpp/dynamics/sensitivities.cpp",
    "cpp/dynamics/parameter_sensitivities.h",
    "cpp/operators/rigid_values.h",
    "cpp/rigid/rigid_factors.h",
    "cpp/simulation/effects/*.cpp",
    "cpp/simulation/effects/*.h",
    "cpp/simulation/scene_kinematics.h",
]
BOOKKEEPING = {"DenseBlocks", "RigidBlocks", "resize", "throw_singular_hinge", "add", "operator+=", "operator-=", "operator-", "operator+"}
POINTERS = re.compile(
    r"\s*(?:tree\w*\.|model\.\w+_offset|at_|d_\b|f\b|first\b|size_t|1\b|static_cast|int\(|offset|back\b|rows\b|[a-z]\s*[,)])"
)
PAIRS = [
    ("force_to_parent", "motion_to_child"),
    ("cross_motion", "cross_force"),
    ("shift_add", "shift_transposed_add"),
    ("articulated_shift_add", "articulated_shift_transposed_add"),
]
EXCHANGED = {**dict(PAIRS), **{b: a for a, b in PAIRS}}


def blanked(text):
    """The text with comments, strings, subscripts and the heads of loops as blanks: what is left is arithmetic. Same length."""
    hide = lambda m: re.sub(r"[^\n]", " ", m.group())
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


def places(root, file):
    """Every mutant of a file of block rules."""
    text = (root / file).read_text(encoding="utf-8")
    code, names = blanked(text), rule_names(text)
    found = []

    def add(begin, end, after, change):
        rule = next((name for at, name in reversed(names) if at <= begin), "")
        if rule and rule not in BOOKKEEPING:
            found.append(Mutant(file, line_of(text, begin), rule, begin, end, text[begin:end], after, shown_line(text, begin), change))

    for m in re.finditer(r"(?<=[\w)\]] )([+-])(?= [\w(*~])", code):  # a + b
        if not POINTERS.match(code, m.end()) and not code[: m.start()].rstrip().endswith(("data()", "begin()")):
            add(
                m.start(),
                m.end(),
                f"{m.group()} PYCRAFT_SIGN({{i}}) *",
                f"the other sign at `{m.group()}{code[m.end() : m.end() + 12].split(';')[0]}`",
            )
    for m in re.finditer(r"([+-])=(?!=)", code):
        chosen = "?" in code[m.end() : code.index(";", m.end())]  # the sign would belong to the condition
        if not chosen and not POINTERS.match(code, m.end()):
            add(m.start(), m.end(), f"{m.group()} PYCRAFT_SIGN({{i}}) *", f"the other sign at `{m.group()}`")
    for m in re.finditer(r"(?<=[({,=?:] )-(?=[\w(])|(?<=[({])-(?=[\w(])|(?<=return )-(?=[\w(])", code):  # a lone minus
        if not re.match(r"-\d", code[m.start() :]):
            add(m.start(), m.end(), "PYCRAFT_MINUS({i}) *", "a minus lost")
    for m in re.finditer(r"S\(-1\)", code):
        add(m.start(), m.end(), "(PYCRAFT_MUTANT({i}) ? S(1) : S(-1))", "-1 as 1")
    for m in re.finditer(r"\b(transposed_multiply_add|multiply_add|multiply_transposed_add)\(", code):
        parts = arguments(text, m.end() - 1)
        if "S(-1)" not in text[slice(*parts[-1])] and len(parts) == 6:
            add(parts[-1][1], parts[-1][1], ", (PYCRAFT_MUTANT({i}) ? S(-1) : S(1))", f"the other sign in `{m.group(1)}`")
    for name, other in EXCHANGED.items():
        for m in re.finditer(rf"(?<!\.)\b{name}\((?!const |int |Pose)", code):
            add(m.start(), m.end() - 1, f"PYCRAFT_EITHER({{i}}, {name}, {other})", f"`{name}` as `{other}`")
    for m in re.finditer(r"(?<!\.)\btranspose\((?!const )", code):
        add(m.start(), m.end() - 1, "PYCRAFT_TRANSPOSE({i})", "a transpose lost")
    for m in re.finditer(r"(?<!\.)\btranspose_times\((?!const )", code):
        add(m.start(), m.end() - 1, "PYCRAFT_TRANSPOSE_TIMES({i})", "a transpose lost in `transpose_times`")
    for m in re.finditer(r"(?<!\.)\bcross\((?!const )", code):
        if len(arguments(text, m.end() - 1)) == 2:
            add(m.start(), m.end() - 1, "PYCRAFT_CROSS({i})", "a cross product turned round")
    return found


def theorem_places(root, file):
    """Mutants of the theorems that rewrite or invert: a sign of the right side."""
    text = (root / file).read_text(encoding="utf-8")
    found = []
    for m in re.finditer(r"\bstate\(\"", text):
        parts = arguments(text, m.end() - 2)
        if len(parts) < 4 or not any(text[slice(*part)].strip() in ("rewrite", "inverse") for part in parts):
            continue
        name, (begin, end) = text[slice(*parts[0])].strip(' "'), parts[2]

        def add(at, to, after, change, name=name, line=begin):
            found.append(Mutant(file, line_of(text, at), name, at, to, text[at:to], after, shown_line(text, line), change))

        right = text[begin:end]
        for sign in re.finditer(r"(?<= )[+-](?= )", right):
            add(begin + sign.start(), begin + sign.end(), f"{sign.group()} PYCRAFT_SIGN({{i}}) *", "the other sign on the right")
    return found


def everything(root):
    """All mutants of C++, file by file."""
    root, found = pathlib.Path(root), []
    for pattern in TARGETS:
        for path in sorted(root.glob(pattern)):
            file = path.relative_to(root).as_posix()
            found += theorem_places(root, file) if file.endswith("theorems.cpp") else places(root, file)
    return found
