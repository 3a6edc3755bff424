"""The viewer in a real browser: sliders move the figure, play plays, picking picks, and the page does not grow."""

import time

import numpy as np
import pytest

import pycraft as pc
from support.browser import differing, opened, pixels, until

MOVED = 200
"""Pixels: some lengths of a bone that is drawn 3 wide."""


@pytest.fixture
def view():
    with pc.mechanisms.double_pendulum().add(pc.effects.Damping(0.1)).view(q=[1.0, 2.0]) as shown:
        yield shown


def shown_page(browser, view, **options):
    return opened(browser, view.address, size=(1280, 760), **options)


def ready(page):
    until(page, "state !== null")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_sliders_move_the_figure(browser, view, dark, tmp_path):
    with shown_page(browser, view, dark=dark) as page:
        ready(page)
        first = pixels(page)
        page.fill("#u0", "-0.4")
        until(page, "Math.abs(state.u[0] + 0.4) < 1e-9")
        assert view.session.live.u == pytest.approx([-0.4, 2.0]) and differing(first, pixels(page)) > MOVED
        assert page.inner_text(".slider output >> nth=0") == "-0.400 rad"
        page.fill("#u0", "1")
        until(page, "state.u[0] === 1")
        assert differing(first, pixels(page)) == 0
        page.click("#neutral")
        until(page, "state.u[1] === 0")
        page.click("#random")
        until(page, "state.u[1] !== 0")
        page.screenshot(path=tmp_path / "viewer.png")
        asked = {address.removeprefix(view.address) for address in page.asked}
        assert asked <= {"", "do", "setup", "state?arrows="} and len(asked) >= 3  # nothing from elsewhere


def test_a_slider_leaves_whole_turns(browser, view):
    view.session.live.put([20.0, -9.0], [0.0, 0.0])
    with shown_page(browser, view) as page:
        ready(page)
        turns = 6 * np.pi
        assert float(page.input_value("#u0")) == pytest.approx(20.0 - turns)
        page.fill("#u0", "1.5")
        until(page, "state.u[0] !== 20")
        assert view.session.live.u == pytest.approx([1.5 + turns, -9.0])


def test_play_plays(browser, view):
    with shown_page(browser, view) as page:
        ready(page)
        first = pixels(page)
        page.click("#play")
        until(page, "state.t > 0.3")
        assert view.session.playing and differing(first, pixels(page)) > MOVED
        page.click("#play")
        until(page, "!state.playing")
        t = view.session.live.t
        page.click("#step")
        until(page, f"state.t > {t!r}")
        assert view.session.live.t == pytest.approx(t + 1 / 30)
        page.click("#reset")
        until(page, "state.t === 0")
        assert differing(first, pixels(page)) == 0
        page.fill("#scale", "0.01")
        page.press("#scale", "Enter")
        until(page, "state.scale === 0.01")


def test_picking_picks(browser, view):
    view.session.live.put([0.3, 0.9], [0.0, 0.0])
    with shown_page(browser, view) as page:
        ready(page)
        pose, box = view.session.live.model.pose("lower", [0.3, 0.9]), page.locator("#figure").bounding_box()
        middle = (pose @ [0.5, 0, 0, 1])[:3].tolist()
        x, y, _ = page.evaluate("p => figure.seen(p)", middle)
        page.mouse.click(box["x"] + x, box["y"] + y)
        until(page, "document.querySelector('#numbers table') !== null")
        assert page.inner_text("#picked_name") == "lower" and page.inner_text("#tree .picked").startswith("lower")
        numbers = page.inner_text("#numbers")
        assert "pin lower on upper" in numbers and f"{pose[0, 3]:.4g}" in numbers.replace("−", "-")
        assert {"M", "P", "D"} <= set(numbers.split())
        x, y, _ = page.evaluate("p => figure.seen(p)", (view.session.live.model.pose("upper", [0.3, 0.9]) @ [0.4, 0, 0, 1])[:3].tolist())
        page.mouse.click(box["x"] + x, box["y"] + y)
        until(page, "document.getElementById('picked_name').textContent === 'upper'")
        page.mouse.click(box["x"] + 10, box["y"] + 60)
        until(page, "document.getElementById('picked_name').textContent === 'no body picked'")
        page.click("#tree button >> nth=1")
        until(page, "document.getElementById('picked_name').textContent === 'lower'")


