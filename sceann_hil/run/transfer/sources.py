"""Candidates from folders: the genomes of runs, and of whatever other folders somebody knows how to read.

Runs are read here. Studies stand above runs and are found by entry point, as those of any package are::

    [project.entry-points."sceann_hil.candidates"]
    study = "sceann_hil.study.candidates:STUDIES"
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np

from sceann_hil.config import ExperimentConfig, journalled_config
from sceann_hil.errors import ConfigError
from sceann_hil.journal import JournalReader
from sceann_hil.network.coding import Bits, genome_from_hex
from sceann_hil.plugins import RobotConfig
from sceann_hil.registry import entry_points

GROUP = "sceann_hil.candidates"
"""Entry points for folders of other kinds than runs; each names a `CandidateFolder`."""


class CandidateFolder(Protocol):
    """A kind of folder that holds controllers."""

    def knows(self, directory: Path) -> bool:
        """This folder is of this kind."""

    def genomes(self, directory: Path, config: ExperimentConfig) -> dict[str, float]:
        """Genomes in hexadecimal that make the networks of an experiment, and the fitness of each.

        Raises:
            ConfigError: there are none, since all of them mean something else.
        """


def read_source(directory: Path, config: ExperimentConfig) -> Bits:
    """Different genomes of a run, a study or another folder of candidates, fittest first, shape ``(n, L)``.

    Args:
        directory: the folder.
        config: of the experiment that they are candidates for.

    Raises:
        NotARun: nobody knows what it is.
        ConfigError: its genomes mean something else there.
    """
    kind = kind_of(directory)
    found = _genomes_of_run(directory, config) if kind is None else kind.genomes(directory, config)
    order = sorted(found, key=lambda genome: -found[genome])
    length = config.genome_length
    return np.array([genome_from_hex(genome, length) for genome in order], np.uint8).reshape(-1, length)


def kind_of(directory: Path) -> CandidateFolder | None:
    """Who knows this folder; None for a run, and for what nobody knows."""
    kinds: list[CandidateFolder] = [entry.load() for entry in entry_points(GROUP)]
    return next((kind for kind in kinds if kind.knows(directory)), None)


def _genomes_of_run(directory: Path, config: ExperimentConfig) -> dict[str, float]:
    found: dict[str, float] = {}
    reader = JournalReader(directory)
    try:
        theirs = journalled_config(reader)
        told = misfit(theirs, config)
        if told is not None:
            raise does_not_fit(directory, told)
        for generation in reader.generations(finished=True):
            for row in reader.individuals(generation.number):
                value = row.fitness if row.fitness is not None else -np.inf
                found[row.genome] = max(value, found.get(row.genome, -np.inf))
    finally:
        reader.close()
    return found


def body_of(directory: Path) -> RobotConfig | None:
    """The simulated robot of a run; None of a study, or where the robot was a real one."""
    if kind_of(directory) is not None:
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


def does_not_fit(directory: Path, why: str) -> ConfigError:
    """To be raised where a folder's genomes mean something else."""
    return ConfigError(
        f"{directory}: {why}.",
        "Nothing was started. Candidates must make the same networks: name other runs, or change the controller.",
    )
