"""Aseba Playground without a screen: the makers' simulator of the Thymio II, with the robot's own virtual machine."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Self

from sceann_hil.errors import ToolMissing
from sceann_hil.firmware.build import find_tool
from sceann_hil.guarded import guarded
from sceann_hil.robot import LinkError

INNER_PORT = 33333
STEP_S = 0.03
"""The playground simulates this much at once; what is sent to it waits as long at most."""
_START_S = 20.0
_FIRST_FREE = 10
_LIST_NODES = b"\x02\x00\x00\x00\x11\xa0\x05\x00"


@cache
def _has_namespaces() -> bool:
    """Whether a program of this user may have a network of its own."""
    if shutil.which("unshare") is None:
        return False
    return subprocess.run(["unshare", "-rn", "true"], capture_output=True, check=False).returncode == 0


def _duplicate(listener: socket.socket) -> int:
    """Another descriptor of it, with a larger number."""
    if sys.platform == "win32":
        return listener.fileno()
    # POSIX only; Windows has been refused by now
    import fcntl

    return fcntl.fcntl(listener, fcntl.F_DUPFD, _FIRST_FREE)


class Playground:
    """A running playground, reached through a port of this computer's loopback only.

    Args:
        scene: the text of a ``.playground`` file with one robot, at port `INNER_PORT`.
        files: other files beside it, by name.

    Attributes:
        host: ``address:port``, for `sceann_hil.link.aseba_line.AsebaLine`.

    Raises:
        ToolMissing: it is not installed, or this system cannot give it a network of its own.
        LinkError: it does not start.
    """

    def __init__(self, scene: str, files: dict[str, bytes] | None = None) -> None:
        program = find_tool("asebaplayground", "aseba")
        if not _has_namespaces():
            raise ToolMissing(
                "asebaplayground: it listens on every network, and this system lets no program have one of its own "
                "(unshare -rn).",
                "Start it yourself where that does no harm, and give robot.host its address.",
            )
        self._open = ExitStack()
        folder = Path(self._open.enter_context(tempfile.TemporaryDirectory(prefix="sceann-playground-")))
        for name, content in (files or {}).items():
            (folder / name).write_bytes(content)
        path = folder / "arena.playground"
        path.write_text(scene, encoding="utf-8")
        with socket.create_server(("127.0.0.1", 0)) as listener:
            self.host = f"127.0.0.1:{listener.getsockname()[1]}"
            # the small numbers are taken in the shell that ends the program with this one
            inherited = _duplicate(listener)
        here = f"HOME={folder} XDG_DATA_HOME={folder} XDG_RUNTIME_DIR={folder} QT_QPA_PLATFORM=offscreen".split()
        bridge = Path(__file__).with_name("playground_bridge.py")
        try:
            command = [
                *("env", *here, "unshare", "-rn"),
                *(sys.executable, "-I", str(bridge), str(inherited), str(INNER_PORT)),
                *(program, str(path)),
            ]
            self._open.enter_context(guarded(command, subprocess.DEVNULL, pass_fds=[inherited]))
        except BaseException:
            self._open.close()
            raise
        finally:
            os.close(inherited)
        try:
            self._wait()
        except BaseException:
            self.close()
            raise

    def _wait(self) -> None:
        """Until its robot answers."""
        name, port = self.host.split(":")
        until_s = time.monotonic() + _START_S
        while time.monotonic() < until_s:
            try:
                with socket.create_connection((name, int(port)), timeout=1.0) as line:
                    line.sendall(_LIST_NODES)
                    line.settimeout(max(until_s - time.monotonic(), 0.1))
                    if line.recv(8):
                        return
            except ConnectionRefusedError:
                break
            except OSError:
                time.sleep(0.05)
        raise LinkError("asebaplayground: it did not start; does `QT_QPA_PLATFORM=offscreen asebaplayground` run?")

    def close(self) -> None:
        """End it; may be called twice."""
        self._open.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


ARENA = f"""<!DOCTYPE aseba-playground>
<aseba-playground>
<color name="wall" r="0.9" g="0.9" b="0.9" />
<world w="110" h="110" color="wall" />
<robot type="thymio2" x="55" y="55" angle="0" port="{INNER_PORT}" name="thymio" />
</aseba-playground>
"""
"""A robot alone in an arena, centimetres."""
