"""Runs, individuals and trials as a Python user meets them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import sceann_hil as sh
from sceann_hil.errors import ConfigError, NotARun, PackageMissing, RunExists
from sceann_hil.run.experiment import Progress
from tests.runs import GOAL, POLE, contents, evolve


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> sh.Run:
    return sh.evolve(sh.config(GOAL), tmp_path_factory.mktemp("runs") / "goal")


def test_a_run_from_python_is_the_run_of_the_command(run: sh.Run, tmp_path: Path) -> None:
    evolve(tmp_path / "goal", GOAL)
    assert contents(run.directory) == contents(tmp_path / "goal")


def test_the_same_call_goes_on_with_a_run_that_was_interrupted(run: sh.Run, tmp_path: Path) -> None:
    def interrupt(progress: Progress) -> None:
        if progress.generation.number == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sh.evolve(sh.config(GOAL), tmp_path / "goal", progress=interrupt)
    assert not sh.open(tmp_path / "goal").finished
    assert sh.evolve(sh.config(GOAL), tmp_path / "goal").finished
    assert contents(run.directory) == contents(tmp_path / "goal")


def test_another_configuration_is_refused_with_what_differs(run: sh.Run) -> None:
    with pytest.raises(ConfigError, match=r"made with another configuration: seed: 1 -> 2\."):
        sh.evolve(sh.config(GOAL, seed=2), run.directory)
    assert sh.evolve(None, run.directory).finished


def test_a_folder_with_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("words")
    with pytest.raises(RunExists):
        sh.evolve(sh.config(GOAL), tmp_path)


def test_a_folder_that_is_no_run_cannot_be_opened(tmp_path: Path) -> None:
    with pytest.raises(NotARun):
        sh.open(tmp_path)


def test_tables_have_a_row_for_everything(run: sh.Run) -> None:
    assert list(run.generations().index) == [0, 1, 2, 3]
    assert run.generations().best_fitness.max() == run.individuals().fitness.max()
    assert list(run.individuals().index) == list(range(1, 25))
    trials = run.trials()
    assert list(trials.index) == list(range(1, 73))
    assert {"start_x_m", "start_heading_rad", "final_state_x_m", "end_reason", "fitness"} <= set(trials.columns)
    assert trials.loc[1, "start_x_m"] == 0.0275
    assert list(run.events().kind) == ["started", "finished"]


def test_the_champion_is_the_commands_and_has_named_weights(run: sh.Run) -> None:
    best = run.champion()
    assert best.fitness == run.individuals().loc[best.id, "fitness"]
    assert best.hex == run.individuals().loc[best.id, "genome"]
    assert list(best.weights.index) == ["h1", "m1", "m2"]
    assert list(best.weights.columns) == ["s1", "s2", "s3", "h1", "m1", "m2"]
    assert np.array_equal(best.weights.to_numpy(), best.weight_matrix)


def test_the_line_of_descent_ends_in_the_first_generation(run: sh.Run) -> None:
    line = run.lineage(run.champion())
    assert list(line.generation) == [3, 2, 1, 0]
    individuals = run.individuals()
    assert [individuals.loc[child, "parent"] for child in line.index[:-1]] == list(line.index[1:])


def test_journalled_trials_come_back_as_they_were(run: sh.Run) -> None:
    best = run.champion()
    trials = run.trials_of(best)
    journalled = run.trials().query(f"generation == {best.generation}")
    assert len(trials) == 3
    assert np.mean([trial.fitness for trial in trials]) == best.fitness
    assert all((journalled.steps == trial.steps).any() for trial in trials)


def test_a_trial_is_a_table_of_what_happened(run: sh.Run) -> None:
    (trial,) = run.simulate(run.champion(), changes={"task.headings_deg": [90]})
    frame = trial.frame()
    assert len(frame) == trial.steps + 1
    names = ["time_s", "x_m", "y_m", "heading_rad", "s1", "s2", "s3", "h1", "m1", "m2", "u_h1", "u_m1", "u_m2"]
    assert list(frame.columns) == names
    assert frame.x_m[0] == pytest.approx(trial.start["x_m"])
    assert frame.time_s.iloc[-1] == pytest.approx(trial.steps * trial.tick_s)
    assert frame[["s1", "m1", "h1"]].iloc[:-1].stack().between(0, 1).all()
    assert frame.m1.isna().sum() == 1
    controller = run.champion().controller()
    controller.step(trial.trace.sensors[0])
    assert frame.u_h1[0] == controller.u[0] / 1024


def test_a_gap_changes_what_the_sensors_say(run: sh.Run) -> None:
    best = run.champion()
    plain, again = run.simulate(best), run.simulate(best)
    noisy = run.simulate(best, gap={"sensor_noise": 0.2})
    assert [trial.steps for trial in plain] == [trial.steps for trial in again]
    assert not np.array_equal(plain[0].trace.sensors[:5], noisy[0].trace.sensors[:5])
    with pytest.raises(ConfigError, match=r"robot\.gap\.sensor_nois"):
        run.simulate(best, gap={"sensor_nois": 0.2})


def test_repeats_are_grouped_by_trial_and_differ_in_their_noise(run: sh.Run) -> None:
    trials = run.simulate(run.champion(), gap={"sensor_noise": 0.2}, repeats=2)
    assert [trial.number for trial in trials] == [0, 0, 1, 1, 2, 2]
    assert not np.array_equal(trials[0].trace.sensors[:5], trials[1].trace.sensors[:5])


def test_a_controller_of_another_size_does_not_fit(run: sh.Run) -> None:
    with pytest.raises(ConfigError, match="expected a controller for"):
        sh.simulate(sh.config(POLE), run.champion())


def test_a_controller_outside_any_run_can_be_exported(run: sh.Run, tmp_path: Path) -> None:
    best = run.champion()
    same = sh.Individual.from_hex(best.phenotype, best.hex)
    written = sh.export(same, tmp_path / "walker.h", name="walker")
    assert "walker: an evolved controller" in written.read_text()
    with pytest.raises(ValueError, match="expected one of a run"):
        run.lineage(same)


def test_without_pandas_the_message_names_the_extra(run: sh.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(PackageMissing, match=r"sceann-hil\[notebook\]"):
        run.generations()
    assert run.champion().weight_matrix.shape == (3, 6)


@pytest.mark.parametrize(
    "source",
    [GOAL, {"task": {"type": "goal_reach"}, "robot": "diffdrive", "controller": {}, "algorithm": "sga"}, None],
)
def test_a_configuration_from_text_mapping_or_sections(source: object) -> None:
    sections = {
        "task": "goal_reach",
        "robot": "diffdrive",
        "controller": {"coding": "sceann1", "n_hidden": 0},
        "algorithm": "oga",
        "seed": 5,
    }
    config = sh.config(source, **sections)  # type: ignore[arg-type]
    assert (config.seed, config.algorithm.type, config.controller.n_hidden) == (5, "oga", 0)
