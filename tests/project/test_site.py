"""The site (`make docs`) and its pages agree, seen without Sphinx: nothing is left out, no link is dead, nothing asks the network."""

import ast
import re
from pathlib import Path

import pytest

from making import contents, layers, offline
from making.plain_index import plain_index, title_and_sentence

ROOT = Path(__file__).parents[2]


def configured():
    """Return the constants that conf.py sets."""
    tree = ast.parse((ROOT / "docs" / "making" / "conf.py").read_text())
    found = {}
    for node in tree.body:
        if isinstance(node, ast.Assign):
            try:
                found[node.targets[0].id] = ast.literal_eval(node.value)
            except ValueError:
                continue
    return found


def test_the_configuration_names_the_first_page_and_makes_no_request():
    conf = configured()
    assert conf["root_doc"] == contents.listed()[0] == "docs/index"
    assert conf["nb_ipywidgets_js"] == {} and conf["mathjax_path"] == "tex-svg-full.js"
    assert conf["nb_execution_raise_on_error"] is True
    assert "-W" in (ROOT / "docs" / "making" / "__main__.py").read_text()


def test_no_page_is_left_out_and_none_is_listed_twice():
    listed = contents.listed()
    assert len(set(listed)) == len(listed)
    there = [path for folder in ("docs", "notebooks") for path in (ROOT / folder).rglob("*") if path.suffix in (".md", ".ipynb")]
    there = {path.relative_to(ROOT).with_suffix("").as_posix() for path in there if ".ipynb_checkpoints" not in path.parts}
    left_out = there - set(listed)
    assert not left_out, f"docs/index.md does not list {sorted(left_out)}"
    assert len(contents.committed()) > 70


@pytest.mark.parametrize("path", [*contents.committed(), ROOT / "README.md"], ids=lambda p: p.relative_to(ROOT).with_suffix("").as_posix())
def test_no_link_is_dead(path):
    assert contents.dead_links(path) == []


def test_a_page_of_the_site_links_to_pages_of_the_site():
    """A link that works only in the repository would be dead in the site: linked pages are also listed."""
    listed = set(contents.listed())
    for path in contents.committed():
        for target in contents.links(path):
            place = (path.parent / target.partition("#")[0]).resolve()
            if place.suffix in (".md", ".ipynb"):
                assert place.relative_to(ROOT).with_suffix("").as_posix() in listed, (path.name, target)


def test_dead_links_are_found(tmp_path, monkeypatch):
    monkeypatch.setattr(contents, "ROOT", tmp_path)
    (tmp_path / "there.md").write_text("# There\n\n## A heading: φ, ψ\n")
    page = tmp_path / "page.md"
    page.write_text(
        "# Page\n\n[a](there.md) [b](there.md#a-heading-φ-ψ) [c](gone.md) [d](there.md#gone) [e](#page) [f](#gone) "
        "[g](https://example.org) `[h](i)` ε = \\[I−HψK\\](τ−𝒞)\n\n```\n[j](k)\n```\n"
    )
    assert contents.dead_links(page) == ["gone.md", "there.md#gone", "#gone"]


@pytest.mark.parametrize(
    "asks",
    [
        '<script src="https://cdn.example/x.js"></script>',
        '<script src="//cdn.example/x.js"></script>',
        '<link rel="stylesheet" href="http://a/x.css">',
        '<img src="https://a/x.png"/>',
        '<p style="background: url(https://a/x.png)">',
        '<style>@import "https://a/x.css";</style>',
        "<style>p { background: url('//a/x.png') }</style>",
        '<svg><image xlink:href="https://a/x.png"/></svg>',
        '<iframe src="https://a/"></iframe>',
    ],
)
def test_what_asks_the_network_is_found(asks):
    assert len(offline.asked_of_others(f"<html>{asks}</html>")) == 1


def test_what_asks_nobody_is_let_pass(tmp_path):
    page = (
        '<a href="https://a/">a</a><link rel="canonical" href="https://a/"><script src="x.js"></script><img src="data:image/png;base64,/">'
    )
    assert offline.asked_of_others(page + "<style>p { background: url(x.png) }</style><svg xmlns='http://www.w3.org/2000/svg'/>") == []
    (tmp_path / "x.css").write_text("p { background: url(https://a/x.png) }")
    (tmp_path / "x.html").write_text(page)
    assert offline.not_offline(tmp_path) == ["x.css: https://a/x.png"]


def test_the_plain_index_has_every_page_with_its_first_sentence():
    lines = plain_index({page: "# T\n\nOne. Two." for page in contents.GENERATED}).splitlines()[2:]
    assert len(lines) == len(contents.listed())
    for line, page in zip(lines, contents.listed(), strict=True):
        assert re.fullmatch(rf"- \[[^\]]+\]\({re.escape(page)}\.html\): .{{10,}}", line) or page in contents.GENERATED, line
    assert title_and_sentence("# A `b`\n\n```\ncode\n```\n\nSee [it](x.md), e.g. this. More.") == ("A b", "See it, e.g. this.")
    with pytest.raises(ValueError, match="without a title"):
        title_and_sentence("no title")


@pytest.mark.parametrize("picture", layers.PICTURES)
def test_the_pictures_of_the_layers_are_current(picture):
    uses = layers.order(layers.PICTURES[picture])
    drawn = (layers.FOLDER / picture).read_text(encoding="utf-8")
    assert drawn == layers.svg(uses), "run PYTHONPATH=docs python -m making.layers"
    assert all(f">{layers.shown(name)}</text>" in drawn for name in uses) and len(uses) > 15
    height = layers.heights(uses)
    assert all(height[name] > height[used] for name in uses for used in uses[name])
