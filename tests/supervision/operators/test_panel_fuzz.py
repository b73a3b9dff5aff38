"""Requests that no browser sends: nothing is a fault of the server, and the page works afterwards.

``python -m tests.supervision.operators.test_panel_fuzz 100000`` tries as many as one likes.
"""

from __future__ import annotations

import json
import logging
import re
import socket
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from random import Random

from sceann_hil.supervision.operators import Desk, Verb
from sceann_hil.supervision.operators.web import WebPanel
from tests.supervision.operators.stations import cookie_of, post

PATHS = ["/", "/press", "/alive", "/pose.svg", "/panel.js", "/panel.css", "/nowhere", "/?t=", "*", "//", "/\x00", ""]
METHODS = ["GET", "POST", "HEAD", "PUT", "OPTIONS", "DELETE", "CONNECT", "get", "G\x00T", ""]
VERSIONS = ["HTTP/1.1", "HTTP/1.0", "HTTP/2", "HTTP/0.9", "http/1.1", "HTTP/1.1 x", ""]
BODIES = [
    "",
    "{}",
    "[" * 5000,
    '{"verb": "note", "text": "\\ud800"}',
    '{"verb": "note", "text": "a\\u0000b\\r\\nc"}',
    '{"verb": "ready", "question": 1e999}',
    '{"verb": "ready", "question": ' + "9" * 5000 + "}",
    '{"verb": ["note"], "text": {}}',
    '{"verb": "stop"}',
    '{"verb": "note", "text": "x"}' * 3,
    "NaN",
    "a=b&c=%ff",
    '--x\r\nContent-Disposition: form-data; name="a"\r\n\r\nb\r\n--x--',
]
HEADERS = [
    "Content-Type: application/json",
    "Content-Type: application/x-www-form-urlencoded",
    "Content-Type: multipart/form-data; boundary=x",
    "Content-Type: application/json; charset=\x80",
    "Content-Length: 5",
    "Content-Length: -1",
    "Content-Length: 1e3",
    "Content-Length: 99999999999999999999",
    "Content-Length: 5, 6",
    "Transfer-Encoding: chunked",
    "Transfer-Encoding: gzip, chunked",
    "Content-Encoding: gzip",
    "Expect: 100-continue",
    "Connection: close",
    "Connection: keep-alive, upgrade",
    "Upgrade: websocket",
    "Host: evil.example",
    "Host: [::1",
    "Origin: null",
    "Origin: http://evil.example",
    "Sec-Fetch-Site: cross-site",
    "Cookie: sceann_token_1=\xff; a",
    "Cookie: =;;=\x01",
    "Range: bytes=0-",
    "If-None-Match: *",
    "X: " + "y" * 9000,
    "No colon",
    ": no name",
    " folded: line",
    "Accept-Language: \xff\xfe",
]


class Listener(logging.Handler):
    """Keeps everything that anybody complains about."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.said: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append(self.format(record))


@contextmanager
def complaints() -> Iterator[list[str]]:
    listener = Listener()
    names = ("tornado.application", "asyncio")
    before = threading.excepthook
    threading.excepthook = lambda failed: listener.said.append(repr(failed.exc_value))
    for name in names:
        logging.getLogger(name).addHandler(listener)
    try:
        yield listener.said
    finally:
        threading.excepthook = before
        for name in names:
            logging.getLogger(name).removeHandler(listener)


def request(random: Random, cookie: str) -> bytes:
    """Something like a request; most of them know the token."""
    body = random.choice(BODIES).encode("utf-8", "surrogatepass")
    lines = [f"{random.choice(METHODS[:3])} {random.choice(PATHS)} HTTP/1.1", "Host: 127.0.0.1"]
    if random.random() < 0.3:
        lines[0] = f"{random.choice(METHODS)} {random.choice(PATHS)} {random.choice(VERSIONS)}"
    if random.random() < 0.9:
        lines.append(f"Cookie: {cookie}")
    if random.random() < 0.7:
        lines.append(f"Content-Length: {len(body)}")
    if random.random() < 0.5:
        lines.append(HEADERS[0])
    lines += random.sample(HEADERS, random.choice([0, 0, 1, 1, 2, 4]))
    end = random.choice(["\r\n", "\r\n", "\r\n", "\n", "\r"])
    raw = bytearray((end.join(lines) + end + end).encode("latin1", "replace") + body)
    for _ in range(random.choice([0, 0, 0, 1, 3, 10])):
        place = random.randrange(len(raw))
        match random.randrange(3):
            case 0:
                raw[place] = random.randrange(256)
            case 1:
                del raw[place : place + random.randrange(20)]
            case _:
                raw[place:place] = random.randbytes(random.randrange(20))
        raw = raw or bytearray(b"x")
    return bytes(raw[: random.randrange(1, len(raw) + 1)] if random.random() < 0.1 else raw)


def exchange(port: int, raw: bytes) -> bytes:
    """Everything that is answered until the server closes, or what comes once nothing more is sent."""
    with socket.create_connection(("127.0.0.1", port), timeout=30) as connection:
        answer = b""
        try:
            connection.sendall(raw)
            connection.shutdown(socket.SHUT_WR)
            while chunk := connection.recv(65536):
                answer += chunk
        except OSError:
            pass
        return answer


def fuzz(panel: WebPanel, n: int, seed: int) -> Counter[str]:
    """Send `n` requests; how often each status came."""
    random, statuses = Random(seed), Counter[str]()
    cookie = cookie_of(panel)["Cookie"]
    for _ in range(n):
        raw = request(random, cookie)
        answer = exchange(panel.port, raw)
        found = re.findall(rb"HTTP/1\.[01] (\d\d\d)", answer) or [b"none"]
        statuses.update(status.decode() for status in found)
        assert not any(status.startswith(b"5") for status in found), (raw, answer)
        panel.desk.said()
    return statuses


def test_nothing_that_is_sent_is_a_fault_of_the_server() -> None:
    with complaints() as said, WebPanel(Desk(), "127.0.0.1", 0) as panel:
        statuses = fuzz(panel, 500, seed=1)
        assert said == []
        assert {"200", "400", "403", "404"} <= set(statuses)
        assert post(panel, {"verb": "note", "text": "still there"}, cookie_of(panel))[0] == 200
        assert [press.verb for press in panel.desk.said()] == [Verb.NOTE]


if __name__ == "__main__":
    with complaints() as told, WebPanel(Desk(), "127.0.0.1", 0) as served:
        print(json.dumps(fuzz(served, int(sys.argv[1]), seed=int(sys.argv[2]) if len(sys.argv) > 2 else 0)), told)
