"""Who may use the panel: whoever has the link that the run printed, on this machine too.

The token is in the link only. The first request with it gets a cookie that no script can read and that no other site's
page can make a browser send (``HttpOnly``, ``SameSite=Strict``), and is sent on to an address without it. The cookie's
name holds the port, because browsers keep one set of cookies for all ports of a machine: two runs stay apart.
"""

from __future__ import annotations

import hmac
import secrets
import socket
from ipaddress import ip_address
from urllib.parse import urlsplit

TOKEN_BYTES = 12
"""96 bits cannot be guessed over a network, and the QR code of the link still fits into a small terminal."""


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
    # nothing is sent: this only asks which interface a packet would leave by
    for family, somewhere in ((socket.AF_INET, "192.0.2.1"), (socket.AF_INET6, "2001:db8::1")):
        if family is socket.AF_INET6 and host == "0.0.0.0":
            continue
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect((somewhere, 9))
                return str(probe.getsockname()[0])
        except OSError:
            continue
    return socket.gethostname()


def in_a_link(host: str) -> str:
    """An address as it is written in a link: IPv6 in brackets."""
    return f"[{host}]" if ":" in host else host


class Access:
    """Decides about requests.

    Attributes:
        token: that a link must have.
        cookie: name of the cookie that holds the token afterwards.

    Args:
        host: address that the panel listens on.
        port: its port.
    """

    def __init__(self, host: str, port: int) -> None:
        self._local = is_local(host)
        self._names = {host.lower(), "localhost"}
        if not self._local:
            name = socket.gethostname().lower()
            self._names |= {name, name.partition(".")[0], f"{name.partition('.')[0]}.local"}
        self.token = secrets.token_urlsafe(TOKEN_BYTES)
        self.cookie = f"sceann_token_{port}"

    def is_token(self, given: str) -> bool:
        """Whether this is the token; how long it takes says nothing about it."""
        return hmac.compare_digest(given.encode(errors="replace"), self.token.encode())

    def is_our_host(self, header: str) -> bool:
        """Whether a browser means this machine: by an address, or by a name that is its own.

        A name of somebody else that resolves to this machine (DNS rebinding) is refused.
        """
        try:
            name = (urlsplit(f"//{header}").hostname or "").removesuffix(".")
        except ValueError:
            return False
        if name in self._names:
            return True
        try:
            address = ip_address(name)
        except ValueError:
            return False
        return address.is_loopback if self._local else True

    @staticmethod
    def is_our_page(origin: str | None, fetch_site: str | None, host_header: str) -> bool:
        """Whether the page that sends a request, if a page does, is ours.

        Args:
            origin: header ``Origin``; None where there is none, as from a program that is no browser.
            fetch_site: header ``Sec-Fetch-Site``.
            host_header: header ``Host``.
        """
        if fetch_site is not None and fetch_site not in ("same-origin", "none"):
            return False
        return origin is None or origin.lower() == f"http://{host_header.lower()}"
