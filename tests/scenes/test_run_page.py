"""Runs as pages: what they hold is the run, they play in a real browser, and ask for nothing."""

import base64
import json
import re

import numpy as np
import pytest

import pycraft as pc
from pycraft.view.skeleton import Skeleton, placed
from support.browser import differing, opened, pixels, until
from support.mechanisms import every_kind

SINGLE = 2.0**-23  # of a number's size, in single precision


def held(page):
    """The data of a page, its numbers as arrays."""
    text = re.search(r'<script type="application/json" id="data">(.*?)</script>', page.html, re.S).group(1)
    return json.loads(text)


def numbers(text):
    return np.frombuffer(base64.b64decode(text), "<f4").astype(float)


@pytest.fixture(scope="module")
def run():
    return pc.mechanisms.double_pendulum().simulate(2.0, q=[1.0, 2.0])


def test_poses_are_those_of_the_run(run):
    page = run.to_html(fps=10, speed=0.5, trace="lower")
    data = held(page)
    assert page.times == pytest.approx(np.arange(41) * 0.05) and numbers(data["times"]) == pytest.approx(page.times, rel=SINGLE)
    poses = numbers(data["poses"]).reshape(41, 2, 3, 4)
    for k, body in enumerate(("upper", "lower")):
        there = run.model.pose(body, run.at(page.times).q)[:, :3]
        np.testing.assert_allclose(poses[:, k], there, rtol=SINGLE, atol=SINGLE)
    np.testing.assert_allclose(numbers(data["way"]).reshape(-1, 3), poses[:, 1, :, 3], rtol=SINGLE, atol=SINGLE)
    assert 'value="0.5" selected' in page.html and repr(page).startswith("<page of 'double pendulum': 41 frames, 0 to 2 s, ")


def test_the_end_of_a_run_is_a_frame(run):
    assert run.to_html(fps=7).times[-1] == 2.0 and len(run.to_html(fps=7).times) == 15
    short = run.to_html(fps=0.3)
    assert short.times.tolist() == [0.0, 2.0]


def test_plots_are_those_of_the_run(run):
    energies, angles = held(run.to_html(None, "energy", "q", coordinates="lower"))["panels"]
    assert energies["title"] == "energies" and energies["axis"] == "J" and energies["names"][:2] == ["kinetic", "potential"]
    assert angles["names"] == ["lower"] and angles["axis"] == "rad"
    times = numbers(energies["t"])
    at = np.abs(run.t[:, None] - times).argmin(axis=0)
    assert times[0] == 0 and times[-1] == 2.0 and len(times) == min(len(run.t), 1000)
    np.testing.assert_allclose(numbers(energies["lines"][0]), run.energy["kinetic"][at], rtol=SINGLE, atol=1e-30)
    assert [panel["title"] for panel in held(run.to_html())["panels"]] == ["energies"]
    without = pc.mechanisms.double_pendulum().simulate(0.1, energy=False)
    assert [panel["title"] for panel in held(without.to_html())["panels"]] == ["angles"]


@pytest.mark.parametrize("seed", range(2))
def test_every_kind_of_hinge(seed):
    model = every_kind(seed=seed)
    state = model.random_state(seed)
    run = pc.Scene(model).add(pc.effects.Gravity(g=(0, 0, -9.81))).simulate(0.1, state.q, 0.1 * state.v)
    data = held(run.to_html(fps=20))
    skeleton, figure = Skeleton(model), data["figure"]
    poses = numbers(data["poses"]).reshape(3, -1, 3, 4)
    for kind, (owners, places) in skeleton.points.items():
        shown = figure["points"][kind]
        assert shown["of"] == owners.tolist()
        there = placed(skeleton.poses(run.at(0.05).q), owners, places)
        drawn = [poses[1, k, :, :3] @ np.array(p) + poses[1, k, :, 3] if k >= 0 else p for k, p in zip(owners, shown["at"], strict=True)]
        np.testing.assert_allclose(np.reshape(drawn, (-1, 3)), there, atol=1e-6 * (1 + np.abs(there).max(initial=0)))
    low, high = np.subtract(figure["centre"], figure["half"]), np.add(figure["centre"], figure["half"])
    places = np.concatenate([poses[:, :, :, 3].reshape(-1, 3)])
    assert len(figure["bodies"]) == len(figure["parents"]) == poses.shape[1] and np.all(high > low) and np.isfinite(places).all()


