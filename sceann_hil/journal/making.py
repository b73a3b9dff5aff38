"""A new journal gets its name only when it is whole: a process that is killed before leaves no half-made run."""

from __future__ import annotations

import sqlite3
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from sceann_hil.errors import RunExists
from sceann_hil.journal.database import as_ours, new_database
from sceann_hil.journal.entries import FirstGeneration
from sceann_hil.journal.insertion import insert_generation, insert_row
from sceann_hil.journal.schema import APPLICATION_ID, JOURNAL_NAME, SCHEMA, SCHEMA_VERSION, UNBORN_NAME
from sceann_hil.journal.seal import seal_path


def is_unborn(path: Path) -> bool:
    """True for a file that `make_journal` leaves behind if it is killed; it holds nothing."""
    return path.name.startswith(UNBORN_NAME)


def make_journal(directory: Path, run: tuple[Any, ...], first: FirstGeneration | None, spec: str | None = None) -> None:
    """Make a journal with a run in it, and generation 0 if it comes from another run.

    Args:
        directory: where; it exists.
        run: name, time, root seed, configuration, versions and parent.
        first: generation 0.
        spec: JSON of what is known of its robot.

    Raises:
        RunExists: there is a journal already.
    """
    path = directory / JOURNAL_NAME
    if path.exists():
        raise RunExists(f"{directory} already holds a run.", "Choose another --out, or `sceann resume` this run.")
    for leftover in filter(is_unborn, directory.iterdir()):
        leftover.unlink()
    seal_path(path).unlink(missing_ok=True)
    making = directory / UNBORN_NAME
    with as_ours(path), new_journal(making) as db:
        insert_row(db, "run", (1, *run))
        if spec is not None:
            insert_row(db, "robot", (1, spec))
        if first is not None:
            insert_generation(db, 0, first.state, first.genomes, None, first.parents, first.structures)
    making.rename(path)


def new_journal(path: Path) -> AbstractContextManager[sqlite3.Connection]:
    """See `new_database`."""
    return new_database(path, SCHEMA, APPLICATION_ID, SCHEMA_VERSION)
