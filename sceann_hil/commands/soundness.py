"""Is a run or a study as it was written, and a copy of it that is sound."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from sceann_hil.commands.arguments import AsJson, print_json
from sceann_hil.errors import RunIsDamaged
from sceann_hil.journal import JOURNAL_NAME, JournalReader
from sceann_hil.journal.copying import copy_beside, copy_database, new_folder
from sceann_hil.journal.verify import Verdict, examine
from sceann_hil.pasting import pasteable
from sceann_hil.study.schema import STUDY_NAME

Place = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run, or of a study.", show_default=False)]


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(check)
    app.command()(copy)


def check(directory: Place, as_json: AsJson = False) -> None:
    """Check that nothing in a run or a study was changed, lost or damaged since it was written.

    Every row is compared with its checksum, every generation with its digest, every individual with its trials.

    Example: sceann check runs/first
    """
    verdict = _examine(directory)
    if as_json:
        print_json(
            {
                "directory": str(directory),
                "sound": not verdict.damage,
                "damage": list(verdict.damage),
                "generations_finished": verdict.generations,
                "last_sound_generation": verdict.last_sound,
                "untouched": verdict.untouched,
                "has_checksums": verdict.has_checksums,
            }
        )
    else:
        _print(directory, verdict)
    if verdict.damage:
        n = len(verdict.damage)
        raise RunIsDamaged(
            f"{directory}: {n} place{'s are' if n > 1 else ' is'} not as {'they were' if n > 1 else 'it was'} written.",
            verdict.way_out.replace(" DIR ", f" {pasteable(directory)} "),
        )


def copy(
    directory: Place,
    out: Annotated[Path, typer.Option("--out", metavar="NEW", help="Folder of the copy: new, or empty.")],
) -> None:
    """Copy a run or a study, also while somebody works on it.

    The copy has the journal and the configuration; recordings and reports can be made again from them.

    Example: sceann copy runs/first --out backups/first
    """
    if (directory / STUDY_NAME).exists():
        from sceann_hil.study.store import StudyReader

        with StudyReader(directory) as study:
            copy_database(study.database, directory / STUDY_NAME, new_folder(out) / STUDY_NAME)
    else:
        reader = JournalReader(directory)
        try:
            copy_database(reader.database, directory / JOURNAL_NAME, new_folder(out) / JOURNAL_NAME)
        finally:
            reader.close()
    copy_beside(directory, out, "config.yaml", "study.yaml")
    typer.echo(out)


def _examine(directory: Path) -> Verdict:
    if not (directory / STUDY_NAME).exists():
        return examine(directory)
    from sceann_hil.study.store import examine_study

    return examine_study(directory)


def _print(directory: Path, verdict: Verdict) -> None:
    console = Console(highlight=False)
    for place in verdict.damage:
        console.print(place, markup=False, soft_wrap=True)
    table = Table(show_header=False)
    table.add_row("folder", escape(str(directory)))
    table.add_row("generations", f"{verdict.generations} finished")
    if verdict.damage:
        sound = "none" if verdict.last_sound is None else str(verdict.last_sound)
        table.add_row("last sound generation", sound)
    else:
        table.add_row(
            "verdict", "sound" if verdict.has_checksums else "SQLite finds no damage; schema 1 has no checksums"
        )
        if verdict.untouched:
            table.add_row("file", "byte for byte as its last process left it")
    console.print(table)
