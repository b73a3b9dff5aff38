"""How a run shows that it is alive: a bar on a terminal, a line now and then elsewhere.

Beside a robot that works one trial at a time there is a second line: the trial that runs with a clock, and what budget
and forecast say.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext

from rich.cells import cell_len
from rich.console import Console, RenderableType
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from sceann_hil.run.experiment import Progress as RunProgress
from sceann_hil.run.measuring import Report
from sceann_hil.supervision.operators import Desk, Phase, View

_SECONDS_BETWEEN_LINES = 5.0


@contextmanager
def show_preparation(console: Console) -> Iterator[Callable[[str, int, int], None]]:
    """A function to report to of what is prepared before a run: what, how much is done, how much there is."""
    columns = (TextColumn("{task.description}"), MofNCompleteColumn(), BarColumn(), TextColumn("ETA"))
    with Progress(
        *columns, TimeRemainingColumn(compact=True), console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        shown: dict[str, TaskID] = {}
        last_line = time.monotonic()

        def report(what: str, done: int, total: int) -> None:
            nonlocal last_line
            if what not in shown:
                shown[what] = bar.add_task(what, total=total)
            bar.update(shown[what], completed=done, total=total)
            now = time.monotonic()
            if not console.is_terminal and now - last_line >= _SECONDS_BETWEEN_LINES:
                last_line = now
                console.print(f"{what}: {done} of {total}")

        yield report


@contextmanager
def show_progress(
    console: Console,
    last_generation: int,
    desk: Desk | None = None,
    *,
    by_trial: bool = True,
    picture: Callable[[], RenderableType] | None = None,
) -> Iterator[Callable[[RunProgress], None]]:
    """A function for `Experiment.evolve` to report to.

    Args:
        console: where it is shown; a bar if that is a terminal, else lines.
        last_generation: number of the run's last generation.
        desk: where the run tells how its trials stand, and the console what is being typed.
        by_trial: the robot does its trials one by one.
        picture: drawn above the bar on a terminal.
    """
    by_trial = by_trial and desk is not None
    if not console.is_terminal:
        with _lines_by_trial(console, desk) if by_trial and desk is not None else _lines(console) as report:
            yield report
        return
    columns = (
        TextColumn("generation"),
        MofNCompleteColumn(),
        BarColumn(),
        TextColumn("best [bold green]{task.fields[best]}[/] mean {task.fields[mean]}"),
        *(() if by_trial else (TextColumn("{task.fields[rate]} trials/s"),)),
        TextColumn("ETA"),
        TimeRemainingColumn(compact=True),
    )
    with _Clocked(*columns, console=console, transient=True, desk=desk, clock=by_trial, picture=picture) as bar:
        shown = bar.add_task("evolve", total=last_generation, best="-", mean="-", rate="-")

        def report(progress: RunProgress) -> None:
            row = progress.generation
            bar.update(
                shown,
                completed=row.number,
                best=f"{row.best_fitness:.4g}",
                mean=f"{row.mean_fitness:.4g}",
                rate=f"{progress.trials / max(row.wall_s or 0.0, 1e-9):,.0f}",
            )

        yield report


class _Clocked(Progress):
    """A bar with a line below it that tells how the desk's trial stands.

    Args:
        columns: of the bar.
        console: where.
        transient: nothing is left of it in the end.
        desk: whose trial, and what is typed beside it; without one there is no such line.
        clock: whether its trial is shown.
        picture: what is drawn above the bar.
    """

    def __init__(
        self,
        *columns: str | ProgressColumn,
        console: Console,
        transient: bool,
        desk: Desk | None,
        clock: bool = True,
        picture: Callable[[], RenderableType] | None = None,
    ) -> None:
        self._picture = picture
        self._desk = desk
        self._clock = Clock() if clock else None
        super().__init__(*columns, console=console, transient=transient)

    def get_renderables(self) -> Iterable[RenderableType]:
        if self._picture is not None:
            yield self._picture()
        yield from super().get_renderables()
        if self._desk is not None and self._clock is not None:
            if remark := self._desk.view().status.remark:
                yield Text(remark)
            yield Text(self._clock.line(self._desk.view()), overflow="ellipsis", no_wrap=True)
        if self._desk is not None and (typed := self._desk.typing):
            yield Text(_end_of(f"{typed}_", self.console.width), no_wrap=True)


def _end_of(line: str, width: int) -> str:
    """What fits of a line that is being written: its end."""
    while cell_len(line) >= width:
        line = line[1:]
    return line


class Clock:
    """Knows how long the desk's phase has lasted, and says in a line how run and trial stand."""

    def __init__(self) -> None:
        self._now: tuple[Phase, str] = (Phase.IDLE, "")
        self._since_s = time.monotonic()

    def line(self, view: View) -> str:
        """For people, shortest first: what is cut off on a narrow terminal matters least."""
        status, title = view.status, view.situation.title if view.situation else ""
        if (view.phase, title) != self._now:
            self._now, self._since_s = (view.phase, title), time.monotonic()
        doing = {
            Phase.RUNNING: "running",
            Phase.BEFORE: "waits for you",
            Phase.AFTER: "waits for your verdict",
        }.get(view.phase, "between trials")
        if view.phase is Phase.PAUSED:
            doing = f"paused ({view.reason})"
        if view.phase is Phase.SUSPENDED:
            doing = status.warnings[0] if status.warnings else f"suspended: {view.reason}"
        parts = [
            f"trial {min(status.done + 1, status.todo)} of {status.todo}",
            f"{doing} {_clock(time.monotonic() - self._since_s)}",
            *status.left,
            status.best,
            status.forecast,
        ]
        return " · ".join(part for part in parts if part)


