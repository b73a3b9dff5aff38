"""A run that could not begin is removed: its own files, nothing measured, nothing of anybody else's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sceann_hil.errors import UserError
from sceann_hil.journal import JOURNAL_NAME, AttemptKind, Journal, RunLock, Slots
from sceann_hil.robot import EndReason, Results
from sceann_hil.run.experiment import Experiment
from tests.runs import POLE, config_of


def test_what_somebody_else_put_into_the_folder_stays(tmp_path: Path) -> None:
    experiment = Experiment.create(config_of(POLE), tmp_path / "run")
    (tmp_path / "run" / "my notes.txt").write_text("wheels: 42 mm")
    assert experiment.forget()
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["my notes.txt"]


def test_a_folder_that_a_link_leads_to_is_emptied_without_a_traceback(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "run").symlink_to(tmp_path / "disk", target_is_directory=True)
    assert Experiment.create(config_of(POLE), tmp_path / "run").forget()
    assert not list((tmp_path / "disk").iterdir())
    Experiment.create(config_of(POLE), tmp_path / "run").close()


def test_a_run_with_a_reference_run_in_it_is_kept(tmp_path: Path) -> None:
    """Regression: robot time had been spent, and no attempt told of it."""
    experiment = Experiment.create(config_of(POLE), tmp_path / "run")
    results = Results.void(1, EndReason.TIME_UP, 0)
    slots = Slots(*(np.zeros(1, np.int64) for _ in range(3)))
    journal = experiment.journal
    ids = journal.intend(
        None, slots, np.zeros((1, 4)), np.zeros(1, np.uint64), AttemptKind.REFERENCE, genomes=["0" * 8]
    )
    journal.record(ids, results, np.array([0.5]))
    assert not experiment.forget()
    experiment.close()
    assert (tmp_path / "run" / JOURNAL_NAME).exists()


def test_a_run_that_cannot_be_opened_is_not_left_locked(tmp_path: Path) -> None:
    Journal.create(tmp_path, name="x", root_seed=1, config="robot: {type: gone}", versions={}).close()
    with pytest.raises(UserError):
        Experiment.open(tmp_path)
    assert not RunLock.is_held(tmp_path)
