"""The documents are correct: the operator table is complete, examples in docstrings and in the README run."""

import doctest
import importlib
import pkgutil
import re
import textwrap
from pathlib import Path

import pytest

import pycraft
from pycraft import _core

ROOT = Path(__file__).parents[2]


def test_notation_lists_every_operator():
    text = (ROOT / "docs" / "notation.md").read_text()
    for ascii_name, unicode_name, latex in ((s.name, s.text, s.latex) for s in _core.symbols):
        row = next((line for line in text.splitlines() if re.match(rf"\| `{re.escape(ascii_name)}[`(]", line)), None)
        assert row is not None, ascii_name
        assert f"| {unicode_name} |" in row and f"`{latex}`" in row, row


def modules():
    skipped = ("pycraft._core", "pycraft.cli.__main__", "pycraft.interop.pinocchio", "pycraft.peers.peers")
    return sorted(m.name for m in pkgutil.walk_packages(pycraft.__path__, "pycraft.") if m.name not in skipped)


@pytest.mark.parametrize("name", modules())
def test_docstring_examples(name):
    module = importlib.import_module(name)
    result = doctest.testmod(module, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0


def test_the_readme_example_runs():
    text = (ROOT / "README.md").read_text()
    block = re.search(r"```python\n(.*?)```", text, re.S).group(1)
    names = {}
    exec(compile(block, "README.md", "exec"), names)
    assert names["MM"].shape == (7, 7)


# Pages of examples that print, run as doctests, and how many there are at least.
EXAMPLES = {
    "index": 4,
    "start": 20,
    "tour_researcher": 12,
    "tour_teacher": 15,
    "tour_engineer": 14,
    "troubleshooting": 55,
    "conventions": 20,
    "sensitivities": 20,
    "comparing": 5,
    "mixed_trees": 8,
    "ensembles": 8,
    "hybrid_dynamics": 12,
    "linearization": 30,
    "task_space": 14,
    "interbody_forces": 12,
    "statics": 18,
    "statistical_dynamics": 5,
    "identification": 20,
    "frames": 30,
    "inverse_kinematics": 25,
    "subgraphs": 20,
    "loops": 18,
    "locking": 14,
    "structure": 25,
    "divide_and_conquer": 1,
    "viewing": 12,
    "coming_from": 2,
    "sdf": 5,
}
# Pages whose blocks are run one after the other.
BLOCKS = ["symbolic", "kalman", "accuracy", "evaluation", "statements", "teaching", "proofs", "compiled", "pictures"]
# Pages that other tests run.
ELSEWHERE = {
    "algorithm": "project/test_docs.py",
    "models": "models/test_urdf.py",
    "mjcf": "models/test_mjcf_export.py",
    "scenes": "project/test_docs.py",
    "simulation": "project/test_docs.py",
}


def test_no_page_with_examples_is_left_out():
    """Every block of Python in a page runs in some test."""
    pages = {path.stem for path in (ROOT / "docs").glob("*.md") if "```python\n" in path.read_text()}
    assert pages == {*EXAMPLES, *BLOCKS, *ELSEWHERE, "scaling"}  # whose blocks need a cluster
    for page, test in ELSEWHERE.items():
        assert re.search(rf'"{page}(\.md)?"', (ROOT / "tests" / test).read_text()), page


def test_the_figures_of_the_readme_are_those_of_the_page_of_speed():
    """They are made by a command there, and nowhere typed by hand."""
    goals = re.search(r"## Goals\n(.*?)\n## ", (ROOT / "docs" / "performance.md").read_text(), re.S).group(1)
    made = {cells[0]: cells[1:4] for line in goals.splitlines() if len(cells := [c.strip() for c in line.strip("|").split("|")]) == 7}
    shown = re.search(r"\| call \| goal \|.*?\n\|[-:|]+\|\n(.*?)\n\n", (ROOT / "README.md").read_text(), re.S).group(1)
    rows = [[c.strip() for c in line.strip("|").split("|")] for line in shown.splitlines()]
    assert len(rows) > 5
    for call, goal, ratios, met in rows:
        assert [goal, met, ratios] == made[call], call


@pytest.mark.slow
def test_the_picture_of_the_readme_is_drawn(tmp_path):
    from making import landing

    landing.draw(tmp_path / "landing.png")
    assert (tmp_path / "landing.png").stat().st_size > 20_000 < landing.PICTURE.stat().st_size < 200_000


@pytest.mark.parametrize(("page", "examples"), EXAMPLES.items())
def test_the_pages_run(page, examples, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write files
    options = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    result = doctest.testfile(str(ROOT / "docs" / f"{page}.md"), module_relative=False, optionflags=options)
    assert result.failed == 0 and result.attempted > examples


EFFECTS = [made for made in vars(pycraft.effects).values() if isinstance(made, type) and hasattr(made, "made_for")]
PAGES = sorted((ROOT / "docs" / "effects").glob("*.md"))


@pytest.mark.parametrize("page", [ROOT / "docs" / "scenes.md", ROOT / "docs" / "simulation.md", *PAGES], ids=lambda page: page.stem)
def test_the_pages_of_scenes_run(page):
    result = doctest.testfile(str(page), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    assert result.failed == 0 and result.attempted > 3


def test_every_effect_has_its_page_and_its_row():
    """With all that it is given and its source in C++; and there is no page of anything else."""
    effects = {made.kind(): made for made in EFFECTS if made is not pycraft.effects.Effect}
    assert sorted(effects) == [page.stem for page in PAGES] and len(effects) > 20
    table = (ROOT / "docs" / "scenes.md").read_text()
    for kind, made in effects.items():
        text = (ROOT / "docs" / "effects" / f"{kind}.md").read_text()
        assert f"| [{made.__name__}](effects/{kind}.md) |" in table and f"`pc.effects.{made.__name__}(" in text
        missing = [field for field in made.__dataclass_fields__ if f"`{field}`" not in text]
        assert not missing, (kind, missing)
        assert all((ROOT / "cpp" / header).is_file() for header in re.findall(r"`(simulation/[\w/]+\.h)`", text))


def test_help_starts_with_what_to_type():
    typed, rest = pycraft.__doc__.split("What to type::")[1].split("\n\n", 2)[1:]
    names = {}
    exec(textwrap.dedent(typed), names)
    assert names["MM"].shape == (7, 7) and "pc.check(" in typed and "doctest" not in typed and "arm.soa?" in rest


ROBOTS = ROOT / "pycraft" / "models" / "robots"


def test_what_the_page_of_algorithms_prints():
    text = (ROOT / "docs" / "algorithm.md").read_text()
    names = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.S):
        exec(compile(block, "algorithm.md", "exec"), names)
    assert abs(names["y"] - names["MM"].inv() @ names["x"]).max() < 1e-9
    printed = re.findall(r"`print\((\w+)\.algorithm\(\)\)`[^\n]*:\n\n```\n(.*?)```", text, re.S)
    assert [name for name, _ in printed] == ["MM", "inverse"]
    for name, shown in printed:
        assert str(names[name].algorithm()).strip() == shown.strip(), name


@pytest.mark.peers
def test_the_other_packages_of_the_page_of_comparisons(tmp_path, monkeypatch):
    pytest.importorskip("pinocchio")
    monkeypatch.chdir(tmp_path)
    Path("panda.urdf").write_text((ROBOTS / "panda.urdf").read_text())
    pycraft.models.robots.panda().save("panda.xml")
    block = re.search(r"```python\n(import mujoco.*?)```", (ROOT / "docs" / "comparing.md").read_text(), re.S).group(1)
    names = {"pc": pycraft, "arm": pycraft.models.robots.panda()}
    imports, *compared = block.splitlines()
    exec(imports, names)
    assert len(compared) == 3 and all(eval(line, names) for line in compared)


@pytest.mark.parametrize("page", BLOCKS)
def test_the_blocks_of_a_page_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / f"{page}.md").read_text(), re.S)
    for block in blocks:
        exec(compile(block, f"{page}.md", "exec"), names)
    assert blocks and len(names) > 3


