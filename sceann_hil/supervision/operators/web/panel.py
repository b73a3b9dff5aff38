"""The operator with a phone: one page, served by the run itself, that shows the desk and presses verbs.

``GET /`` is the page, ``GET /events`` the desk's view as server-sent events, ``GET /pose.svg`` the start pose, and
``POST /press`` says something. A page that is loaded again, or a second device, sees the same view; the desk decides
whose answer was first.
"""

from __future__ import annotations

import contextlib
import errno
import io
import json
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any
from urllib.parse import parse_qs, urlsplit

import segno

from sceann_hil.errors import PanelUnavailable
from sceann_hil.robot.scenery import Scenery
from sceann_hil.supervision.operators.desk import Desk
from sceann_hil.supervision.operators.messages import View
from sceann_hil.supervision.operators.operator import Operator
from sceann_hil.supervision.operators.settings import Prompt
from sceann_hil.supervision.operators.verbs import Phase, Verb
from sceann_hil.supervision.operators.web.access import COOKIE, Access, is_local, reachable_host
from sceann_hil.supervision.operators.web.pose import draw_pose

ALIVE_S = 1.0
"""A connected page is told so often that it is; silence for three times as long and it shows that the run is gone."""
LONGEST_BODY = 10_000


class WebPanel(Operator):
    """Serves the page.

    Attributes:
        url: where the page is, with the token if one is needed.

    Args:
        desk: where to press.
        host: address to listen on.
        port: 0 for any that is free.
        scenery: for the picture of the start pose.
        prompt: whether the page beeps or speaks.

    Raises:
        PanelUnavailable: the port is in use, or the address is not this machine's.
    """

    name = "web"

    def __init__(
        self, desk: Desk, host: str, port: int, scenery: Scenery | None = None, prompt: Prompt = Prompt.NONE
    ) -> None:
        super().__init__(desk)
        self.access = Access(host)
        self.scenery = scenery
        self.prompt = prompt
        self.page = (files("sceann_hil.supervision.operators.web") / "page.html").read_bytes()
        panel = self

        class Handler(_Handler):
            def __init__(self, *args: Any, **kwargs: Any) -> None:
                self.panel = panel
                super().__init__(*args, **kwargs)

        try:
            self._server = _Server((host, port), Handler)
        except OSError as error:
            why = "is in use" if error.errno == errno.EADDRINUSE else f"cannot be opened: {error.strerror or error}"
            raise PanelUnavailable(
                f"operator.port: port {port} at {host} {why}.",
                "Close the other program, or choose another one: --set operator.port=0 takes any free port.",
            ) from error
        where = host if is_local(host) else reachable_host(host)
        token = f"?t={self.access.token}" if self.access.token else ""
        self.url = f"http://{where}:{self._server.server_address[1]}/{token}"

    def _serve(self) -> None:
        self._server.serve_forever(0.1)

    def stop(self) -> None:
        self._leaving.set()
        self._server.shutdown()
        self._server.server_close()
        super().stop()

    @property
    def leaving(self) -> bool:
        """Connections must end."""
        return self._leaving.is_set()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = 32

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that goes away is no error of the run."""


class _Handler(BaseHTTPRequestHandler):
    panel: WebPanel
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """Page, events, picture."""
        path, query = self._asked()
        if not self._allowed(query):
            return
        token = query.get("t", "")
        if path == "/" and token:
            self.send_response(HTTPStatus.SEE_OTHER)
            self.send_header("Location", "/")
            self.send_header("Set-Cookie", f"{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/")
            self.send_header("Content-Length", "0")
            self.end_headers()
        elif path == "/":
            self._answer(HTTPStatus.OK, "text/html; charset=utf-8", self.panel.page)
        elif path == "/pose.svg":
            situation = self.panel.desk.view().situation
            picture = draw_pose(self.panel.scenery, dict(situation.start if situation else ()))
            self._answer(HTTPStatus.OK, "image/svg+xml", picture.encode())
        elif path == "/events":
            self._stream()
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "There is only one page here: /")

    def do_POST(self) -> None:
        """Something is pressed."""
        path, query = self._asked()
        length = self.headers.get("Content-Length", "")
        if not length.isdigit() or int(length) > LONGEST_BODY:
            self.close_connection = True
            self._refuse(HTTPStatus.BAD_REQUEST, "expected a short JSON document")
            return
        body = self.rfile.read(int(length))
        if not self._allowed(query):
            return
        origin = self.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != self.headers.get("Host"):
            self._refuse(HTTPStatus.FORBIDDEN, "this page may not press buttons here")
        elif path != "/press" or self.headers.get_content_type() != "application/json":
            self._refuse(HTTPStatus.BAD_REQUEST, "expected JSON at /press")
        else:
            self._press(body)

    def _press(self, body: bytes) -> None:
        try:
            said = json.loads(body)
            verb, question, text = Verb(said["verb"]), said.get("question"), said.get("text", "")
            if not (question is None or type(question) is int) or not isinstance(text, str):
                raise TypeError
            if verb.is_answer and question is None:
                raise TypeError
        except (ValueError, KeyError, TypeError, AttributeError):
            self._refuse(HTTPStatus.BAD_REQUEST, "expected a verb, the question's number and maybe text")
            return
        receipt = self.panel.desk.press(verb, by=self.panel.name, question=question, text=text)
        status = HTTPStatus.OK if receipt.accepted else HTTPStatus.CONFLICT
        self._answer(status, "application/json", json.dumps({"message": receipt.message}).encode())

    def _stream(self) -> None:
        self.close_connection = True
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        version = -1
        with contextlib.suppress(OSError):
            while not self.panel.leaving:
                view = self.panel.desk.wait(version, ALIVE_S)
                if view.version > version:
                    version = view.version
                    text = json.dumps(as_json(view, self.panel.prompt))
                    self.wfile.write(f"data: {text}\n\n".encode())
                else:
                    self.wfile.write(b"event: alive\ndata:\n\n")
                self.wfile.flush()
                self.panel.desk.seen()

    def _asked(self) -> tuple[str, dict[str, str]]:
        parts = urlsplit(self.path)
        return parts.path, {name: values[0] for name, values in parse_qs(parts.query).items()}

    def _allowed(self, query: dict[str, str]) -> bool:
        headers = self.headers
        if self.panel.access.allows(headers.get("Host", ""), headers.get("Cookie", ""), query.get("t", "")):
            return True
        self._refuse(HTTPStatus.FORBIDDEN, "Open the whole link that the run printed: its token is missing or wrong.")
        return False

    def _refuse(self, status: HTTPStatus, why: str) -> None:
        self._answer(status, "text/plain; charset=utf-8", f"{why}\n".encode())

    def _answer(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """The run's own output is not an access log."""


