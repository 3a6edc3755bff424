"""A page that is left open, at an accelerated rate: what browser and server keep does not grow; and ghosts of two scenes over time."""

import gc
import http.client
import json
import tracemalloc
from urllib.parse import urlsplit

import numpy as np
import pytest

import pycraft as pc
from support.browser import opened, until

ROUNDS, EACH = 4, 250
"""Real refreshes of the page: with 250 between two looks its garbage is collected at least once."""
GROWTH = 1.0
"""MB that the used heap may differ by: the plots' 600 states of a hundred numbers each are less, and are there from the first round on."""


def used_heap(page):
    """MB in use after the garbage was collected, by the DevTools protocol."""
    tools = page.context.new_cdp_session(page)
    tools.send("HeapProfiler.collectGarbage")
    return tools.send("Runtime.getHeapUsage")["usedSize"] / 1e6


def test_a_page_left_open_does_not_grow(browser):
    """More than a thousand refreshes in a row, each of a state of its own, with arrows, a picked body, blocks, colours and a ghost."""
    scene = pc.mechanisms.double_pendulum().add(pc.effects.Damping(0.01))
    with scene.view(q=[1.0, 2.0]) as view, opened(browser, view.address, size=(1280, 760)) as page:
        until(page, "state !== null")
        page.check("#velocity")
        page.select_option("#letter", "ℳ")
        page.select_option("#shade", "shares")
        page.click("#tree button >> nth=1")
        page.select_option("#ghost", "without damping")
        heaps, elements = [], []
        for _ in range(ROUNDS + 1):
            page.evaluate(
                """async (n) => {
                    for (let i = 0; i < n; i++) {
                        looked = 0;
                        while (busy) await new Promise((done) => setTimeout(done, 1));
                        await act("step");
                    }
                }""",
                EACH,
            )
            heaps.append(used_heap(page))
            elements.append(page.evaluate("document.querySelectorAll('*').length"))
        assert view.session.live.t > 0.9 * (ROUNDS + 1) * EACH / 30
        assert page.evaluate("kept.length <= KEPT && kept[0].t < 1 && figure.arrows.length === 2")
    # The first rounds fill what is bounded (600 states of the plots); after them nothing is added.
    assert max(heaps[3:]) - heaps[2] < GROWTH, heaps
    assert len(set(elements)) == 1, elements


def test_the_server_does_not_grow():
    """Send the requests and actions of a page, over HTTP and without a browser in this process: a round leaves nothing behind."""
    scene = pc.mechanisms.double_pendulum().add(pc.effects.Damping(0.01))
    with scene.view(q=[1.0, 2.0]) as view:
        address = urlsplit(view.address)
        connection = http.client.HTTPConnection(address.hostname, address.port, timeout=20)
        view.session.do("ghost", name="without damping")

        def refreshed(times):
            for _ in range(times):
                connection.request("POST", "/do", json.dumps({"action": "step"}))
                connection.getresponse().read()
                for path in ("/state?arrows=velocity,force&shade=shares", "/body?name=lower", "/blocks?of=D"):
                    connection.request("GET", path)
                    assert "error" not in json.loads(connection.getresponse().read())

        kept = []
        tracemalloc.start()
        try:
            for _ in range(5):
                refreshed(100)
                gc.collect()
                kept.append(tracemalloc.get_traced_memory()[0])
        finally:
            tracemalloc.stop()
            connection.close()
        # Pools that fill slow down (70 bytes a refresh in the fifth round); a state that were kept is some hundreds, an answer thousands.
        assert (kept[-1] - kept[-2]) / 100 < 150, kept


def test_augmented_and_embedded_loops_are_each_others_ghost():
    """The same linkage kept both ways, side by side: by the integrator's tolerance the ghost is where the figure is."""
    scene, other = pc.mechanisms.bricard("augment"), pc.mechanisms.bricard("embed")
    with scene.view(beside=other) as view:
        session = view.session
        assert session.setup()["ghost_name"] == "beside" and session.setup()["ghosts"][0] == "beside"
        for _ in range(15):
            session.do("step")
        ghost, live = session.ghost, session.live
        assert live.t == pytest.approx(0.5) and ghost.t == live.t and np.abs(live.u).max() > 1e-3
        # rtol 1e-7 of coordinates of order one, along half a second in pieces of a thirtieth, on motions that keep apart slowly.
        np.testing.assert_allclose(ghost.poses(), live.poses(), atol=1e-4)
        session.do("effect", name=next(n for n in session.live.scene.effects if "gravity" in n), on=False)
        for _ in range(10):
            session.do("step")
        assert np.abs(ghost.poses() - live.poses()).max() > 1e-3


def test_a_ghost_without_an_effect_parts_from_the_figure(browser):
    scene = pc.mechanisms.double_pendulum().add(pc.effects.Damping(2.0))
    with scene.view(q=[1.0, 2.0]) as view, opened(browser, view.address, size=(1280, 760)) as page:
        until(page, "state !== null")
        page.select_option("#ghost", "without damping")
        until(page, "figure.ghosts.length === 1 && figure.ghosts[0].poses.length === 24")
        apart = "Math.max(...figure.ghosts[0].poses.map((x, i) => Math.abs(x - figure.poses[i])))"
        assert page.evaluate(apart) == 0
        page.click("#play")
        until(page, "state.t > 0.5")
        page.click("#play")
        until(page, "!state.playing")
        alone = pc.mechanisms.double_pendulum().simulate(view.session.live.t, q=[1.0, 2.0])
        # The ghost is the motion without damping, by tolerances of 1e-7 and single precision.
        np.testing.assert_allclose(view.session.ghost.q, alone.q[-1], atol=1e-4)
        assert page.evaluate(apart) > 0.02
