"""The panel's five addresses.

``GET /`` is the page (`panel.css` and `panel.js` belong to it), ``GET /events`` the desk's view as server-sent events,
``GET /pose.svg`` the start pose, ``POST /press`` says something, and ``GET /alive`` keeps a connection open for the
next press.
"""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from importlib.resources import files

from tornado.iostream import StreamClosedError

from sceann_hil.supervision.operators.messages import Receipt
from sceann_hil.supervision.operators.verbs import Verb
from sceann_hil.supervision.operators.web.access import Access
from sceann_hil.supervision.operators.web.guard import Guarded, GuardedServer, Refusal

ALIVE_S = 1.0
"""A connected page is told so often that it is; silence for three times as long and it shows that the run is gone."""
DEAF_S = 10.0
"""A page that takes nothing for so long is gone."""
_FILES = {"/": "text/html", "/panel.css": "text/css", "/panel.js": "text/javascript"}


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


def panel_server(behind: Behind, listening: Sequence[socket.socket]) -> GuardedServer:
    """The server for one panel.

    Args:
        behind: what its answers are made of.
        listening: sockets; they are closed by `stop`.
    """
    pages = [(path.replace(".", r"\."), _Page) for path in _FILES]
    others = [(r"/events", _Events), (r"/pose\.svg", _Pose), (r"/press", _Press), (r"/alive", _Alive)]
    return GuardedServer.of([*pages, *others], behind.access, listening, behind.seen, behind=behind)


def _behind(handler: Guarded) -> Behind:
    behind: Behind = handler.settings["behind"]
    return behind


class _Page(Guarded):
    def get(self) -> None:
        name = "page.html" if self.request.path == "/" else self.request.path[1:]
        text = (files("sceann_hil.supervision.operators.web") / name).read_bytes()
        self.answer(_FILES[self.request.path], text)


class _Pose(Guarded):
    def get(self) -> None:
        self.answer("image/svg+xml", _behind(self).pose())


class _Alive(Guarded):
    def get(self) -> None:
        self.set_status(HTTPStatus.NO_CONTENT)


class _Events(Guarded):
    async def get(self) -> None:
        self.set_header("Content-Type", "text/event-stream")
        feed, shown = _behind(self).feed, ""
        try:
            while True:
                changed = feed.changed
                self.write(f"data: {feed.text}\n\n" if feed.text != shown else "event: alive\ndata:\n\n")
                shown = feed.text
                await asyncio.wait_for(self.flush(), DEAF_S)
                self.settings["seen"]()
                if feed.over:
                    return
                try:
                    await asyncio.wait_for(changed.wait(), ALIVE_S)
                except TimeoutError:
                    continue
        except (StreamClosedError, TimeoutError):
            self.stream.close()


class _Press(Guarded):
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
        receipt = await loop.run_in_executor(None, _behind(self).press, verb, question, text)
        status = HTTPStatus.OK if receipt.accepted else HTTPStatus.CONFLICT
        self.answer("application/json", json.dumps({"message": receipt.message}), status)


def _said(body: bytes) -> tuple[Verb, int | None, str]:
    said = json.loads(body)
    verb, question, text = Verb(said["verb"]), said.get("question"), said.get("text", "")
    if not (question is None or type(question) is int) or not isinstance(text, str):
        raise TypeError
    if verb.is_answer and question is None:
        raise TypeError
    return verb, question, text
