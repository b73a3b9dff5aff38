"""Small runs for tests, and what of a journal must be equal between two runs."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np

from sceann_hil.config import ExperimentConfig, parse_config
from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.journal.insertion import rewrite_digests, update_checksums
from sceann_hil.journal.schema import COLUMNS
from sceann_hil.network.coding import Bits, genome_to_hex
from sceann_hil.robot import Robot
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.run.measuring import Measurement, measuring
from sceann_hil.run.session import Presence
from sceann_hil.supervision.operators import Desk

POLE = """
task: {type: pole_balancing, max_steps: 300}
robot: {type: cartpole, n_sensors: 2}
controller: {coding: sceann3, n_hidden: 3}
algorithm: {type: sga, population: 8, generations: 4}
"""
GOAL = """
task: {type: goal_reach, max_steps: 60, headings_deg: [0, 45, 200]}
robot: {type: diffdrive, n_sensors: 3}
controller: {coding: sceann2, n_hidden: 1}
algorithm: {type: oga, population: 6, generations: 3}
"""


def config_of(text: str, *overrides: str) -> ExperimentConfig:
    """A validated configuration."""
    return parse_config(text, "test", overrides)


def evolve(directory: Path, text: str = POLE, *overrides: str) -> Outcome:
    """A whole run in `directory`."""
    config = config_of(text, *overrides)
    with Experiment.create(config, directory) as experiment, config.robot.build() as robot:
        return experiment.evolve(robot)


def resume(directory: Path) -> Outcome:
    """The rest of a run."""
    with Experiment.open(directory) as experiment, experiment.config.robot.build() as robot:
        return experiment.evolve(robot)


def falsify(directory: Path, statement: str) -> None:
    """Change a journal behind its back, checksums and all: what only a replay can find out."""
    db = sqlite3.connect(directory / JOURNAL_NAME)
    db.execute(statement)
    for table in COLUMNS:
        update_checksums(db, table)
    rewrite_digests(db, since_generation=0)
    db.commit()
    db.close()


def measure_on(
    directory: Path, config: ExperimentConfig, robot: Robot, genomes: Bits, repeats: int = 1, desk: Desk | None = None
) -> Measurement:
    """Genomes on a connected robot, in the journal of a run that has not begun."""
    exists = directory.exists()
    with Experiment.open(directory) if exists else Experiment.create(config, directory) as experiment:
        n_trials = len(genomes) * repeats * config.task.build().n_trials
        plan: dict[str, object] = {"genomes": [genome_to_hex(bits) for bits in genomes], "repeats": repeats}
        with measuring(experiment.journal, config, robot, "test", plan, n_trials, Presence(desk)) as ask:
            return ask.run_all(genomes, repeats)


CONTENTS = {
    "run": "root_seed, config",
    "generation": "number, algorithm_state, finished_at IS NOT NULL, robot_s, best_fitness, mean_fitness, "
    "worst_fitness, success_rate",
    "individual": "id, generation, number, genome, coalesce(parent, ancestor), structure, fitness",
    "attempt": "id, generation, individual, trial, attempt, "
    "(SELECT start_values FROM start WHERE start.id = attempt.start), printf('%016x', noise_key), end_reason, steps, "
    "state_hash, numbers(final_state), robot_s, fitness",
}
"""Everything in a journal but times of day and the events that tell of interruptions."""


def contents(directory: Path) -> dict[str, list[Any]]:
    """What two runs must have in common to be the same run."""
    db = sqlite3.connect(directory / JOURNAL_NAME)
    db.create_function("numbers", 1, lambda text: text and json.dumps(np.array(json.loads(text), np.float32).tolist()))
    try:
        return {table: db.execute(f"SELECT {what} FROM {table}").fetchall() for table, what in CONTENTS.items()}
    finally:
        db.close()
