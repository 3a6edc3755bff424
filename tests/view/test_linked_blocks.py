"""Blocks beside their robot, and what scripts of other pages do, in a real browser."""

import re

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.report import Finding, Report
from support.browser import opened

TREE = pc.tree([-1, 0, 0, 1], ["free", "pin", "ball", "slider"], seed=2)


def squares(page):
    """(row, column, whether an exact zero, title) of each block."""
    found = re.findall(r"data-row='(\d+)' data-column='(\d+)'( data-zero)? .*?<title>(.*?)</title>", page)
    return [(int(row), int(column), bool(zero), title) for row, column, zero, title in found]


@pytest.mark.parametrize("order", ["base-to-tip", "tip-to-base"])
def test_blocks_know_their_bodies(order):
    """Of bodies, hinges and nodes, in either order; what is welded on is part of what carries it."""
    names = list(TREE.soa._source.body_names)
    for name in ("phi", "MM"):
        view = getattr(TREE.soa, name).blocks(order)
        found = squares(view.on_robot()._repr_html_())
        assert len(found) == view.largest().size == 16
        hinges = TREE.soa._source.hinge_names
        for (row, column, zero, title), x in zip(found, view.largest().ravel(), strict=True):
            label = names if name == "phi" else hinges
            assert title.startswith(f"{label[row]} × {label[column]}: ") and zero == (x == 0)
    welded = pc.tree([-1, 0], ["pin", "weld"], seed=1)
    page = welded.soa.MM.blocks().on_robot()._repr_html_()
    assert [zero for *_, zero, _ in squares(page)] == [False] and page.count("class='body'") == 1
    arm = pc.robots.panda()
    tip = list(arm.nodes)[-1]
    (rows,) = {row for row, *_ in squares(arm.soa.Jacobian(tip).blocks().on_robot()._repr_html_())}
    assert list(arm.soa._source.body_names)[rows] == arm.nodes[tip].body.name


def test_squares_that_have_room_show_their_number():
    view = TREE.soa.MM.blocks()
    page = view.on_robot()._repr_html_()
    shown = [float(x) for x in re.findall(r"<text class='entry'[^>]*>([^<]*)</text>", page)]
    largest = view.largest()[view.largest() != 0]
    np.testing.assert_allclose(shown, largest, rtol=0.05)  # two figures
    assert "the number is its largest entry" in page and "Point at a block" in page
    many = pc.chain(40).soa.MM.blocks().on_robot()._repr_html_()
    assert "class='entry'" not in many and "the number is its largest entry" not in many


def test_what_cannot_be_linked_is_refused(tmp_path):
    with pytest.raises(pc.EvaluationError, match="'robot'.*'tree'"):
        TREE.soa.phi.blocks().on_robot("moon")
    with pytest.raises(pc.EvaluationError, match="has no model"):
        pc.constant([[1.0]], pc.euclidean(1), pc.euclidean(1), "C").blocks().on_robot()
    with pytest.raises(pc.EvaluationError, match="not a body, hinge or node"):
        TREE.soa.velocity.blocks().on_robot()
    with pytest.raises(pc.EvaluationError, match=r"61 × 61 blocks: at most 60 per row"):
        pc.chain(61).soa.MM.blocks().on_robot()
    with pytest.raises(pc.EvaluationError, match="ends in .html"):
        TREE.soa.phi.blocks().on_robot().save(tmp_path / "blocks.png")


@pytest.mark.parametrize("dark", [False, True])
def test_pointing_at_a_block_lights_its_path(browser, tmp_path, dark):
    target = TREE.soa.MM.inv().blocks().on_robot("tree").save(tmp_path / "blocks.html")  # also between siblings
    parents = list(TREE.soa._source.parents)
    leaves = [k for k in range(4) if k not in parents]
    with opened(browser, target.as_uri(), dark=dark) as page:
        lit = (
            "(name) => [...document.querySelectorAll('.' + name)].map((e, k) => e.classList.contains('lit') ? k : -1).filter((k) => k >= 0)"
        )
        page.hover(f".block[data-row='{leaves[0]}'][data-column='{leaves[1]}']")
        on_path = set()
        for leaf in leaves:  # to where both lines to the base meet: body 0, on which all stands
            while parents[leaf] >= 0:
                on_path.add(leaf)
                leaf = parents[leaf]
        assert set(page.evaluate(lit, "edge")) == on_path and set(page.evaluate(lit, "body")) == on_path | {0}
        assert "→" in page.inner_text(".told")
        page.hover("p")
        assert page.evaluate(lit, "edge") == [] and "exact zero" in page.inner_text(".told")
        page.hover(".body >> nth=1")
        assert len(page.evaluate(lit, "block")) == 7 and page.evaluate(lit, "edge") == []  # a row and a column
        page.click(".block >> nth=1")
        page.hover("p")
        assert len(page.evaluate(lit, "edge")) == 1  # kept
        page.click("p")
        assert page.evaluate(lit, "edge") == [] and page.asked == [target.as_uri()]


def test_an_exact_zero_lights_no_path(browser, tmp_path):
    target = TREE.soa.phi.blocks().on_robot().save(tmp_path / "phi.html")
    with opened(browser, target.as_uri()) as page:
        page.hover(".block[data-zero] >> nth=0")
        assert page.locator(".edge.lit").count() == 0 and page.locator(".body.end").count() == 2
        assert "exactly zero" in page.inner_text(".told")


def test_a_report_of_theorems_is_filtered(browser, tmp_path):
    findings = [
        Finding(f"name {i}", f"group {i // 2}", f"φ = {i}", "x", ["J = 0"] if i % 2 else [], [], verdict, states=1)
        for i, verdict in enumerate(["holds", "holds", "fails", "holds", "expected to fail", "expected to fail"])
    ]
    target = tmp_path / "report.html"
    target.write_text(
        f"<!DOCTYPE html><meta charset=utf-8><link rel=icon href='data:,'>{Report('arm', {}, findings)._repr_html_()}", "utf-8"
    )
    with opened(browser, target.as_uri()) as page:
        rows = page.locator("tr[data-verdict]:visible")
        assert rows.count() == 6 and page.inner_text(".count") == "6 of 6"
        page.click("button[data-verdict='holds']")
        assert rows.count() == 3 and page.locator("tr.group:visible").count() == 1  # groups of what holds have none left
        page.fill("input", "J = 0")
        assert rows.count() == 1 and page.inner_text(".count") == "1 of 6"
        page.click("button[data-verdict='holds']")
        assert rows.count() == 3
        page.fill("input", "nothing like it")
        assert rows.count() == 0 and page.locator("tr.group:visible").count() == 0


def test_names_stay_names_and_nothing_is_nothing():
    odd = pc.Multibody("odd")
    odd.add_body("<!--<script>", None, "pin", mass=1.0, inertia=np.eye(3))
    assert "<!--" not in odd.soa.phi.blocks().on_robot()._repr_html_()
    with pytest.raises(pc.EvaluationError, match="there is nothing to point at"):
        pc.tree([-1, 0], ["weld", "weld"]).soa.phi.blocks().on_robot()
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        odd.soa.phi.blocks().on_robot().save("/nonexistent/blocks.html")
