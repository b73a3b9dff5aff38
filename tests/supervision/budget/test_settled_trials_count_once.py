"""A trial that a crash cut off and the resumed run settles is one trial of the budget, not two."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from sceann_hil.journal import JournalReader
from sceann_hil.run.experiment import Experiment, Outcome
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside


class _Dying(Beside):
    def run(self, trials: Any) -> Any:
        if self.starts == 2:
            raise SystemExit("the host dies")
        return super().run(trials)


def test_a_budget_of_trials_is_used_up_to_the_last_one(tmp_path: Path) -> None:
    """Regression: the intent was counted, and its outcome once more."""
    config = config_of(GOAL, "budget.trials=6")
    with (
        pytest.raises(SystemExit),
        Experiment.create(config, tmp_path / "run") as experiment,
        _Dying(config.robot.build()) as robot,
    ):
        experiment.evolve(robot)
    with Experiment.open(tmp_path / "run") as experiment, Beside(config.robot.build()) as robot:
        assert experiment.evolve(robot) is Outcome.BUDGET_SPENT
    reader = JournalReader(tmp_path / "run")
    assert reader.count_attempts() == reader.spent().trials == 6
    reader.close()