def welds():
    model = pc.Multibody("welds")
    model.add_body("a", hinge="weld", mass=1.0, inertia=np.eye(3))
    return model


@pytest.mark.parametrize("made", [welds, lambda: pc.chain(1), lambda: pc.chain(400)], ids=["welds", "one", "many"])
def test_small_and_large_models(made):
    model = made()
    page = pc.Scene(model).simulate(0.1).to_html()
    figure = held(page)["figure"]
    assert len(figure["bodies"]) == len(model.bodies) and min(figure["half"]) > 0
    assert bool(held(page)["panels"]) == (model.nv > 0)


def test_runs_from_files_and_without_steps(run, tmp_path):
    pytest.importorskip("xarray")
    run.save(tmp_path / "run.nc")
    again = pc.load_run(tmp_path / "run.nc")
    one, other = held(run.to_html(fps=5)), held(again.to_html(fps=5))
    assert one["figure"]["bodies"] == other["figure"]["bodies"]
    np.testing.assert_allclose(numbers(one["poses"]), numbers(other["poses"]), atol=1e-6)  # Hermite's interpolation, and the integrator's
    sparse = pc.mechanisms.double_pendulum().simulate(1.0, t_eval=[0, 0.5, 1.0], dense=False, q=[1.0, 2.0])
    poses = numbers(held(sparse.to_html(fps=4))["poses"]).reshape(5, -1)
    assert np.array_equal(poses[0], poses[1]) and np.array_equal(poses[2], poses[3]) and not np.array_equal(poses[1], poses[2])


def test_events_are_marked():
    run = pc.mechanisms.double_pendulum().simulate(2.0, q=[1.0, 2.0], events={"level": lambda t, state: state.q[0]})
    data = held(run.to_html())
    assert data["marks"] == run.events["level"].t.tolist()


def test_pages_are_small_and_alike(run, tmp_path):
    """64 bytes a body and frame, and what every page has: under 50 kB."""
    page = run.to_html(fps=100)
    assert page.html == run.to_html(fps=100).html
    assert len(held(page)["poses"]) == 64 * 2 * 201
    assert len(page.html) - len(json.dumps(held(page))) < 50_000
    run.animate(tmp_path / "film.html", fps=30)
    run.to_html(tmp_path / "page.html", fps=30)
    assert (tmp_path / "film.html").stat().st_size > 10 * (tmp_path / "page.html").stat().st_size


def test_names_are_no_markup():
    model = pc.Multibody("</script><b>&amp;")
    model.add_body("<i>", hinge="pin", axis=(0, 1, 0), mass=1.0, com=(0.5, 0, 0), inertia=np.eye(3))
    page = pc.Scene(model).simulate(0.1).to_html()
    assert page.html.count("</script>") == 2 and "<b>" not in page.html and "<i>" not in page.html
    assert held(page)["figure"]["bodies"] == ["<i>"] and held(page)["figure"]["name"] == "</script><b>&amp;"
    assert page._repr_html_().count("<") == 2


def test_refusals(run, tmp_path):
    for arguments, options, words in (
        (("run.gif",), {}, "ends in .html"),
        ((), {"fps": 0}, "fps=0: give a positive number"),
        ((), {"speed": float("inf")}, "speed=inf: give a positive number"),
        ((), {"fps": 1e6}, "a page holds at most 100 MB: use a lower fps"),
        ((None, "voltage"), {}, "no plot is called 'voltage'"),
    ):
        with pytest.raises(pc.EvaluationError, match=re.escape(words)):
            run.to_html(*arguments, **options)
    with pytest.raises(pc.ModelError, match="hand"):
        run.to_html(trace="hand")
    with pytest.raises(OSError, match="there is no folder"):
        run.to_html(tmp_path / "none" / "run.html")
    edited = pc.mechanisms.double_pendulum()
    moved = edited.simulate(0.1)
    edited.model.bodies["upper"].mass = 7.0
    with pytest.raises(pc.StaleOperatorError, match="was edited since"):
        moved.to_html()


