"""The pages that the site makes from the code say what the code says, of every letter, theorem and public name."""

import inspect
import re

import numpy as np
import pytest

import pycraft as pc
from making import api, contents, dark, docstrings, gallery, generated, groups, offline, operators, theorems
from pycraft import _core


@pytest.fixture(scope="module")
def pages():
    return generated.pages()


def test_the_table_of_contents_lists_them(pages):
    """The first page of each folder is listed, and lists the others."""
    assert set(contents.GENERATED) <= set(pages) and set(contents.GENERATED) <= set(contents.listed())
    for page in set(pages) - set(contents.GENERATED):
        folder, _, name = page.rpartition("/")
        listed = pages[f"{folder}/index"] + pages.get("docs/api/Multibody", "") * (folder == "docs/api")
        assert re.search(rf"^{re.escape(name)}$", listed, re.M), page


def test_links_between_them_lead_somewhere(pages):
    labels = set(re.findall(r"^\(([\w-]+)\)=$", "\n".join(pages.values()), re.M))
    for page, text in pages.items():
        for target in re.findall(r"(?<!\\)\]\(([^)\s]+)\)", text):
            file, _, anchor = target.partition("#")
            if file.endswith(".png"):
                assert page.startswith("docs/gallery/"), (page, target)
            elif file:
                place = ((contents.ROOT / page).parent / file).resolve()
                assert place.is_file() or place.relative_to(contents.ROOT).with_suffix("").as_posix() in pages, (page, target)
            else:
                assert anchor in labels, (page, target)


@pytest.mark.parametrize("symbol", _core.symbols, ids=lambda s: s.name)
def test_every_letter_has_its_page(symbol, pages):
    text = pages[f"docs/operators/{symbol.name}"]
    made = operators.letter(symbol)
    assert operators.plain(symbol.meaning) in text and symbol.codomain in text
    assert eval(operators.typed(symbol), {"soa": operators.example().soa}).text() == made.text()
    for section in ("Derivative", "Recursion", "Cost", "Blocks", "Source"):
        assert f"\n## {section}\n" in text
    assert str(made.algorithm()).strip() in text and str(made.explain()).strip() in text
    assert made.blocks()._repr_html_() in text
    assert operators.formula(made.diff("hinge1[0]"), rf"\partial_i {made.latex()}") in text
    assert symbol.is_vector or "\n## Theorems\n" in text or symbol.name in {"B", "V_bar", "Lambda", "Jacobian", "V_tilde", "H_dot"}


def test_what_proofs_take_as_definitions_is_said(pages):
    assert "D = H P H* + J" in pages["docs/operators/D"] and "φ⁻¹ = I − E_φ" in pages["docs/operators/phi"]
    assert "M = R" not in re.findall(r"assume of it:\n\n```text\n(.*?)```", pages["docs/operators/H"], re.S)[0]
    assert operators.tokens("M = P − E_ψ P E_φ*") >= {"M", "P", "E_ψ", "E_φ"} and "φ" not in operators.tokens("E_φ*")


def test_a_letter_lists_the_theorems_with_it_on_either_side(pages):
    number = {theorem.name: n for n, theorem in enumerate(operators.example().soa.theorems())}
    for name in ("φG = G+φK", "gain shifted to the parent", "φKHψ = φ-ψ"):  # K on the right, on the right alone, on the left
        assert f"(#theorem-{number[name]})" in pages["docs/operators/K"]
    assert f"(#theorem-{number['Eφ = φ-I']})" not in pages["docs/operators/K"]


def test_every_theorem_is_there_with_its_hypotheses_and_its_proof(pages):
    text = "\n".join(pages[page] for page in pages if page.startswith("docs/theorems/") and page != "docs/theorems/index")
    listed = pages["docs/theorems/index"]
    catalogue = operators.example().soa.theorems()
    entries = {int(n): body for n, body in re.findall(r"\(theorem-(\d+)\)=\n(.*?)(?=\n\(theorem-|\Z)", text, re.S)}
    assert set(entries) == {n for n, t in enumerate(catalogue) if not t.waiting} and len(entries) > 140
    for number, entry in entries.items():
        theorem = catalogue[number]
        assert f"[{operators.plain(theorem.name)}](#theorem-{number})" in listed
        assert operators.plain(theorem.name) in entry and theorem.latex in entry
        assert all(hypothesis in entry for hypothesis in theorem.hypotheses)
        assert ("<details><summary>Proof" in entry) != ("finds no proof" in entry)
    # tests/proofs/test_prove_catalogue.py counts those that are proved
    assert sum("finds no proof" in entry for entry in entries.values()) < 10
    assert all(t.waiting in text and operators.plain(t.name) in text for t in catalogue if t.waiting)
    assert not re.search(r"soa\.md", text)
    assert theorems.source("soa.md #3") == "Derived for PyCraft"


