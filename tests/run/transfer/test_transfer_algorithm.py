"""A transfer is a run like any other: journalled, resumed, repeated."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.journal import JournalReader
from sceann_hil.run.champion import champion_of
from sceann_hil.run.experiment import Experiment, Outcome, StopRequest
from sceann_hil.run.transfer.again import read_transfer
from sceann_hil.run.transfer.state import TransferState, Verdict
from tests.runs import falsify


def decisions(directory: Path) -> list[tuple[str, int, float | None]]:
    reader = JournalReader(directory)
    rows = [row for g in reader.generations() for row in reader.attempts(g.number)]
    genomes = {row.id: row.genome for g in reader.generations() for row in reader.individuals(g.number)}
    listed = [(genomes[reader.individuals(row.generation)[0].id], row.trial, row.fitness) for row in rows]
    reader.close()
    return listed


def run(config: ExperimentConfig, directory: Path, stop_after: int | None = None) -> Outcome:
    done = 0

    def count(_: object) -> None:
        nonlocal done
        done += 1

    def stop() -> StopRequest:
        return StopRequest.NONE if stop_after is None or done < stop_after else StopRequest.AFTER_GENERATION

    exists = directory.exists()
    with Experiment.open(directory) if exists else Experiment.create(config, directory) as experiment:
        robot = config.robot.build()
        with robot:
            return experiment.evolve(robot, count, stop)


def test_one_trial_a_generation_then_the_best_in_all_trials(small: ExperimentConfig, tmp_path: Path) -> None:
    assert run(small, tmp_path / "run") is Outcome.FINISHED
    reader = JournalReader(tmp_path / "run")
    per_generation = [len(reader.attempts(g.number)) for g in reader.generations()]
    assert per_generation == [1] * 6 + [3, 3]
    state, measured = read_transfer(tmp_path / "run")
    assert state.verdict is Verdict.TRIALS_DONE
    assert len(state.observed) == 6
    assert len(measured) == 2
    champion = reader.champion()
    told = json.loads(reader.individuals(7)[0].structure or "")
    assert champion is not None
    assert champion.genome == told["recommended"]
    exported = champion_of(reader, keeps_best=small.algorithm.keeps_best)
    assert exported is not None
    assert exported.genome == told["recommended"]
    assert "measured on fresh trials" in told["why"]


def test_a_run_that_was_stopped_comes_to_the_same_decisions(small: ExperimentConfig, tmp_path: Path) -> None:
    run(small, tmp_path / "whole")
    while run(small, tmp_path / "parts", stop_after=2) is not Outcome.FINISHED:
        pass
    assert decisions(tmp_path / "parts") == decisions(tmp_path / "whole")


def test_what_a_person_needed_is_known_after_a_resume_too(small: ExperimentConfig, tmp_path: Path) -> None:
    run(small, tmp_path / "run", stop_after=2)
    falsify(tmp_path / "run", "UPDATE attempt SET operator_s = 7.5 WHERE generation = 1")
    assert read_transfer(tmp_path / "run")[0].observed.operator_s.tolist() == [0.0, 7.5]
    run(small, tmp_path / "run", stop_after=1)
    assert read_transfer(tmp_path / "run")[0].observed.operator_s.tolist() == [0.0, 7.5, 0.0]


def test_states_of_before_people_s_time_was_known_are_read(small: ExperimentConfig) -> None:
    algorithm = small.algorithm.for_experiment(small)
    state = algorithm.start(np.random.default_rng(0))
    state = algorithm.tell_attended(state, np.array([0.5]), 3.0, np.random.default_rng(0))
    document = json.loads(algorithm.dump(state))
    assert document["observed"].pop() == [3.0]
    assert algorithm.load(json.dumps(document).encode()).observed.operator_s.tolist() == [0.0]


def test_equal_states_give_equal_bytes_and_come_back(small: ExperimentConfig) -> None:
    algorithm = small.algorithm.for_experiment(small)
    state = algorithm.start(np.random.default_rng(0))
    state = algorithm.tell(state, np.array([0.5]), np.random.default_rng(0))
    again = algorithm.load(algorithm.dump(state))
    assert isinstance(again, TransferState)
    assert algorithm.dump(again) == algorithm.dump(state)
    for wrong in (b"", b"{}", b"\xff", algorithm.dump(state)[:-5]):
        with pytest.raises(ValueError, match=r"state|Expecting|Unterminated|codec"):
            algorithm.load(wrong)
    with pytest.raises(ValueError, match="finite"):
        algorithm.tell(state, np.array([np.nan]), np.random.default_rng(0))


def test_sga_goes_on_from_the_best_candidates_of_a_transfer(small: ExperimentConfig, tmp_path: Path) -> None:
    from sceann_hil.run.ancestor import Ancestor

    run(small, tmp_path / "run")
    state, _ = read_transfer(tmp_path / "run")
    config = small.with_changes({"algorithm": {"type": "sga", "population": 12, "generations": 1}})
    first = Ancestor(tmp_path / "run").first_generation(config)
    assert (first.genomes == state.candidates[list(state.ranking[:12])]).all()


def test_saving_trials_and_weighing_them_do_not_go_together(small: ExperimentConfig) -> None:
    with pytest.raises(ConfigError, match="weighs every trial"):
        small.with_changes({"saving": {"reuse": True}})


def test_a_task_without_bounds_is_refused(small: ExperimentConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    from sceann_hil.tasks.goal_reach import GoalReach

    monkeypatch.setattr(GoalReach, "best_fitness", float("inf"))
    with pytest.raises(ConfigError, match="one scale"):
        small.algorithm.for_experiment(small).start(np.random.default_rng(0))


def test_a_study_knows_it(small: ExperimentConfig) -> None:
    from sceann_hil.study import evolve_together

    with small.robot.build() as robot:
        generations = list(evolve_together(small, np.array([1, 2], np.uint64), robot))
    assert [g.fitness.shape for g in generations] == [(2, 1)] * 8
    assert generations[0].states[0].candidate == generations[0].states[1].candidate