# In a browser ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def film(run, tmp_path):
    return run.to_html(trace="lower").save(tmp_path / "run.html")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_it_plays(browser, film, dark, tmp_path):
    with opened(browser, film.as_uri(), dark=dark) as page:
        first = pixels(page)
        assert page.inner_text("#now") == "t = 0.00 s" and (first[2, 2].mean() < 0.3) == dark
        page.click("#play")
        until(page, "document.getElementById('time').value > 10")
        assert differing(first, pixels(page)) > 200
        until(page, "document.getElementById('play').textContent === '▶'")  # it stops at its end
        assert page.inner_text("#now") == "t = 2.00 s"
        page.screenshot(path=tmp_path / "end.png")
        assert page.asked == [film.as_uri()]  # nothing but itself


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_a_page_in_a_cell_has_the_theme_of_its_notebook(browser, run, tmp_path, dark):
    """JupyterLab's body has its theme, which a page takes, also against the system's mode, and again when it changes."""
    cell = tmp_path / "cell.html"
    body = f"<body data-jp-theme-light='{str(not dark).lower()}'>{run.to_html()._repr_html_()}</body>"
    cell.write_text(f"<!DOCTYPE html><html lang='en'><meta charset='utf-8'><link rel='icon' href='data:,'>{body}</html>", encoding="utf-8")
    colours = {True: ["rgb(27, 27, 29)", "#1b1b1d"], False: ["rgb(255, 255, 255)", "#ffffff"]}
    with opened(browser, cell.as_uri(), dark=not dark) as page:
        (frame,) = page.frames[1:]
        frame.wait_for_selector("#figure")
        seen = "[getComputedStyle(document.body).backgroundColor, colourOf('--page')]"
        assert frame.evaluate(seen) == colours[dark]
        page.evaluate(f"document.body.dataset.jpThemeLight = '{str(dark).lower()}'")
        frame.wait_for_function(f"{seen}[0] === '{colours[not dark][0]}'")
        assert frame.evaluate(seen) == colours[not dark]


def test_the_slider_and_the_plot_choose_the_time(browser, film):
    with opened(browser, film.as_uri()) as page:
        first = pixels(page)
        page.fill("#time", "30")
        assert page.inner_text("#now") == "t = 1.00 s" and differing(first, pixels(page)) > 200
        page.fill("#time", "0")
        assert differing(first, pixels(page)) == 0
        box = page.locator("#plots canvas").bounding_box()
        page.mouse.click(box["x"] + 58 + (box["width"] - 70) / 2, box["y"] + 60)
        assert page.inner_text("#now") in ("t = 0.97 s", "t = 1.00 s")
        page.keyboard.press("ArrowRight")
        assert page.inner_text("#now") in ("t = 1.00 s", "t = 1.03 s")


def test_bones_are_drawn_where_they_are(browser, film, run):
    """The elbow's place in the picture, from the page's own camera, is where the marker's colour is."""
    with opened(browser, film.as_uri()) as page:
        for frame in (0, 17, 40):
            page.fill("#time", str(frame))
            elbow = run.model.pose("lower", run.at(frame / 30).q)[:3, 3]
            x, y, _ = page.evaluate("p => figure.seen(p)", elbow.tolist())
            colour = pixels(page)[round(y), round(x)]
            np.testing.assert_allclose(colour, np.array([0x00, 0x72, 0xB2]) / 255, atol=0.05)  # a pin's
            right, up = (page.evaluate("p => figure.seen(p)", p)[:2] for p in ([1, 0, 0], [0, 0, 1]))
            origin = page.evaluate("p => figure.seen(p)", [0, 0, 0])[:2]
            assert right[0] > origin[0] and right[1] == pytest.approx(origin[1]) and up[1] < origin[1] and up[0] == pytest.approx(origin[0])


