"""Reference runs: when they are due, over all sessions; on an attended robot; and in a rehearsal."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from sceann_hil.cli import app
from sceann_hil.config import parse_config
from sceann_hil.errors import ConfigError
from sceann_hil.journal import AttemptKind, JournalReader
from sceann_hil.robot import EndReason, Results
from sceann_hil.run.experiment import Experiment, Outcome
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside, attended_run

EVERY = 5
GENOME = "0" * 2 * ((config_of(GOAL).genome_length + 7) // 8)
REAL = """
task: {type: pole_balancing, max_steps: 20}
robot: {type: remote, port: nowhere, n_sensors: 2, n_motors: 1, tick_s: 0.02, bumper: fell,
  start_fields: [x_m, velocity_m_s, angle_rad, angular_velocity_rad_s]}
controller: {coding: sceann3, n_hidden: 3}
algorithm: {type: sga, population: 3, generations: 4}
reference: {every: 4}
"""


def sequence(directory: Path) -> list[AttemptKind]:
    """What the run did, in order."""
    reader = JournalReader(directory)
    rows = [row for g in reader.generations() for row in reader.attempts(g.number)]
    rows += reader.attempts_of_kind(AttemptKind.REFERENCE)
    return [row.kind for row in sorted(rows, key=lambda row: row.id)]


def one_session(directory: Path, trials: int) -> Outcome:
    config = config_of(GOAL, f"reference={{every: {EVERY}, genome: '{GENOME}'}}")
    exists = directory.exists()
    with (
        Experiment.open(directory) if exists else Experiment.create(config, directory) as experiment,
        Beside(config.robot.build()) as robot,
    ):
        return experiment.evolve(robot, more={"trials": trials})


@pytest.mark.parametrize("trials_per_session", [1, 2, 3, 7, 1000])
def test_short_sessions_are_watched_like_long_ones(trials_per_session: int, tmp_path: Path) -> None:
    """Regression: the count began anew with every session, so sessions of fewer trials never had a reference run."""
    sessions = 0
    while one_session(tmp_path / "run", trials_per_session) is not Outcome.FINISHED and sessions < 30:
        sessions += 1
    kinds = sequence(tmp_path / "run")
    expected = [AttemptKind.REFERENCE, *[AttemptKind.EVOLUTION] * EVERY] * len(kinds)
    assert kinds == expected[: len(kinds)]


def test_a_reference_run_that_came_to_nothing_is_done_again(tmp_path: Path) -> None:
    class Losing(Beside):
        def run(self, trials: Any) -> Results:
            results = super().run(trials)
            return Results.void(1, EndReason.LINK_LOST, 4, "lost") if self.starts == 1 else results

    config = config_of(GOAL, f"reference={{every: {EVERY}, genome: '{GENOME}'}}", "algorithm.generations=0")
    with Experiment.create(config, tmp_path / "run") as experiment, Losing(config.robot.build()) as robot:
        assert experiment.evolve(robot) is Outcome.FINISHED
        rows = experiment.journal.reader.attempts_of_kind(AttemptKind.REFERENCE)
    assert [(row.individual, row.attempt, row.note) for row in rows[:3]] == [(0, 0, "lost"), (0, 1, None), (1, 0, None)]


def test_a_person_judges_a_reference_run_like_any_other_trial(tmp_path: Path) -> None:
    script = ["ready", "discard the wheel slipped", "ready", "accept"] + ["ready", "accept"] * 12
    outcome, _ = attended_run(tmp_path / "run", script, f"reference={{every: 100, genome: '{GENOME}'}}")
    assert outcome is Outcome.FINISHED
    rows = JournalReader(tmp_path / "run").attempts_of_kind(AttemptKind.REFERENCE)
    assert [(row.note, row.fitness is None) for row in rows] == [("discard: the wheel slipped", True), (None, False)]


@pytest.mark.parametrize("genome", ["zz", "00", GENOME + "00"])
def test_a_wrong_genome_is_refused_when_the_configuration_is_read(genome: str) -> None:
    """Regression: it was a traceback when the robot stood ready."""
    with pytest.raises(ConfigError, match=r"reference\.genome"):
        parse_config(GOAL, "test", [f"reference.genome='{genome}'"])


@pytest.mark.parametrize("confirm", [True, False])
def test_a_rehearsal_of_an_attended_run_with_references_keeps_in_step(confirm: bool, tmp_path: Path) -> None:
    """Regression: a reference run was not judged, and the script answered the next question with its verdict."""
    (tmp_path / "c.yaml").write_text(REAL)
    told = CliRunner().invoke(
        app,
        [
            "rehearse",
            str(tmp_path / "c.yaml"),
            "--json",
            "--out",
            str(tmp_path / "run"),
            "--set",
            f"operator.confirm={str(confirm).lower()}",
        ],
        catch_exceptions=False,
    )
    document = json.loads(told.stdout)
    assert document["outcome"] == "finished"
    assert sequence(tmp_path / "run").count(AttemptKind.REFERENCE) == 3
