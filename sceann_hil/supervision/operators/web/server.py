"""The panel's HTTP server: Tornado, with a `Lobby` in front of it and four addresses behind.

Tornado, because it is one package without dependencies of its own, with wheels for arm64, and limits what a client may
cost: size of headers and body, and the time for each. It lets us see a connection before anything is read from it,
which is where the lobby decides. (uvicorn and aiohttp set no limit to the time for the first header, hypercorn brings
four packages.)

``GET /`` is the page (`panel.css` and `panel.js` belong to it), ``GET /events`` the desk's view as server-sent events,
``GET /pose.svg`` the start pose, ``POST /press`` says something, and ``GET /alive`` keeps a connection open for the
next press.
"""

from __future__ import annotations

import asyncio
import json
import logging
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from importlib.resources import files
from typing import Any, NoReturn

from tornado.http1connection import HTTP1Connection, HTTP1ServerConnection
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPConnection, HTTPMessageDelegate
from tornado.iostream import IOStream, StreamClosedError
from tornado.web import Application, Finish, HTTPError, RequestHandler

from sceann_hil.supervision.operators.messages import Receipt
from sceann_hil.supervision.operators.verbs import Verb
from sceann_hil.supervision.operators.web.access import Access
from sceann_hil.supervision.operators.web.gate import (
    MOST_FRIENDS,
    MOST_STRANGERS,
    PATIENCE_S,
    Crowd,
    Lobby,
    share_of_files,
)

ALIVE_S = 1.0
"""A connected page is told so often that it is; silence for three times as long and it shows that the run is gone."""
LONGEST_BODY = 10_000
LONGEST_HEADER = 8_192
BODY_S = 5.0
IDLE_S = 600.0
"""How long the connection of somebody who has the token may be silent; all others have `PATIENCE_S`."""
DEAF_S = 10.0
"""A page that takes nothing for so long is gone."""
SWEEP_S = 0.5
_FILES = {"/": "text/html", "/panel.css": "text/css", "/panel.js": "text/javascript"}
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_AGAIN = '<!doctype html><meta http-equiv="refresh" content="0"><p>One moment...</p>'
_NO_TOKEN = "Open the whole link that the run printed: its token is missing or wrong."

logging.getLogger("tornado.general").addHandler(logging.NullHandler())


class Feed:
    """The newest document for all pages. Used in the server's thread only."""

    def __init__(self) -> None:
        self.text = "{}"
        self.over = False
        self.changed = asyncio.Event()

    def put(self, text: str, *, last: bool = False) -> None:
        """A newer document; after the last one no page waits for more."""
        self.text = text
        self.over = last
        self.changed.set()
        self.changed = asyncio.Event()


@dataclass(frozen=True, slots=True)
class Behind:
    """What the server's answers are made of.

    Attributes:
        access: who may ask.
        press: says something to the desk; may take its time, so it is called in threads of its own.
        pose: the picture of the start pose, SVG.
        seen: told when somebody with the token is there.
        feed: what pages show.
    """

    access: Access
    press: Callable[[Verb, int | None, str], Receipt]
    pose: Callable[[], str]
    seen: Callable[[], object]
    feed: Feed