def test_blocks_follow_the_pose(browser, view):
    with shown_page(browser, view) as page:
        ready(page)
        page.select_option("#letter", "ℳ")
        until(page, "document.getElementById('blocks').onpointermove !== null")
        first = pixels(page, "#blocks")
        page.fill("#u1", "0.1")
        until(page, "Math.abs(state.u[1] - 0.1) < 1e-9")
        page.wait_for_timeout(700)  # blocks are asked for some times a second
        assert differing(first, pixels(page, "#blocks")) > 30
        box = page.locator("#blocks").bounding_box()
        page.mouse.move(box["x"] + 80, box["y"] + 80)  # beside the names of rows and below those of columns
        largest = view.session.live.model.mass_matrix(view.session.live.q)[0, 0]
        name, shown = page.inner_text("#block").rsplit(": ", 1)
        assert name == "upper, upper" and float(shown) == pytest.approx(largest, rel=1e-12)


def test_effects_and_their_parameters(browser, view):
    scene = view.session.live.scene
    with shown_page(browser, view) as page:
        ready(page)
        page.uncheck("#on_gravity")
        until(page, "setup.effects.find(effect => effect.name === 'gravity').on === false")
        assert not scene.is_on("gravity") and page.inner_text("#said") == "damping"
        page.fill("#damping_coefficient", "2.5")
        page.press("#damping_coefficient", "Enter")
        until(page, "setup.effects.find(effect => effect.name === 'damping').fields[0].value === 2.5")
        assert scene.effects["damping"].coefficient == 2.5
        page.fill("#damping_coefficient", "much")
        page.press("#damping_coefficient", "Enter")
        until(page, "document.getElementById('message').textContent !== ''")
        assert scene.effects["damping"].coefficient == 2.5


def test_ghosts_and_arrows(browser, view, tmp_path):
    view.session.live.put([1.0, 2.0], [1.0, -1.0])
    with shown_page(browser, view) as page:
        ready(page)
        first = pixels(page)
        page.check("#velocity")
        until(page, "figure.arrows.length === 2")
        with_velocities = pixels(page)
        assert differing(first, with_velocities) > 60
        page.check("#force")
        until(page, "figure.arrows.length === 4")
        assert "longest velocity" in page.inner_text("#longest") and " N" in page.inner_text("#longest")
        page.select_option("#ghost", "without gravity")
        until(page, "figure.ghosts.length === 1")
        page.click("#step")
        page.click("#step")
        page.uncheck("#velocity")
        page.uncheck("#force")
        until(page, "figure.arrows.length === 0")
        both = pixels(page)
        page.select_option("#ghost", "")
        until(page, "figure.ghosts.length === 0")
        assert differing(both, pixels(page)) > 30
        page.screenshot(path=tmp_path / "ghost.png")


def test_a_loop_follows_its_slider(browser):
    with pc.mechanisms.five_bar().view() as view, shown_page(browser, view) as page:
        ready(page)
        to = float(view.session.live.u[0] - 0.4)
        page.fill("#u0", repr(to))
        until(page, f"Math.abs(state.u[0] - {to!r}) < 1e-9")
        live = view.session.live
        assert np.abs(live.model.loops.residual(live.q)).max() < 1e-10 and "tip" in page.inner_text("#loops")


def test_many_coordinates_are_those_of_the_picked_body(browser):
    with pc.chain(100).view() as view, shown_page(browser, view) as page:
        ready(page)
        assert page.locator(".slider").count() == 0 and "100 coordinates" in page.inner_text("#sliders")
        page.click("#tree button >> nth=41")
        until(page, "document.querySelectorAll('.slider').length === 1")
        assert page.locator("#u41").count() == 1