def as_json(view: View, prompt: Prompt) -> dict[str, Any]:
    """A view for the page."""
    status, situation = view.status, view.situation
    return {
        "version": view.version,
        "phase": view.phase.value,
        "question": view.question,
        "title": situation.title if situation else "",
        "instruction": situation.instruction if situation and view.phase is Phase.BEFORE else "",
        "outcome": situation.outcome if situation and view.phase is Phase.AFTER else "",
        "pose": f"/pose.svg?q={view.question}" if situation else "",
        "reason": view.reason,
        "accepts": [verb.value for verb in Verb if verb in view.accepts],
        "pausing": view.pausing,
        "finishing": view.finishing,
        "last": f"{view.last.by}: {view.last.verb.value.replace('_', ' ')}" if view.last else "",
        "run": status.run,
        "robot": status.robot,
        "robot_ok": status.robot_ok,
        "robot_messages": list(status.robot_messages),
        "link_quality": status.link_quality,
        "battery": status.battery_fraction,
        "done": status.done,
        "todo": status.todo,
        "generation": status.generation,
        "generations": status.generations,
        "robot_s": status.robot_s,
        "wall_s": status.wall_s,
        "left": list(status.left),
        "forecast": status.forecast,
        "warnings": list(status.warnings),
        "history": [
            {"title": f.title, "outcome": f.outcome, "duration_s": f.duration_s, "fitness": f.fitness}
            for f in view.history
        ],
        "prompt": prompt.value,
    }


def announce(panel: WebPanel, show: Callable[[str], object]) -> None:
    """Print the panel's link, and a QR code of it if it is for other devices."""
    show(f"Operator panel: {panel.url}")
    if panel.access.token:
        text = io.StringIO()
        segno.make(panel.url, error="m").terminal(out=text, compact=True)
        show(text.getvalue())
