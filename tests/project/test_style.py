"""The phrases that docs/style.md rules out are absent from prose, docstrings, comments and messages."""

import ast
import io
import json
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# Files and folders that are not edited yet. Take off what has been edited; the list ends empty.
NOT_EDITED = [
    "cpp",
    "pycraft/identities/block_reading.py",
    "pycraft/identities/block_relations.py",
    "pycraft/identities/block_values.py",
    "pycraft/identities/book.py",
    "pycraft/identities/checker.py",
    "pycraft/identities/definitions.py",
    "pycraft/identities/directions.py",
    "pycraft/identities/family.py",
    "pycraft/identities/formula_reading.py",
    "pycraft/identities/parse.py",
    "pycraft/identities/part_letters.py",
    "pycraft/identities/search.py",
    "pycraft/identities/spelling.py",
    "pycraft/identities/standard_letters.py",
    "pycraft/identities/truth.py",
    "pycraft/identities/vocabulary.py",
    # names of mutants, which tests/mutation.md quotes
    "tests/mutants/of_cpp.py",
    "tests/mutants/of_integrators.py",
    "tests/mutants/of_python.py",
    "tests/mutants/of_scenes.py",
    # messages that they match
    "tests/operators/test_embedded.py",
    "tests/operators/test_loop_second_derivatives.py",
]

# A body may hang on these.
CARRIERS = r"rope|string|cable|thread|wall|hook|spring|hinge|pin|body|base|[{']"
# What is refused, with the words to write in its place. Letters' case does not matter; a line break counts as a space.
PHRASES = {
    rf"\bh(?:angs?|ung|anging) on\b(?! (?:(?:a|the|its|one) )?(?:{CARRIERS}))": "depends on",
    r"(?<!not )\bbut for\b": "except",
    r"\bthat of the\b": "repeat the noun",
    r"\bthose of the\b": "repeat the noun",
    r"(?<!time )(?<!years )\bgo(?:es)? by\b": "is computed with, uses",
    r"\b(?:is|are|was|were) told\b": "gets, receives, is given",
    r"\bsa(?:ys?|id) so\b": "reports, raises, states",
    r"\b(?:lower|upper|every|each|which|other|own|one|the|of|all|these|those|its|and|no) rooms?\b(?! for\b)": "module, layer",
    r"\bthe house\b": "the architecture",
    r", too(?=[.;:)\n]|$)": "also",
    r"(?<!is )(?<!are )\bneither(?=[.;:)])": "nor does ..., not ... either",
}
REFUSED = {re.compile(pattern, re.IGNORECASE): instead for pattern, instead in PHRASES.items()}
# A docstring begins with a verb ("Return", "Check that") or, for a value or a class, with a noun.
OPENING = re.compile(r"\s*(?:What|Whether|Of each|Of every|How many|Which|That) (?![^.]*\?)")


def of_markdown(text):
    """Return the prose of a page: without blocks of code, code in lines, and targets of links."""
    text = re.sub(
        r"^( *)(```|~~~|:::).*?^\1\2[`~:]*$",
        lambda found: found[0] if found[2] == ":::" else "\n" * found[0].count("\n"),
        text,
        flags=re.M | re.S,
    )
    return re.sub(r"`[^`\n]*`", "`code`", re.sub(r"\]\([^)\n]*\)", "]", text))


def of_notebook(text):
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "markdown"]
    return "\n\n".join(of_markdown("".join(cell["source"])) for cell in cells)


def of_python(text):
    """Return comments and strings; comments on consecutive lines are one text."""
    parts, last = [], -2
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            if token.start[0] == last + 1 and parts:
                parts[-1] += " " + token.string.lstrip("# ")
            else:
                parts.append(token.string.lstrip("# "))
            last = token.end[0]
        elif token.type == tokenize.STRING or tokenize.tok_name[token.type] == "FSTRING_MIDDLE":
            parts.append(re.sub(r"`[^`\n]*`", "`code`", token.string).rstrip("\"'"))
    return "\n\n".join(parts)


def of_cpp(text):
    """Return comments and strings; `//` on consecutive lines is one text."""
    parts, last = [], -1
    for found in re.finditer(r'//[^\n]*|/\*.*?\*/|R"(\w*)\((.*?)\)\1"|"(?:\\.|[^"\\\n])*"', text, re.S):
        words = found[0].lstrip("/* ").rstrip('"*/')
        if found[0].startswith("//") and parts and not text[last : found.start()].strip() and text.count("\n", last, found.start()) == 1:
            parts[-1] += " " + words
        else:
            parts.append(words)
        last = found.end()
    return "\n\n".join(parts)