def test_a_page_left_open_does_not_grow(browser, view):
    """Ten thousand states at once, as an hour or more gives: what is kept of them is bounded, and so are the elements."""
    with shown_page(browser, view) as page:
        ready(page)
        elements = page.evaluate("document.querySelectorAll('*').length")
        page.evaluate("for (let i = 1; i <= 10000; i++) { const now = { ...state, t: state.t + 0.033 }; kept.push(now); state = now;"
                      " if (kept.length > KEPT) show(now); }")  # fmt: skip
        assert page.evaluate("kept.length") <= page.evaluate("KEPT")
        assert page.evaluate("kept.every((entry, i) => i === 0 || entry.t > kept[i - 1].t)")
        assert page.evaluate("kept[0].t") < 0.1  # the whole time is in view
        assert page.evaluate("document.querySelectorAll('*').length") == elements


def test_the_page_says_that_the_viewer_is_gone(browser):
    view = pc.chain(2).view()
    page = browser.new_page()
    page.goto(view.address)
    ready(page)
    view.close()
    until(page, "document.getElementById('message').textContent.includes('was closed')")
    page.close()


def test_a_notebook_shows_it_in_its_cell(browser, view, tmp_path):
    """The frame that a notebook has in a cell, here in a page of another local server's origin."""
    from http.server import BaseHTTPRequestHandler, HTTPServer
    from threading import Thread

    class Notebook(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(view._repr_html_().encode() if self.path == "/" else b"")

        def log_message(self, *_):
            pass

    server = HTTPServer(("127.0.0.1", 0), Notebook)
    Thread(target=server.serve_forever, daemon=True).start()
    page = browser.new_page()
    page.goto(f"http://localhost:{server.server_address[1]}/")
    frame = page.frame(url=view.address)
    began = time.monotonic()
    while not frame.evaluate("typeof state !== 'undefined' && state !== null") and time.monotonic() - began < 10:
        page.wait_for_timeout(50)
    frame.click("#step")
    page.wait_for_timeout(500)
    assert view.session.live.t == pytest.approx(1 / 30)
    page.close()
    server.shutdown()
    server.server_close()


def test_bodies_are_coloured_by_their_shares(browser, view):
    with shown_page(browser, view) as page:
        ready(page)
        first = pixels(page)
        page.select_option("#shade", "shares")
        until(page, "figure.shade !== null")
        shares = view.session.live.model.dof_shares(view.session.live.q)
        assert page.evaluate("figure.shade.values") == pytest.approx(list(shares.values))
        assert (
            page.evaluate("figure.shade.label") == "degrees of freedom by body, tr Υ(k)M(k): 2 of N = 2"
            and differing(first, pixels(page)) > MOVED
        )
        colours = page.evaluate("[0, 1].map((k) => figure.shadeOf(k))")
        assert len(set(colours)) == 2 and colours[int(np.argmax(shares.values))] == "rgb(189, 223, 38)"
        page.select_option("#shade", "")
        until(page, "figure.shade === null")
        assert differing(first, pixels(page)) == 0


def test_limits_and_the_frame_of_what_is_picked(browser):
    arm = pc.robots.panda()
    with arm.view() as view, shown_page(browser, view) as page:
        ready(page)
        assert page.inner_text(".slider span >> nth=0") == "panda_joint1"
        low, high = (float(page.inner_text(f".slider small >> nth={i}")) for i in (0, 1))
        assert [low, high] == pytest.approx([float(page.get_attribute("#u0", end)) for end in ("min", "max")], rel=5e-3)
        without = pixels(page)
        page.click("#tree button >> nth=3")
        until(page, "figure.chosen === 3")
        tips = page.evaluate("[0, 1, 2].map((i) => figure.seen(placed(figure.poses, 3, [0, 1, 2].map((j) => (i === j ? 0.05 : 0)))))")
        picture = pixels(page)
        for (x, y, _), colour in zip(tips, ([213, 94, 0], [0, 158, 115], [0, 114, 178]), strict=True):
            near = picture[int(y) - 3 : int(y) + 4, int(x) - 3 : int(x) + 4]
            assert (np.abs(near - np.array(colour) / 255).max(axis=-1) < 0.1).any()  # x, y and z of its frame in their colours
        assert differing(without, picture) > 60


def test_a_limit_that_is_crossed_is_marked(browser):
    """At its slider, in the heading and in the figure; what no limit holds is not, and the mark goes with the reason."""
    model = pc.Multibody("arm")
    rod = dict(mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0.01, 0.1, 0.1]), hinge="pin", axis=(0, 1, 0))
    model.add_body("upper", **rod, limits=(-1.0, 0.5))
    model.add_body("lower", parent="upper", position=(1, 0, 0), **rod)
    with model.view() as view, shown_page(browser, view) as page:
        ready(page)
        assert page.inner_text("#beyond") == "" and page.locator(".slider.beyond").count() == 0
        before = pixels(page)
        view.session.do("move", coordinate=1, to=3.0)
        until(page, "state.u[1] === 3")
        assert page.inner_text("#beyond") == ""
        view.session.do("move", coordinate=1, to=0.0)
        view.session.do("move", coordinate=0, to=0.5)
        until(page, "state.u[0] === 0.5")
        assert page.inner_text("#beyond") == ""  # at it is not beyond it
        view.session.do("move", coordinate=0, to=0.7)
        until(page, "figure.beyond.size === 1")
        assert page.inner_text("#beyond") == "beyond limits: upper" and page.evaluate("[...figure.beyond]") == [0]
        assert page.inner_text(".slider.beyond span") == "upper" and page.inner_text("small.crossed") == "0.5"
        red = np.array([208, 0, 0]) / 255
        assert (np.abs(pixels(page) - red).max(axis=-1) < 0.05).sum() > 30 > (np.abs(before - red).max(axis=-1) < 0.05).sum()
        view.session.do("move", coordinate=0, to=-2.0)
        until(page, "state.u[0] === -2")
        assert page.inner_text("small.crossed") == "-1"


