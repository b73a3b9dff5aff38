"""Looking into a run: how it stands, whether it can be trusted, as a table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from sceann_hil.commands.arguments import AsJson, RunDirectory, print_json
from sceann_hil.commands.printing import print_table
from sceann_hil.config import outline_of
from sceann_hil.errors import ReplayDiffers
from sceann_hil.journal import AttemptRow, IndividualRow, JournalReader, RunLock
from sceann_hil.journal.tables import export_csv
from sceann_hil.journal.verify import require_sound
from sceann_hil.pasting import pasteable
from sceann_hil.recording.process import status_now
from sceann_hil.run.champion import best_so_far, champion_of
from sceann_hil.timespans import duration_text, moment_text
from sceann_hil.versions import running_versions, version_differences, write_versions

if TYPE_CHECKING:
    from sceann_hil.run.replay import Comparison


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(status)
    app.command("replay")(replay_trial)
    app.command("export-csv")(export_tables)


def status(directory: RunDirectory, as_json: AsJson = False) -> None:
    """Show how a run stands, also while it is running.

    Example: sceann status runs/first
    """
    reader = JournalReader(directory)
    run, sessions = reader.run(), reader.sessions()
    outline = outline_of(run.config, f"{directory}: journalled configuration")
    generations = reader.generations(finished=True)
    champion = champion_of(reader, keeps_best=outline.keeps_best)
    last = outline.generations
    events = reader.events()
    finished = len(generations) == last + 1 or (bool(events) and events[-1][2] == "finished")
    state = "finished" if finished else "running" if RunLock.is_held(directory) else "stopped"
    recording = status_now(directory)
    leading = None if finished else best_so_far(reader)
    best = max(generations, key=lambda row: row.best_fitness or 0.0, default=None)
    document: dict[str, Any] = {
        "directory": str(directory),
        "name": run.name,
        "state": state,
        "created_at": run.created_at,
        "root_seed": run.root_seed,
        "generations_finished": len(generations),
        "generations_in_all": last + 1,
        "trials": reader.count_attempts(),
        "robot_s": sum(robot_s for _, _, robot_s, _ in reader.costs()),
        "wall_s": sum(row.wall_s for row in sessions),
        "operator_s": reader.operator_s(),
        "best_fitness_ever": best and best.best_fitness,
        "champion": champion and _document_of(champion),
        "best_so_far": leading and {**_document_of(leading.individual), "trials": leading.trials},
        "recording": recording and asdict(recording),
        "versions": run.versions,
        "sessions": [
            {
                "session": row.id,
                "started_at": row.started_at,
                "robot": row.robot,
                "versions": row.versions,
                "body": row.body,
            }
            for row in sessions
        ],
    }
    if as_json:
        print_json(document)
        return
    console = Console(highlight=False)
    table = Table(show_header=False)
    table.add_row("folder", escape(str(directory)))
    table.add_row("begun", moment_text(run.created_at))
    table.add_row("task, robot", f"{outline.task}, {outline.robot}")
    table.add_row("algorithm, coding", f"{outline.algorithm}, {outline.coding}")
    table.add_row("root seed", str(run.root_seed))
    table.add_row("generations", f"{len(generations)} of {last + 1}")
    table.add_row("trials", f"{document['trials']:,}")
    table.add_row("robot time", duration_text(document["robot_s"]))
    if document["operator_s"]:
        table.add_row("a person's time at prompts", duration_text(document["operator_s"]))
    kinds = {(tuple(row.versions.items()), row.robot, row.body) for row in sessions}
    if len({versions for versions, _, _ in kinds}) > 1 or len(kinds) > len({robot for _, robot, _ in kinds}):
        table.add_row("sessions", f"{len(sessions)}, on different versions or bodies: --json lists them")
    if champion:
        table.add_row("champion", f"{champion.place}: fitness [bold]{champion.fitness:.4g}[/]")
        table.add_row("its genome", champion.genome)
    if leading:
        table.add_row("unfinished generation", f"{leading.individual.generation}, {leading.counted} trials counted")
        so_far = f"individual {leading.individual.number}: fitness [bold]{leading.individual.fitness:.4g}[/]"
        table.add_row("best in it so far", f"{so_far}, {leading.trials} trial{'s' if leading.trials > 1 else ''}")
    if recording is not None:
        table.add_row("recording", escape(recording.words))
    print_table(console, f"{run.name}: {state}", table)
    if generations:
        console.print("best fitness by generation", _sparkline([row.best_fitness or 0.0 for row in generations]))
    if state == "stopped":
        console.print(f"  sceann resume {pasteable(directory)}", markup=False, soft_wrap=True)


def _document_of(row: IndividualRow) -> dict[str, Any]:
    told = {"individual": row.id, "generation": row.generation, "number": row.number}
    return {**told, "fitness": row.fitness, "genome": row.genome}


def replay_trial(
    directory: RunDirectory,
    trial: Annotated[int | None, typer.Argument(metavar="TRIAL", help="Its number.", show_default=False)] = None,
    every: Annotated[bool, typer.Option("--all", help="Replay every trial of the run.")] = False,
    as_json: AsJson = False,
) -> None:
    """Run a journalled trial again and prove that it gives the same bits.

    Example: sceann replay runs/first 17
    """
    if (trial is None) is not every:
        raise typer.BadParameter("name one TRIAL, or give --all")
    from sceann_hil.config import journalled_config
    from sceann_hil.run.replay import (  # bodies and their compiled code
        replay,
        sessions_of_another_body,
    )

    # what a trial gives again is compared with the row as it stands; what no replay can tell is checked after it
    reader = JournalReader(directory, checked=False)
    config = journalled_config(reader)
    others = _other_versions(reader)
    for line in others:
        typer.echo(f"note: {line}", err=True)
    compared: list[tuple[int, list[Comparison]]] = []
    n_compared = 0
    sessions: set[int | None] = set()
    with config.robot.build() as robot:
        for rows in [[reader.attempt(trial)]] if trial is not None else _counted(reader):
            sessions |= {row.session for row in rows}
            n_compared += len(rows)
            pairs = zip([row.id for row in rows], replay(reader, config, robot, rows), strict=True)
            compared += [pair for pair in pairs if trial is not None or not all(c.equal for c in pair[1])]
        bodies = sessions_of_another_body(reader, robot, sessions)
    different = [identity for identity, comparisons in compared if not all(c.equal for c in comparisons)]
    if as_json:
        print_json(
            {
                "replayed": n_compared,
                "other_versions": others,
                "different": different,
                "sessions_with_another_body": bodies,
                "trials": {
                    identity: {c.quantity: {"journalled": c.journalled, "replayed": c.replayed} for c in comparisons}
                    for identity, comparisons in compared
                },
            }
        )
    else:
        _print_replay(compared if trial is not None else [], n_compared, different, bodies)
    if different:
        shown = ", ".join(map(str, different[:10])) + (" ..." if len(different) > 10 else "")
        raise ReplayDiffers(
            f"{len(different)} of {n_compared} replayed trials differ from the journal: {shown}.",
            f"The journal names the versions it was written with: {reader.run().versions}.",
        )
    if trial is not None:
        JournalReader(directory).attempt(trial)
    else:
        require_sound(directory)


def _counted(reader: JournalReader) -> Iterator[list[AttemptRow]]:
    """The counted trials of each finished generation."""
    for generation in reader.generations(finished=True):
        if rows := [row for row in reader.attempts(generation.number) if row.fitness is not None]:
            yield rows


def _other_versions(reader: JournalReader) -> list[str]:
    """In what the sessions of a run differ from this process, one line for each session that does."""
    now = running_versions()
    return [
        f"session {row.id} ({row.started_at}) ran on other versions: {'; '.join(lines)}"
        for row in reader.sessions()
        if (lines := version_differences(row.versions, now))
    ]


def export_tables(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of a run, or of a study.", show_default=False)
    ],
    out: Annotated[Path | None, typer.Option("--out", metavar="FOLDER", show_default="DIR/tables")] = None,
    form: Annotated[
        str, typer.Option("--format", metavar="FORMAT", help="csv; of a study also parquet, for large ones.")
    ] = "csv",
) -> None:
    """Write a run's generations, individuals and trials, or a study's conditions and runs, as CSV files.

    Example: sceann export-csv runs/first --out tables
    """
    folder = out or directory / "tables"
    if form not in ("csv", "parquet"):
        raise typer.BadParameter(f"expected csv or parquet, got {form}", param_hint="--format")
    # a study's modules are slow to import, and few exports are of one
    from sceann_hil.study.schema import STUDY_NAME

    if (directory / STUDY_NAME).exists():
        from sceann_hil.study.store import StudyReader
        from sceann_hil.study.tables import Format, export_study

        with StudyReader(directory) as reader:
            paths = export_study(reader, folder, Format(form))
            made_with = [reader.versions]
    elif form == "parquet":
        raise typer.BadParameter("parquet is for studies; this is a run", param_hint="--format")
    else:
        run = JournalReader(directory)
        paths = export_csv(run, folder)
        made_with = [session.versions for session in run.sessions()]
    for path in [*paths, write_versions(folder, made_with)]:
        typer.echo(path)


def _rounded(value: Any) -> str:
    """For people, who want all digits only of what differs."""
    if isinstance(value, tuple):
        return ", ".join(map(_rounded, value))
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _print_replay(
    compared: list[tuple[int, list[Comparison]]], n_compared: int, different: list[int], bodies: list[int]
) -> None:
    console = Console(highlight=False)
    if compared:
        identity, comparisons = compared[0]
        table = Table("", "journalled", "replayed", "")
        for c in comparisons:
            mark = "[green]same[/]" if c.equal else "[bold red]DIFFERENT[/]"
            shown = (c.journalled, c.replayed) if not c.equal else (_rounded(c.journalled), _rounded(c.replayed))
            table.add_row(c.quantity, *map(str, shown), mark)
        print_table(console, f"Trial {identity}", table)
    if bodies:
        console.print(
            f"Session {', '.join(map(str, bodies))} was run with another body than the one that is installed here: its "
            "code, a constant, a parameter or the version of Python has changed.",
            style="yellow",
        )
    if not different:
        console.print(f"{n_compared} trial{'s' if n_compared != 1 else ''} replayed, the same to the last bit.")


def _sparkline(values: list[float]) -> str:
    low, high = min(values), max(values)
    steps = "▁▂▃▄▅▆▇█"
    return "".join(steps[round((v - low) / ((high - low) or 1.0) * (len(steps) - 1))] for v in values)