def test_public_names_have_docstrings():
    for name in pycraft.__all__:
        assert getattr(pycraft, name).__doc__, name


def test_no_machine_or_package_host_in_tracked_text():
    for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "pycraft").rglob("*.py")]:
        text = path.read_text()
        assert not re.search(r"/(home|tmp)/", text), path


def test_troubleshooting_knows_every_class_of_error():
    """Those that a user meets; with what else each is, as Python says."""
    for path in (ROOT / "pycraft").rglob("*.py"):  # classes of modules that are imported on first use
        if "(_core.Error" in (text := path.read_text(encoding="utf-8")) or re.search(r"class \w+\((_core\.)?\w*Error", text):
            importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
    found, todo = set(), [pycraft.Error]
    while todo:
        todo += (below := todo.pop().__subclasses__())
        found |= {c for c in below if not c.__name__.startswith("_")}
    assert len(found) > 12
    page = (ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| `(\w+)` \|", page, re.M))
    for c in found:
        assert f"`{c.__name__}`" in page, c
        if c.__name__ in rows:
            assert rows[c.__name__] in {base.__name__ for base in c.__mro__}, c
    shown = {name for name in rows if re.search(rf"^pycraft\.[\w.]*\b{name}: ", page, re.M)}
    assert set(rows) - shown == {"MissingPackageError", "PeerRefusal"}  # by what is installed: elsewhere another
