"""Who may use the panel, and what it does with requests that no page of ours makes."""

from __future__ import annotations

import http.client
import io
import socket
from collections.abc import Iterator

import pytest

from sceann_hil.errors import PanelUnavailable
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.operators.web import WebPanel, announce
from tests.supervision.operators.stations import post


@pytest.fixture
def local() -> Iterator[WebPanel]:
    with WebPanel(Desk(), "127.0.0.1", 0) as panel:
        yield panel


@pytest.fixture
def open_to_all() -> Iterator[WebPanel]:
    with WebPanel(Desk(), "0.0.0.0", 0) as panel:
        yield panel


def address(panel: WebPanel) -> str:
    return f"127.0.0.1:{panel._server.server_address[1]}"


def get(panel: WebPanel, path: str, **headers: str) -> tuple[int, str, dict[str, str]]:
    connection = http.client.HTTPConnection(address(panel), timeout=5)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    body = answer.read().decode() if answer.headers.get("Content-Length") else ""
    connection.close()
    return answer.status, body, dict(answer.headers)


def test_on_this_machine_no_token_is_needed(local: WebPanel) -> None:
    assert "?t=" not in local.url
    status, body, _ = get(local, "/")
    assert status == 200
    assert "EMERGENCY STOP" in body


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "10.0.0.1"])
def test_a_name_of_somebody_else_that_leads_here_is_refused(local: WebPanel, host: str) -> None:
    assert get(local, "/", Host=host)[0] == 403


@pytest.mark.parametrize("path", ["/", "/events", "/pose.svg", "/?t=", "/?t=wrong"])
def test_from_elsewhere_a_missing_or_wrong_token_is_refused(open_to_all: WebPanel, path: str) -> None:
    status, body, _ = get(open_to_all, path)
    assert status == 403
    assert "Open the whole link" in body


def test_without_the_token_nothing_can_be_pressed(open_to_all: WebPanel) -> None:
    status, _ = post(address(open_to_all), {"verb": "emergency_stop"})
    assert status == 403
    assert open_to_all.desk.said() == []


def test_the_link_s_token_becomes_a_cookie_that_opens_everything(open_to_all: WebPanel) -> None:
    token = open_to_all.access.token
    assert len(token) >= 20
    status, _, headers = get(open_to_all, f"/?t={token}")
    assert (status, headers["Location"]) == (303, "/")
    assert "HttpOnly" in headers["Set-Cookie"]
    cookie = headers["Set-Cookie"].partition(";")[0]
    assert get(open_to_all, "/", Cookie=cookie)[0] == 200
    assert post(address(open_to_all), {"verb": "finish"}, {"Cookie": cookie})[0] == 200


def test_the_link_is_printed_with_a_qr_code_where_a_phone_needs_it(local: WebPanel, open_to_all: WebPanel) -> None:
    out = io.StringIO()
    announce(open_to_all, lambda text: out.write(text + "\n"))
    assert open_to_all.url in out.getvalue()
    assert "\u2588" in out.getvalue() or "\u2580" in out.getvalue()
    out = io.StringIO()
    announce(local, lambda text: out.write(text + "\n"))
    assert out.getvalue() == f"Operator panel: {local.url}\n"


def test_a_page_of_somebody_else_cannot_press(local: WebPanel) -> None:
    assert post(address(local), {"verb": "finish"}, {"Origin": "http://evil.example"})[0] == 403
    assert post(address(local), {"verb": "finish"}, {"Content-Type": "text/plain"})[0] == 400
    assert local.desk.said() == []


@pytest.mark.parametrize(
    "body",
    [
        {},
        [],
        "x",
        {"verb": "dance"},
        {"verb": "ready"},
        {"verb": "ready", "question": "1"},
        {"verb": "note", "text": 5},
    ],
)
def test_nonsense_is_refused(local: WebPanel, body: object) -> None:
    assert post(address(local), body)[0] == 400
    assert local.desk.said() == []


def test_a_body_without_end_is_not_read(local: WebPanel) -> None:
    assert post(address(local), {"verb": "finish"}, {"Content-Length": "99999999"})[0] == 400


def test_a_port_in_use_is_told_before_anything_moves() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        with pytest.raises(PanelUnavailable, match="is in use"):
            WebPanel(Desk(), "127.0.0.1", other.getsockname()[1])


def test_an_address_of_another_machine_is_told() -> None:
    with pytest.raises(PanelUnavailable, match="cannot be opened"):
        WebPanel(Desk(), "192.0.2.1", 0)