def test_every_public_name_has_its_place(pages):
    listed = pages["docs/api/index"]
    everything = "\n".join(pages.values())
    for name, thing in api.public().items():
        row = re.search(rf"^\| \[`{name}`\]\((\w+)\.md\) \| (.+) \|$", listed, re.M)
        assert row and f"docs/api/{row[1]}" in pages and len(row[2]) > 10, name
        if not inspect.ismodule(thing):
            assert re.search(rf"\.\. auto(class|function|exception):: pycraft\.{name}\n", everything), name
    for effect in pc.effects.__all__:
        assert f"pycraft.scenes.effects.{effect}\n" in pages["docs/api/effects_module"] or not callable(getattr(pc.effects, effect))


@pytest.mark.parametrize(
    ("written", "markup"),
    [
        ("H P H* + J, |A| and x_", r"H P H\* + J, \|A\| and x\_"),
        ("`H*` and ``|x|`` stay, * not", r"`H*` and ``|x|`` stay, \* not"),
        (">>> a * b | c", ">>> a * b | c"),
        ("----------", "----------"),
    ],
)
def test_docstrings_are_read_as_they_stand(written, markup):
    assert docstrings.as_markup([written]) == [markup]


def test_examples_and_displays_in_docstrings_are_kept():
    assert docstrings.as_markup(["Text", ">>> a * b", "c*", "", "d*"]) == ["Text", "", ">>> a * b", "c*", "", r"d\*"]
    assert docstrings.as_markup(["As::", "", "    a * b", "", "c*"]) == ["As::", "", "    a * b", "", r"c\*"]
    assert docstrings.as_markup(["Equation", "", "    a* = b", "", "c*"]) == ["Equation", "", "::", "", "    a* = b", "", r"c\*"]


def test_paragraphs_after_a_list_of_parameters_are_notes():
    written = [
        "One",
        "",
        "Parameters",
        "----------",
        "a : int",
        "    What.",
        "",
        "b : float",
        "",
        "Prose goes on.",
        "More.",
        "",
        "Raises",
        "------",
    ]
    assert docstrings.with_notes(written) == [*written[:9], "Notes", "-----", *written[9:]]
    raised = ["Raises", "------", "Error", "    Why.", "", "OtherError", "    Why.", "", "Source: a book."]
    assert docstrings.with_notes(raised) == [*raised[:8], "Notes", "-----", raised[8]]


def test_the_gallery_has_twenty_short_examples_or_more(pages):
    assert len(gallery.SCRIPTS) >= 20 and len(generated.playing(contents.ROOT)) >= 3
    for script in gallery.SCRIPTS:
        written = script.read_text()
        assert len(written.splitlines()) < 30 and max(map(len, written.splitlines())) <= 140, script.name
        assert gallery.said(script).endswith(".") and "import pycraft as pc" in written, script.name
        page, cards = pages[f"docs/gallery/{script.stem}"], pages["docs/gallery/index"]
        assert (f'src="{script.stem}.html"' in page) == gallery.plays(script) == (f"]({script.stem}.md)" in cards)
        for text in (page, cards):
            assert f"({script.stem}.png)" in text and f"({script.stem}_dark.png)" in text and gallery.said(script) in text
        assert written.partition('"""\n\n')[2].strip() in page


def lightness(path):
    """The median lightness of a picture: its ground's."""
    import matplotlib.image

    return float(np.median(matplotlib.image.imread(path)[..., :3] @ (0.299, 0.587, 0.114)))


