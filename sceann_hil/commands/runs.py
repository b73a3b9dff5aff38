"""All runs below a folder in one table: for a class at one computer, and for an afternoon's tries."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from enum import StrEnum
from fnmatch import fnmatch
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from sceann_hil.commands.arguments import AsJson, print_json
from sceann_hil.commands.printing import print_table
from sceann_hil.config import outline_of
from sceann_hil.errors import NotARun, UserError, as_user_error
from sceann_hil.journal import JOURNAL_NAME, JournalReader, RunLock
from sceann_hil.timespans import moment_text


class State(StrEnum):
    """How a run stands."""

    RUNNING = "running"
    STOPPED = "stopped"
    FINISHED = "finished"
    UNREADABLE = "unreadable"


class Order(StrEnum):
    """What the table is sorted by."""

    CREATED = "created"
    BEST = "best"
    FOLDER = "folder"


@dataclass(frozen=True, slots=True)
class RunLine:
    """One run in the table; what is not known is None.

    Attributes:
        folder: where it is, seen from the folder that was asked for.
        state: how it stands.
        name, task, robot, algorithm: of its configuration.
        seed: its root seed.
        created_at: when it was begun.
        generations: finished ones.
        generations_in_all: as configured.
        trials: attempts so far.
        robot_s: robot time of the finished generations.
        best_fitness: the best ever.
        problem: why it cannot be read.
    """

    folder: str
    state: State
    name: str = ""
    task: str = ""
    robot: str = ""
    algorithm: str = ""
    seed: int | None = None
    created_at: str = ""
    generations: int | None = None
    generations_in_all: int | None = None
    trials: int | None = None
    robot_s: float | None = None
    best_fitness: float | None = None
    problem: str = ""


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(runs)


def runs(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Where to look, with all folders below.")] = Path(
        "runs"
    ),
    name: Annotated[str, typer.Option("--name", help="Only runs whose folder or name is like this: 'anna*'.")] = "*",
    task: Annotated[str, typer.Option("--task", help="Only this task.")] = "*",
    robot: Annotated[str, typer.Option("--robot", help="Only this robot.")] = "*",
    algorithm: Annotated[str, typer.Option("--algorithm", help="Only this algorithm.")] = "*",
    state: Annotated[list[State] | None, typer.Option("--state", help="Only such runs; may be given again.")] = None,
    order: Annotated[Order, typer.Option("--sort", help="By when they were begun, by best fitness, or by folder.")] = (
        Order.CREATED
    ),
    page: Annotated[
        Path | None, typer.Option("--page", metavar="FILE.html", help="Write the table as a page as well.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show all runs below a folder in one table.

    Example: sceann runs --task goal_reach --sort best

    Example: sceann runs /home/class --name 'anna*' --page runs.html
    """
    if not folder.is_dir():
        raise NotARun(f"{folder}: there is no such folder.", "Name the folder that your runs are in.")
    found = [
        line
        for line in (_line(run, folder) for run in _below(folder))
        if (fnmatch(line.folder, name) or fnmatch(Path(line.folder).name, name) or fnmatch(line.name, name))
        and (fnmatch(line.task, task) and fnmatch(line.robot, robot) and fnmatch(line.algorithm, algorithm))
        and (not state or line.state in state)
    ]
    found = _sorted(found, order)
    if page is not None:
        page.write_text(_page(found, folder), encoding="utf-8")
    if as_json:
        print_json({"runs": [asdict(line) for line in found]})
        return
    console = Console(highlight=False)
    if not found:
        console.print(f"No such run below {escape(str(folder))}.")
        return
    # what does not fit a narrow terminal is left to --json and --page: cut-off words tell nobody anything
    shown = [place for place, heading in enumerate(_HEADINGS) if console.width >= _WIDE or heading not in _LEFT_OUT]
    table = Table()
    for place in shown:
        table.add_column(_HEADINGS[place], no_wrap=place > 0, overflow="fold")
    for line in found:
        cells = _cells(line)
        table.add_row(*(escape(cells[place]) for place in shown))
    print_table(console, f"{len(found)} run{'s' if len(found) > 1 else ''} below {folder}", table)
    for line in found:
        if line.problem:
            console.print(f"{escape(line.folder)}: {escape(line.problem)}", soft_wrap=True)


