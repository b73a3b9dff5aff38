"""How a study shows that it is alive: bars on a terminal, a line per finished condition everywhere."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from sceann_hil.errors import ExitCode
from sceann_hil.study import BlockResult, Condition, Observer, Todo
from sceann_hil.timespans import duration_text

_SECONDS_BETWEEN_LINES = 10.0


@contextmanager
def show_study_progress(console: Console) -> Iterator[Observer]:
    """An observer for `run_study` that shows on `console` what is done and how long the rest will take."""
    if not console.is_terminal:
        yield _Lines(console)
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("runs, ETA"),
        TimeRemainingColumn(compact=True),
    )
    with Progress(*columns, console=console, transient=True) as bars:
        yield _Bars(console, bars)


def tell_disk_full(console: Console) -> None:
    """Say that the work waits."""
    console.print(
        "[bold red]The disk is full.[/] Waiting: free some space and the work goes on by itself. Ctrl-C stops it; "
        "nothing that was recorded is lost."
    )


@contextmanager
def told_when_interrupted(console: Console) -> Iterator[None]:
    """Ctrl-C ends the command with its own exit code and one sentence."""
    try:
        yield
    except KeyboardInterrupt:
        console.print("Stopped, as asked. What was recorded is safe; the same command goes on.")
        raise typer.Exit(ExitCode.INTERRUPTED_NOW) from None


class _Lines(Observer):
    def __init__(self, console: Console) -> None:
        self._console = console
        self._last_line = -_SECONDS_BETWEEN_LINES

    def begin(self, todo: Todo) -> None:
        self._todo = todo
        self._started = time.monotonic()
        self._missing = [len(runs) for runs in todo.runs]
        self._cost = sum(n * cost for n, cost in zip(self._missing, todo.trials, strict=True))
        self._left = self._cost
        have = sum(n == 0 for n in self._missing)
        n = len(self._missing)
        self._console.print(f"{n} conditions, {have} of them done; {todo.n_runs} runs to do")
        self._tally: dict[int, list[BlockResult]] = {}

    def finished(self, condition: Condition, result: BlockResult) -> None:
        number, n = condition.number, len(result.fitness)
        self._missing[number] -= n
        self._left -= n * self._todo.trials[number]
        self._tally.setdefault(number, []).append(result)
        self._advance(condition, n)
        now = time.monotonic()
        if self._missing[number] == 0:
            self._console.print(self._line(condition), soft_wrap=True, markup=False)
            del self._tally[number]
            self._last_line = now
        elif now - self._last_line > _SECONDS_BETWEEN_LINES and not self._console.is_terminal:
            self._console.print(
                f"  {condition.label}: {self._missing[number]} runs left, {self._eta()}", soft_wrap=True, markup=False
            )
            self._last_line = now

    def disk_full(self) -> None:
        tell_disk_full(self._console)

    def _advance(self, condition: Condition, n: int) -> None:
        """For bars."""

    def _line(self, condition: Condition) -> str:
        blocks = self._tally[condition.number]
        fitness = sum(float(block.fitness.sum()) for block in blocks)
        succeeded = sum(int((block.successes > 0).sum()) for block in blocks)
        n = sum(len(block.fitness) for block in blocks)
        done = sum(missing == 0 for missing in self._missing)
        return (
            f"[{done}/{len(self._missing)}] {condition.label}: best {fitness / n:.4g} (mean of {n} runs), "
            f"{succeeded / n:.0%} succeed; {self._eta()}"
        )

    def _eta(self) -> str:
        done = self._cost - self._left
        left_s = (time.monotonic() - self._started) * self._left / max(done, 1)
        return f"ETA {duration_text(left_s)}"


class _Bars(_Lines):
    def __init__(self, console: Console, bars: Progress) -> None:
        super().__init__(console)
        self._bars = bars
        self._rows: dict[int, TaskID] = {}

    def begin(self, todo: Todo) -> None:
        super().begin(todo)
        self._all = self._bars.add_task("all conditions", total=todo.n_runs)

    def _advance(self, condition: Condition, n: int) -> None:
        number = condition.number
        if number not in self._rows:
            self._rows[number] = self._bars.add_task(condition.label, total=len(self._todo.runs[number]))
        self._bars.advance(self._rows[number], n)
        self._bars.advance(self._all, n)
        if self._missing[number] == 0:
            self._bars.remove_task(self._rows[number])
