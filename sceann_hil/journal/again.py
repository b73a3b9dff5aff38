"""Journalled attempts as trials that can be run again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import RunIsDamaged, way_out_of_damage
from sceann_hil.journal.rows import AttemptRow


@contextmanager
def sound_trials(path: Path) -> Iterator[None]:
    """What is read from a journal must be trials that somebody could have run: compiled code trusts them.

    Args:
        path: of the journal.

    Raises:
        RunIsDamaged: they are not, which the block notices as a ValueError.
    """
    try:
        yield
    except ValueError as error:
        raise RunIsDamaged(
            f"{path} is damaged: no trial could have been like that: {error}.", way_out_of_damage(path)
        ) from error


def trial_arrays(attempts: list[AttemptRow]) -> tuple[NDArray[np.float64], NDArray[np.uint64], NDArray[np.int64]]:
    """Starts, noise keys and ids of attempts as `sceann_hil.robot.Trials` wants them."""
    return (
        np.array([a.start for a in attempts], np.float64),
        np.array([a.noise_key for a in attempts], np.uint64),
        np.array([a.id for a in attempts], np.int64),
    )
