"""In which order a generation's trials are run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.seeds import Purpose, generator


def rounds(
    population: int, n_trials: int, *, trial_by_trial: bool, shuffle: bool, root_seed: int, generation: int
) -> list[NDArray[np.int64]]:
    """All (individual, trial) places of a generation, in rounds.

    Args:
        population: individuals.
        n_trials: trials of each.
        trial_by_trial: one round per trial, for all individuals, as racing needs it; else one round with everything.
        shuffle: random order inside each round, from the seed tree.
        root_seed: the run's seed.
        generation: the generation's number.

    Returns:
        Rounds of shape ``(n, 2)``: individual, trial.
    """
    places = np.indices((population, n_trials), np.int64).reshape(2, -1).T
    parts = [places[places[:, 1] == t] for t in range(n_trials)] if trial_by_trial else [places]
    if shuffle:
        rng = generator(root_seed, Purpose.ORDER, generation)
        parts = [rng.permutation(part) for part in parts]
    return parts