def test_shapes_come_first_and_sticks_when_asked_for(browser):
    with pc.robots.panda().view() as view, shown_page(browser, view) as page:
        ready(page)
        assert page.is_checked("#solid") and not page.is_checked("#sticks")
        assert page.evaluate("figure.items.every((item) => figure.beyond.has(item.body))")  # every body of it has a shape
        clad = pixels(page)
        page.check("#sticks")
        assert page.evaluate("figure.items.length") > 7 and differing(clad, pixels(page)) > MOVED
        page.uncheck("#sticks")
        assert differing(clad, pixels(page)) == 0
        page.uncheck("#solid")
        assert page.evaluate("figure.items.length") > 7  # nothing would be seen else
    with pc.chain(2).view() as view, shown_page(browser, view) as page:
        ready(page)
        assert page.locator("#sticks").count() == 0 and page.evaluate("figure.items.length") > 2


def test_the_wheel_zooms_at_the_pointer(browser):
    with pc.robots.panda().view() as view, shown_page(browser, view) as page:
        ready(page)
        box = page.locator("#figure").bounding_box()
        x, y = 0.3 * box["width"], 0.6 * box["height"]
        there, scale = page.evaluate("([x, y]) => [figure.unseen(x, y, 0.1), figure.scale]", [x, y])
        assert page.evaluate("p => figure.seen(p)", there) == pytest.approx([x, y, 0.1], abs=1e-6)
        page.mouse.move(box["x"] + x, box["y"] + y)
        page.mouse.wheel(0, -500)
        until(page, f"figure.scale > 1.5 * {scale!r}")
        assert page.evaluate("p => figure.seen(p)", there)[:2] == pytest.approx([x, y], abs=1.0)  # a pixel: places of events are whole
        for _ in range(40):
            page.mouse.wheel(0, -2000)
        until(page, "figure.zoom === NEAREST")
        page.click("#look")
        assert page.evaluate("figure.zoom") == 1 and page.evaluate("figure.scale") == pytest.approx(scale)


