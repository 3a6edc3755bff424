"""Films of sweeps: what is shown is what the recursion computes, each block at the step that computes it, in a page that stands alone."""

import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest

import pycraft as pc
from pycraft.view import SweepFilm
from pycraft.view.plane_layout import model_layout, tree_layout
from support.mechanisms import every_kind


def inverse(model):
    H, phi, M = model.soa("H phi M")
    return (H @ phi @ M @ phi.T @ H.T).inv()


def script_of(page):
    return json.loads(re.search(r"<script type='application/json'>(.*?)</script>", page, re.S).group(1))


class Tags(HTMLParser):
    """Every element with its attributes; whether what opens closes."""

    def __init__(self, page):
        super().__init__()
        self.found, self.open = [], []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))
        if tag not in ("meta", "input"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


# Steps ----------------------------------------------------------------------------------------------------------------


def test_steps_are_the_recursion_with_its_numbers():
    model = pc.tree([-1, 0, 0, 1, 2], ["free", "ball", "pin", "universal", "slider"])
    model.q = model.random_state(seed=1).q
    MM_inverse, x = inverse(model), np.linspace(-1, 2, model.nv)
    written = MM_inverse.algorithm()
    steps = written.steps(x)
    P = model.soa("P").dense()
    for step in steps:
        if step.letter == "P":
            rows = slice(6 * step.body, 6 * step.body + 6)
            np.testing.assert_allclose(step.value, P[rows, rows], rtol=0, atol=1e-13 * np.abs(P).max())  # of sums of few bodies
    y = np.concatenate([step.value.ravel() for step in sorted((s for s in steps if s.name == "y"), key=lambda s: s.body)])
    np.testing.assert_allclose(y, MM_inverse @ x, rtol=1e-9)
    lines = written.lines()
    assert all(lines[step.line][1].startswith(f"{step.letter}(k) = ") for step in steps)


def test_passes_go_the_way_that_they_say():
    steps = inverse(pc.tree([-1, 0, 0, 1], ["pin"] * 4)).algorithm().steps()
    for direction, order in ((-1, [3, 2, 1, 0]), (1, [0, 1, 2, 3])):
        bodies = [step.body for step in steps if step.direction == direction]
        assert list(dict.fromkeys(bodies)) == order
    assert [step.direction for step in steps] == sorted(step.direction for step in steps)


def test_a_step_takes_columns_and_refuses_what_is_no_vector():
    model = pc.chain(3)
    written = inverse(model).algorithm()
    assert written.steps(np.eye(3))[-1].value.shape == (6, 3)
    for x in ([1.0, 2.0], [1, 2, np.nan], np.ones((3, 1, 1)), "abc"):
        with pytest.raises(pc.Error):
            written.steps(x)


def test_what_is_computed_as_a_whole_is_one_step_and_lights_its_lines():
    H, phi, M, I = pc.chain(3).soa("H phi M I")
    written = (H @ phi @ M @ phi.T @ H.T + 0.1 * I).inv().algorithm()
    wholes = [step for step in written.steps() if step.body < 0]
    assert wholes and wholes[0].lines > 1
    assert all(step.line + step.lines <= len(written.lines()) for step in wholes)


# Pages ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("on", ["robot", "tree"])
@pytest.mark.parametrize(
    "model", [pc.chain(1), pc.tree([-1, 0, 0, -1], ["free", "ball", "weld", "pin"]), every_kind()], ids=lambda m: m.name
)
def test_a_page_has_every_block_once_and_needs_nothing_from_elsewhere(model, on):
    film = inverse(model).animate(on=on)
    page = film._repr_html_()
    tags = Tags(page)
    assert not tags.open
    made = [int(a["data-step"]) for tag, a in tags.found if a.get("class") == "made"]
    assert sorted(made) == [i for i, step in enumerate(film.steps) if step.body >= 0]
    assert not re.search(r"https?://|src=|@import|url\(", page)
    told = script_of(page)["steps"]
    assert len(told) == len(film.steps)
    assert [film._names.index(words.split(":")[0]) for *_, body, words in told if body >= 0] == [b for *_, b, _ in told if b >= 0]
    ellipses = [a for tag, a in tags.found if tag == "ellipse"]
    assert len(ellipses) == (len(model.bodies) if on == "robot" else 0)
    numbers = [float(x) for _, a in tags.found for key in ("cx", "cy", "x1", "y2", "rx", "ry", "x") if key in a for x in [a[key]]]
    assert np.isfinite(numbers).all()


def test_names_that_look_like_tags_stay_names():
    model = pc.Multibody("</script><b>")
    model.add_body("<img src=x>", mass=1.0, inertia=np.eye(3), hinge="pin", axis=(0, 0, 1))
    model.add_body("</script>", parent="<img src=x>", mass=1.0, inertia=np.eye(3), hinge="pin", axis=(0, 0, 1))
    page = inverse(model).animate()._repr_html_()
    tags = Tags(page)
    assert not tags.open and not any(tag in ("img", "b") for tag, _ in tags.found)
    assert any(words.startswith("</script>:") for *_, words in script_of(page)["steps"])


def test_ellipses_are_the_apparent_masses():
    """A point mass m on a slider along x moves freely along it: P⁺ has nothing there, and P is m in every direction."""
    model = pc.Multibody("cart")
    model.add_body("cart", mass=4.0, inertia=np.eye(3), hinge="slider", axis=(1, 0, 0))
    model.add_body("light", parent="cart", mass=1.0, inertia=np.eye(3), hinge="slider", axis=(1, 0, 0))
    tags = Tags(inverse(model).play()._repr_html_())
    sizes = {int(a["data-step"]): (float(a["rx"]), float(a["ry"])) for tag, a in tags.found if tag == "ellipse"}
    (_, light), (_, cart) = sorted(sizes.items())
    # P of the cart: 4 along x, where the light one slides freely, 5 across.
    np.testing.assert_allclose([cart[1] / cart[0], light[1] / light[0], light[0] / cart[0]], [np.sqrt(4 / 5), 1, np.sqrt(1 / 5)], atol=2e-3)


def test_what_cannot_be_shown_is_refused():
    model = pc.chain(3)
    with pytest.raises(pc.EvaluationError, match="'robot'.*'tree'"):
        inverse(model).animate(on="moon")
    with pytest.raises(pc.EvaluationError, match=r"251 bodies: at most 250"):
        inverse(pc.chain(251)).animate()
    with pytest.raises(pc.EvaluationError, match="no model"):
        pc.identity(pc.euclidean(3)).animate()
    with pytest.raises(pc.EvaluationError, match="no steps to show"):
        H, phi, M = pc.tree([-1, 0], ["weld", "weld"]).soa("H phi M")
        (H @ phi @ M @ phi.T @ H.T).animate()
    with pytest.raises(pc.EvaluationError, match="'.html'"):
        inverse(model).animate().save("film.gif")
    with pytest.raises(OSError):
        inverse(model).animate().save("/nowhere/at/all/film.html")


def test_states_that_are_bound_are_those_that_are_shown():
    model = pc.chain(2)
    straight, bent = model_layout(model, [0, 0], 480, 360, 28, 7), model_layout(model, [0, 1.0], 480, 360, 28, 7)
    assert not np.allclose(straight.bones, bent.bones)
    bound = inverse(model).at([0, 1.0])
    np.testing.assert_array_equal(SweepFilm(bound, on="robot")._layout.bones, bent.bones)
    batch = inverse(model).at(np.array([[0, 1.0], [0, 0]]))
    np.testing.assert_array_equal(SweepFilm(batch, on="robot")._layout.bones, bent.bones)


def test_scalars_parts_and_trees_that_are_no_models_have_films():
    model = pc.tree([-1, 0, 1, 1], ["pin"] * 4)
    assert len(inverse(model).logdet().animate().steps)
    part = inverse(model.subgraph(root="body1")).play()
    assert part._layout.axes is not None and len(part._names) == 3
    rooted = model.soa("phi").inv().animate()
    assert rooted.steps


def test_diagrams_put_bodies_apart_and_above_what_carries_them():
    parents = [-1, 0, 0, 1, 1, 2, -1]
    layout = tree_layout(parents, 480, 360, 28)
    apart = np.linalg.norm(layout.bodies[:, None] - layout.bodies[None], axis=2)[np.triu_indices(7, 1)]
    assert apart.min() > 20
    assert all(layout.bodies[k, 1] < (layout.bodies[p, 1] if p >= 0 else layout.base[1]) for k, p in enumerate(parents))
    assert layout.bodies.min() >= 28 and (layout.bodies <= [452, 332]).all()


def test_bodies_at_one_place_are_drawn_side_by_side():
    model = pc.tree([-1, 0, 1], ["pin", "pin", "pin"])
    panda = pc.robots.panda()
    for shown in (model, panda):
        layout = model_layout(shown, shown.zero_q(), 480, 360, 28, 7)
        n = len(layout.bodies)
        assert np.linalg.norm(layout.bodies[:, None] - layout.bodies[None], axis=2)[np.triu_indices(n, 1)].min() >= 0.94 * 2.2 * 7


def test_zeros_are_marked_and_the_pictures_are_explained():
    model = pc.chain(3)
    tip = np.array([0.0, 0.0, 1.0])
    page = inverse(model).play(tip)._repr_html_()
    film = inverse(model).play(tip)
    zeros = [i for i, step in enumerate(film.steps) if step.body >= 0 and step.value.size and not step.value.any()]
    assert zeros and sorted(map(int, re.findall(r"class='zero made' data-step='(\d+)'", page))) == zeros
    told = script_of(page)["steps"]
    assert all(told[i][-1].endswith("\n= 0") for i in zeros)
    assert "a row for each quantity, a column for each body" in page and "Applied to x" not in page
    assert "Applied to x = (1, ..., 1)." in inverse(model).play()._repr_html_()


def test_the_button_that_pauses_is_drawn_by_every_font():
    """U+23F8 is an empty box in many; the other pages have two heavy bars."""
    assert "⏸" not in inverse(pc.chain(2)).play()._repr_html_() and "❚❚" in inverse(pc.chain(2)).play()._repr_html_()


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("chromium"), reason="needs chromium")
def test_a_browser_plays_it(tmp_path):
    """The script runs without an error: it tells the last step, and lights its line."""
    page = inverse(pc.chain(3)).animate().save(tmp_path / "film.html")
    arguments = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
    told = subprocess.run(
        ["chromium", *arguments, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", page.as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert "33 of 33" in told.stdout and 'class="line lit"' in told.stdout and 'data-ready="yes"' in told.stdout
    assert 'class="controls" hidden' not in told.stdout