_WIDE = 110
"""Columns of a terminal that has room for everything."""
_LEFT_OUT = frozenset({"task", "robot", "trials"})
_HEADINGS = ("folder", "state", "task", "robot", "generations", "trials", "best", "begun")


def _cells(line: RunLine) -> tuple[str, ...]:
    done = "" if line.generations is None else f"{line.generations} of {line.generations_in_all}"
    best = "" if line.best_fitness is None else f"{line.best_fitness:.4g}"
    trials = "" if line.trials is None else f"{line.trials:,}"
    return (
        line.folder,
        line.state.value,
        line.task,
        line.robot,
        done,
        trials,
        best,
        moment_text(line.created_at),
    )


def _below(folder: Path) -> Iterator[Path]:
    """Folders of runs, each once however links lead to it."""
    seen: set[tuple[int, int]] = set()
    for where, below, files in os.walk(folder, followlinks=True):
        status = Path(where).stat()
        if (status.st_dev, status.st_ino) in seen:
            below.clear()
            continue
        seen.add((status.st_dev, status.st_ino))
        below.sort()
        if JOURNAL_NAME in files:
            yield Path(where)
            below.clear()


def _line(run: Path, folder: Path) -> RunLine:
    shown = str(run.relative_to(folder)) if run != folder else run.name or str(run)
    try:
        return _read(run, shown)
    except Exception as error:
        told = error if isinstance(error, UserError) else as_user_error(error)
        if told is None:
            raise
        return RunLine(shown, State.UNREADABLE, problem=told.message)


def _read(run: Path, shown: str) -> RunLine:
    reader = JournalReader(run)
    try:
        row = reader.run()
        outline = outline_of(row.config, f"{run}: journalled configuration")
        done = reader.generations(finished=True)
        events = reader.events()
        finished = len(done) == outline.generations + 1 or (bool(events) and events[-1][2] == "finished")
        state = State.FINISHED if finished else State.RUNNING if RunLock.is_held(run) else State.STOPPED
        return RunLine(
            folder=shown,
            state=state,
            name=row.name,
            task=outline.task,
            robot=outline.robot,
            algorithm=outline.algorithm,
            seed=row.root_seed,
            created_at=row.created_at,
            generations=len(done),
            generations_in_all=outline.generations + 1,
            trials=reader.count_attempts(),
            robot_s=sum(robot_s for _, _, robot_s, _ in reader.costs()),
            best_fitness=max((g.best_fitness for g in done if g.best_fitness is not None), default=None),
        )
    finally:
        reader.close()


def _sorted(lines: list[RunLine], order: Order) -> list[RunLine]:
    if order is Order.BEST:
        return sorted(lines, key=lambda line: (line.best_fitness is None, -(line.best_fitness or 0.0), line.folder))
    return sorted(lines, key=lambda line: (line.created_at if order is Order.CREATED else "", line.folder))


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>
body {{ font: 16px/1.4 system-ui, sans-serif; margin: 1.5rem; color: #0f172a; }}
table {{ border-collapse: collapse; }}
th, td {{ text-align: left; padding: .3rem .8rem; border-bottom: 1px solid #cbd5e1; }}
th {{ background: #f1f5f9; }} tr.unreadable td {{ color: #b91c1c; }}
</style></head><body><h1>{title}</h1><table><thead><tr>{headings}</tr></thead><tbody>
{rows}
</tbody></table></body></html>
"""


def _page(lines: list[RunLine], folder: Path) -> str:
    def row(tag: str, cells: tuple[str, ...]) -> str:
        return "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells)

    rows = (
        f'<tr class="{line.state.value}" title="{html.escape(line.problem)}">{row("td", _cells(line))}</tr>'
        for line in lines
    )
    title = html.escape(f"Runs below {folder}")
    return _PAGE.format(title=title, headings=row("th", _HEADINGS), rows="\n".join(rows))
