"""The viewer's server: its own page alone is answered, on this machine alone unless told otherwise, and bad requests change nothing."""

import http.client
import json
import socket
from urllib.parse import urlsplit

import numpy as np
import pytest

import pycraft as pc
from pycraft.viewer import View


@pytest.fixture(scope="module")
def view():
    with pc.mechanisms.double_pendulum().add(pc.effects.Damping(0.1)).view(q=[1.0, 2.0]) as shown:
        yield shown


def asked(view, method, path, body=None, headers=None):
    """Status and answer, with the headers that are given beside Host."""
    address = urlsplit(view.address)
    connection = http.client.HTTPConnection(address.hostname, address.port, timeout=20)
    try:
        connection.request(method, path, body, headers or {})
        answer = connection.getresponse()
        return answer.status, answer.read().decode(), dict(answer.getheaders())
    finally:
        connection.close()


def test_what_it_says(view):
    assert isinstance(view, View) and view.address.startswith("http://127.0.0.1:") and view.is_local
    assert repr(view) == f"<view of 'double pendulum' at {view.address} (this machine only)>"
    assert f'<iframe src="{view.address}"' in view._repr_html_()
    status, page, headers = asked(view, "GET", "/")
    assert (
        status == 200
        and page.startswith("<!DOCTYPE html>")
        and "connect-src 'self'" in page
        and "http" not in page.replace("http-equiv", "")
    )
    assert headers["Cache-Control"] == "no-store" and "frame-ancestors 'self'" in headers["Content-Security-Policy"]


def test_only_this_machine_reaches_it(view):
    """It listens at the loopback alone: another address of this machine is refused."""
    assert view._server.socket.getsockname()[0] == "127.0.0.1"
    with pytest.raises(OSError), socket.create_connection(("127.0.0.2", view._server.server_address[1]), timeout=2):
        pass


def test_answers(view):
    port = view._server.server_address[1]
    state = json.loads(asked(view, "GET", "/state?arrows=velocity")[1])
    assert state["u"] == [1.0, 2.0] and list(state["arrows"]) == ["velocity"]
    assert json.loads(asked(view, "GET", "/setup")[1])["figure"]["bodies"] == ["upper", "lower"]
    assert json.loads(asked(view, "GET", "/body?name=upper")[1])["hinge"] == "upper"
    assert json.loads(asked(view, "GET", "/blocks?of=D")[1])["rows"] == ["upper", "lower"]
    own = {"Origin": f"http://127.0.0.1:{port}", "Sec-Fetch-Site": "same-origin"}
    assert asked(view, "POST", "/do", '{"action": "move", "coordinate": 0, "to": 0.5}', own)[0] == 200
    assert view.session.live.u[0] == pytest.approx(0.5)
    assert asked(view, "POST", "/do", '{"action": "reset"}', own)[0] == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Host": "evil.example"},
        {"Host": "evil.example:PORT"},
        {"Host": "127.0.0.1:1"},
        {"Host": "127.0.0.1:x"},
        {"Host": ""},
        {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"},
        {"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "cors"},
    ],
    ids=lambda headers: " ".join(f"{name}={value}" for name, value in headers.items()),
)
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_foreign_pages_are_refused(view, headers, method):
    port = view._server.server_address[1]
    before = view.session.live.q.copy()
    given = {name: value.replace("PORT", str(port)) for name, value in headers.items()}
    path, body = ("/state", None) if method == "GET" else ("/do", '{"action": "random"}')
    status, told, sent = asked(view, method, path, body, given)
    assert status == 403 and json.loads(told) == {"error": "this viewer answers only its own page"}
    assert not any(name.lower().startswith("access-control") for name in sent)
    np.testing.assert_array_equal(view.session.live.q, before)


def test_a_link_from_elsewhere_opens_it(view):
    """The page, which changes nothing; a notebook's frame does so."""
    assert asked(view, "GET", "/", None, {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"})[0] == 200


@pytest.mark.parametrize(
    "body", ["", "[]", "{}", "3", "no json", '{"action": 3}', '{"action": "move", "coordinate": "a", "to": 1}', "x" * 70000]
)
def test_bad_actions(view, body):
    before = view.session.live.q.copy()
    status, told, _ = asked(view, "POST", "/do", body)
    assert status in (200, 400) and json.loads(told)["error"]
    np.testing.assert_array_equal(view.session.live.q, before)


def test_other_paths(view):
    assert asked(view, "GET", "/etc/passwd")[0] == 404 and asked(view, "POST", "/state", "{}")[0] == 400
    for path in ("/body?name=hand", "/body", "/blocks?of=Z"):
        assert "error" in json.loads(asked(view, "GET", path)[1])


def test_other_machines_where_it_is_told_to():
    with pytest.warns(UserWarning, match="open to other machines"), pc.chain(1).view(host="0.0.0.0") as shown:
        assert not shown.is_local and shown.address.startswith("http://localhost:")
        assert asked(shown, "GET", "/state", None, {"Host": f"robot.lab:{shown._server.server_address[1]}"})[0] == 200
        assert asked(shown, "GET", "/state", None, {"Origin": "http://evil.example"})[0] == 403


def test_it_ends():
    view = pc.chain(1).view()
    threads = view.session._thread, view._server._thread
    view.close()
    view.close()
    assert repr(view) == "<view of 'chain of 1 rods', closed>" and "iframe" not in view._repr_html_()
    assert not any(thread.is_alive() for thread in threads)
    with pytest.raises(OSError):
        asked(view, "GET", "/")


def test_refusals(view):
    model = pc.chain(1)
    taken = view._server.server_address[1]
    for options, words in (
        ({"port": taken}, f"port {taken}: .*port=0 picks a free port"),
        ({"port": 70000}, "port=70000: give a port from 1 to 65535"),
        ({"host": "256.0.0.1"}, "cannot use 256.0.0.1"),
    ):
        with pytest.raises(pc.EvaluationError, match=words):
            model.view(**options)
    with pytest.raises(pc.ModelError):
        model.view(q=[1.0, 2.0])
    with pytest.raises(pc.ModelError, match="beside takes a second scene, not 3"):
        pc.Scene(model).view(beside=3)


def test_a_model_is_under_its_own_gravity():
    heavy = pc.chain(2)
    heavy.gravity = (0, 0, -1.62)
    with heavy.view() as with_gravity, pc.chain(2).view() as without:
        assert list(with_gravity.session.live.scene.effects) == ["gravity"] and list(without.session.live.scene.effects) == []
