"""Appearance of tables in JupyterLab, which applies its own style sheet to every table: here with its rules, and without style elements and
scripts, which are removed from notebooks that are not trusted."""

import re

import pytest

import pycraft as pc
from support.browser import opened

# JupyterLab 4, packages/rendermime/style/base.css: what it sets of tables and of preformatted text.
RULES = """
.jp-RenderedHTMLCommon { font: 13px sans-serif; width: 760px; }
.jp-RenderedHTMLCommon table { border-collapse: collapse; border-spacing: 0; border: none; font-size: 12px; table-layout: fixed;
  margin: 0 auto 1em; }
.jp-RenderedHTMLCommon td, .jp-RenderedHTMLCommon th, .jp-RenderedHTMLCommon tr { vertical-align: middle; padding: 0.5em;
  line-height: normal; white-space: normal; max-width: none; border: none; text-align: right; }
.jp-RenderedHTMLCommon pre { white-space: pre-wrap; word-break: break-all; }
"""


@pytest.fixture(scope="module")
def report():
    return pc.chain(3).soa.check(states=0, progress=False)


def page_of(tmp_path, *shown, trusted=True):
    cells = "<hr>".join(one._repr_html_() for one in shown)
    if not trusted:
        cells = re.sub(r"<(style|script)\b.*?</\1>", "", cells, flags=re.S)
    path = tmp_path / "cell.html"
    path.write_text(f"<!DOCTYPE html><meta charset='utf-8'><style>{RULES}</style><div class='jp-RenderedHTMLCommon'>{cells}</div>")
    return path.as_uri()


ALIGNED = "(of) => [...new Set([...document.querySelectorAll(of)].map((cell) => getComputedStyle(cell).textAlign))]"
LINES = """(of) => Math.max(...[...document.querySelectorAll(of)].map((cell) => { const range = document.createRange();
    range.selectNodeContents(cell); return new Set([...range.getClientRects()].map((box) => Math.round(box.top))).size; }))"""


@pytest.mark.parametrize("trusted", [True, False], ids=["trusted", "not trusted"])
def test_theorems_are_on_the_left_and_numbers_in_one_piece(browser, report, trusted, tmp_path):
    with opened(browser, page_of(tmp_path, report, trusted=trusted), size=(800, 900)) as page:
        assert page.evaluate(ALIGNED, "td:nth-child(-n+2)") == ["left"] and page.evaluate(ALIGNED, "td:nth-child(n+3)") == ["right"]
        assert page.evaluate(LINES, "td:nth-child(n+3)") == 1
        widths = [page.locator("tr:has(td)").nth(4).locator("td").nth(i).bounding_box()["width"] for i in range(4)]
        assert widths[1] > 2 * max(widths[0], *widths[2:])  # formulas get most of the width, not a quarter


def test_tidy_tables_keep_numbers_in_one_piece(browser, tmp_path):
    scene = pc.mechanisms.double_pendulum().add(pc.effects.Damping(0.1))
    with opened(browser, page_of(tmp_path, scene.compare(T=0.2)), size=(800, 900)) as page:
        assert page.evaluate(ALIGNED, "td") == ["left"]
        assert page.evaluate(LINES, "td:not(:first-child):not(:last-child)") == 1


def test_the_tree_of_a_model_keeps_its_lines(browser, tmp_path):
    arm = pc.robots.panda()
    with opened(browser, page_of(tmp_path, arm), size=(800, 900)) as page:
        assert page.inner_text("pre").rstrip().splitlines() == str(arm.tree(80)).splitlines()
        height, font = page.evaluate(
            "[document.querySelector('pre')].map((pre) => [pre.scrollHeight, parseFloat(getComputedStyle(pre).lineHeight)])[0]"
        )
        assert round(height / font) == len(str(arm.tree(80)).splitlines())  # none is broken in two


def test_columns_have_names_of_their_own():
    """Two were called "saved", and one of them said -838 %."""
    from pycraft.scenes.comparison import ComparisonTable

    headings = list(ComparisonTable.shown.values())
    assert len(set(headings)) == len(headings)
    row = {"left out": ["gravity"], "together": False, "saved": -0.5, "saved of run": -8.38}
    table = ComparisonTable("", [row], {"own_error": 0.0, "noise": 0.01})
    assert table.cell("saved of run", row) == "takes 9.4 ×" and table.cell("saved", row) == "-50 %"


def test_what_is_not_trusted_scrolls_and_has_no_buttons(browser, report, tmp_path):
    """Buttons without their script do nothing, and a hundred rows are no page."""
    with opened(browser, page_of(tmp_path, report, trusted=False), size=(800, 900)) as page:
        assert not page.is_visible(".controls") and page.locator(".rows").bounding_box()["height"] <= 460
    with opened(browser, page_of(tmp_path, report), size=(800, 900)) as page:
        assert page.is_visible(".controls") and page.evaluate("getComputedStyle(document.querySelector('.controls')).display") == "flex"
