"""Who may use the panel, and what it does with requests that no page of ours makes."""

from __future__ import annotations

import http.client
import io
import re
import socket
from collections.abc import Iterator
from urllib.parse import quote

import pytest

from sceann_hil.errors import PanelUnavailable
from sceann_hil.supervision.operators import Desk, Verb
from sceann_hil.supervision.operators.web import WebPanel, described
from tests.supervision.operators.stations import cookie_of, post

PATHS = ["/", "/panel.js", "/panel.css", "/events", "/pose.svg", "/alive", "/nowhere"]


@pytest.fixture(scope="module")
def local() -> Iterator[WebPanel]:
    with WebPanel(Desk(), "127.0.0.1", 0) as panel:
        yield panel


@pytest.fixture(scope="module")
def open_to_all() -> Iterator[WebPanel]:
    with WebPanel(Desk(), "0.0.0.0", 0) as panel:
        yield panel


@pytest.fixture(params=["local", "open_to_all"])
def panel(request: pytest.FixtureRequest) -> WebPanel:
    panel: WebPanel = request.getfixturevalue(request.param)
    panel.desk.said()
    return panel


def get(panel: WebPanel, path: str, headers: dict[str, str] | None = None) -> tuple[int, str, http.client.HTTPMessage]:
    connection = http.client.HTTPConnection("127.0.0.1", panel.port, timeout=20)
    connection.request("GET", path, headers=headers or {})
    answer = connection.getresponse()
    body = answer.read().decode() if answer.headers.get("Content-Length") else ""
    connection.close()
    return answer.status, body, answer.headers


@pytest.mark.parametrize("path", [*PATHS, "/?t=", "/?t=wrong", "/?t=%ff", "/?t=%00"])
def test_a_missing_or_wrong_token_is_refused(panel: WebPanel, path: str) -> None:
    status, body, _ = get(panel, path)
    assert status == 403
    assert "Open the whole link" in body
    assert get(panel, path, {"Cookie": f"{panel.access.cookie}=wrong"})[0] == 403


def test_without_the_token_nothing_can_be_pressed(panel: WebPanel) -> None:
    status, _ = post(panel, {"verb": "finish"})
    assert status == 403
    assert panel.desk.said() == []


def test_the_link_s_token_becomes_a_cookie_that_opens_everything(panel: WebPanel) -> None:
    path = panel.url[panel.url.index("/?t=") :]
    assert len(panel.access.token) >= 16
    status, _, headers = get(panel, path)
    assert (status, headers["Location"]) == (303, "/")
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= set(headers["Set-Cookie"].split("; "))
    cookie = {"Cookie": headers["Set-Cookie"].partition(";")[0]}
    for path in ("/", "/panel.js", "/panel.css", "/pose.svg"):
        assert get(panel, path, cookie)[0] == 200
    assert post(panel, {"verb": "finish"}, cookie)[0] == 200


def test_two_panels_of_one_machine_have_cookies_of_their_own(local: WebPanel, open_to_all: WebPanel) -> None:
    assert local.access.cookie != open_to_all.access.cookie
    assert get(local, "/", cookie_of(open_to_all))[0] == 403


@pytest.mark.parametrize("inserted", ["\r\nX-New: 1", "\r\n\r\n<script>", "\nSet-Cookie: a=b", "\r", "\u0100", "\x00"])
@pytest.mark.parametrize("place", ["/?t={}", "/?t={token}{}", "/?x={}&t={token}", "/{}", "/pose.svg?q={}"])
def test_what_is_asked_for_never_becomes_a_header(panel: WebPanel, inserted: str, place: str) -> None:
    path = place.replace("{token}", panel.access.token).replace("{}", quote(inserted))
    status, body, headers = get(panel, path, cookie_of(panel))
    assert status in (200, 303, 400, 404)
    assert "X-New" not in headers
    assert "a=b" not in headers.get("Set-Cookie", "")
    assert "<script>" not in body.replace('<script src="/panel.js" defer>', "")


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "localhost.evil.example", "", "[", "a b", "[::1"])
def test_a_name_of_somebody_else_that_leads_here_is_refused(panel: WebPanel, host: str) -> None:
    assert get(panel, "/", {"Host": host, **cookie_of(panel)})[0] in (400, 403)


@pytest.mark.parametrize("host", ["10.0.0.1", "192.0.2.7:8075", "[2001:db8::1]:8075"])
def test_only_a_panel_for_other_devices_has_addresses_for_them(
    local: WebPanel, open_to_all: WebPanel, host: str
) -> None:
    assert get(local, "/", {"Host": host, **cookie_of(local)})[0] == 403
    assert get(open_to_all, "/", {"Host": host, **cookie_of(open_to_all)})[0] == 200