READERS = {".md": of_markdown, ".ipynb": of_notebook, ".py": of_python, ".h": of_cpp, ".cpp": of_cpp}


def docstrings(text):
    """Yield the docstrings of a module, of its classes, functions and attributes."""
    for node in ast.walk(ast.parse(text)):
        body = getattr(node, "body", None)
        for item in body if isinstance(body, list) else ():
            if isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant) and isinstance(item.value.value, str):
                yield item.value.value


def findings(text, suffix):
    """Return each refused phrase with the words around it and what to write in its place."""
    prose, found = re.sub(r"[ \t]*\n[ \t]*(?=[^\s])|[ \t]+", " ", READERS[suffix](text)), []
    for pattern, instead in REFUSED.items():
        for m in pattern.finditer(prose):
            around = " ".join(prose[max(m.start() - 30, 0) : m.end() + 20].split())
            found.append(f"'{' '.join(m[0].split())}' ({instead}): ... {around} ...")
    if suffix == ".py":
        found += [f"docstring opens: {' '.join(words.split())[:60]}" for words in docstrings(text) if OPENING.match(words)]
    return found


def written():
    """Return the files with prose."""
    pages = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("docs/**/*.py"), *ROOT.glob("notebooks/*.ipynb")]
    sources = [p for pattern in ("pycraft/**/*.py", "cpp/**/*.h", "cpp/**/*.cpp", "tests/**/*.py") for p in ROOT.glob(pattern)]
    allowed = {ROOT / "docs" / "style.md", Path(__file__)}  # they quote the phrases
    return sorted({*pages, *sources} - allowed)


def is_edited(path):
    name = path.relative_to(ROOT).as_posix()
    return not any(name == entry or name.startswith(entry + "/") for entry in NOT_EDITED)


GROUPS = sorted(
    {
        p.relative_to(ROOT).parts[:2] if len(p.relative_to(ROOT).parts) > 2 else p.relative_to(ROOT).parts[:1]
        for p in written()
        if is_edited(p)
    }
)


@pytest.mark.parametrize("group", GROUPS, ids="/".join)
def test_no_refused_phrase(group):
    place = ROOT.joinpath(*group)
    paths = [p for p in written() if is_edited(p) and (p == place or (p.parent == place if len(group) == 1 else place in p.parents))]
    found = [f"{p.relative_to(ROOT)}: {line}" for p in paths for line in findings(p.read_text(encoding="utf-8"), p.suffix)]
    assert paths and not found, "docs/style.md has the rules:\n" + "\n".join(found)


def test_the_list_of_files_not_edited_names_what_exists():
    assert [entry for entry in NOT_EDITED if not (ROOT / entry).exists()] == []


@pytest.mark.parametrize(
    ("text", "suffix", "count"),
    [
        ("The result hangs\non the state.", ".md", 1),
        ("All of them but for one, as those of the base; it is neither.", ".md", 2),
        (
            "`hangs on`\n\n```\nbut for\n```\n\nIt hangs on a spring, a body on a hinge; not for this but for that. Time goes by.",
            ".md",
            1,
        ),
        ("It goes by the tree, is told the limits, and says so.", ".md", 3),
        ("Lower rooms of the house know it, too.", ".md", 3),
        ("There is room for more: too many, and neither is known. Nor does that, too long a list, matter.", ".md", 0),
        ('def f():\n    """What it is."""', ".py", 1),
        ('def f():\n    """Whether it is."""\n    # it hangs\n    # on that\n    raise E("no pose but for the base")', ".py", 3),
        ('def f():\n    """What if it falls? Then this."""\n    return hangs_on, "What"', ".py", 0),
        ('int f();  // hangs\n// on it\nthrow Error("is told");', ".cpp", 2),
        (
            json.dumps({"cells": [{"cell_type": "markdown", "source": ["but ", "for"]}, {"cell_type": "code", "source": ["# but for"]}]}),
            ".ipynb",
            1,
        ),
    ],
)
def test_phrases_are_found(text, suffix, count):
    assert len(findings(text, suffix)) == count, findings(text, suffix)


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) < 900


def test_every_refused_phrase_is_in_the_page_of_style():
    """The page shows each of them, as what not to write."""
    page = " ".join((ROOT / "docs" / "style.md").read_text(encoding="utf-8").split())
    assert [pattern.pattern for pattern in REFUSED if not pattern.search(page)] == []
