"""Connections of strangers, as many as they like: a phone still stops the robot, and the run has its files."""

from __future__ import annotations

import http.client
import json
import resource
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest

from sceann_hil.robot import EndReason
from sceann_hil.supervision.operators import Desk, Phase
from sceann_hil.supervision.operators.web import WebPanel, gate
from sceann_hil.supervision.operators.web.gate import Crowd, Pace
from tests.supervision.operators.stations import cookie_of, desk_in, post, until
from tests.supervision.operators.test_panel_fuzz import complaints

REPOSITORY = Path(__file__).parents[3]
CROWD = REPOSITORY / "tools" / "bench" / "panel_crowd.py"


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lobby that is easily full."""
    monkeypatch.setattr(gate, "MOST_WAITING", 16)


@pytest.fixture
def panel(small: None) -> Iterator[WebPanel]:
    with complaints() as said, WebPanel(Desk(), "127.0.0.1", 0) as panel:
        yield panel
    assert said == []


def connect(panel: WebPanel, stack: ExitStack, n: int = 1) -> list[socket.socket]:
    return [stack.enter_context(socket.create_connection(("127.0.0.1", panel.port), timeout=20)) for _ in range(n)]


def is_closed(connection: socket.socket) -> bool:
    try:
        return connection.recv(1) == b""
    except ConnectionError:
        return True


def test_idle_connections_displace_each_other_and_nobody_with_the_token(panel: WebPanel) -> None:
    friend = http.client.HTTPConnection("127.0.0.1", panel.port, timeout=20)
    friend.request("GET", "/alive", headers=cookie_of(panel))
    assert friend.getresponse().read() == b""
    mine = friend.sock
    with ExitStack() as stack:
        idle = connect(panel, stack, 60)
        assert all(is_closed(connection) for connection in idle[:40])
        friend.request("GET", "/alive", headers=cookie_of(panel))
        assert friend.getresponse().status == 204
        assert friend.sock is mine, "the connection was closed and opened again"
        assert post(panel, {"verb": "finish"}, cookie_of(panel))[0] == 200
    friend.close()


def test_who_says_nothing_or_says_it_slowly_is_shown_out(panel: WebPanel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gate, "PATIENCE_S", 0.2)
    monkeypatch.setattr("sceann_hil.supervision.operators.web.guard.PATIENCE_S", 0.2)
    with ExitStack() as stack:
        silent, slow = connect(panel, stack, 2)
        slow.sendall(b"GET / HT")
        assert is_closed(silent)
        assert is_closed(slow)


def test_a_header_without_end_is_not_kept(panel: WebPanel) -> None:
    with ExitStack() as stack:
        (endless,) = connect(panel, stack)
        with pytest.raises(ConnectionError):
            endless.sendall(b"X" * 100_000_000)
        assert post(panel, {"verb": "finish"}, cookie_of(panel))[0] == 200


def test_a_stranger_gets_one_answer_per_connection(panel: WebPanel, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    is_ours = panel.access.is_our_host
    monkeypatch.setattr(panel.access, "is_our_host", lambda host: asked.append(host) or is_ours(host))
    with ExitStack() as stack:
        (many,) = connect(panel, stack)
        many.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 50)
        answer = b""
        with suppress(ConnectionError):
            while chunk := many.recv(65536):
                answer += chunk
        assert answer.count(b"HTTP/1.1 403") == 1
    assert post(panel, {"verb": "finish"}, cookie_of(panel))[0] == 200
    assert len(asked) == 2, "requests that were sent at once were served though nobody hears the answers"


def test_a_flood_without_the_token_keeps_no_stop_waiting_for_good(small: None) -> None:
    over = threading.Event()
    with complaints() as said, desk_in(Phase.RUNNING) as run, WebPanel(run.desk, "127.0.0.1", 0) as panel:

        def flood() -> None:
            while not over.is_set():
                try:
                    with socket.create_connection(("127.0.0.1", panel.port), timeout=20) as connection:
                        connection.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 20)
                        connection.recv(1)
                except OSError:
                    continue

        threads = [threading.Thread(target=flood, daemon=True) for _ in range(8)]
        for thread in threads:
            thread.start()
        try:
            assert until(lambda: _stops(panel), 30)
            assert run.interrupts == [EndReason.OPERATOR]
        finally:
            over.set()
            for thread in threads:
                thread.join(20)
    assert said == []


def _stops(panel: WebPanel) -> bool:
    try:
        return post(panel, {"verb": "stop"}, cookie_of(panel))[0] == 200
    except ConnectionError:
        # a lobby of 16 may turn over before it was looked at; the page tries again too
        return False


RUN = """
import http.client, resource, sys
resource.setrlimit(resource.RLIMIT_NOFILE, (256, 256))
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.operators.web import WebPanel
with WebPanel(Desk(), "127.0.0.1", 0) as panel:
    print(panel.port, flush=True)
    sys.stdin.readline()
    files = [open("/dev/null") for _ in range(100)]
    connection = http.client.HTTPConnection("127.0.0.1", panel.port, timeout=60)
    cookie = {"Cookie": f"{panel.access.cookie}={panel.access.token}", "Content-Type": "application/json"}
    connection.request("POST", "/press", '{"verb": "emergency_stop"}', cookie)
    print(connection.getresponse().status, panel.desk.view().phase.value, len(files))
"""


def test_more_idle_connections_than_a_process_may_open_files_cost_the_run_none() -> None:
    command = [sys.executable, "-c", RUN]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "cwd": REPOSITORY}
    with subprocess.Popen(command, stderr=subprocess.PIPE, **pipes) as run:  # type: ignore[call-overload]
        port = run.stdout.readline().strip()
        with subprocess.Popen([sys.executable, str(CROWD), port, "600", "20", "2"], **pipes) as crowd:  # type: ignore[call-overload]
            assert crowd.stdout.readline() == "ready\n"
            told, complained = run.communicate("go\n", timeout=120)
            crowd.communicate("", timeout=60)
    assert told.split() == ["200", "closed", "100"], complained
    assert "Traceback" not in complained


def test_the_oldest_of_the_fullest_address_goes() -> None:
    closed: list[str] = []
    crowd: Crowd[str] = Crowd(4, closed.append)
    crowd.add("mine", "10.0.0.7")
    for name in ("a", "b", "c", "d", "e"):
        crowd.add(name, "10.0.0.66")
    assert closed == ["a", "b"]
    assert "mine" in crowd
    for number in range(9):
        crowd.add(f"v6 {number}", f"2001:db8::{number}")
    assert "mine" in crowd, "a network is one address"
    assert len(crowd) == 4


def test_files_are_shared_where_there_are_few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda _: (256, 256))
    assert gate.share_of_files(384) == 96
    monkeypatch.setattr(resource, "getrlimit", lambda _: (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    assert gate.share_of_files(384) == 384


def test_a_pace_lets_a_burst_through_and_then_so_many_per_second(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 0.0
    monkeypatch.setattr(gate.time, "monotonic", lambda: now_s)
    pace = Pace(per_s=2.0, at_once=3.0)
    assert [pace.allows() for _ in range(4)] == [True, True, True, False]
    now_s = 0.5
    assert [pace.allows() for _ in range(2)] == [True, False]


def test_words_of_the_desk_are_json_for_every_page(panel: WebPanel) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", panel.port, timeout=20)
    connection.request("GET", "/events", headers=cookie_of(panel))
    answer = connection.getresponse()
    lines = [answer.readline().decode() for _ in range(4)]
    documents = [json.loads(line.removeprefix("data:")) for line in lines if line.startswith("data: {")]
    assert documents[-1]["phase"] == "idle"
    connection.close()