@pytest.mark.parametrize("host", ["localhost:1", "127.0.0.1", "127.8.9.1:80", "[::1]:8075", "LOCALHOST", "localhost."])
def test_this_machine_has_many_names(panel: WebPanel, host: str) -> None:
    assert get(panel, "/", {"Host": host, **cookie_of(panel)})[0] == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": ""},
        {"Origin": "https://127.0.0.1"},
        {"Origin": "http://127.0.0.1:1"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_a_page_of_somebody_else_cannot_press(panel: WebPanel, headers: dict[str, str]) -> None:
    assert post(panel, {"verb": "finish"}, {**cookie_of(panel), **headers})[0] == 403
    assert panel.desk.said() == []


def test_our_page_can_press(panel: WebPanel) -> None:
    ours = {"Origin": f"http://127.0.0.1:{panel.port}", "Sec-Fetch-Site": "same-origin", **cookie_of(panel)}
    assert post(panel, {"verb": "note", "text": "well"}, ours)[0] == 200


@pytest.mark.parametrize("kind", ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data", "x", ""])
def test_what_a_form_can_send_presses_nothing(panel: WebPanel, kind: str) -> None:
    assert post(panel, {"verb": "finish"}, {**cookie_of(panel), "Content-Type": kind})[0] == 400
    assert panel.desk.said() == []


@pytest.mark.parametrize("path", ["/", "/panel.js", "/pose.svg", "/nowhere", "/?t="])
def test_no_page_may_frame_or_script_it(panel: WebPanel, path: str) -> None:
    for headers in ({}, cookie_of(panel)):
        _, _, answered = get(panel, path, headers)
        policy = answered["Content-Security-Policy"]
        assert "frame-ancestors 'none'" in policy
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert answered["X-Frame-Options"] == "DENY"
        assert answered["X-Content-Type-Options"] == "nosniff"
        assert "Tornado" not in answered.get("Server", "")


def test_the_page_has_no_script_or_style_of_its_own(local: WebPanel) -> None:
    _, body, _ = get(local, "/", cookie_of(local))
    assert "EMERGENCY STOP" in body
    assert re.findall(r"<script(?![^>]*\bsrc=)|<style|\bon[a-z]+=|style=", body) == []


@pytest.mark.parametrize(
    "body",
    [
        {},
        [],
        "x",
        None,
        {"verb": "dance"},
        {"verb": ["ready"]},
        {"verb": {}},
        {"verb": "ready"},
        {"verb": "ready", "question": "1"},
        {"verb": "ready", "question": True},
        {"verb": "ready", "question": 1.0},
        {"verb": "note", "text": 5},
        {"verb": "note", "text": None},
    ],
)
def test_nonsense_is_refused(panel: WebPanel, body: object) -> None:
    assert post(panel, body, cookie_of(panel))[0] == 400
    assert panel.desk.said() == []


def test_a_body_without_end_is_not_read(panel: WebPanel) -> None:
    try:
        status = post(panel, {"verb": "finish"}, {"Content-Length": "99999999", **cookie_of(panel)})[0]
    except ConnectionResetError:
        # the server has closed the line with a part of the body unread; its answer may be lost with that
        status = 400
    assert status == 400
    assert not panel.desk.said()


@pytest.mark.parametrize("text", ["\ud800", "a\udfffb", "\udc80\udcff"])
def test_half_a_character_in_a_note_is_mended(panel: WebPanel, text: str) -> None:
    assert post(panel, {"verb": "note", "text": text}, cookie_of(panel))[0] == 200
    (said,) = panel.desk.said()
    assert said.verb is Verb.NOTE
    assert "\ufffd" in said.text
    said.text.encode()


def test_the_link_is_printed_with_a_qr_code_where_a_phone_needs_it(local: WebPanel, open_to_all: WebPanel) -> None:
    shown = described(open_to_all, lines=24)
    assert open_to_all.url in shown
    assert "\u2588" in shown
    assert shown.count("\n") < 18, "the question and the keys must fit below it on 24 lines"
    assert max(map(len, shown.splitlines())) <= 80
    assert "make the terminal higher" in described(open_to_all, lines=20)
    assert described(local) == f"Operator panel: {local.url}"


def test_a_terminal_that_cannot_draw_a_qr_code_gets_the_link(
    open_to_all: WebPanel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr", io.TextIOWrapper(io.BytesIO(), encoding="latin-1"))
    assert described(open_to_all, lines=60) == f"Operator panel: {open_to_all.url}"


def test_a_port_in_use_is_told_before_anything_moves() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        with pytest.raises(PanelUnavailable, match="is in use"):
            WebPanel(Desk(), "127.0.0.1", other.getsockname()[1])


@pytest.mark.parametrize(
    "host", ["192.0.2.1", "no.such.name.invalid", "x" * 300, "a..b", "::g", "1.2.3.4.5", "2001:db8::1"]
)
def test_an_address_that_is_not_this_machine_s_is_told(host: str) -> None:
    with pytest.raises(PanelUnavailable, match="cannot be opened"):
        WebPanel(Desk(), host, 0)


@pytest.mark.parametrize("host", ["::1", "::", "localhost"])
def test_ipv6(host: str) -> None:
    if not _has_ipv6():
        pytest.skip("this machine has no IPv6 address")
    with WebPanel(Desk(), host, 0) as panel:
        assert panel.url.startswith(("http://[", "http://localhost", "http://1"))
        addresses = {"::1": ["::1"], "::": ["::1", "127.0.0.1"], "localhost": ["127.0.0.1"]}[host]
        for address in addresses:
            connection = http.client.HTTPConnection(address, panel.port, timeout=20)
            connection.request("GET", "/", headers=cookie_of(panel))
            assert connection.getresponse().status == 200
            connection.close()


def _has_ipv6() -> bool:
    try:
        with socket.socket(socket.AF_INET6) as probe:
            probe.bind(("::1", 0))
    except OSError:
        return False
    return True
