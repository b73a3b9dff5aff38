"""How a run shows that it is alive: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

if TYPE_CHECKING:
    from sceann_hil.run.experiment import Progress as RunProgress
    from sceann_hil.study.gap import Measured

_SECONDS_BETWEEN_LINES = 5.0


@contextmanager
def show_progress(console: Console, last_generation: int) -> Iterator[Callable[[RunProgress], None]]:
    """A function for `Experiment.evolve` to report to.

    Args:
        console: where it is shown; a bar if that is a terminal, else lines.
        last_generation: number of the run's last generation.
    """
    if not console.is_terminal:
        yield _lines(console)
        return
    columns = (
        TextColumn("generation"),
        MofNCompleteColumn(),
        BarColumn(),
        TextColumn("best [bold green]{task.fields[best]}[/] mean {task.fields[mean]}"),
        TextColumn("{task.fields[rate]} trials/s"),
        TextColumn("ETA"),
        TimeRemainingColumn(compact=True),
    )
    with Progress(*columns, console=console, transient=True) as bar:
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


def _lines(console: Console) -> Callable[[RunProgress], None]:
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

    return report


@contextmanager
def show_trials(console: Console, robot: str, n_trials: int) -> Iterator[Callable[[Measured], None]]:
    """A function for `measure` to report to.

    Args:
        console: where it is shown; a bar if that is a terminal, else a line now and then.
        robot: name of the robot that does the trials.
        n_trials: how many there will be.
    """
    columns = (TextColumn("{task.description}"), MofNCompleteColumn(), BarColumn(), TextColumn("ETA"))
    with Progress(
        *columns, TimeRemainingColumn(compact=True), console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        shown = bar.add_task(f"trials on {robot}", total=n_trials)
        done = 0
        last_line = time.monotonic()

        def report(trial: Measured) -> None:
            nonlocal done, last_line
            done += 1
            bar.update(shown, completed=done)
            now = time.monotonic()
            if not console.is_terminal and now - last_line >= _SECONDS_BETWEEN_LINES:
                last_line = now
                console.print(f"trial {done}/{n_trials} on {robot}: fitness {trial.fitness:.4g}")

        yield report
