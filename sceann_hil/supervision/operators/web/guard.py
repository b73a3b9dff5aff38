"""An HTTP server of which strangers get nothing: a `Lobby` in front of Tornado, and the token before every answer.

Tornado, because it is one package without dependencies of its own, with wheels for arm64, and limits what a client may
cost: size of headers and body, and the time for each. It lets us see a connection before anything is read from it,
which is where the lobby decides. (uvicorn and aiohttp set no limit to the time for the first header, hypercorn brings
four packages.)
"""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Callable, Sequence
from http import HTTPStatus
from typing import Any, NoReturn

from tornado.http1connection import HTTP1Connection, HTTP1ServerConnection
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPConnection, HTTPMessageDelegate
from tornado.iostream import IOStream, StreamClosedError
from tornado.web import Application, Finish, HTTPError, RequestHandler

from sceann_hil.supervision.operators.web.access import Access
from sceann_hil.supervision.operators.web.gate import (
    MOST_FRIENDS,
    MOST_STRANGERS,
    PATIENCE_S,
    Crowd,
    Lobby,
    share_of_files,
)

LONGEST_BODY = 10_000
LONGEST_HEADER = 8_192
BODY_S = 5.0
IDLE_S = 600.0
"""How long the connection of somebody who has the token may be silent; all others have `PATIENCE_S`."""
SWEEP_S = 0.5
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_AGAIN = '<!doctype html><meta http-equiv="refresh" content="0"><p>One moment...</p>'
_NO_TOKEN = "Open the whole link that the run printed: its token is missing or wrong."

logging.getLogger("tornado.general").addHandler(logging.NullHandler())


class GuardedServer(HTTPServer):
    """Make and use it in the thread of its event loop: `lobby` takes connections from there on."""

    lobby: Lobby
    most_bytes: int
    strangers: Crowd[IOStream]
    friends: Crowd[IOStream]
    answered: set[IOStream]
    """Strangers that had their answer: one each, whatever else they have sent already."""

    @classmethod
    def of(
        cls,
        rules: Sequence[Any],
        access: Access,
        listening: Sequence[socket.socket],
        seen: Callable[[], object] = lambda: None,
        longest_body: int = LONGEST_BODY,
        **settings: Any,
    ) -> GuardedServer:
        """A server.

        Args:
            rules: patterns of paths, and `Guarded` handlers.
            access: who may ask.
            listening: sockets; they are closed by `stop`.
            seen: told when somebody with the token is there.
            longest_body: that a request may have, in bytes.
            settings: for the handlers.
        """
        application = Application(
            list(rules),
            default_handler_class=_Nowhere,
            log_function=lambda _: None,
            access=access,
            seen=seen,
            **settings,
        )
        server = cls(
            application,
            max_header_size=LONGEST_HEADER,
            max_body_size=longest_body,
            body_timeout=BODY_S,
            idle_connection_timeout=IDLE_S,
        )
        application.settings["server"] = server
        server.most_bytes = 2 * (LONGEST_HEADER + longest_body)
        server.strangers = Crowd(share_of_files(MOST_STRANGERS), IOStream.close)
        server.friends = Crowd(share_of_files(MOST_FRIENDS), IOStream.close)
        server.answered = set()
        server.lobby = Lobby(listening, access.token.encode(), server._admit)
        return server

    def _admit(self, connection: socket.socket, address: Any, has_token: bool) -> None:
        stream = IOStream(connection, max_buffer_size=self.most_bytes)
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


class Guarded(RequestHandler):
    """Knows who asks before anything else happens."""

    POLICY = POLICY
    """Content security policy of the answer."""

    @property
    def access(self) -> Access:
        access: Access = self.settings["access"]
        return access

    @property
    def server(self) -> GuardedServer:
        server: GuardedServer = self.settings["server"]
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
        self.set_header("Content-Security-Policy", self.POLICY)

    def prepare(self) -> None:
        access, headers = self.access, self.request.headers
        if not access.is_our_host(headers.get("Host", "")):
            self._turn_away("This panel has another address: open the link that the run printed.")
        if self._is_first_visit():
            # what is set is our own token, never what was sent
            self.server.trust(self.stream)
            self.set_cookie(access.cookie, access.token, path="/", httponly=True, samesite="Strict")
            self.redirect(self.landing, status=HTTPStatus.SEE_OTHER)
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
        self.settings["seen"]()

    @property
    def landing(self) -> str:
        """Where somebody goes who came with the token in the link."""
        return "/"

    def _is_first_visit(self) -> bool:
        given = self.request.query_arguments.get("t", [b""])[0].decode("latin1")
        return self.request.method == "GET" and self.request.path == "/" and self.access.is_token(given)

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


class _Nowhere(Guarded):
    def prepare(self) -> None:
        super().prepare()
        raise Refusal(HTTPStatus.NOT_FOUND, "There is no such page here.")