def test_figures_for_dark_pages():
    """Greys are turned about, colours that are seen stay, and texts stand out from the ground."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.colors import to_rgba

    assert np.allclose(dark.turned("white"), to_rgba(dark.GROUND)) and np.allclose(dark.turned("black"), to_rgba(dark.INK))
    assert dark.turned("tab:orange") == to_rgba("tab:orange") and dark.turned("none") == "none"
    assert sum(dark.turned("navy")[:3]) > sum(to_rgba("navy")[:3])
    figure, axes = plt.subplots()
    axes.plot([0, 1], color="k", label="line")
    axes.set(title="title", xlabel="x")
    axes.legend()
    dark.darken(figure)
    figure.canvas.draw()
    texts = [axes.title, axes.xaxis.label, *axes.get_xticklabels(), *axes.get_legend().get_texts()]
    assert all(np.mean(to_rgba(text.get_color())[:3]) > 0.6 for text in texts)
    assert np.mean(to_rgba(axes.lines[0].get_color())[:3]) > 0.6 and np.mean(axes.get_facecolor()[:3]) < 0.2
    plt.close(figure)


def test_every_public_name_is_in_one_group(pages):
    names = [name for name in dir(pc.Multibody) if not name.startswith("_")]
    by_heading = groups.grouped(groups.MULTIBODY, names)
    for heading, members in by_heading.items():
        page = pages[f"docs/api/Multibody_{heading.lower().replace(' ', '_')}"]
        assert all(re.search(rf"^\.\. auto\w+:: pycraft\.Multibody\.{member}$", page, re.M) for member in members)
        assert all(f"`{member} <pycraft.Multibody.{member}>`" in pages["docs/api/Multibody"] for member in members)
    with pytest.raises(ValueError, match="pose must be in one group"):
        groups.grouped({"a": "pose", "b": "pose"}, ["pose"])
    with pytest.raises(ValueError, match="jacobian must be in one group"):
        groups.grouped({"a": "pose"}, ["pose", "jacobian"])


def test_the_pictures_of_the_tours_are_there():
    for name in ("researcher", "teacher", "engineer"):
        picture = contents.ROOT / "docs" / "static" / f"tour_{name}.png"
        assert 5_000 < picture.stat().st_size < 60_000
        assert f"static/tour_{name}.png" in (contents.ROOT / "docs" / "index.md").read_text()
        assert f"docs/static/tour_{name}.png" in (contents.ROOT / "README.md").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("script", gallery.SCRIPTS, ids=lambda s: s.stem)
def test_every_example_of_the_gallery_draws(script, tmp_path):
    gallery.draw(script, tmp_path / "picture.png")
    for name in ("picture", "picture_dark"):
        picture = (tmp_path / f"{name}.png").read_bytes()
        assert picture.startswith(b"\x89PNG") and len(picture) > 5000
    light, dark = (lightness(tmp_path / f"{name}.png") for name in ("picture", "picture_dark"))
    assert light > 0.6 > 0.4 > dark
    page = tmp_path / "picture.html"
    assert page.is_file() == gallery.plays(script)
    if page.is_file():  # whole, small, and it asks nobody
        text = page.read_text(encoding="utf-8")
        assert "<script" in text and len(text) < 500_000 and offline.asked_of_others(text) == []


def test_an_example_that_draws_nothing_is_an_error(tmp_path):
    (tmp_path / "nothing.py").write_text('"""Nothing."""\n')
    with pytest.raises(ValueError, match="nothing.py leaves no figure"):
        gallery.draw(tmp_path / "nothing.py", tmp_path / "nothing.png")


def test_citation_and_package_say_the_same():
    cff, project = (contents.ROOT / "CITATION.cff").read_text(), (contents.ROOT / "pyproject.toml").read_text()
    version = re.search(r'^version = "(.*)"$', project, re.M)[1]
    assert f"\nversion: {version}\n" in cff and f"version = {{{version}}}" in (contents.ROOT / "docs" / "cite.md").read_text()
    assert pc.__version__ == version


def test_public_papers_are_cited_where_a_theorem_is_theirs(pages):
    names = {theorem.name for theorem in operators.example().soa.theorems()}
    whole = "\n".join(pages.values())
    assert {*theorems.ALSO} <= names and all(paper in whole for paper in theorems.ALSO.values())
    assert "soa.md" not in whole and not re.search(r"Source:[^\n]*\bequation \d", whole)
