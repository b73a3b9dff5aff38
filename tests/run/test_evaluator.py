"""What a generation's trials say of its individuals: each trial counted once, in the journal, with its own noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sceann_hil.journal import AttemptRow
from sceann_hil.network.coding import Bits
from sceann_hil.robot import EndReason, Results, Robot, RobotSpec, Trials
from sceann_hil.run.evaluator import Evaluator
from sceann_hil.run.experiment import Experiment
from sceann_hil.run.trial_runner import TrialRunner
from sceann_hil.seeds import Purpose, keys
from sceann_hil.supervision.companion import Alone, Upcoming
from sceann_hil.supervision.saving import SavingConfig
from tests.runs import GOAL, config_of

SEED = 11
POPULATION, TRIALS = 6, 3


class Counting(Robot):
    """A simulated robot that knows how many trials it ran; the first of them is void if it is told so."""

    def __init__(self, body: Robot, *, first_is_void: bool = False) -> None:
        self._body = body
        self._void = first_is_void
        self.ran = 0

    @property
    def spec(self) -> RobotSpec:
        return self._body.spec

    def run(self, trials: Trials) -> Results:
        results = self._body.run(trials)
        if self._void and not self.ran:
            results = replace(results, end_reasons=results.end_reasons.copy())
            results.end_reasons[0] = EndReason.LINK_LOST
        self.ran += len(trials)
        return results


class Listening(Alone):
    """Notes what it is told of a generation."""

    def __init__(self) -> None:
        self.begun: list[tuple[int, int, int]] = []
        self.remarks: set[str] = set()

    def begin(self, generation: int, todo: int, total: int) -> None:
        self.begun.append((generation, todo, total))

    def ready(self, upcoming: Upcoming) -> bool:
        self.remarks.add(upcoming.remark)
        return True


class Bench:
    """An evaluator over the journal of a new run."""

    def __init__(self, directory: Path, *overrides: str, saving: SavingConfig | None = None, **robot: Any) -> None:
        self.config = config_of(GOAL, *overrides)
        self.experiment = Experiment.create(self.config, directory)
        self.robot = Counting(self.config.robot.build(), **robot)
        self.task = self.config.build_task()
        self.companion = Listening()
        self.runner = TrialRunner(self.config.phenotype, self.task, self.robot, self.experiment.journal, self.companion)
        self.evaluator = Evaluator(self.runner, SEED, saving)

    def genomes(self) -> Bits:
        return np.random.default_rng(SEED).integers(0, 2, (POPULATION, self.config.genome_length), np.uint8)

    def begin(self, number: int, genomes: Bits) -> None:
        self.experiment.journal.begin_generation(number, b"", genomes, [None] * POPULATION, [None] * POPULATION)

    def rows(self, number: int = 0) -> list[AttemptRow]:
        return list(self.experiment.journal.reader.attempts(number))


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    bench = Bench(tmp_path / "run")
    yield bench
    bench.experiment.close()


def test_fitness_is_the_mean_over_an_individual_s_trials(bench: Bench) -> None:
    bench.begin(0, bench.genomes())
    found = bench.evaluator.evaluate(0, bench.genomes())
    rows = bench.rows()
    by_individual = [[row.fitness for row in rows if row.individual == i] for i in range(POPULATION)]
    assert found.fitness.tolist() == [float(np.mean(values)) for values in by_individual]
    assert found.success_rate == np.mean([row.end_reason == EndReason.GOAL for row in rows])
    assert sorted((row.individual, row.trial) for row in rows) == list(np.ndindex(POPULATION, TRIALS))
    assert bench.companion.begun == [(0, POPULATION * TRIALS, POPULATION * TRIALS)]


def test_what_the_journal_holds_is_not_run_again(bench: Bench) -> None:
    bench.begin(0, bench.genomes())
    first = bench.evaluator.evaluate(0, bench.genomes())
    again = bench.evaluator.evaluate(0, bench.genomes())
    assert bench.robot.ran == POPULATION * TRIALS
    assert again.fitness.tolist() == first.fitness.tolist()
    assert again.success_rate == first.success_rate
    assert bench.companion.begun[-1] == (0, 0, POPULATION * TRIALS)


def test_noise_is_a_trial_s_own_and_a_second_attempt_has_another(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run", first_is_void=True)
    bench.begin(0, bench.genomes())
    bench.evaluator.evaluate(0, bench.genomes())
    rows = bench.rows()
    expected = [int(keys(SEED, Purpose.TRIAL, 0, row.individual, row.trial, row.attempt).item()) for row in rows]
    assert [row.noise_key for row in rows] == expected
    assert len(set(expected)) == POPULATION * TRIALS + 1
    assert [(row.attempt, row.fitness is None) for row in rows if (row.individual, row.trial) == (0, 0)] == [
        (0, True),
        (1, False),
    ]
    bench.experiment.close()


def test_only_the_trials_that_an_algorithm_wants_are_run_and_count(bench: Bench) -> None:
    of = np.zeros((POPULATION, TRIALS), np.bool_)
    of[:, 1] = True
    of[2] = True
    bench.begin(0, bench.genomes())
    found = bench.evaluator.evaluate(0, bench.genomes(), of, "one heading is enough")
    assert bench.robot.ran == of.sum()
    values = np.full(of.shape, np.nan)
    for row in bench.rows():
        values[row.individual, row.trial] = row.fitness
    assert (~np.isnan(values) == of).all()
    assert found.fitness.tolist() == np.nanmean(values, axis=1).tolist()
    assert bench.companion.begun == [(0, int(of.sum()), int(of.sum()))]
    assert bench.companion.remarks == {"one heading is enough"}


def test_what_is_known_of_a_genome_without_noise_is_not_measured_again(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run", "robot.motion_noise=0.0", saving=SavingConfig(reuse=True))
    genomes = bench.genomes()
    bench.begin(0, genomes)
    first = bench.evaluator.evaluate(0, genomes)
    turned = genomes[::-1].copy()
    turned[0, 0] ^= 1
    bench.begin(1, turned)
    second = bench.evaluator.evaluate(1, turned)
    assert bench.robot.ran == (POPULATION + 1) * TRIALS
    assert second.fitness[1:].tolist() == first.fitness[::-1][1:].tolist()
    assert {row.individual for row in bench.rows(1)} == {0}
    bench.experiment.close()


def test_a_race_runs_fewer_trials_and_finds_the_same_best(tmp_path: Path) -> None:
    racing = SavingConfig.model_validate({"racing": "exact"}, strict=False)
    found, ran = [], []
    for saving in (SavingConfig(), racing):
        long = ("robot.motion_noise=0.0", "task.max_steps=200", "task.headings_deg=[0, 30, 60, 45, 90]")
        bench = Bench(tmp_path / str(saving.racing), *long, saving=saving)
        # two of these six reach the target, one much better: its place is settled before its last trial
        genomes = np.random.default_rng(382).integers(0, 2, (POPULATION, bench.config.genome_length), np.uint8)
        bench.begin(0, genomes)
        found.append(bench.evaluator.evaluate(0, genomes).fitness)
        ran.append(bench.robot.ran)
        bench.experiment.close()
    assert ran[1] < ran[0] == POPULATION * 5
    assert found[0].argmax() == found[1].argmax() == 2
    assert found[0].max() == found[1].max()
