"""A landscape holds what running each genome by itself gives, however it was interrupted."""

from __future__ import annotations

import errno
import json
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.config import ExperimentConfig, load_config, parse_config
from sceann_hil.errors import ConfigError, NotARun, OtherVersions, RunIsDamaged, StudyChanged
from sceann_hil.network.coding import Coding, genome_to_hex
from sceann_hil.robot import Trials
from sceann_hil.seeds import Purpose, keys
from sceann_hil.study.landscape import (
    Landscape,
    analyse,
    champion_ranks,
    enumerate_landscape,
    enumeration,
    genomes_of,
    landscapes_in,
)
from sceann_hil.study.landscape.analysis import expected_best, solution_neighbours
from sceann_hil.study.landscape.files import LandscapeWriter
from sceann_hil.versions import BODIES

POLE = """\
task: {type: pole_balancing, max_steps: 30}
robot: {type: cartpole}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga}
"""
GOAL = """\
seed: 5
task: {type: goal_reach, max_steps: 70, headings_deg: [0, 90]}
robot: {type: diffdrive, n_sensors: 1}
controller: {coding: sceann3, n_hidden: 0}
algorithm: {type: sga}
"""


def config_of(text: str, *overrides: str) -> ExperimentConfig:
    return parse_config(text, "test", overrides)


@pytest.mark.parametrize("text", [POLE, GOAL], ids=["pole", "goal"])
@pytest.mark.parametrize("neuron", ["accumulating", "memoryless"])
def test_every_genome_has_the_fitness_of_its_own_trials(text: str, neuron: str, tmp_path: Path) -> None:
    config = config_of(text, f"controller.neuron={neuron}")
    landscape = enumerate_landscape(config, tmp_path, 2)
    task, length = config.task.build(), config.genome_length
    assert landscape.fitness.shape == (2**length,)
    with config.robot.build() as robot:
        for number in range(2**length):
            genome = np.array([int(bit) for bit in f"{number:0{length}b}"], np.uint8)
            n = task.n_trials
            trials = Trials(
                size=config.size,
                dynamics=config.controller.dynamics,
                weights=Coding.SCEANN3.decode(genome[None], config.size),
                genome_index=np.zeros(n, np.int32),
                starts=task.starts,
                keys=keys(config.seed, Purpose.TRIAL, 0, number, np.arange(n), 0),
                max_steps=task.max_steps,
                ids=np.arange(n),
            )
            results = robot.run(trials)
            assert landscape.fitness[number] == np.float32(task.fitness(results).mean())
            assert landscape.successes[number] == task.succeeded(results).sum()


def test_genome_numbers_are_binary_with_the_first_bit_first() -> None:
    for length in (1, 8, 15, 26):
        numbers = np.array([0, 1, 2 ** (length - 1), 2**length - 1])
        for number, genome in zip(numbers, genomes_of(numbers, length), strict=True):
            assert "".join(map(str, genome)) == f"{number:0{length}b}"


class Interrupted(Exception):
    pass


def test_an_interrupted_enumeration_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = config_of(POLE, "controller.coding=sceann2", "controller.n_hidden=1")
    whole = enumerate_landscape(config, tmp_path / "whole", 2)
    monkeypatch.setattr(enumeration, "_TRIALS_AT_ONCE", 1 << 12)
    monkeypatch.setattr(enumeration, "_SECONDS_BETWEEN_SYNCS", -1.0)
    told: list[int] = []

    def stop(done: int, n: int) -> None:
        told.append(done)
        if done == 5:
            raise Interrupted

    with pytest.raises(Interrupted):
        enumerate_landscape(config, tmp_path / "parts", 2, stop)
    left = Landscape(tmp_path / "parts")
    assert not left.is_complete
    assert landscapes_in(tmp_path) == [] or all(found.directory.name == "whole" for found in landscapes_in(tmp_path))
    done = int(left.done.sum())
    # three chunks are in the air; if all of them come at once, none of them is synced yet
    assert 2 <= done <= 5
    told.clear()
    parts = enumerate_landscape(config, tmp_path / "parts", 2, lambda *at: told.append(at[0]))
    assert told == list(range(done + 1, 17))
    np.testing.assert_array_equal(whole.fitness, parts.fitness)
    np.testing.assert_array_equal(whole.successes, parts.successes)


def test_numpy_opens_the_arrays(tmp_path: Path) -> None:
    enumerate_landscape(config_of(POLE), tmp_path, 1)
    assert np.load(tmp_path / "fitness.npy", mmap_mode="r").dtype == np.float32
    assert np.load(tmp_path / "successes.npy").dtype == np.uint16
    assert load_config(tmp_path / "config.yaml") == config_of(POLE)


