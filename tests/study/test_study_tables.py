"""A study as tables: every run once, whole files or none."""

from __future__ import annotations

import csv
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from small_study import SMALL

from sceann_hil.errors import RunExists
from sceann_hil.study import LocalWorkers, StudyReader, parse_study, run_study
from sceann_hil.study.tables import Format, _Csv, export_study


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("tables") / "small"
    run_study(parse_study(SMALL.replace("runs: 12", "runs: 3"), "small.yaml"), directory, LocalWorkers(1))
    return directory


def read(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_run_of_every_condition_is_a_row(study: Path, tmp_path: Path) -> None:
    with StudyReader(study) as reader:
        conditions, runs, best = export_study(reader, tmp_path / "out")
        expected = [reader.runs(condition.number) for condition in reader.conditions()]
    rows = read(runs)
    assert len(rows) == 12
    assert [float(row["fitness"]) for row in rows] == [value for one in expected for value in one.fitness.tolist()]
    assert [int(row["seed"]) for row in rows] == [int(seed) for one in expected for seed in one.seeds]
    assert {row["algorithm.type"] for row in rows} == {"sga", "oga"}
    assert read(conditions)[0]["label"] == "sga, n_sensors=2"
    curve = [float(row["best"]) for row in read(best) if (row["condition"], row["run"]) == ("2", "1")]
    np.testing.assert_array_equal(np.float32(curve), expected[2].best[1])


def test_parquet_holds_the_same_and_the_versions(study: Path, tmp_path: Path) -> None:
    parquet = import_module("pyarrow.parquet")

    with StudyReader(study) as reader:
        texts = export_study(reader, tmp_path / "csv")
        files = export_study(reader, tmp_path / "parquet", Format.PARQUET)
        versions = reader.versions
    for text, file in zip(texts, files, strict=True):
        table = parquet.read_table(file)
        rows = read(text)
        assert table.num_rows == len(rows)
        assert table.column_names == list(rows[0])
        assert [str(value) for value in table.column("condition").to_pylist()] == [row["condition"] for row in rows]
        assert table.schema.metadata[b"sceann-hil"].decode() == versions["sceann-hil"]


def test_nothing_is_overwritten_and_nothing_cut_off_is_left(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with StudyReader(study) as reader:
        with monkeypatch.context() as patch:
            patch.setattr(_Csv, "write", full)
            with pytest.raises(OSError, match="No space"):
                export_study(reader, tmp_path / "out")
        assert list((tmp_path / "out").iterdir()) == []
        export_study(reader, tmp_path / "out")
        with pytest.raises(RunExists, match="nothing was overwritten"):
            export_study(reader, tmp_path / "out")


def test_a_study_without_runs_yet_has_empty_tables(tmp_path: Path) -> None:
    class Nobody(LocalWorkers):
        def compute(self, blocks: object) -> object:  # type: ignore[override]
            return iter(())

    run_study(parse_study(SMALL, "small.yaml"), tmp_path / "study", Nobody(1))  # type: ignore[arg-type]
    with StudyReader(tmp_path / "study") as reader:
        _, runs, best = export_study(reader, tmp_path / "out")
    assert read(runs) == read(best) == []
