"""Candidates from folders: the genomes of runs and the champions of studies."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sceann_hil.config import ExperimentConfig, journalled_config
from sceann_hil.errors import ConfigError
from sceann_hil.journal import JournalReader
from sceann_hil.network.coding import Bits, genome_from_hex
from sceann_hil.plugins import RobotConfig

STUDY = "study.sqlite"


def read_source(directory: Path, config: ExperimentConfig) -> Bits:
    """Different genomes of a run or a study, fittest first, shape ``(n, L)``.

    Args:
        directory: folder of a run, or of a study.
        config: of the experiment that they are candidates for.

    Raises:
        NotARun: it is neither.
        ConfigError: its genomes mean something else there.
    """
    found: dict[str, float] = {}
    if (directory / STUDY).exists():
        # studies stand above runs; whoever names one needs it
        from sceann_hil.study import StudyReader

        with StudyReader(directory) as study:
            suited = 0
            for condition in study.conditions():
                if misfit(condition.config, config) is None:
                    suited += 1
                    runs = study.runs(condition.number)
                    for genome, fitness in zip(runs.genomes, runs.fitness.tolist(), strict=True):
                        found[genome] = max(fitness, found.get(genome, -np.inf))
            if not suited:
                raise ConfigError(
                    f"{directory}: no condition of this study has the controller of this experiment.", _HINT
                )
    else:
        reader = JournalReader(directory)
        try:
            theirs = journalled_config(reader)
            told = misfit(theirs, config)
            if told is not None:
                raise ConfigError(f"{directory}: {told}.", _HINT)
            for generation in reader.generations(finished=True):
                for row in reader.individuals(generation.number):
                    value = row.fitness if row.fitness is not None else -np.inf
                    found[row.genome] = max(value, found.get(row.genome, -np.inf))
        finally:
            reader.close()
    order = sorted(found, key=lambda genome: -found[genome])
    length = config.genome_length
    return np.array([genome_from_hex(genome, length) for genome in order], np.uint8).reshape(-1, length)


def body_of(directory: Path) -> RobotConfig | None:
    """The simulated robot of a run; None of a study, or where the robot was a real one."""
    if (directory / STUDY).exists():
        return None
    reader = JournalReader(directory)
    try:
        robot = journalled_config(reader).robot
    finally:
        reader.close()
    return robot if robot.spec.takes_batches else None


def misfit(theirs: ExperimentConfig, ours: ExperimentConfig) -> str | None:
    """Why genomes of one experiment mean nothing in another; None if they do."""
    for name, expected, got in (
        ("coding", ours.controller.coding.value, theirs.controller.coding.value),
        ("neuron", ours.controller.neuron.value, theirs.controller.neuron.value),
        ("initial_output", ours.controller.initial_output, theirs.controller.initial_output),
        ("n_hidden", ours.size.n_hidden, theirs.size.n_hidden),
        ("sensors", ours.size.n_sensors, theirs.size.n_sensors),
        ("motors", ours.size.n_motors, theirs.size.n_motors),
    ):
        if expected != got:
            return f"{name}: expected {expected}, as this experiment has it, got {got}"
    return None


_HINT = "Nothing was started. Candidates must make the same networks: name other runs, or change the controller."