def test_the_camera_follows(browser):
    model = pc.Multibody("thrown")
    model.add_body("box", hinge="free", mass=1.0, inertia=np.eye(3) / 6)
    with pc.Scene(model).view(v=[0, 0, 0, 5.0, 0, 0]) as view, shown_page(browser, view) as page:
        ready(page)
        middle = page.evaluate("figure.seen([0, 0, 0])")
        page.select_option("#follow", "robot")
        view.session.do("scale", to=60)
        page.click("#step")
        until(page, "state.t > 1")
        at = view.session.live.model.pose("box", view.session.live.q)[:3, 3].tolist()
        assert np.linalg.norm(at) > 5
        x, y, _ = page.evaluate("p => figure.seen(p)", at)
        width, height = page.evaluate("[figure.canvas.clientWidth / 2, figure.canvas.clientHeight / 2]")
        assert [x, y] == pytest.approx([width, height], abs=1.0) and middle[:2] != [x, y]
        page.select_option("#follow", "0")
        assert page.evaluate("p => figure.seen(p)", at)[:2] == pytest.approx([width, height], abs=1.0)
        page.select_option("#follow", "")
        assert page.evaluate("p => figure.seen(p)", at)[0] > 2 * width


@pytest.mark.parametrize("name, axes", [("side", ("x", "z")), ("front", ("y", "z")), ("top", ("x", "y"))])
def test_directions_to_look_from(browser, name, axes):
    with pc.robots.panda().view() as view, shown_page(browser, view) as page:
        ready(page)
        page.select_option("#direction", name)
        across, up, _ = page.evaluate("figure.basis()")
        assert across == pytest.approx(np.eye(3)["xyz".index(axes[0])], abs=1e-3)
        assert up == pytest.approx(np.eye(3)["xyz".index(axes[1])], abs=1e-3)
        page.select_option("#direction", "")
        assert page.evaluate("[figure.yaw, figure.pitch]") == [0.6, 0.35]


def grabbed(page, body, place):
    """Where a place of a body is on the screen."""
    box = page.locator("#figure").bounding_box()
    x, y, _ = page.evaluate("([body, place]) => figure.seen(placed(figure.poses, body, place))", [body, place])
    return box["x"] + x, box["y"] + y


def test_a_body_is_pushed_with_the_mouse(browser, view):
    """Ctrl and drag: the scene plays, the body follows the pointer, and the push ends with the button."""
    view.session.live.put([0.3, 0.9], [0.0, 0.0])
    view.session.do("effect", name="gravity", on=False)
    with shown_page(browser, view) as page:
        ready(page)
        x, y = grabbed(page, 1, [0.5, 0, 0])
        yaw = page.evaluate("figure.yaw")
        page.keyboard.down("Control")
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 40, y - 30, steps=4)
        until(page, "state.playing && state.push !== null && state.t > 0.1")
        assert view.session.live.acting is not view.session.live.scene and page.evaluate("figure.yaw") == yaw
        assert "push: " in page.inner_text("#longest") and page.evaluate("state.u[0] !== 0.3")
        page.mouse.up()
        page.keyboard.up("Control")
        until(page, "state.push === null")
        assert view.session.live.acting is view.session.live.scene and page.inner_text("#picked_name") == "lower"


def test_a_body_is_led_with_the_mouse(browser):
    arm = pc.robots.panda()
    q = np.array([0, 0.3, 0, -1.5, 0, 1.8, 0])
    with pc.Scene(arm).view(q=q) as view, shown_page(browser, view) as page:
        ready(page)
        page.select_option("#hand", "lead")
        x, y = grabbed(page, 6, [0, 0, 0])
        before = arm.pose("panda_link7", q)[:3, 3]
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 30, y + 25, steps=5)
        until(page, "hands.sent === null && state.u[1] !== 0.3")
        page.wait_for_timeout(300)
        page.mouse.up()
        after = arm.pose("panda_link7", view.session.live.q)[:3, 3]
        scale, (across, up, _) = page.evaluate("[figure.scale, figure.basis()]")
        moved = np.array([np.dot(after - before, across), -np.dot(after - before, up)]) * scale
        assert moved == pytest.approx([30, 25], abs=12)  # the hand is turned as well: the place that is held is not its origin
        assert not view.session.live.v.any() and not view.session.playing


