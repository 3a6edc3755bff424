"""The viewer's page and data over HTTP, by default for this machine only, and always for the page's own origin only.

Sources: W3C, Fetch Metadata Request Headers; RFC 6454 (origins). The name in `Host` is also checked: a foreign name that resolves to this
machine would turn a foreign page's origin into the server's own (DNS rebinding).
"""

from __future__ import annotations

import json
import socket
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

from .. import _core
from .session import Session

LONGEST = 65536
"""Largest size, bytes, of a request's body."""
LOCAL = ("127.0.0.1", "localhost", "::1")
FRAMES = "frame-ancestors 'self' http://localhost:* http://127.0.0.1:* vscode-webview:"
"""Pages that may embed the viewer: notebooks of this machine."""


class ViewServer(ThreadingHTTPServer):
    """Serve one session at an address; `start` returns at once.

    Raises
    ------
    EvaluationError
        The port is taken, or the host is not an address of this machine; the message gives the remedy.
    """

    daemon_threads = True
    request_queue_size = 32

    def __init__(self, session: Session, page: str, host: str, port: int):
        self.session, self.page, self.given_host, self.ended = session, page.encode(), host, False
        if ":" in host:
            self.address_family = socket.AF_INET6
        try:
            super().__init__((host, port), _Handler)
        except OSError as error:
            raise _core.EvaluationError(
                f"the viewer cannot use {host} port {port}: {error.strerror or error}; port=0 picks a free port"
            ) from None
        self._thread = threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.1}, name="pycraft viewer, pages", daemon=True)

    @property
    def address(self) -> str:
        """Address to open in a browser."""
        name = self.given_host if self.given_host not in ("0.0.0.0", "::") else "localhost"
        return f"http://{f'[{name}]' if ':' in name else name}:{self.server_address[1]}/"

    @property
    def is_local(self) -> bool:
        """True if only this machine can reach the server."""
        return self.given_host in LOCAL

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Stop serving. Open pages get no notice."""
        self.ended = True
        self.shutdown()
        self.server_close()
        self.session.close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore connections that a page closed during the answer."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    timeout = 60
    disable_nagle_algorithm = True  # and answers in one piece: otherwise each waits 40 ms for an acknowledgement
    wbufsize = -1
    server: ViewServer

    def do_GET(self) -> None:
        """Answer with the page or with its data."""
        if not self._is_own():
            return
        url = urlsplit(self.path)
        given = {key: values[-1] for key, values in parse_qs(url.query).items()}
        session = self.server.session
        if url.path == "/":
            return self._answer(200, self.server.page, "text/html; charset=utf-8")
        answers = {
            "/setup": session.setup,
            "/state": lambda: session.state(tuple(given.get("arrows", "").split(",")), given.get("shade", "")),
            "/body": lambda: session.body(given.get("name", "")),
            "/blocks": lambda: session.blocks(given.get("of", "")),
        }
        if url.path not in answers:
            return self._refuse(404, f"the viewer has no page {url.path}")
        self._told(answers[url.path])

    def do_POST(self) -> None:
        """An action."""
        if not self._is_own():
            return
        length = self.headers.get("Content-Length", "")
        if urlsplit(self.path).path != "/do" or not length.isdecimal() or int(length) > LONGEST:
            self.close_connection = True
            return self._refuse(400, f"post an action to /do, in at most {LONGEST} bytes")
        text = self.rfile.read(int(length))
        try:
            given = json.loads(text)
            action = given.pop("action")
        except (ValueError, KeyError, AttributeError, TypeError):
            return self._refuse(400, 'an action must be JSON, such as {"action": "play"}')

        def done() -> dict[str, Any]:
            self.server.session.do(action, **given)
            return {}

        self._told(done)

    def _told(self, answer: Any) -> None:
        try:
            self._answer(200, json.dumps(answer(), allow_nan=False).encode(), "application/json")
        except (_core.Error, ArithmeticError, KeyError) as error:
            self._refuse(
                200, str(error.args[0] if isinstance(error, KeyError) else error)
            )  # status 200: the browser should not report an error

    def _is_own(self) -> bool:
        """Return whether the request comes from a page of this server; other requests are refused before they act."""
        if self.server.ended:
            self.close_connection = True
            return False
        host = urlsplit("//" + self.headers.get("Host", ""))
        origin = self.headers.get("Origin")
        try:
            known = host.hostname in LOCAL if self.server.is_local else bool(host.hostname)
            known = known and (host.port or 80) == self.server.server_address[1]
        except ValueError:
            known = False
        foreign = origin is not None and urlsplit(origin).netloc != self.headers.get("Host")
        embedded = self.headers.get("Sec-Fetch-Site") in ("cross-site", "same-site") and self.headers.get("Sec-Fetch-Mode") != "navigate"
        if known and not foreign and not embedded:
            return True
        self.close_connection = True
        self._refuse(403, "this viewer answers only its own page")
        return False

    def _refuse(self, status: int, why: str) -> None:
        self._answer(status, json.dumps({"error": why}).encode(), "application/json")

    def _answer(self, status: int, body: bytes, kind: str) -> None:
        self.send_response(status)
        headers = {
            "Content-Type": kind, "Content-Length": str(len(body)), "Cache-Control": "no-store", "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer", "Cross-Origin-Resource-Policy": "same-origin", "Content-Security-Policy": FRAMES,
        }  # fmt: skip
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: Any) -> None:
        """Log no requests."""