class PanelServer(HTTPServer):
    """Make and use it in the thread of its event loop: `lobby` takes connections from there on."""

    lobby: Lobby
    strangers: Crowd[IOStream]
    friends: Crowd[IOStream]
    answered: set[IOStream]
    """Strangers that had their answer: one each, whatever else they have sent already."""

    @classmethod
    def answering(cls, behind: Behind, listening: Sequence[socket.socket]) -> PanelServer:
        """The server for one panel.

        Args:
            behind: what its answers are made of.
            listening: sockets; they are closed by `stop`.
        """
        pages = [(path.replace(".", r"\."), _Page) for path in _FILES]
        others = [(r"/events", _Events), (r"/pose\.svg", _Pose), (r"/press", _Press), (r"/alive", _Alive)]
        rules: Any = [*pages, *others]
        application = Application(rules, default_handler_class=_Nowhere, log_function=lambda _: None, behind=behind)
        server = cls(
            application,
            max_header_size=LONGEST_HEADER,
            max_body_size=LONGEST_BODY,
            body_timeout=BODY_S,
            idle_connection_timeout=IDLE_S,
        )
        application.settings["server"] = server
        server.strangers = Crowd(share_of_files(MOST_STRANGERS), IOStream.close)
        server.friends = Crowd(share_of_files(MOST_FRIENDS), IOStream.close)
        server.answered = set()
        server.lobby = Lobby(listening, behind.access.token.encode(), server._admit)
        return server

    def _admit(self, connection: socket.socket, address: Any, has_token: bool) -> None:
        stream = IOStream(connection, max_buffer_size=2 * (LONGEST_HEADER + LONGEST_BODY))
        if not has_token:
            self.strangers.add(stream, str(address[0]))
        self.handle_stream(stream, address)

    def trust(self, stream: IOStream) -> None:
        """A connection's request had the right token."""
        self.strangers.discard(stream)
        self.friends.discard(stream)
        self.friends.add(stream)

    def distrust(self, stream: IOStream) -> None:
        """A connection's request had none, though it seemed to have."""
        if stream not in self.friends:
            self.strangers.add(stream)

    def start_request(self, server_conn: object, request_conn: HTTPConnection) -> HTTPMessageDelegate:
        if isinstance(server_conn, HTTP1ServerConnection) and server_conn.stream in self.answered:
            return _NoMore(request_conn)
        return super().start_request(server_conn, request_conn)

    def on_close(self, server_conn: object) -> None:
        if isinstance(server_conn, HTTP1ServerConnection):
            self.answered.discard(server_conn.stream)
            self.strangers.discard(server_conn.stream)
            self.friends.discard(server_conn.stream)
        super().on_close(server_conn)

    async def keep_order(self) -> None:
        """Turns out who stays too long, until it is cancelled."""
        while True:
            await asyncio.sleep(SWEEP_S)
            self.lobby.sweep()
            self.strangers.sweep(PATIENCE_S)

    def stop(self) -> None:
        self.lobby.stop()
        super().stop()


class _NoMore(HTTPMessageDelegate):
    """Takes no further request from a connection."""

    def __init__(self, connection: HTTPConnection) -> None:
        self._connection = connection

    def headers_received(self, start_line: object, headers: object) -> None:
        if isinstance(self._connection, HTTP1Connection):
            self._connection.detach()


class Refusal(HTTPError):
    """An answer other than yes, with a sentence of ours for the person who asked."""

    def __init__(self, status: HTTPStatus, why: str) -> None:
        super().__init__(status)
        self.why = why


class _Handler(RequestHandler):
    """Knows who asks before anything else happens."""

    @property
    def behind(self) -> Behind:
        behind: Behind = self.settings["behind"]
        return behind

    @property
    def server(self) -> PanelServer:
        server: PanelServer = self.settings["server"]
        return server

    @property
    def stream(self) -> IOStream:
        connection = self.request.connection
        if not isinstance(connection, HTTP1Connection):
            raise TypeError(f"connection: expected HTTP/1, got {type(connection).__name__}")
        return connection.stream

    def set_default_headers(self) -> None:
        self.clear_header("Server")
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        access, headers = self.behind.access, self.request.headers
        if not access.is_our_host(headers.get("Host", "")):
            self._turn_away("This panel has another address: open the link that the run printed.")
        if self._takes_token():
            return
        if not access.is_token(self.get_cookie(access.cookie) or ""):
            if self.request.path == "/" and headers.get("Sec-Fetch-Site") == "cross-site":
                # a link followed from another site comes without its cookie; asked for by a page of ours, with it
                self.set_status(HTTPStatus.FORBIDDEN)
                self.set_header("Content-Type", "text/html; charset=utf-8")
                raise Finish(_AGAIN)
            self._turn_away(_NO_TOKEN)
        self.server.trust(self.stream)
        asks_only = self.request.method in ("GET", "HEAD")
        site = None if asks_only and self.request.path == "/" else headers.get("Sec-Fetch-Site")
        if not access.is_our_page(headers.get("Origin"), site, headers.get("Host", "")):
            raise Refusal(HTTPStatus.FORBIDDEN, "this page may not press buttons here")
        self.behind.seen()

    def _takes_token(self) -> bool:
        """Whether this is the first visit, with the token in the link."""
        return False

    def _turn_away(self, why: str) -> NoReturn:
        self.server.distrust(self.stream)
        self.set_header("Connection", "close")
        raise Refusal(HTTPStatus.FORBIDDEN, why)

    def write_error(self, status_code: int, **kwargs: Any) -> None:
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        error = kwargs.get("exc_info", (None, None))[1]
        stream = self.stream
        said = self.finish(f"{error.why if isinstance(error, Refusal) else HTTPStatus(status_code).phrase}\n")
        if stream not in self.server.friends:
            self.server.answered.add(stream)
            said.add_done_callback(lambda _: stream.close())

    def log_exception(self, kind: Any, error: Any, trace: Any) -> None:
        if not isinstance(error, HTTPError | StreamClosedError):
            super().log_exception(kind, error, trace)

    def answer(self, kind: str, text: str | bytes, status: HTTPStatus = HTTPStatus.OK) -> None:
        """The whole answer."""
        self.set_status(status)
        self.set_header("Content-Type", f"{kind}; charset=utf-8")
        self.finish(text)


