"""A viewer without a window: pictures for documentation, and what its views complain about for tests."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from rerun.experimental import ViewerClient

from sceann_hil.errors import ViewerUnavailable
from sceann_hil.guarded import guarded
from sceann_hil.recording.display import NO_DISPLAY
from sceann_hil.recording.rrd import VIEWER, quiet_environment

LOCAL = ("--bind", "127.0.0.1")
"""Nobody but this machine may talk to the viewer."""

_START_TIMEOUT_S = 90.0


@contextlib.contextmanager
def headless_viewer(*sources: str | Path, window: tuple[int, int] = (1600, 900)) -> Iterator[ViewerClient]:
    """A viewer that has opened `sources` and that a program can talk to; it ends with the block.

    Args:
        sources: files, or addresses in a catalog.
        window: its size in points.

    Raises:
        ViewerUnavailable: it did not start, or ended, and why.
    """
    with tempfile.TemporaryDirectory() as private:
        log = Path(private) / "viewer.log"
        port = _free_port()
        size = f"{window[0]}x{window[1]}"
        command = [
            str(VIEWER),
            "--headless",
            "--hide-welcome-screen",
            *LOCAL,
            "--port",
            str(port),
            "--window-size",
            size,
        ]
        environment = {**quiet_environment(), "XDG_RUNTIME_DIR": private}
        with log.open("wb") as output, guarded([*command, *map(str, sources)], output, environment) as process:
            client = _connected(process, port, log)
            try:
                yield client
            except ConnectionError:
                # it opened its port before it found that it cannot draw
                raise explain_failure(log.read_text(errors="replace")) from None


def complaints(client: ViewerClient) -> dict[str, list[str]]:
    """Errors and warnings by the name of the view that reports them."""
    return {view.name: [report.summary for report in view.reports] for view in client.get_state().views if view.reports}


def wait_for_views(client: ViewerClient, timeout_s: float = 60.0) -> None:
    """Return when everything is loaded and a screen is shown.

    Raises:
        ViewerUnavailable: that does not happen in time.
    """
    _wait_until(lambda: bool((state := client.get_state()).views and not state.loading), timeout_s)


def wait_for_gallery(client: ViewerClient, timeout_s: float = 120.0) -> None:
    """Return when the trials that a table shows are loaded: a table has no views, and asks for trials as it is drawn.

    Raises:
        ViewerUnavailable: that does not happen in time.
    """
    _wait_until(lambda: bool((state := client.get_state()).recordings and not state.loading), timeout_s)


def _wait_until(shown: Callable[[], bool], timeout_s: float) -> None:
    deadline = time.monotonic() + timeout_s
    while True:
        if shown():
            return
        if time.monotonic() > deadline:
            raise ViewerUnavailable(f"The viewer shows nothing after {timeout_s:g} s.", "Try again on an idle machine.")
        time.sleep(0.1)


def explain_failure(said: str) -> ViewerUnavailable:
    """What a user should know about a viewer that did not start, from what it said."""
    if "DISPLAY" in said or "EventLoopError" in said:
        return ViewerUnavailable("The viewer found no display to open its window on.", NO_DISPLAY)
    if "graphics adapter" in said or "render context" in said:
        return ViewerUnavailable(
            "The viewer found no graphics driver (Vulkan).",
            "Install one; on Debian and Ubuntu the package mesa-vulkan-drivers draws without a graphics card.",
        )
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    return ViewerUnavailable(
        f"The viewer did not start: {lines[0][:300] if lines else 'it said nothing'}",
        f"Try `{VIEWER} --version`; if that fails too, install rerun-sdk again.",
    )


def _connected(process: subprocess.Popen[bytes], port: int, log: Path) -> ViewerClient:
    deadline = time.monotonic() + _START_TIMEOUT_S
    while True:
        try:
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            client.get_state()
            return client
        except Exception:
            if process.poll() is not None or time.monotonic() > deadline:
                raise explain_failure(log.read_text(errors="replace")) from None
            time.sleep(0.2)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
