"""A journal that asks for a trial that nobody could have run is damaged; compiled code never sees it."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from sceann_hil.config import journalled_config
from sceann_hil.errors import RunIsDamaged
from sceann_hil.journal import JOURNAL_NAME, JournalReader
from sceann_hil.run.replay import replay
from tests.runs import evolve

SMALL = """
task: {type: pole_balancing, max_steps: 20}
robot: {type: cartpole}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga, population: 4, generations: 0}
"""
CHANGES = [
    "UPDATE start SET start_values = '[0.0, 0.0]', checksum = NULL",
    "UPDATE start SET start_values = '[0.0, 0.0, 1e999, 0.0]', checksum = NULL",
    "UPDATE attempt SET individual = 4000, checksum = NULL WHERE id = 1",
    "UPDATE attempt SET individual = -3, checksum = NULL WHERE id = 1",
]


@pytest.mark.parametrize("change", CHANGES)
def test_it_is_refused_with_the_place(change: str, tmp_path: Path) -> None:
    evolve(tmp_path / "run", SMALL)
    with sqlite3.connect(tmp_path / "run" / JOURNAL_NAME) as db:
        db.execute("PRAGMA foreign_keys = OFF")
        db.execute(change)
    db.close()
    with pytest.raises(RunIsDamaged, match="is damaged"):
        _replayed(tmp_path / "run")


def _replayed(folder: Path) -> None:
    reader = JournalReader(folder)
    try:
        config = journalled_config(reader)
        with config.robot.build() as robot:
            replay(reader, config, robot, reader.attempts(0))
    finally:
        reader.close()
