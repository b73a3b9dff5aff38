"""Who may use the panel: everybody on this machine, and whoever has the link with the token."""

from __future__ import annotations

import hmac
import secrets
import socket
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address

COOKIE = "sceann_token"


def is_local(host: str) -> bool:
    """Whether an address to listen on is reached from this machine only."""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def reachable_host(host: str) -> str:
    """An address by which other devices reach a server that listens on `host`."""
    if host not in ("", "0.0.0.0", "::"):
        return host
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # nothing is sent: this only asks which interface a packet would leave by
            probe.connect(("192.0.2.1", 9))
        except OSError:
            return socket.gethostname()
        return str(probe.getsockname()[0])


class Access:
    """Decides about requests.

    Attributes:
        token: that other devices must have; empty if the panel is for this machine only.

    Args:
        host: address that the panel listens on.
    """

    def __init__(self, host: str) -> None:
        self._local = is_local(host)
        self.token = "" if self._local else secrets.token_urlsafe(16)

    def allows(self, host_header: str, cookie_header: str, query_token: str) -> bool:
        """Whether a request may be answered.

        Args:
            host_header: what the browser thinks it talks to; a foreign name that resolves to this machine is refused.
            cookie_header: its cookies.
            query_token: token in the link.
        """
        if self._local:
            name = host_header.rpartition(":")[0] if ":" in host_header.rpartition("]")[2] else host_header
            return is_local(name.strip("[]"))
        return self._is_token(query_token) or self._is_token(_cookie(cookie_header))

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())


def _cookie(header: str) -> str:
    try:
        cookies = SimpleCookie(header)
    except CookieError:
        return ""
    return cookies[COOKIE].value if COOKIE in cookies else ""
