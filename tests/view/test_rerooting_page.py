"""One motion from every base: what stays is what the definitions say, whoever the base is, and the page shows these numbers."""

import json
import re

import numpy as np
import pytest

import pycraft as pc
from support.browser import differing, opened, pixels, until


def robot():
    model = pc.tree([-1, 0, 1, 1, 0, 4], ["free", "pin", "ball", "pin", "universal", "slider"], seed=1)
    state = model.random_state(0)
    model.q, model.v = state.q, state.v
    return model


@pytest.fixture(scope="module")
def page():
    return robot().rerootings()


def test_what_stays_stays(page):
    model = robot()
    # Coordinates change by matrices of determinant ±1, of condition some tens: some dozens of roundings of the numbers' own size.
    assert page.bases == list(model.bodies)
    momentum = model.centroidal_momentum().value
    for name, value in {
        "kinetic energy, J": float(model.kinetic_energy()),
        "momentum, N s": np.linalg.norm(momentum[3:]),
        "angular momentum about the centre of mass, N m s": np.linalg.norm(momentum[:3]),
        "ln det ℳ": np.linalg.slogdet(model.mass_matrix())[1],
        "Σ tr Υ(k)M(k)": model.nv,
    }.items():
        assert page.stays[name] == pytest.approx([value] * 6, rel=1e-12)
    assert all(max(row) < 1e-12 for name, row in page.stays.items() if name.startswith("largest")) and len(page.stays) == 9


def test_masses_that_are_felt_are_those_of_the_jacobians(page):
    """Υ(k)⁻¹ by Jacobians and ℳ, which no base decides; P(k) is all of it where k is the base, and a part elsewhere."""
    model = robot()
    MM_inverse = np.linalg.inv(model.mass_matrix())
    felt = []
    for name in model.bodies:
        jacobian = model.jacobian(name)
        felt.append(np.trace(np.linalg.inv(jacobian @ MM_inverse @ jacobian.T)[3:, 3:]) / 3)
    np.testing.assert_allclose(page.inverse_of_Upsilon, [felt] * 6, rtol=1e-11)  # condition of ℳ up to 300
    np.testing.assert_allclose(np.diag(page.P), felt, rtol=1e-11)
    others = ~np.eye(6, dtype=bool)
    assert (page.P[others] < page.inverse_of_Upsilon[others] * (1 - 1e-6)).all()


def test_what_changes_is_that_of_the_base(page):
    model = robot()
    twists = [model.frame(name).velocity() for name in model.bodies]
    assert page.changes["speed of the base, m/s"] == pytest.approx([np.linalg.norm(V[3:]) for V in twists])
    assert page.changes["rate of turn of the base, rad/s"] == pytest.approx([np.linalg.norm(V[:3]) for V in twists])
    assert page.changes["bodies on the longest path"] == [3, 4, 5, 5, 4, 5]
    for base, condition in zip(page.bases, page.changes["condition of ℳ"], strict=True):
        other = robot()
        other.reroot(base)
        assert condition == pytest.approx(np.linalg.cond(other.mass_matrix()), rel=1e-9)


def test_the_model_stays_as_it_was():
    model = robot()
    before = model.description()
    model.rerootings(model.random_state(3))
    assert list(model.bodies) == [f"body{k}" for k in range(6)]
    np.testing.assert_array_equal(model.q, before["q"])


def test_trees_that_fly_and_trees_that_do_not():
    two = pc.tree([-1, -1, 1, 0], ["free", "pin", "pin", "pin"], seed=1).rerootings()
    assert two.bases == ["body0", "body3"] and two.inverse_of_Upsilon.shape == (2, 2)
    one = pc.tree([-1], ["free"]).rerootings()
    assert one.bases == ["body0"] and one.changes["bodies on the longest path"] == [1]
    rotors = pc.tree([-1, 0, 1], ["free", "pin", "pin"], seed=2)
    for hinge in list(rotors.hinges)[1:]:
        rotors.hinges[hinge].rotor_inertia = 0.3
    page = rotors.rerootings(rotors.random_state(1))
    assert np.ptp(page.stays["ln det ℳ"]) < 1e-12 and np.ptp(page.stays["kinetic energy, J"]) < 1e-12 and page.bases == list(rotors.bodies)


def test_refusals():
    with pytest.raises(pc.ModelError, match=r"detach\('body0'\) first"):
        pc.chain(2).rerootings()
    with pytest.raises(pc.EvaluationError, match=r"61 bodies: at most 60.*subgraph"):
        pc.tree([-1, *range(60)], ["free", *["pin"] * 60]).rerootings()
    with pytest.raises(pc.ModelError):
        robot().rerootings([0.0])
    with pytest.raises(pc.EvaluationError, match="ends in .html"):
        robot().rerootings().save("bases.gif")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_the_slider_chooses_the_base(browser, page, dark, tmp_path):
    address = page.save(tmp_path / "bases.html").as_uri()
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page.html, re.S).group(1))
    assert data["outboard"] == page.P.tolist() and data["parents"][0] == [-1, 0, 1, 1, 0, 4] and data["parents"][3] == [1, 3, 1, -1, 0, 4]
    with opened(browser, address, size=(1200, 700), dark=dark) as shown:
        first, stays = pixels(shown), shown.inner_text("#stays").split("largest")[0]
        assert shown.evaluate("figure.arrows.length") == 5
        shown.fill("#base", "3")
        until(shown, "document.getElementById('now').textContent === 'body3'")
        assert differing(first, pixels(shown)) > 200 and shown.inner_text("#stays").split("largest")[0] == stays
        assert shown.inner_text("#felt .chosen").startswith("body3") and "+ 0 =" in shown.inner_text("#felt .chosen")
        assert f"{page.changes['condition of ℳ'][3]:.8g}"[:6] in shown.inner_text("#changes")
        assert shown.asked == [address]
