"""The Kalman dictionary running: both sides take one recursion, and its numbers are the filter's, the smoother's and the mechanism's."""

import html
import json
import re

import numpy as np
import pytest

import pycraft as pc
from pycraft.view.kalman_page import WORDS
from support.browser import differing, opened, pixels, until

STEP = 0.5


def track(steps=6):
    return pc.kalman(
        A=[[1, STEP], [0, 1]], B=[[STEP**2 / 2], [STEP]], C=[[1, 0]], Q=0.5, R=0.2, x0=[1, 0], P0=np.eye(2), steps=steps
    )  # fmt: skip


@pytest.fixture(scope="module")
def page():
    model = track()
    y = model.sample(seed=1)[1]
    y[3] = np.nan
    return model.play(y)


def told(page):
    """Return the data of the page's script."""
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page.html, re.S).group(1))


def by_letter(steps, letter, count):
    """Values of a quantity, from the base to the tip."""
    found = {step.body: step.value for step in steps if step.letter == letter}
    return [found[k] for k in range(count)]


def test_the_recursion_is_the_filters(page):
    f, s, y = page.track.filter(page.measurements), page.track.smooth(page.measurements), page.measurements
    P, P_plus, D, G, z, innovation, adjoint = (
        by_letter(page.filter_steps, letter, 6)[::-1] for letter in ("P", "P⁺", "D", "G", "z", "ε", "α")
    )
    mean = np.array([1.0, 0.0])  # of a track that begins at rest: it stays
    size = dict(rtol=0, atol=1e-13 * 10)  # some sums of numbers below ten
    np.testing.assert_allclose(P, f.predicted_covariance, **size)
    np.testing.assert_allclose(P_plus, f.filtered_covariance, **size)
    np.testing.assert_allclose(np.array(z)[..., 0] + mean, f.predicted, **size)
    np.testing.assert_allclose(np.array(z)[..., 0] + mean + np.einsum("tij,tj->ti", P, np.array(adjoint)[..., 0]), s.states, **size)
    for t in (0, 1, 2, 4, 5):
        np.testing.assert_allclose(innovation[t][0, 0], y[t, 0] - f.predicted[t, 0], **size)
        np.testing.assert_allclose(D[t], f.innovation_covariance[t], **size)
        np.testing.assert_allclose(G[t], f.gain[t], **size)
    assert innovation[3].size == 0 and D[3].size == 0  # nothing was measured


def test_the_recursion_is_the_chains(page):
    model, n = page.model, 6
    P = model.soa.P.dense()
    for k, block in enumerate(by_letter(page.mechanics_steps, "P", n)):
        np.testing.assert_allclose(block, P[6 * k : 6 * k + 6, 6 * k : 6 * k + 6], rtol=0, atol=1e-12 * np.abs(P).max())
    y = np.ravel(by_letter(page.mechanics_steps, "y", n))
    at_rest = np.linalg.solve(model.mass_matrix(), np.ones(n))  # ℳ of mass_matrix has J in it
    np.testing.assert_allclose(y, at_rest, rtol=1e-13 * np.linalg.cond(model.mass_matrix()))


def test_steps_go_side_by_side(page):
    assert len(page.filter_steps) == len(page.mechanics_steps) == 11 * 6 and len(page.lines) == 13
    for a, b in zip(page.filter_steps, page.mechanics_steps, strict=True):
        assert (a.line, a.body, a.letter, a.direction) == (b.line, b.body, b.letter, b.direction)
    assert {step.letter for step in page.filter_steps} == set(WORDS)


def test_the_page_counts_time_from_the_tip(page):
    data = told(page)
    assert [step[1:4] for step in data["steps"][:9:8]] == [[0, 5, "P"], [1, 4, "P"]] and data["steps"][-1][1:4] == [0, 5, "α"]
    assert data["measured"][0][1] == pytest.approx(page.measurements[1, 0], rel=1e-5) and len(data["words"]) == 11
    shown = page._repr_html_()  # a frame that holds the page as an attribute: in a notebook it needs no file and no server
    assert shown.count("<") == 2 and html.unescape(shown.split('srcdoc="')[1].split('" style')[0]) == page.html


