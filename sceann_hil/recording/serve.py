"""The viewer for a browser elsewhere: one address with a token, for a host that has no display.

Rerun's own servers (its page, and the data as gRPC-web) listen on this machine only and ask nobody who they are. In
front of them stands the guarded server of the operator's panel: it lets those in who have the link, and passes on what
they ask. The viewer's page needs inline script, WebAssembly and workers; nothing of it comes from anywhere else.
"""

from __future__ import annotations

import asyncio
import contextlib
import re
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from http import HTTPStatus
from pathlib import Path
from urllib.parse import quote, urlsplit

from tornado.httpclient import AsyncHTTPClient, HTTPRequest
from tornado.netutil import bind_sockets
from tornado.simple_httpclient import SimpleAsyncHTTPClient

from sceann_hil.errors import PanelUnavailable, ViewerUnavailable
from sceann_hil.guarded import guarded
from sceann_hil.recording.headless import LOCAL, explain_failure
from sceann_hil.recording.rrd import VIEWER, quiet_environment
from sceann_hil.supervision.operators.web.access import Access, in_a_link, is_local, reachable_host
from sceann_hil.supervision.operators.web.gate import serve_until_done
from sceann_hil.supervision.operators.web.guard import Guarded, GuardedServer, Refusal

POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' blob:; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' data: blob:; worker-src 'self' blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
LONGEST_REQUEST = 10_000_000
LARGEST_FILE = 1 << 30
_START_S = 60.0
_PAGE = re.compile(r"web-viewer at http://[^:\s]+:(\d+)")
_DATA = re.compile(r"gRPC connections on [^\s]*:(\d+)")
_PASSED_ON = re.compile(r"(accept|content-type|te|range|grpc-.*|x-.*|rerun-.*)", re.IGNORECASE)
_PASSED_BACK = re.compile(r"(content-type|content-range|grpc-.*|x-(?!frame|content).*|rerun-.*)", re.IGNORECASE)


def serve(source: str, host: str, port: int, show: Callable[[str], object]) -> None:
    """Serve the viewer with a source until Ctrl-C.

    Args:
        source: a file, or an address in a catalog on this machine.
        host: address to listen on.
        port: 0 for any that is free.
        show: prints the link.

    Raises:
        PanelUnavailable: the port is in use, or the address is not this machine's.
        ViewerUnavailable: the viewer does not start, and why.
    """
    try:
        listening = bind_sockets(port, "" if host == "::" else host)
    except (OSError, ValueError) as error:
        said = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise PanelUnavailable(
            f"--port: port {port} at {host:.100} cannot be opened: {said}.", "Choose another."
        ) from error
    bound = listening[0].getsockname()[1]
    access = Access(host, bound)
    with _viewer_page(source) as (page_port, data_port):
        served = urlsplit(source)
        upstream = served.port if served.scheme.startswith("rerun") and served.port else data_port
        path = f"{served.path}?{served.query}".rstrip("?") if upstream != data_port else "/proxy"
        where = in_a_link(host if is_local(host) else reachable_host(host))
        show(f"The run in a browser: http://{where}:{bound}/?t={access.token}")
        show("Whoever has this link sees it. Ctrl-C ends it.")
        rules = [
            (r"/", _Landing, {"port": page_port, "path": path}),
            (r"/[A-Za-z0-9_.]+/[A-Za-z0-9_]+", _Data, {"port": upstream}),
            (r"/[A-Za-z0-9_-]+\.[a-z0-9]+", _File, {"port": page_port}),
        ]

        async def work() -> None:
            server = GuardedServer.of(rules, access, listening, longest_body=LONGEST_REQUEST)
            serving = asyncio.create_task(server.keep_order())
            # rerun's own servers must not outlive this one, however it ends
            for ending in (signal.SIGINT, signal.SIGTERM):
                # Windows has no such handlers; Ctrl-C ends the loop there
                with contextlib.suppress(NotImplementedError):
                    asyncio.get_running_loop().add_signal_handler(ending, serving.cancel)
            with contextlib.suppress(asyncio.CancelledError):
                await serving
            server.stop()
            await server.close_all_connections()

        serve_until_done(work())


class _PassedOn(Guarded):
    """Asks one of rerun's servers and gives its answer, while it comes."""

    POLICY = POLICY

    def initialize(self, port: int) -> None:
        self._port = port

    async def pass_on(self) -> None:
        """The whole answer of the server behind."""
        headers = {name: value for name, value in self.request.headers.items() if _PASSED_ON.fullmatch(name)}
        client: AsyncHTTPClient = SimpleAsyncHTTPClient(force_instance=True, max_body_size=LARGEST_FILE)

        def header(line: str) -> None:
            if line.startswith("HTTP/"):
                self.set_status(int(line.split(" ")[1]))
            name, _, value = line.partition(":")
            if _PASSED_BACK.fullmatch(name):
                self.set_header(name, value.strip())

        def part(chunk: bytes) -> None:
            self.write(chunk)
            self.flush()

        request = HTTPRequest(
            f"http://127.0.0.1:{self._port}{self.request.uri}",
            method=self.request.method or "GET",
            headers=headers,
            body=self.request.body if self.request.method == "POST" else None,
            request_timeout=0,
            header_callback=header,
            streaming_callback=part,
            decompress_response=False,
        )
        try:
            await client.fetch(request, raise_error=False)
        except OSError as error:
            raise Refusal(HTTPStatus.BAD_GATEWAY, f"The viewer's server does not answer: {error}.") from error
        finally:
            client.close()


class _File(_PassedOn):
    async def get(self) -> None:
        await self.pass_on()


class _Data(_PassedOn):
    async def post(self) -> None:
        await self.pass_on()


class _Landing(_PassedOn):
    """The viewer's page; its address tells it where the data are, in the browser's words for this server."""

    def initialize(self, port: int, path: str = "") -> None:
        super().initialize(port)
        self._path = path

    @property
    def landing(self) -> str:
        host = self.request.headers.get("Host", "")
        return f"/?hide_welcome_screen=1&url={quote(f'rerun+http://{host}{self._path}', safe='')}"

    async def get(self) -> None:
        if "url" not in self.request.query_arguments:
            self.redirect(self.landing, status=HTTPStatus.SEE_OTHER)
            return
        await self.pass_on()


@contextlib.contextmanager
def _viewer_page(source: str) -> Iterator[tuple[int, int]]:
    """Rerun's server of page and data for this machine only: their ports."""
    with tempfile.TemporaryDirectory() as private:
        log = Path(private) / "viewer.log"
        environment = quiet_environment()
        environment["RUST_LOG"] = f"{environment.get('RUST_LOG', 'error')},re_sdk::web_viewer=info,re_grpc_server=info"
        command = [str(VIEWER), "--serve-web", *LOCAL, "--port", "auto", "--web-viewer-port", "0", source]
        with log.open("wb") as output, guarded(command, output, environment) as process:
            yield _ports(process, log, needs_data=not source.startswith("rerun"))


def _ports(process: subprocess.Popen[bytes], log: Path, *, needs_data: bool) -> tuple[int, int]:
    deadline = time.monotonic() + _START_S
    while time.monotonic() < deadline:
        said = re.sub(r"\x1b\[[0-9;]*m", "", log.read_text(errors="replace"))
        page, data = _PAGE.search(said), _DATA.search(said)
        if page is not None and (data is not None or not needs_data):
            return int(page[1]), int(data[1]) if data is not None else 0
        if process.poll() is not None:
            raise explain_failure(said)
        time.sleep(0.1)
    raise ViewerUnavailable(f"The viewer's server did not start within {_START_S:g} s.", "Try again, or use --picture.")
