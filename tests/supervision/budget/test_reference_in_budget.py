"""A reference run counts against the budget before the trial that it stands in front of."""

from __future__ import annotations

from pathlib import Path

from sceann_hil.journal import JournalReader
from sceann_hil.run.experiment import Experiment, Outcome
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside


def test_a_reference_run_takes_the_last_trial_of_the_budget(tmp_path: Path) -> None:
    """Regression: the trial after it was not looked at again, and the budget was overdrawn by one."""
    whole = config_of(GOAL, "algorithm.generations=1", "budget.trials=1000")
    with Experiment.create(whole, tmp_path / "whole") as experiment, Beside(whole.robot.build()) as robot:
        experiment.evolve(robot)
        champion = experiment.journal.reader.champion()
        assert champion is not None
    config = config_of(GOAL, f"reference.genome={champion.genome}", "reference.every=4", "budget.trials=6")
    with Experiment.create(config, tmp_path / "run") as experiment, Beside(config.robot.build()) as robot:
        assert experiment.evolve(robot) is Outcome.BUDGET_SPENT
    reader = JournalReader(tmp_path / "run")
    assert reader.spent().trials == 6
    reader.close()
