"""A run of a study is the same run as an experiment with its seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sceann_hil.network.coding import genome_from_hex
from sceann_hil.run.experiment import Experiment
from sceann_hil.study.blocks import Block, compute_block, evolve_together
from sceann_hil.study.condition import Condition
from sceann_hil.study.config import parse_study

POLE = "task: {type: pole_balancing, max_steps: 300}\nrobot: {type: cartpole}"
NOISY_POLE = POLE[:-1] + ", gap: {sensor_noise: 0.01, sensor_offset: {normal: [0.0, 0.01]}}}"
GOAL = "task: {type: goal_reach, max_steps: 60, headings_deg: [0, 90, 180]}\nrobot: {type: diffdrive, n_sensors: 3}"
SGA = "algorithm: {type: sga, population: 7, generations: 4}"
OGA = "algorithm: {type: oga, population: 7, generations: 4}"


def condition(*lines: str) -> Condition:
    body = "\n".join(lines).replace("\n", "\n  ")
    text = f"name: test\nbase:\n  {body}\n  controller: {{coding: sceann3, n_hidden: 2}}\n"
    return parse_study(text, "test").conditions[0]


@pytest.mark.parametrize("body", [POLE, NOISY_POLE, GOAL], ids=["pole", "noisy pole", "goal"])
@pytest.mark.parametrize("algorithm", [SGA, OGA], ids=["sga", "oga"])
def test_run_k_of_a_study_is_the_experiment_with_its_seed_bit_for_bit(
    body: str, algorithm: str, tmp_path: Path
) -> None:
    tested = condition(body, algorithm)
    seeds = tested.seeds(5, range(3, 9))
    with tested.config.robot.build() as robot:
        generations = list(evolve_together(tested.config, seeds, robot))
        for place, run in ((0, 3), (4, 7)):
            with Experiment.create(tested.experiment(5, run), tmp_path / str(run)) as experiment:
                experiment.evolve(robot)
                reader = experiment.journal.reader
                length = experiment.config.genome_length
                for generation in generations:
                    rows = reader.individuals(generation.number)
                    assert [row.fitness for row in rows] == generation.fitness[place].tolist()
                    genomes = np.stack([row.genome_bits(length) for row in rows])
                    np.testing.assert_array_equal(genomes, generation.states[place].genomes)


@pytest.mark.parametrize("body", [POLE, NOISY_POLE, GOAL], ids=["pole", "noisy pole", "goal"])
def test_a_run_does_not_depend_on_the_runs_beside_it(body: str) -> None:
    tested = condition(body, OGA)
    together = compute_block(Block(0, 0, tested.text, tuple(tested.seeds(1, range(6)).tolist())))
    for first, last in ((0, 1), (1, 4), (4, 6)):
        part = compute_block(Block(0, first, tested.text, tuple(tested.seeds(1, range(first, last)).tolist())))
        np.testing.assert_array_equal(part.fitness, together.fitness[first:last])
        np.testing.assert_array_equal(part.best, together.best[first:last])
        np.testing.assert_array_equal(part.successes, together.successes[first:last])
        assert part.genomes == together.genomes[first:last]


def test_the_champion_is_the_first_of_the_best_of_the_last_generation() -> None:
    tested = condition(POLE, SGA)
    seeds = tested.seeds(1, range(4))
    result = compute_block(Block(0, 0, tested.text, tuple(seeds.tolist())))
    with tested.config.robot.build() as robot:
        last = list(evolve_together(tested.config, seeds, robot))[-1]
    for run in range(4):
        best = int(np.flatnonzero(last.fitness[run] == last.fitness[run].max())[0])
        assert result.fitness[run] == last.fitness[run, best]
        genome = genome_from_hex(result.genomes[run], tested.config.genome_length)
        np.testing.assert_array_equal(genome, last.states[run].genomes[best])


def test_seeds_depend_on_study_condition_and_run_only() -> None:
    one, other = condition(POLE, SGA), condition(POLE, OGA)
    assert one.identity != other.identity
    np.testing.assert_array_equal(one.seeds(1, range(2, 5)), one.seeds(1, range(6))[2:5])
    every = np.concatenate([c.seeds(study, range(100)) for c in (one, other) for study in (1, 2)])
    assert len(np.unique(every)) == len(every)
    assert every.max() < 2**63