def _clock(seconds: float) -> str:
    """As on a stop watch: 0:07, 12:34, 1:02:03."""
    minutes, second = divmod(int(seconds), 60)
    hours, minute = divmod(minutes, 60)
    return f"{hours}:{minute:02}:{second:02}" if hours else f"{minute}:{second:02}"


@contextmanager
def _lines(console: Console) -> Iterator[Callable[[RunProgress], None]]:
    last_line = -_SECONDS_BETWEEN_LINES

    def report(progress: RunProgress) -> None:
        nonlocal last_line
        row = progress.generation
        now = time.monotonic()
        if now - last_line >= _SECONDS_BETWEEN_LINES or row.number == progress.last_generation:
            last_line = now
            console.print(
                f"generation {row.number}/{progress.last_generation}: best {row.best_fitness:.4g}, "
                f"mean {row.mean_fitness:.4g}, success {row.success_rate:.0%}"
            )

    yield report


@contextmanager
def _lines_by_trial(console: Console, desk: Desk) -> Iterator[Callable[[RunProgress], None]]:
    """Lines of generations, and between them one now and then of the newest trial."""
    over = threading.Event()
    remarked = ""

    def tell_remark() -> None:
        nonlocal remarked
        if (remark := desk.view().status.remark) and remark != remarked:
            remarked = remark
            console.print(remark, markup=False, soft_wrap=True)

    def watch() -> None:
        shown, waiting = None, ""
        while not over.wait(_SECONDS_BETWEEN_LINES):
            tell_remark()
            view = desk.view()
            newest = view.history[0] if view.history else None
            if view.phase is Phase.SUSPENDED and view.reason != waiting:
                console.print(f"{'; '.join(view.status.warnings)}; waiting until it is good again", soft_wrap=True)
            waiting = view.reason if view.phase is Phase.SUSPENDED else ""
            if newest is not None and newest is not shown:
                shown = newest
                status = view.status
                left = f" ({'; '.join((*status.left, status.forecast))})" if status.left or status.forecast else ""
                console.print(
                    f"{status.done} of {status.todo} trials: {newest.title}: {newest.outcome}{left}",
                    markup=False,
                    soft_wrap=True,
                )

    watcher = threading.Thread(target=watch, name="progress", daemon=True)
    watcher.start()
    try:
        with _lines(console) as report:

            def told(progress: RunProgress) -> None:
                # trials may be shorter than the time between two looks
                tell_remark()
                report(progress)

            yield told
    finally:
        over.set()
        watcher.join()


@contextmanager
def show_trials(console: Console, robot: str, n_trials: int, desk: Desk | None = None) -> Iterator[Report]:
    """A function for a measurement to report to.

    Args:
        console: where it is shown; a bar if that is a terminal, else a line now and then.
        robot: name of the robot that does the trials.
        n_trials: how many there will be.
        desk: where the measurement tells how it stands, if people are there.
    """
    columns = (TextColumn("{task.description}"), MofNCompleteColumn(), BarColumn(), TextColumn("ETA"))
    if not console.is_terminal:
        with _lines_by_trial(console, desk) if desk is not None else nullcontext():
            yield _line_of_trials(console, robot) if desk is None else lambda *_: None
        return
    with _Clocked(*columns, TimeRemainingColumn(compact=True), console=console, transient=True, desk=desk) as bar:
        shown = bar.add_task(f"trials on {robot}", total=n_trials)
        yield lambda done, _total, _fitness: bar.update(shown, completed=done)


def _line_of_trials(console: Console, robot: str) -> Report:
    last_line = time.monotonic()

    def report(done: int, total: int, fitness: float) -> None:
        nonlocal last_line
        now = time.monotonic()
        if now - last_line >= _SECONDS_BETWEEN_LINES:
            last_line = now
            console.print(f"trial {done}/{total} on {robot}: fitness {fitness:.4g}", markup=False)

    return report
