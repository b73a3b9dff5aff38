"""The operator with a phone: one page, served by the run itself, that shows the desk and presses verbs.

A page that is loaded again, or a second device, sees the same view; the desk decides whose answer was first.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import threading
from concurrent.futures import ThreadPoolExecutor

from tornado.netutil import bind_sockets

from sceann_hil.errors import PanelUnavailable
from sceann_hil.robot.drawing import Drawing
from sceann_hil.supervision.operators.desk import Desk
from sceann_hil.supervision.operators.keymap import KeyMap
from sceann_hil.supervision.operators.messages import Receipt
from sceann_hil.supervision.operators.operator import Operator
from sceann_hil.supervision.operators.settings import Prompt
from sceann_hil.supervision.operators.verbs import Verb
from sceann_hil.supervision.operators.web.access import Access, in_a_link, is_local, reachable_host
from sceann_hil.supervision.operators.web.document import as_json
from sceann_hil.supervision.operators.web.gate import serve_until_done
from sceann_hil.supervision.operators.web.pose import draw_pose
from sceann_hil.supervision.operators.web.server import ALIVE_S, Behind, Feed, panel_server

BACKLOG = 1024
"""Connections that the system keeps for us until we look: a burst of strangers must not make a phone wait and retry."""
PRESSING_THREADS = 8
"""A press that waits for the robot's line keeps no other one waiting."""
_BETWEEN_DOCUMENTS_S = 0.03
_LAST_WORDS_S = 0.1


class WebPanel(Operator):
    """Serves the page.

    Attributes:
        url: where the page is, with the token that it needs.
        port: on which it listens.

    Args:
        desk: where to press.
        host: address to listen on; ``::`` is every address, IPv4 and IPv6.
        port: 0 for any that is free.
        drawing: for the picture of the start pose.
        prompt: whether the page beeps or speaks.
        keymap: what keys say on the page.

    Raises:
        PanelUnavailable: the port is in use, or the address is not this machine's.
    """

    name = "web"

    def __init__(
        self,
        desk: Desk,
        host: str,
        port: int,
        drawing: Drawing | None = None,
        prompt: Prompt = Prompt.NONE,
        keymap: KeyMap | None = None,
    ) -> None:
        super().__init__(desk)
        self._drawing = drawing
        self._prompt = prompt
        self._keymap = keymap or KeyMap()
        try:
            # "" is every address of both families, where the system has both
            self._sockets = bind_sockets(port, "" if host == "::" else host, backlog=BACKLOG)
        except (OSError, ValueError, OverflowError) as error:
            in_use = isinstance(error, OSError) and error.errno == errno.EADDRINUSE
            said = (error.strerror if isinstance(error, OSError) else None) or error
            why = "is in use" if in_use else f"cannot be opened: {said}"
            raise PanelUnavailable(
                f"operator.port: port {port} at {host:.100} {why}.",
                "Close the other program, or choose another one: --set operator.port=0 takes any free port."
                if in_use
                else "operator.host: expected an address of this machine, such as 127.0.0.1, ::1 or 0.0.0.0.",
            ) from error
        self.port: int = self._sockets[0].getsockname()[1]
        self.access = Access(host, self.port)
        self.is_local = is_local(host)
        where = host if self.is_local else reachable_host(host)
        self.url = f"http://{in_a_link(where)}:{self.port}/?t={self.access.token}"
        self._loop: asyncio.AbstractEventLoop | None = None
        self._over = asyncio.Event()

    def _serve(self) -> None:
        serve_until_done(self._work())

    async def _work(self) -> None:
        self._loop = loop = asyncio.get_running_loop()
        if self._leaving.is_set():
            return
        loop.set_default_executor(ThreadPoolExecutor(PRESSING_THREADS, "press"))
        feed = Feed()
        behind = Behind(self.access, self._press, self._pose, self.desk.seen, feed)
        server = panel_server(behind, self._sockets)
        sweeping = asyncio.create_task(server.keep_order())
        threading.Thread(target=self._watch, args=(loop, feed), name="panel view", daemon=True).start()
        await self._over.wait()
        sweeping.cancel()
        server.stop()
        # how the run ended is the last thing that pages hear
        feed.put(as_json(self.desk.view(), self._prompt, self._keymap), last=True)
        await asyncio.sleep(_LAST_WORDS_S if len(server.friends) else 0.0)
        await server.close_all_connections()

    def _watch(self, loop: asyncio.AbstractEventLoop, feed: Feed) -> None:
        """Hand every new view to the pages, in a thread that may wait for the desk."""
        version = -1
        # the loop is closed while this thread waits, if the panel goes
        with contextlib.suppress(RuntimeError):
            while not self._leaving.wait(_BETWEEN_DOCUMENTS_S):
                view = self.desk.wait(version, ALIVE_S)
                if view.version > version:
                    version = view.version
                    loop.call_soon_threadsafe(feed.put, as_json(view, self._prompt, self._keymap))

    def _press(self, verb: Verb, question: int | None, text: str) -> Receipt:
        return self.desk.press(verb, by=self.name, question=question, text=text)

    def _pose(self) -> str:
        situation = self.desk.view().situation
        return draw_pose(self._drawing, dict(situation.start if situation else ()))

    def stop(self) -> None:
        self._leaving.set()
        if self._loop is not None:
            # it may be closed already
            with contextlib.suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._over.set)
        super().stop()
        if not self._thread.is_alive():
            for listening in self._sockets:
                listening.close()