def test_what_is_seen_is_saved(browser, view, tmp_path):
    with shown_page(browser, view) as page:
        ready(page)
        with page.expect_download() as download:
            page.click("#picture")
        assert download.value.suggested_filename == "double pendulum.png"
        download.value.save_as(tmp_path / "picture.png")
        from matplotlib.image import imread

        picture = imread(tmp_path / "picture.png")
        assert (picture[..., 3] == 1).all() and picture[..., :3].std() > 0.01  # no hole where the page was
        page.click("#record")
        assert page.inner_text("#record") == "stop"
        page.click("#play")
        until(page, "state.t > 0.5")
        with page.expect_download() as download:
            page.click("#record")
        download.value.save_as(tmp_path / "film.webm")
        film = (tmp_path / "film.webm").read_bytes()
        assert film[:4] == b"\x1a\x45\xdf\xa3" and len(film) > 2000  # EBML, which WebM is
        until(page, "document.getElementById('record').textContent === 'record'")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_a_phone_has_one_column(browser, dark):
    """The controls of playback are below the figure, nothing overlaps, nothing is wider than the screen."""
    with pc.robots.panda().view() as view, opened(browser, view.address, size=(390, 844), dark=dark) as page:
        ready(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        parts = ["header", "#figure", ".bar >> nth=0", "#camera", "#left", "#plots"]
        boxes = [page.locator(part).first.bounding_box() for part in parts]
        for above, below in zip(boxes, boxes[1:], strict=False):
            assert above["y"] + above["height"] <= below["y"] + 1
        assert boxes[1]["height"] > 0.5 * 844


def test_blocks_have_names_and_units(browser):
    with pc.robots.panda().view() as view, shown_page(browser, view) as page:
        ready(page)
        assert not page.is_visible("#blocks")
        page.select_option("#letter", "ℳ")
        until(page, "document.getElementById('blocks').onpointermove !== null")
        assert page.inner_text("#block") == "largest entry of each block, kg m² and kg by hinge"
        without = page.evaluate("""() => { const { width, height } = document.getElementById('blocks');
            const data = document.getElementById('blocks').getContext('2d').getImageData(0, 0, 60, height).data;
            return data.filter((x, i) => i % 4 === 3 && x > 100).length; }""")
        assert without > 200  # ink of the names on the left
        page.click("#tree button >> nth=3")
        until(page, "document.querySelectorAll('#numbers td').length > 60")
        assert "M (kg m², kg m; kg m, kg)" in page.inner_text("#numbers")
        cut = "[...document.querySelectorAll('#numbers td')].filter((td) => td.scrollWidth > td.clientWidth + 1).length"
        assert page.evaluate(cut) == 0 and page.evaluate(
            "document.getElementById('numbers').scrollWidth <= document.getElementById('numbers').clientWidth"
        )


def test_what_acts_on_all_says_so(view):
    fields = {effect["name"]: effect["fields"] for effect in view.session.setup()["effects"]}
    assert {"name": "hinges", "text": "all hinges"} in fields["damping"]
    assert all("None" not in field.get("text", "") for own in fields.values() for field in own)


def test_code_turns_the_camera(browser):
    arm = pc.robots.panda()
    with arm.view() as view, shown_page(browser, view) as page:
        ready(page)
        assert view.look("front", follow=arm.bodies["panda_link7"], zoom=2.0) is view
        until(page, "figure.zoom === 2")
        x, y, _ = page.evaluate("figure.seen(placed(figure.poses, 6, [0, 0, 0]))")
        width, height = page.evaluate("[figure.canvas.clientWidth / 2, figure.canvas.clientHeight / 2]")
        assert [x, y] == pytest.approx([width, height], abs=1.0) and page.input_value("#direction") == "front"
        page.click("#look")  # whoever looks moves it, and it stays moved
        view.label("a", (0, 0, 0))
        until(page, "figure.extras.length === 1")
        assert page.evaluate("figure.zoom") == 1
        with shown_page(browser, view) as another:
            ready(another)
            assert another.evaluate("[figure.zoom, figure.follow]") == [2, "6"]
        for wrong, words in ((("moon",), "choose from 'from above'"), (("top", "moon"), "'robot', a body of 'panda'")):
            with pytest.raises(pc.Error, match=words):
                view.look(*wrong)
        with pytest.raises(pc.EvaluationError, match="zoom=0"):
            view.look(zoom=0)
    from pycraft.viewer.session import DIRECTIONS

    with pc.chain(1).view() as view, shown_page(browser, view) as page:
        assert page.evaluate("Object.keys(VIEWS)") == list(DIRECTIONS)
