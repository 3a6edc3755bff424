"""Theorems, findings and reports in HTML: everything is said, nothing is asked of others, and scripts only hide."""

import re

import pytest

import pycraft as pc
from making.offline import asked_of_others
from pycraft.identities.report import Finding, Report
from pycraft.identities.verdict_html import MARKS, verdict_html

VERDICTS = ["holds", "fails", "undecided", "expected to fail", "holds anyway", "waiting", "undefined"]


def report():
    made = Report("arm <1>", {})
    for i, verdict in enumerate(VERDICTS):
        found = Finding(f"theorem {i}", f"group {i // 3}", f"E_φ* < {i}", "x", ["J = 0"], [], verdict, 1e-16, 1e-13, 1e-33, 2e-30, 50)
        found.states, found.note = (0, "loops") if verdict == "waiting" else (2, "")
        found.unmet = ["J = 0"] if verdict == "expected to fail" else []
        made.findings.append(found)
    return made


def test_a_report_is_a_table_that_stands_without_its_script():
    page = report()._repr_html_()
    rows = re.findall(r'<tr data-verdict="([^"]+)" data-words="([^"]+)"', page)
    held = ("holds", "holds anyway")
    first = [verdict for verdict in VERDICTS if verdict not in held]
    assert [verdict for verdict, _ in rows] == [*first, *held] and page.count('class="group"') == 3  # two groups have one that holds
    assert all(f"theorem {VERDICTS.index(verdict)}" in words and "j = 0" in words for verdict, words in rows)
    assert re.findall(r'<button type="button" data-verdict="([^"]+)"', page) == VERDICTS
    assert (
        '<div class="controls" hidden style="display:none">' in page
    )  # shown by the script alone: without it there is nothing that does not work
    assert " hidden" not in page.split('<div class="rows"')[1].split("<script>")[0]
    for text in ("arm &lt;1&gt;", "E<sub>φ</sub><sup>*</sup> &lt; 3", "not met here: J = 0", "waits for loops", "2e-30", "in 50 digits"):
        assert text in page, text
    assert not asked_of_others(page) and "http" not in page and "require" not in page and "$" not in page.split("<script>")[0]


def test_a_finding_and_a_statement_by_themselves():
    made = report()
    page = made["theorem 3"]._repr_html_()
    for text in ("✗ expected to fail", "<b>theorem 3</b>", "where J = 0", "not met here: J = 0", "bound 2e-30", "2 states"):
        assert text in page, text
    with pytest.raises(KeyError, match="no theorem is called 'nothing'"):
        made["nothing"]
    page = pc.check("HψMψ*H* = D", pc.tree([-1, 0], ["pin", "pin"], seed=1, rotor_inertia=True), states=1)._repr_html_()
    assert "✗ fails" in page and "H<sup>*</sup>" in page and "TRUE where J = 0" in page and "smallest counterexample" in page


def test_every_theorem_shows_itself():
    """With what its model does not meet; those that wait say for what."""
    shown = {t.name: t._repr_html_() for t in pc.tree([-1, 0, 0], ["pin", "ball", "pin"], seed=1).soa.theorems()}
    assert "where serial chain; not met by tree of 3: serial chain" in shown["Ω decomposed by Υ"]
    assert "not met" not in shown["mass matrix inverse"] and "where J = 0" in shown["mass matrix inverse"]
    assert any("waits for flexible bodies" in page for page in shown.values())
    assert any("the planner inverts by it" in page for page in shown.values()) and any("no hypothesis" in p for p in shown.values())
    for name, page in shown.items():
        assert page.count("<div") == page.count("</div>") and name.replace("&", "&amp;").replace("'", "&#x27;") in page, name


def test_verdicts_are_told_apart_without_colour():
    assert set(VERDICTS) <= set(MARKS)
    shown = {verdict: re.sub(r"<[^>]*>", "", verdict_html(verdict)) for verdict in MARKS}
    assert len(set(shown.values())) == len(MARKS) and all(verdict in text for verdict, text in shown.items())
    assert "color:" not in verdict_html("holds")  # the words are in the page's own ink, on white and on black
