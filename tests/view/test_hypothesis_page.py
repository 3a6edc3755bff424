"""Switches for hypotheses: what the page says of a combination is what the checker and the definitions say of that model."""

import json
import re

import numpy as np
import pytest

import pycraft as pc
from pycraft.view.hypothesis_page import SWITCHES, _in_motion, _spec, _state
from support.browser import differing, opened, pixels, until

FIRST = ("J = 0", "chain", "single-DOF", "fixed")


@pytest.fixture(scope="module")
def page():
    said = []
    made = pc.hypothesis_switches(bodies=3, seed=2, progress=said.append)
    made.said = said
    return made


def held(page):
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page.html, re.S).group(1))


def test_positions_are_the_hypotheses_that_they_say():
    for positions, met in (
        (FIRST, {"J = 0", "serial chain", "constant H", "single-DOF hinges"}),
        (("J > 0", "branch", "universal", "free"), {"free root"}),
        (("J = 0", "branch", "ball", "fixed"), {"J = 0", "constant H"}),
        (("J > 0", "chain", "ball", "free"), {"serial chain", "constant H", "free root"}),
    ):
        spec = _spec(positions, 5, 0)
        assert spec.met == met and len(spec.parents) == 5
        traits = _in_motion(spec, 0).soa._source.traits
        assert {name for name, is_met in traits.items() if is_met and name != "blocks of one size"} == met - {"free root"}


@pytest.mark.parametrize("arguments", [{"bodies": 2}, {"bodies": 17}, {"bodies": 3, "seed": -1}])
def test_refusals(arguments):
    with pytest.raises(pc.EvaluationError, match=f"{list(arguments)[-1]}={list(arguments.values())[-1]}"):
        pc.hypothesis_switches(**arguments)


@pytest.mark.slow
def test_what_breaks_breaks_by_a_hypothesis_that_is_not_met(page):
    assert page.broken("J = 0", "chain", "single-DOF", "free") == []
    assert [f.name for f in page.broken(*FIRST)] == ["two-filter form"]
    for positions in page.specs:
        report = page.report(*positions)
        assert not report.failed and not report.undecided
        for finding in page.broken(*positions):
            assert finding.unmet and not set(finding.unmet) & page.specs[positions].met
    with_rotors = {f.name for f in page.broken("J > 0", "chain", "single-DOF", "free")}
    assert {"Riccati equation of P", "H is a left inverse of G", "innovations factorization", "mass matrix inverse"} <= with_rotors
    assert {"∂ℳ"} <= {f.name for f in page.broken("J = 0", "chain", "universal", "free")}
    assert {"C is the Christoffel matrix"} <= {f.name for f in page.broken("J = 0", "chain", "ball", "free")}
    with pytest.raises(pc.EvaluationError, match="one of each of J: 'J = 0', 'J > 0'; tree"):
        page.broken("J = 0")


def test_an_inverse_that_is_not_there_is_said_to_be_none(page):
    (finding,) = page.broken(*FIRST)
    assert _state(finding) == "undefined" and finding.states == 0 and "singular" in finding.note
    assert {_state(f) for f in page.report(*FIRST).findings if f.verdict == "holds"} == {"holds"}


def test_by_how_much(page):
    """H G = I with J > 0, by the definitions: H G = HPH*(HPH* + J)⁻¹, of which the residual is J D⁻¹, applied to vectors."""
    positions = ("J > 0", "chain", "single-DOF", "fixed")
    model = _in_motion(page.specs[positions], 2)
    D, J = (letter.dense() for letter in model.soa("D J"))
    off = np.abs(np.diag(J) / np.diag(D))  # all diagonal: pins
    finding = next(f for f in page.broken(*positions) if f.name == "H is a left inverse of G")
    assert off.min() * 0.99 <= finding.residual <= off.max() / (1 - off.max())  # relative to the larger side


@pytest.mark.slow
def test_the_page_holds_every_combination(page):
    data = held(page)
    assert list(data["cases"]) == ["|".join(positions) for positions in page.specs] and data["switches"] == {
        name: list(choices) for name, choices in SWITCHES.items()
    }
    for key, case in data["cases"].items():
        report = page.report(*key.split("|"))
        names = {finding.name: finding for finding in report.findings if finding.verdict != "waiting"}
        rows = {theorem["name"]: row for theorem, row in zip(data["theorems"], case["rows"], strict=True) if row is not None}
        assert rows.keys() == names.keys() and len(rows) > 140
        broken = {name for name, row in rows.items() if row[0] in ("breaks", "undefined")}
        assert broken == {finding.name for finding in page.broken(*key.split("|"))}
        assert all(row[1] == pytest.approx(names[name].residual, rel=5e-3) for name, row in rows.items() if row[0] == "breaks")
    assert "connect-src 'none'" in page.html and not re.search(r"https?://", page.html)
    assert sorted(page.said) == sorted(", ".join(positions) for positions in page.specs)  # each is checked once
    assert repr(page) == "<switches of hypotheses: 24 models of 3 bodies, 24 of them checked by now>"


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_switches_switch(browser, page, dark, tmp_path):
    address = page.save(tmp_path / "hypotheses.html").as_uri()
    with opened(browser, address, size=(1200, 700), dark=dark) as shown:
        assert shown.inner_text("#summary").startswith("1 of ") and "1 needs free root" in shown.inner_text("#summary")
        first = pixels(shown)
        shown.click("text=J > 0")
        count = len(page.broken("J > 0", "chain", "single-DOF", "fixed"))
        until(shown, f"document.getElementById('summary').textContent.startsWith('{count} of ')")
        assert shown.locator("#theorems tr.broken").count() == count and shown.locator("#theorems tr.changed").count() == count - 1
        riccati = shown.locator("#theorems tr", has_text="Riccati equation of P").inner_text()
        residual = next(f for f in page.broken("J > 0", "chain", "single-DOF", "fixed") if f.name == "Riccati equation of P").residual
        assert "breaks" in riccati and float(riccati.split()[-1]) == pytest.approx(residual, rel=0.06)
        shown.click("text=branch")
        assert differing(first, pixels(shown)) > 100  # another model
        shown.click("text=free >> nth=0")
        shown.click("text=J = 0 >> nth=0")
        shown.click("text=chain")
        until(shown, "document.getElementById('summary').textContent.startsWith('none of ')")
        shown.select_option("#shown", "now")
        assert shown.locator("#theorems tr.broken").count() == 0 and shown.locator("#theorems tbody tr").count() == 0
        shown.select_option("#shown", "all")
        assert shown.locator("#theorems tbody tr").count() > 147
        assert shown.asked == [address]
