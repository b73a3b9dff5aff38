"""What a run's algorithm keeps besides its population: the map of different good controllers, read from the journal."""

from __future__ import annotations

import numpy as np

from sceann_hil.config import ExperimentConfig
from sceann_hil.evolution.algorithm import Archive
from sceann_hil.journal import JournalReader


def archive_of(reader: JournalReader, config: ExperimentConfig, generation: int | None = None) -> Archive | None:
    """The archive that a generation came from; None if the algorithm keeps none, or nothing has begun.

    Args:
        reader: the run's journal.
        config: its configuration.
        generation: its number; the newest one if it is not given.

    Raises:
        RunIsDamaged: the algorithm's state is not as it was written.
        PackageMissing: the algorithm needs a package that is not there.
    """
    if not config.algorithm.measures:
        return None
    if generation is None:
        last = reader.last_generation()
        if last is None:
            return None
        generation = last.number
    algorithm = config.algorithm.build(config.genome_length)
    return algorithm.archive(algorithm.load(reader.algorithm_state(generation)))


def empty_archive(config: ExperimentConfig) -> Archive | None:
    """The archive before anything is in it: its axes; None if the algorithm keeps none."""
    if not config.algorithm.measures:
        return None
    algorithm = config.algorithm.build(config.genome_length)
    return algorithm.archive(algorithm.start(np.random.default_rng(0)))
