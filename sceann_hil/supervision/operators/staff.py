"""The operators that a configuration names, at one desk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial

from sceann_hil.robot import Robot
from sceann_hil.supervision.operators.console import Console
from sceann_hil.supervision.operators.desk import Desk
from sceann_hil.supervision.operators.keys import open_keys
from sceann_hil.supervision.operators.prompter import Prompter, ring
from sceann_hil.supervision.operators.script import Script
from sceann_hil.supervision.operators.settings import OperatorConfig, Prompt, Who
from sceann_hil.supervision.stopping import StopRequest, nobody


@contextmanager
def staffed_desk(
    robot: Robot, settings: OperatorConfig, show: Callable[[str], object], stop: Callable[[], StopRequest] = nobody
) -> Iterator[Desk]:
    """A desk with all of them at it, for as long as the block lasts.

    Args:
        robot: the robot that they stand beside.
        settings: who they are.
        show: prints a line at the console.
        stop: what the command line wants.

    Raises:
        UserError: somebody cannot come; nothing has moved yet.
    """
    who = settings.resolved(attended=robot.spec.attended)
    desk = Desk(asks=bool(who), on_emergency=robot.make_safe, stop=stop)
    keymap = settings.keymap
    help_text: Callable[[], str] = str
    with ExitStack() as present:
        if Who.WEB in who:
            # the page needs a server and a QR encoder, which most runs do not
            from sceann_hil.supervision.operators.web import WebPanel, described

            panel = WebPanel(desk, settings.host, settings.port, robot.drawing, settings.prompt, keymap)
            present.enter_context(panel)
            help_text = partial(described, panel)
            show(help_text())
        if Who.SCRIPT in who:
            present.enter_context(Script(desk, settings.steps, repeat=settings.repeat_script))
        if Who.CONSOLE in who:
            present.enter_context(Console(desk, open_keys(), show, keymap, help_text, robot.drawing))
        if settings.prompt is not Prompt.NONE and who:
            present.enter_context(Prompter(desk, settings.prompt, ring))
        try:
            yield desk
        finally:
            desk.close("the run is over")
