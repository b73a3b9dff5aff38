"""A run's journal as CSV files: every row, nothing overwritten, and measurements apart from evolution."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.errors import RunExists
from sceann_hil.journal import JournalReader, tables
from sceann_hil.journal.tables import export_csv
from tests.runs import GOAL, config_of, evolve, measure_on
from tests.supervision.operators.fakes import Beside


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_row_of_the_journal_is_a_row_of_its_table(tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL, "algorithm.generations=1")
    reader = JournalReader(tmp_path / "run")
    written = export_csv(reader, tmp_path / "csv")
    assert [path.name for path in written] == ["generations.csv", "individuals.csv", "trials.csv"]
    assert [len(rows(path)) for path in written] == [2, 12, 36]
    first, attempt = rows(tmp_path / "csv" / "trials.csv")[0], reader.attempts(0)[0]
    assert (float(first["fitness"]), first["end_reason"]) == (
        attempt.fitness,
        str(attempt.end_reason).replace(" ", "_"),
    )
    assert tuple(map(float, first["start"].split())) == attempt.start


def test_measurements_are_told_from_evolution(tmp_path: Path) -> None:
    config = config_of(GOAL)
    with Beside(config.robot.build()) as robot:
        measure_on(tmp_path / "run", config, robot, np.zeros((1, config.genome_length), np.uint8), repeats=2)
    export_csv(JournalReader(tmp_path / "run"), tmp_path / "csv")
    table = rows(tmp_path / "csv" / "trials.csv")
    assert [(row["kind"], row["individual"], row["trial"]) for row in table] == [
        ("measurement", str(repeat), str(trial)) for repeat in range(2) for trial in range(3)
    ]


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL, "algorithm.generations=0")
    (tmp_path / "csv").mkdir()
    (tmp_path / "csv" / "trials.csv").write_text("mine")
    with pytest.raises(RunExists):
        export_csv(JournalReader(tmp_path / "run"), tmp_path / "csv")
    assert (tmp_path / "csv" / "trials.csv").read_text() == "mine"
    assert not (tmp_path / "csv" / "generations.csv").exists()


def test_lines_are_those_of_the_csv_module() -> None:
    nasty = ["plain", 'with "quotes"', "a, b", "two\nlines", "100 % wet", "", None, "ünïcode"]
    n = len(nasty)
    columns: list[list[object]] = [
        [*range(n)],
        [1.0 / (k + 3) for k in range(n)],
        [1, 2.5] * (n // 2),
        nasty,
        [None] * n,
        ['said "50 %, about"'] * n,
        [2**64 - 1] * n,
        [None, 0.1] * (n // 2),
        [str(k) for k in range(n)],
    ]
    text = io.StringIO()
    csv.writer(text).writerows(zip(*columns, strict=True))
    assert tables._lines(columns) == text.getvalue()
    assert tables._lines([[5] * 3, [None] * 3]) == "5,\r\n" * 3