class _Page(_Handler):
    def _takes_token(self) -> bool:
        given = self.request.query_arguments.get("t", [b""])[0].decode("latin1")
        return self.request.path == "/" and self.behind.access.is_token(given)

    def get(self) -> None:
        access = self.behind.access
        if self._takes_token():
            # what is set is our own token, never what was sent
            self.server.trust(self.stream)
            self.set_cookie(access.cookie, access.token, path="/", httponly=True, samesite="Strict")
            self.redirect("/", status=HTTPStatus.SEE_OTHER)
            return
        name = "page.html" if self.request.path == "/" else self.request.path[1:]
        text = (files("sceann_hil.supervision.operators.web") / name).read_bytes()
        self.answer(_FILES[self.request.path], text)


class _Pose(_Handler):
    def get(self) -> None:
        self.answer("image/svg+xml", self.behind.pose())


class _Alive(_Handler):
    def get(self) -> None:
        self.set_status(HTTPStatus.NO_CONTENT)


class _Events(_Handler):
    async def get(self) -> None:
        self.set_header("Content-Type", "text/event-stream")
        feed, shown = self.behind.feed, ""
        try:
            while True:
                changed = feed.changed
                self.write(f"data: {feed.text}\n\n" if feed.text != shown else "event: alive\ndata:\n\n")
                shown = feed.text
                await asyncio.wait_for(self.flush(), DEAF_S)
                self.behind.seen()
                if feed.over:
                    return
                try:
                    await asyncio.wait_for(changed.wait(), ALIVE_S)
                except TimeoutError:
                    continue
        except (StreamClosedError, TimeoutError):
            self.stream.close()


class _Press(_Handler):
    async def post(self) -> None:
        kind = self.request.headers.get("Content-Type", "").partition(";")[0].strip().lower()
        if kind != "application/json":
            raise Refusal(HTTPStatus.BAD_REQUEST, "expected JSON at /press")
        try:
            verb, question, text = _said(self.request.body)
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            why = "expected a verb, the question's number and maybe text"
            raise Refusal(HTTPStatus.BAD_REQUEST, why) from None
        loop = asyncio.get_running_loop()
        receipt = await loop.run_in_executor(None, self.behind.press, verb, question, text)
        status = HTTPStatus.OK if receipt.accepted else HTTPStatus.CONFLICT
        self.answer("application/json", json.dumps({"message": receipt.message}), status)


class _Nowhere(_Handler):
    def prepare(self) -> None:
        super().prepare()
        raise Refusal(HTTPStatus.NOT_FOUND, "There is only one page here: /")


def _said(body: bytes) -> tuple[Verb, int | None, str]:
    said = json.loads(body)
    verb, question, text = Verb(said["verb"]), said.get("question"), said.get("text", "")
    if not (question is None or type(question) is int) or not isinstance(text, str):
        raise TypeError
    if verb.is_answer and question is None:
        raise TypeError
    return verb, question, text
