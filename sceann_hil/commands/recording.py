"""Recording beside an evolution, seen from the commands: start it, wait for it, say how it ended."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from sceann_hil.errors import ViewerUnavailable, as_user_error
from sceann_hil.pasting import pasteable
from sceann_hil.recording import Detail, RecorderProcess, RecorderStatus, State
from sceann_hil.recording.display import require_display
from sceann_hil.recording.feed import LiveFeed
from sceann_hil.robot import Robot

_SECONDS_BETWEEN_LOOKS = 0.2


class RecordChoice(StrEnum):
    """Which trials go to the viewer."""

    ALL = "all"
    BEST = "best"
    NONE = "none"


Record = Annotated[
    RecordChoice,
    typer.Option(help="Trials to record for the viewer: all, those of each generation's best, none."),
]


Live = Annotated[
    bool,
    typer.Option(
        "--live", help="Show the running trial in the viewer while the robot moves; in simulation only with --watch."
    ),
]


def must_be_watchable(robot: Robot, *, again: bool = False) -> None:
    """Refuse a live view that would show nothing.

    Args:
        robot: whose trials.
        again: trials are shown again afterwards.

    Raises:
        ViewerUnavailable: the robot has no steps to watch, or there is no display.
    """
    if robot.spec.batch_size != 1 and not again:
        raise ViewerUnavailable(
            f"--live: {robot.spec.name} does whole batches of trials at once; there are no steps to watch.",
            "Add --watch, which shows the best of every generation again, or leave --live out: `sceann view RUN` shows "
            "every trial afterwards.",
        )
    require_display()


@contextmanager
def watched_live(robot: Robot, directory: Path, show: Callable[[str], object]) -> Iterator[None]:
    """Show the robot's trials during the block, as `live_view`.

    Args:
        robot: whose trials.
        directory: of the run.
        show: prints a line.
    """
    with live_view(directory, show) as feed:
        robot.observe(feed)
        try:
            yield
        finally:
            robot.observe(None)


@contextmanager
def live_view(directory: Path, show: Callable[[str], object]) -> Iterator[LiveFeed]:
    """A viewer for trials as they happen. The run goes on without it, but not without saying so.

    Args:
        directory: of the run.
        show: prints a line.
    """
    feed = LiveFeed(directory)
    over = threading.Event()

    def watch() -> None:
        while not over.wait(_SECONDS_BETWEEN_LOOKS):
            if failure := feed.failure:
                show(f"! The live view has ended, the run goes on: {failure}")
                return

    watcher = threading.Thread(target=watch, name="live view", daemon=True)
    watcher.start()
    try:
        yield feed
    finally:
        over.set()
        watcher.join()
        feed.close()


@contextmanager
def recorded(console: Console, directory: Path, choice: RecordChoice) -> Iterator[None]:
    """Record a run during the block, and leave the rest of it to the recorder.

    Args:
        console: where it is said how things stand.
        directory: the run; its journal exists.
        choice: which trials.
    """
    if choice is RecordChoice.NONE:
        yield
        return
    if missing := _what_is_missing():
        # nobody would read in the end what a recorder in the background says of it
        yield
        _tell_of_failure(console, directory, missing)
        return
    recorder = RecorderProcess(directory, Detail(choice.value))
    recorder.start()
    try:
        yield
    except BaseException:
        recorder.finish(timeout_s=0.0)
        raise
    status = recorder.finish(timeout_s=0.0)
    if status.state is State.FAILED:
        _tell_of_failure(console, directory, status.message)
    elif status.state is not State.FINISHED:
        console.print(
            "Recording goes on in the background, at low priority: nobody has to wait for it. How far it is: "
            f"`sceann status {pasteable(directory)}`. To wait: `sceann record {pasteable(directory)}`.",
            markup=False,
            soft_wrap=True,
        )


def _what_is_missing() -> str:
    """Why nothing can be recorded here, if the package that draws is not installed."""
    try:
        if find_spec("rerun") is not None:
            return ""
    except ImportError:
        pass
    return str(as_user_error(ModuleNotFoundError("No module named 'rerun'", name="rerun")) or "rerun is not installed")


def _tell_of_failure(console: Console, directory: Path, why: str) -> None:
    console.print(f"[bold red]Not everything was recorded:[/] {escape(why)}", soft_wrap=True)
    again = f"sceann record {pasteable(directory)}"
    console.print(f"The run itself is complete; `{again}` makes the rest.", markup=False, soft_wrap=True)


@contextmanager
def show_recording(console: Console) -> Iterator[Callable[[RecorderStatus], None]]:
    """A function to report to: a bar on a terminal, one line elsewhere."""
    if not console.is_terminal:
        yield _one_line(console)
        return
    columns = (
        TextColumn("recording: generation"),
        MofNCompleteColumn(),
        BarColumn(),
        TextColumn("ETA"),
        TimeRemainingColumn(compact=True),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        shown = bar.add_task("record", total=None)
        yield lambda status: bar.update(shown, completed=status.generations, total=status.known or None)


def _one_line(console: Console) -> Callable[[RecorderStatus], None]:
    told = time.monotonic()

    def report(status: RecorderStatus) -> None:
        nonlocal told
        if time.monotonic() - told > 5.0:
            told = time.monotonic()
            console.print(f"recorded {status.generations} of {status.known} generations")

    return report
