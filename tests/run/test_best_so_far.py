"""Runs that were looked at in the middle of a generation: everybody tells the best so far, and how little is known."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import sceann_hil
from sceann_hil.cli import app
from sceann_hil.errors import NotARun
from sceann_hil.journal import JournalReader
from sceann_hil.recording import RecordingPaths, view
from sceann_hil.run.champion import best_so_far
from sceann_hil.run.chosen import chosen_individual
from sceann_hil.run.experiment import Experiment
from sceann_hil.supervision.standings import Leader, Standings
from tests.runs import GOAL, config_of

PER_GENERATION = 18
"""6 individuals, 3 trials each."""


def stopped_after(directory: Path, trials: int) -> Path:
    """A run whose budget was spent after so many trials."""
    config = config_of(GOAL)
    with Experiment.create(config, directory) as experiment, config.robot.build() as robot:
        experiment.evolve(robot, more={"trials": trials})
    return directory


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Seven trials: two individuals are known, of a third one trial."""
    return stopped_after(tmp_path_factory.mktemp("run") / "first", 7)


@pytest.fixture(scope="module")
def second(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One generation, and two trials of the next."""
    return stopped_after(tmp_path_factory.mktemp("run") / "second", PER_GENERATION + 2)


def told(run: Path, *command: str) -> str:
    result = CliRunner().invoke(
        app, [command[0], str(run), *command[1:]], catch_exceptions=False, env={"COLUMNS": "120"}
    )
    assert result.exit_code == 0
    return result.output


def test_only_those_are_compared_of_whom_most_is_known() -> None:
    standings = Standings()
    assert standings.leader is None
    for individual, fitness in ((4, 0.25), (4, 0.5), (1, 0.9)):
        standings.add(individual, fitness)
    assert standings.leader == Leader(4, 0.375, 2)
    for fitness in (0.5, 0.25):
        standings.add(0, fitness)
    assert standings.leader == Leader(0, 0.375, 2), "the first of equals"


def test_everybody_tells_the_same_best_so_far(first: Path) -> None:
    reader = JournalReader(first)
    rows = reader.attempts(0)
    means = [sum(row.fitness or 0.0 for row in rows[3 * k : 3 * k + 3]) / 3 for k in (0, 1)]
    best = reader.individuals(0)[means.index(max(means))]
    found = best_so_far(reader)
    assert found is not None
    assert (found.individual.genome, found.trials, found.counted) == (best.genome, 3, 7)
    status = json.loads(told(first, "status", "--json"))
    assert status["champion"] is None
    assert status["best_so_far"]["genome"] == best.genome
    assert status["best_so_far"]["fitness"] == pytest.approx(max(means))
    assert json.loads(told(first, "champion", "--json"))["champions"][0]["genome"] == best.genome
    assert sceann_hil.open(first).champion().hex == best.genome
    assert f"generation 0, individual {best.number} (so far, 3 of 3 trials)" in told(first, "champion")
    chosen = chosen_individual(reader)
    assert chosen.individual.genome == best.genome
    assert f"individual {best.number}" in chosen.note
    assert "over 3 trials" in chosen.note


def test_status_of_a_first_generation_tells_what_is_known(first: Path) -> None:
    document = json.loads(told(first, "status", "--json"))
    rows = JournalReader(first).attempts(0)
    assert document["robot_s"] == pytest.approx(sum(row.robot_s or 0.0 for row in rows))
    assert document["wall_s"] > 0.0
    shown = told(first, "status")
    assert "7 trials counted" in shown
    assert "robot time" in shown
    assert " 0.0 s" not in shown


def test_the_header_of_an_unfinished_run_says_whose_it_is(first: Path) -> None:
    header = told(first, "export")
    found = best_so_far(JournalReader(first))
    assert found is not None
    assert f"--genome 0:{found.individual.number} " in header
    assert "is not finished: the best so far" in header  # standard error, in the same stream here


def test_where_a_generation_is_finished_the_champion_stays_the_champion(second: Path) -> None:
    reader = JournalReader(second)
    champion = max(reader.individuals(0), key=lambda row: row.fitness or 0.0)
    status = json.loads(told(second, "status", "--json"))
    assert status["champion"]["genome"] == champion.genome
    assert status["best_so_far"]["trials"] == 2
    assert chosen_individual(reader).note == ""


@pytest.mark.parametrize(
    ("name", "wrong"), [("9:0", "has not begun"), ("0:6", "individuals 0 to 5"), ("x", "lists the")]
)
def test_individuals_are_named_by_their_place(name: str, wrong: str, second: Path) -> None:
    reader = JournalReader(second)
    row = reader.individuals(0)[4]
    assert chosen_individual(reader, "0:4").individual == row
    assert chosen_individual(reader, str(row.id)).individual == row
    with pytest.raises(NotARun) as caught:
        chosen_individual(reader, name)
    assert wrong in caught.value.hint


def test_trials_so_far_can_be_seen_and_are_not_kept(first: Path) -> None:
    with view.prepared(first, view.Screen(trial=2)) as shown:
        assert shown.endswith("_g000_i00_t1")
    with view.prepared(first, view.GALLERY) as gallery:
        assert gallery.startswith("rerun+http")
    assert RecordingPaths(first).recorded_generations() == []
    with pytest.raises(NotARun, match="no finished generation"), view.prepared(first, view.OVERVIEW):
        pass


def test_a_run_without_trials_has_nothing_to_show(tmp_path: Path) -> None:
    Experiment.create(config_of(GOAL), tmp_path / "run").close()
    with pytest.raises(NotARun, match="no trial yet"), view.prepared(tmp_path / "run", view.GALLERY):
        pass
    with pytest.raises(NotARun, match="no trial yet"):
        chosen_individual(JournalReader(tmp_path / "run"))


def test_looking_changes_nothing_of_what_follows(tmp_path: Path) -> None:
    run = stopped_after(tmp_path / "run", PER_GENERATION + 2)
    with view.prepared(run, view.GALLERY):
        pass
    with Experiment.open(run) as experiment, experiment.config.robot.build() as robot:
        experiment.evolve(robot, more={"trials": 10 * PER_GENERATION})
    with view.prepared(run, view.GALLERY):
        assert RecordingPaths(run).recorded_generations() == [0, 1, 2, 3]