def test_the_figure_turns(browser, film):
    with opened(browser, film.as_uri()) as page:
        first, box = pixels(page), page.locator("#figure").bounding_box()
        page.mouse.move(box["x"] + 300, box["y"] + 300)
        page.mouse.down()
        page.mouse.move(box["x"] + 380, box["y"] + 330, steps=4)
        page.mouse.up()
        assert differing(first, pixels(page)) > 200
        page.mouse.wheel(0, 300)
        page.click("#look")
        assert differing(first, pixels(page)) == 0


def test_limits_that_are_left_are_red_while_they_are(browser, tmp_path):
    """In the heading with the value, and at the hinge in the frames at which it is beyond."""
    model = pc.Multibody("slide")
    model.add_body("car", hinge="slider", axis=(1, 0, 0), mass=1.0, inertia=np.eye(3), limits=(-1.0, 1.0))
    model.add_body("arm", parent="car", hinge="pin", axis=(0, 1, 0), mass=1.0, com=(0, 0, 0.5), inertia=np.eye(3))
    with pytest.warns(pc.models.warning.ModelWarning, match="car reached"):
        run = pc.Scene(model).add(pc.effects.Spring(4.0, hinges="car")).simulate(4.0, [0.0, 0.0], [4.0, 0.0], progress=False)
    page = run.to_html(fps=20)
    q = run.at(page.times).q[:, 0]
    (beyond,) = [one for one in held(page)["beyond"] if one["spans"][0][0] < np.argmax(q < -1)]
    frames = {k for first, last in beyond["spans"] for k in range(first, last + 1)}
    assert beyond["body"] == 0 and frames == set(np.flatnonzero(q > 1 + 1e-9).tolist()) and 0 < len(frames) < len(q)
    with opened(browser, page.save(tmp_path / "run.html").as_uri()) as shown:
        assert shown.inner_text(".crossed") == "beyond limits: car"
        assert re.fullmatch(r"car reached \S+ \(limit -1.*; car reached \S+ \(limit 1.*", shown.get_attribute(".crossed", "title"))
        for frame, red in ((0, 0), (min(frames), 1)):
            shown.fill("#time", str(frame))
            assert shown.evaluate("figure.beyond.size") == red
    held_by = pc.Scene(model).add(pc.effects.Limits()).simulate(0.5, [0.0, 0.0], [4.0, 0.0], progress=False).to_html()
    assert held(held_by)["beyond"] == [] and 'class="crossed"' not in held_by.html


def test_what_falls_far_is_followed(browser, tmp_path):
    """A loose robot fills the picture while it falls; one that stays where it is is not followed."""
    dog = pc.robots.a1()
    scene = pc.Scene(dog).add(pc.effects.Gravity((0, 0, -9.81)))
    q = dog.clamped(dog.neutral())
    fall = scene.simulate(1.0, q, progress=False).to_html(fps=10)
    assert held(fall)["follow"] == "robot"
    assert held(scene.simulate(0.1, q, progress=False).to_html())["follow"] == ""
    assert held(pc.mechanisms.double_pendulum().simulate(0.2).to_html())["follow"] == ""
    with opened(browser, fall.save(tmp_path / "fall.html").as_uri()) as page:
        assert page.input_value("#follow") == "robot"
        for frame in ("0", "10"):
            page.fill("#time", frame)
            places = page.evaluate("figure.data.bodies.map((_, k) => figure.seen(placed(figure.poses, k, [0, 0, 0])))")
            size = np.ptp(np.array(places)[:, :2], axis=0)
            box = page.locator("#figure").bounding_box()
            assert size.max() > 0.3 * min(box["width"], box["height"])
            middle = np.array(places)[:, :2].mean(axis=0)
            assert middle == pytest.approx([box["width"] / 2, box["height"] / 2], abs=1.0)


def test_meshes_that_are_missing_are_one_line(tmp_path):
    from pycraft.view.web_page import notes

    assert notes([]) == "" and "1 shape is not shown" in notes(["a"])
    many = notes([f"mesh {i} <is> missing" for i in range(7)])
    assert "<summary>7 shapes are not shown (why?)</summary>" in many and "mesh 6 &lt;is&gt; missing" in many
