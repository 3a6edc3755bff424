"""Lost digits along a run: what is shown is what certificates say, state by state, and the page works in a browser."""

import re

import numpy as np
import pytest

import pycraft as pc
from pycraft.scenes.lost_digits import _colour
from support.browser import opened


def heavy_tip(last=1e9, bodies=4):
    """A chain whose tip weighs so much more that D of the first hinges loses as many digits as the ratio has."""
    model = pc.Multibody("heavy tip")
    for k in range(bodies):
        mass = 1.0 if k < bodies - 1 else last
        inertia = np.diag([0.01, 0.2, 0.2]) * mass
        at = dict(position=(1, 0, 0)) if k else {}
        model.add_body(f"link{k}", f"link{k - 1}" if k else None, "pin", axis=(0, 1, 0), mass=mass, com=(0.5, 0, 0), inertia=inertia, **at)
    model.q = np.linspace(0.3, 0.9, bodies)
    return model


def run_of(model):
    return pc.Scene(model).add(pc.effects.Gravity((0, 0, -9.81))).simulate(0.1)


@pytest.fixture(scope="module")
def lost():
    return run_of(heavy_tip()).lost_digits(3, seconds=0.001)


def test_digits_are_those_of_the_certificates(lost):
    assert lost.digits.shape == (3, 4) and list(lost.t) == sorted(lost.t) and lost.t[0] == 0 and lost.t[-1] == 0.1
    for row, one in zip(lost.digits, lost.certificates, strict=True):
        assert {loss.hinge: loss.digits for loss in one.locator} == dict(zip(lost.hinges, row, strict=True))
    # A mass ratio of 1e9 takes some nine digits where the heavy body is carried, and none from its own hinge.
    assert 5 < lost.digits.max() < 11 and lost.digits[:, -1].max() < 1
    assert lost.worst == np.argmax([one.error for one in lost.certificates])


def test_accelerations_are_those_of_the_run(lost):
    """The certificate is of the forces that give them."""
    run = run_of(heavy_tip())
    found = run.lost_digits(2, seconds=0.001).certificates[-1]
    scale = np.abs(run.vdot[-1]).max()
    assert np.abs(found.value - run.vdot[-1]).max() < 1e-5 * scale  # what 1e-8 in double, both ways, leaves


def test_what_is_said_names_the_hinge_the_rung_and_its_price(lost):
    said = lost.told(lost.worst)
    hinge = lost.hinges[int(np.argmax(lost.digits[lost.worst]))]
    step = lost.certificates[lost.worst].next_rung
    assert f"D({hinge}) lost" in said and f"Next rung: {step.rung.label}, error" in said and f"at {step.cost:.2g} times the time" in said
    assert said[4:] in repr(lost)
    light = run_of(heavy_tip(1.0, 1)).lost_digits(1, seconds=0.001)
    assert "lost" not in light.told(0) and "no higher rung is needed" in light.told(0)


def test_the_page_has_every_state_and_shows_the_worst(lost):
    page = lost._repr_html_()
    frames = re.findall(r"<g class='frame'( style=display:none)?>(.*?)</g>", page)
    assert [bool(hidden) for hidden, _ in frames] == [i != lost.worst for i in range(3)]
    for (_, drawn), row in zip(frames, lost.digits, strict=True):
        told = re.findall(r"<title>(\S+): ([\d.]+) digits lost</title>", drawn)
        assert told == [(name, f"{x:.1f}") for name, x in zip(lost.hinges, row, strict=True)]
        sizes = [float(r) for r in re.findall(r"r='([\d.]+)' fill", drawn)]
        assert np.array_equal(np.argsort(row.round(1), kind="stable")[-1:], np.argsort(sizes, kind="stable")[-1:]) or len(set(sizes)) < 4
    assert "t (s)" in page and "nan" not in page
    lightness = [sum(map(int, re.findall(r"\d+", _colour(d)))) for d in range(0, 17, 4)]
    assert lightness == sorted(lightness, reverse=True) and _colour(99.0) == _colour(16.0)


@pytest.mark.parametrize("precision", ["single", "extended"])
def test_other_precisions(precision):
    found = run_of(heavy_tip(10.0, 2)).lost_digits(1, precision=precision, seconds=0.001)
    assert found.certificates[0].rung.precision == precision


def test_what_is_welded_on_is_part_of_what_carries_it():
    model = heavy_tip(1.0, 2)
    model.add_body("on it", "link1", "weld", mass=1.0, inertia=np.eye(3))
    found = run_of(model).lost_digits(1, seconds=0.001)
    assert found.digits.shape == (1, 2) and found._repr_html_().count("class='body'") == 2 + 5  # discs of the legend


def test_refusals(lost, tmp_path):
    run = run_of(heavy_tip(1.0, 1))
    for states in (0, 201, 1.5):
        with pytest.raises(pc.EvaluationError, match="a whole number from 1 to 200"):
            run.lost_digits(states)
    with pytest.raises(pc.EvaluationError, match="'.html'|.html"):
        lost.save(tmp_path / "digits.png")
    run.model.add_body("more", None, "pin", mass=1.0, inertia=np.eye(3))
    with pytest.raises(pc.StaleOperatorError):
        run.lost_digits()


@pytest.mark.parametrize("dark", [False, True])
def test_its_slider_shows_other_states(browser, lost, tmp_path, dark):
    target = lost.save(tmp_path / "digits.html")
    with opened(browser, target.as_uri(), dark=dark) as page:
        assert page.inner_text(".told") == lost.told(lost.worst)
        for i in range(3):
            page.locator("input").fill(str(i))
            assert page.inner_text(".told") == lost.told(i) and page.locator(".frame:visible").count() == 1
        page.locator(".at").first.click()
        assert page.inner_text(".told") == lost.told(0) and page.asked == [target.as_uri()]
