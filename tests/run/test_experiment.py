"""A run as a whole: how it begins and ends, what it says of that, and that only one works on it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from sceann_hil.errors import RunExists, RunIsLocked
from sceann_hil.journal import JournalReader
from sceann_hil.robot import LinkError, Results
from sceann_hil.run.ancestor import Ancestor
from sceann_hil.run.experiment import CONFIG_NAME, Experiment, Outcome
from sceann_hil.supervision.stopping import StopRequest
from tests.runs import GOAL, POLE, config_of, evolve, resume
from tests.supervision.operators.fakes import Beside


def events(directory: Path) -> list[tuple[str, str]]:
    return [(kind, message) for _, _, kind, message in JournalReader(directory).events()]


def evolve_until(directory: Path, request: StopRequest, generations: int = 1) -> Outcome:
    config = config_of(POLE)
    asked = iter([StopRequest.NONE] * 2 * generations)
    with Experiment.create(config, directory) as experiment, config.robot.build() as robot:
        return experiment.evolve(robot, stop=lambda: next(asked, request))


@pytest.mark.parametrize(
    ("request_", "outcome", "said"),
    [
        (StopRequest.AFTER_GENERATION, Outcome.STOPPED_AFTER_GENERATION, "Stopped after generation 1, as you asked"),
        (StopRequest.NOW, Outcome.STOPPED_NOW, "Stopped before the next trial, as you asked"),
        (StopRequest.TERMINATED, Outcome.TERMINATED, "Stopped by the system (SIGTERM)"),
        (StopRequest.HUNG_UP, Outcome.HUNG_UP, "Stopped because the terminal was closed (SIGHUP)"),
    ],
)
def test_whoever_ends_it_the_journal_says_so_in_a_sentence_and_it_goes_on(
    request_: StopRequest, outcome: Outcome, said: str, tmp_path: Path
) -> None:
    assert evolve_until(tmp_path / "run", request_) is outcome
    assert events(tmp_path / "run")[-1] == ("stopped", said)
    assert resume(tmp_path / "run") is Outcome.FINISHED
    assert [kind for kind, _ in events(tmp_path / "run")] == ["started", "stopped", "resumed", "finished"]


def test_a_run_that_goes_on_from_another_one_was_started_and_not_resumed(tmp_path: Path) -> None:
    """Regression: its generation 0 is there from the beginning, so it was called resumed."""
    evolve(tmp_path / "first")
    config = config_of(POLE)
    with (
        Experiment.create(config, tmp_path / "second", Ancestor(tmp_path / "first")) as experiment,
        config.robot.build() as robot,
    ):
        experiment.evolve(robot)
    assert [kind for kind, _ in events(tmp_path / "second")] == ["started", "finished"]


def test_a_robot_that_is_lost_is_why_the_run_stopped(tmp_path: Path) -> None:
    class Lost(Beside):
        def run(self, trials: Any) -> Results:
            raise LinkError("the cable is out")

    config = config_of(GOAL)
    with (
        pytest.raises(LinkError),
        Experiment.create(config, tmp_path / "run") as experiment,
        Lost(config.robot.build()) as robot,
    ):
        experiment.evolve(robot)
    assert events(tmp_path / "run")[-1] == ("stopped", "the cable is out")


def test_one_process_works_on_a_run(tmp_path: Path) -> None:
    with Experiment.create(config_of(POLE), tmp_path / "run"), pytest.raises(RunIsLocked):
        Experiment.open(tmp_path / "run")
    Experiment.open(tmp_path / "run").close()


def test_a_place_that_is_taken_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(RunExists):
        Experiment.create(config_of(POLE), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_the_configuration_lies_beside_the_journal_for_people(tmp_path: Path) -> None:
    evolve(tmp_path / "run")
    (tmp_path / "run" / CONFIG_NAME).unlink()
    Experiment.open(tmp_path / "run").close()
    assert (tmp_path / "run" / CONFIG_NAME).read_text() == JournalReader(tmp_path / "run").run().config


def test_a_session_of_a_run_with_a_million_generations_begins_at_once(tmp_path: Path) -> None:
    config = config_of(GOAL, "algorithm.generations=1000000", "budget.trials=60")
    with Experiment.create(config, tmp_path / "run") as experiment, config.robot.build() as robot:
        assert experiment.evolve(robot) is Outcome.BUDGET_SPENT
    assert JournalReader(tmp_path / "run").spent().trials == 60