def test_the_analysis_agrees_with_brute_force(tmp_path: Path) -> None:
    config = config_of(POLE, "controller.n_hidden=2")
    landscape = enumerate_landscape(config, tmp_path, 2)
    summary = analyse(landscape)
    solutions = set(np.flatnonzero(landscape.successes == 1).tolist())
    assert 0 < len(solutions) < 2**15
    assert summary.n_solutions == len(solutions)
    assert np.load(tmp_path / "solutions.npy").tolist() == sorted(solutions)
    count = [sum((g ^ (1 << bit)) in solutions for bit in range(15)) for g in sorted(solutions)]
    assert summary.neighbours_mean == pytest.approx(np.mean(count))
    assert summary.isolated == count.count(0)
    assert summary.random_search == pytest.approx(1 - (1 - len(solutions) / 2**15) ** (25 * 51))
    assert summary.best_fitness == landscape.fitness.max()
    assert analyse(landscape) == summary
    assert json.loads((tmp_path / "summary.json").read_text())["n_solutions"] == len(solutions)


def test_a_landscape_without_solutions_says_so(tmp_path: Path) -> None:
    summary = analyse(enumerate_landscape(config_of(POLE, "task.max_steps=3000"), tmp_path, 1))
    assert (summary.n_solutions, summary.neighbours_mean, summary.random_search) == (0, 0.0, 0.0)


def test_ranks_count_what_is_strictly_fitter(tmp_path: Path) -> None:
    config = config_of(POLE, "controller.n_hidden=2", "task.max_steps=3000")
    landscape = enumerate_landscape(config, tmp_path, 2)
    numbers = np.array([0, 77, 4096, int(landscape.fitness.argmax())])
    genomes = [genome_to_hex(genome) for genome in genomes_of(numbers, config.genome_length)]
    expected = [1 + int((landscape.fitness > landscape.fitness[number]).sum()) for number in numbers]
    assert champion_ranks(landscape, genomes).tolist() == expected
    assert expected[-1] == 1


def test_the_expected_best_of_random_draws_is_exact() -> None:
    values = np.array([0, 0, 1, 5], np.float32)
    # of two draws from four values: both below 1 with 4/16, both below 5 with 9/16
    assert expected_best(values, 2) == pytest.approx((9 - 4) / 16 * 1 + (16 - 9) / 16 * 5)
    assert expected_best(values, 1) == pytest.approx(values.mean())


def test_neighbours_of_no_solution_are_none() -> None:
    assert solution_neighbours(np.array([], np.int64), np.zeros(8, np.uint16), 1, 3).tolist() == []


def test_a_genome_that_is_too_long_is_refused_with_its_length(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="has 35 bits; expected at most 26"):
        enumerate_landscape(config_of(POLE, "controller.n_hidden=4"), tmp_path / "new", 1)
    assert not (tmp_path / "new").exists()


def test_another_experiment_s_folder_is_refused_with_the_difference(tmp_path: Path) -> None:
    enumerate_landscape(config_of(POLE), tmp_path, 1)
    with pytest.raises(StudyChanged, match=r"task.max_steps: 30 -> 40"):
        enumerate_landscape(config_of(POLE, "task.max_steps=40"), tmp_path, 1)
    with pytest.raises(NotARun, match="not a landscape"):
        Landscape(tmp_path / "nowhere")


def test_a_full_disk_pauses_the_enumeration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = config_of(POLE, "controller.n_hidden=2")
    told: list[str] = []

    class Full(LandscapeWriter):
        attempts = 0

        def write(self, chunk: int, first: int, *values: np.ndarray) -> None:
            Full.attempts += 1
            if Full.attempts < 3:
                raise OSError(errno.ENOSPC, "No space left on device")
            super().write(chunk, first, *values)

    monkeypatch.setattr(enumeration, "LandscapeWriter", Full)
    monkeypatch.setattr("sceann_hil.journal.disk.SECONDS_BETWEEN_ATTEMPTS", 0.0)
    landscape = enumerate_landscape(config, tmp_path / "full", 1, disk_full=lambda: told.append("full"))
    assert told == ["full"]
    monkeypatch.undo()
    np.testing.assert_array_equal(landscape.fitness, enumerate_landscape(config, tmp_path / "roomy", 1).fitness)


def test_a_landscape_does_not_go_on_with_other_versions_or_another_body(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = config_of(POLE, "controller.coding=sceann2", "controller.n_hidden=1")
    monkeypatch.setattr(enumeration, "_TRIALS_AT_ONCE", 1 << 12)
    monkeypatch.setattr(enumeration, "_SECONDS_BETWEEN_SYNCS", -1.0)

    def stop(done: int, n: int) -> None:
        raise Interrupted

    with pytest.raises(Interrupted):
        enumerate_landscape(config, tmp_path / "l", 1, stop)
    versions = enumeration.circumstances([config])
    for changed in ("numba", BODIES):
        monkeypatch.setattr(enumeration, "circumstances", lambda _, changed=changed: versions | {changed: "other"})
        with pytest.raises(OtherVersions, match=f"{changed}: .* before, other now"):
            enumerate_landscape(config, tmp_path / "l", 1)
    whole = enumerate_landscape(config, tmp_path / "l", 1, accept_other_versions=True)
    assert whole.is_complete
    assert [session["versions"][BODIES] for session in whole.sessions()] == [versions[BODIES], "other"]
    (tmp_path / "l" / "sessions.json").write_text("[{]")
    with pytest.raises(RunIsDamaged, match=r"sessions.json cannot be read"):
        whole.sessions()