def test_other_chains_and_forces():
    model = pc.tree([-1, 0, 1], ["pin", "slider", "pin"], seed=4)  # no rotors: J is zero
    page = track(3).play([1.0, 2.0, 3.0], model, [1.0, 0.0, 0.0])
    y = np.ravel(by_letter(page.mechanics_steps, "y", 3))
    np.testing.assert_allclose(y, np.linalg.solve(model.mass_matrix(), [1.0, 0, 0]), rtol=1e-10)
    one = track(1).play([1.0])
    assert repr(one) == "<filter beside 'chain of 1 rods': 11 steps of 1 times and bodies>"
    data = told(one)
    assert [data[name] for name in ("measured", "predicted", "smoothed")] == [[[1.0]]] * 3  # x0 is what was measured
    assert data["deviation"] == [[pytest.approx(np.sqrt(1.2), rel=1e-5)]] and not any(
        "nan" in text for step in data["steps"] for text in step[4:6]
    )


def pair():
    y = np.array([[1.0, 8.0], [2.0, np.nan], [np.nan, 6.0], [4.0, 5.0]])
    return pc.kalman(A=np.eye(2), B=None, C=[[1, 0], [1, 2]], Q=np.eye(2), R=np.diag([1.0, 3.0]), P0=np.eye(2), measurements=y).play()


def test_all_of_several_measurements_are_told():
    page = pair()
    assert page.filter_steps[1].value.shape == (2, 2)
    data, f, s = told(page), page.track.filter(), page.track.smooth()
    assert data["measured"] == [[1, 2, None, 4], [8, None, 6, 5]]
    np.testing.assert_allclose(data["predicted"], [[1, 0], [1, 2]] @ f.predicted.T, rtol=1e-5, atol=1e-9)  # the page has six digits
    np.testing.assert_allclose(data["smoothed"], [[1, 0], [1, 2]] @ s.states.T, rtol=1e-5)
    np.testing.assert_allclose(np.array(data["deviation"], float) ** 2, f.innovation_covariance[:, [0, 1], [0, 1]].T, rtol=1e-4)


def test_the_drawn_row_is_chosen(browser, page, tmp_path):
    with opened(browser, page.save(tmp_path / "one.html").as_uri(), size=(1200, 760)) as shown:
        assert not shown.is_visible("#row")
    with opened(browser, pair().save(tmp_path / "two.html").as_uri(), size=(1200, 760)) as shown:
        assert shown.inner_text("#row").split() == ["1", "2"]
        first = pixels(shown, "#track")
        shown.select_option("#row", index=1)
        assert differing(first, pixels(shown, "#track")) > 200
        shown.select_option("#row", index=0)
        assert differing(first, pixels(shown, "#track")) == 0


def test_refusals():
    with pytest.raises(pc.EvaluationError, match="61 time steps: at most 60"):
        track(61).play(np.ones(61))
    with pytest.raises(pc.ModelError, match="no measurements"):
        track().play()
    with pytest.raises(pc.ModelError, match="not a serial chain of 6 bodies"):
        track().play(np.ones(6), pc.chain(5))
    with pytest.raises(pc.ModelError, match="not a serial chain of 6 bodies"):
        track().play(np.ones(6), pc.tree([-1, 0, 0, 1, 1, 2], ["pin"] * 6))
    with pytest.raises(pc.ModelError, match="must be a Multibody, not 'arm'"):
        track().play(np.ones(6), "arm")
    with pytest.raises(pc.ModelError, match=r"one value per coordinate.*\(6,\)"):
        track().play(np.ones(6), tau=[1.0])
    with pytest.raises(pc.SingularHingeError, match="step 1"):
        pc.kalman(1.0, 1.0, 1.0, 0.0, 0.0, P0=1.0, measurements=[1.0, 2.0]).play()


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_it_plays_in_a_browser(browser, page, dark, tmp_path):
    address = page.save(tmp_path / "kalman.html").as_uri()
    data = told(page)
    assert data["measured"][0][3] is None and data["deviation"][0][3] is None and None not in data["smoothed"][0]
    with opened(browser, address, size=(1200, 760), dark=dark) as shown:
        assert shown.inner_text("#now") == "66 of 66" and shown.inner_text("#at_time") == "at t = 0"
        whole, chain = pixels(shown, "#track"), pixels(shown)
        shown.fill("#time", "1")  # D of the first time step, at the tip
        assert shown.inner_text("#rows .lit").startswith("D(k) = H(k) P(k) H*(k) + J(k)") and shown.inner_text("#at_body") == "at body5"
        assert float(shown.inner_text("#rows .lit td >> nth=2").strip("= ")) == pytest.approx(1.2, rel=1e-3)  # P0 + R
        assert differing(whole, pixels(shown, "#track")) > 200 and differing(chain, pixels(shown)) > 100
        shown.click("#next")
        assert shown.inner_text("#rows .lit").startswith("G(k)")
        shown.select_option("#pace", "20")
        shown.click("#play")
        until(shown, "now > 6")
        shown.click("#play")
        assert shown.evaluate("timer") is None and shown.asked == [address]
