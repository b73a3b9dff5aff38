"""The virtual robot's reset rig: the far end of `backends.remote.rig`, on a TCP port of this machine."""

from __future__ import annotations

import contextlib
import json
import socketserver
import threading

from backends.remote.rig import ASK_END
from backends.virtual.body import VirtualBody
from sceann_hil.errors import ConfigError


class _Server(socketserver.ThreadingTCPServer):
    allow_reuse_address = True
    """A robot that is switched off and on gets its address back: its old connections hold it for a minute."""
    daemon_threads = True


class RigServer:
    """Puts a virtual body where it is told to.

    Attributes:
        address: ``host:port``.

    Args:
        body: the body.
        port: to listen on; 0 for any that is free.

    Raises:
        ConfigError: nobody may listen there, or somebody does already.
    """

    def __init__(self, body: VirtualBody, port: int = 0) -> None:
        fields = body.robot.spec.start_fields

        class Handler(socketserver.StreamRequestHandler):
            def handle(self) -> None:
                with contextlib.suppress(OSError):
                    self.wfile.write((_answer(self.rfile.readline()) + "\n").encode())

        def _answer(line: bytes) -> str:
            try:
                asked = json.loads(line)
                if asked == ASK_END:
                    return body.ended.name.lower() if body.ended is not None else "running"
                start = asked["place"]
                body.place([float(start[field]) for field in fields])
            except (ValueError, KeyError, TypeError) as error:
                return f"cannot place the robot: expected {', '.join(fields)} ({type(error).__name__}: {error})"
            return "ok"

        try:
            self._server = _Server(("127.0.0.1", port), Handler)
        except OSError as error:
            raise ConfigError(f"--rig-port {port}: {error.strerror}.", "Choose another, or 0 for any.") from error
        host, number = self._server.server_address[:2]
        self.address = f"{host!s}:{number}"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.05,), name="rig", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()
