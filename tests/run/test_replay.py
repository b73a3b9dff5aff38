"""Replaying a journalled trial: the same bits, or a word about what differs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.config import journalled_config
from sceann_hil.errors import NotARun
from sceann_hil.journal import AttemptKind, JournalReader
from sceann_hil.run.replay import journalled_trials, replay, trace_from_sensors
from tests.runs import GOAL, config_of, evolve, measure_on
from tests.supervision.operators.fakes import Beside


@pytest.fixture
def run(tmp_path: Path) -> Path:
    evolve(tmp_path / "run", GOAL, "algorithm.generations=1")
    return tmp_path / "run"


def test_every_quantity_comes_out_again(run: Path) -> None:
    reader = JournalReader(run)
    config = journalled_config(reader)
    rows = reader.attempts(1)
    with config.robot.build() as robot:
        compared = replay(reader, config, robot, rows)
    assert len(compared) == len(rows)
    assert {one.quantity for one in compared[0]} >= {"end reason", "steps", "fitness"}
    assert all(one.equal for comparisons in compared for one in comparisons)


def test_a_difference_is_named(run: Path) -> None:
    reader = JournalReader(run)
    config = journalled_config(reader)
    changed = replace(reader.attempts(0)[0], state_hash=1)
    with config.robot.build() as robot:
        (compared,) = replay(reader, config, robot, [changed])
    assert [one.quantity for one in compared if not one.equal] == ["neuron states (CRC-16)"]


def test_the_trials_are_those_that_ran(run: Path) -> None:
    reader = JournalReader(run)
    rows = reader.attempts(1)
    trials = journalled_trials(reader, journalled_config(reader), rows)
    assert trials.ids.tolist() == [row.id for row in rows]
    assert trials.keys.tolist() == [row.noise_key for row in rows]
    assert trials.genome_index.tolist() == [row.individual for row in rows]


def test_a_robot_that_cannot_repeat_is_not_asked_to(run: Path) -> None:
    reader = JournalReader(run)
    config = journalled_config(reader)
    with Beside(config.robot.build()) as robot, pytest.raises(NotARun, match="cannot repeat"):
        replay(reader, config, robot, reader.attempts(0))
    assert robot.starts == 0


def test_a_trial_without_a_result_has_nothing_to_compare(run: Path) -> None:
    reader = JournalReader(run)
    config = journalled_config(reader)
    with config.robot.build() as robot, pytest.raises(NotARun, match="no result"):
        replay(reader, config, robot, [replace(reader.attempts(0)[0], end_reason=None, fitness=None)])


def test_a_measurement_is_no_trial_of_a_generation(tmp_path: Path) -> None:
    config = config_of(GOAL)
    with Beside(config.robot.build()) as robot:
        measure_on(tmp_path / "run", config, robot, np.zeros((1, config.genome_length), np.uint8))
    reader = JournalReader(tmp_path / "run")
    (row, *_) = reader.attempts_of_kind(AttemptKind.MEASUREMENT)
    with pytest.raises(NotARun, match="no part of evolution"):
        journalled_trials(reader, config, [row])


def test_without_what_the_robot_sent_there_is_no_trace(run: Path) -> None:
    reader = JournalReader(run)
    config = journalled_config(reader)
    weights = config.phenotype.decode(np.zeros((1, config.genome_length), np.uint8))[0]
    assert trace_from_sensors(reader, 1, weights, config.phenotype) is None
