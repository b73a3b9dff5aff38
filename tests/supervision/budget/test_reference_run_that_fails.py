"""A reference run that ends with a fault or an emergency stop: a person must look, and the journal knows why."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sceann_hil.journal import AttemptKind, JournalReader
from sceann_hil.robot import EmergencyStop, EndReason, RobotError, RobotFault
from sceann_hil.run.experiment import Experiment
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside


@pytest.mark.parametrize(
    ("reason", "error"), [(EndReason.FAULT, RobotFault), (EndReason.EMERGENCY_STOP, EmergencyStop)]
)
def test_it_halts_the_run_like_any_other_trial(reason: EndReason, error: type[RobotError], tmp_path: Path) -> None:
    """Regression: after a fault the robot was driven on; after an emergency stop the journal had no word of the run."""

    class Failing(Beside):
        def run(self, trials: Any) -> Any:
            results = super().run(trials)
            is_reference = self.starts == 2 * 3 + 1
            return replace(results, end_reasons=np.array([reason], np.uint8)) if is_reference else results

    config = config_of(GOAL, "reference.every=4", "algorithm.population=2", "algorithm.generations=2")
    with (
        pytest.raises(error),
        Experiment.create(config, tmp_path / "run") as experiment,
        Failing(config.robot.build()) as robot,
    ):
        experiment.evolve(robot)
    reader = JournalReader(tmp_path / "run")
    assert [(row.end_reason, row.fitness) for row in reader.attempts_of_kind(AttemptKind.REFERENCE)] == [(reason, None)]
    reader.close()
