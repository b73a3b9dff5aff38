"""What is given to a journal to be kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Bits


class AttemptKind(StrEnum):
    """What an attempt of a trial is for. The names are stored in journals; they never change."""

    EVOLUTION = "evolution"
    """Its fitness is one of an individual's."""
    REFERENCE = "reference"
    """The reference genome, run again and again to see whether the robot drifts."""
    MEASUREMENT = "measurement"
    """A genome that somebody wants to know more about: compared, repeated, moved by the doctor."""


@dataclass(frozen=True, slots=True)
class Slots:
    """Which places in a generation n attempts are for; integer arrays of shape ``(n,)``.

    Attributes:
        individual: place in the generation; of attempts outside evolution, which repetition of their genome, from 0.
        trial: which of the individual's trials.
        attempt: 0, and one more each time the attempt before was void.
    """

    individual: NDArray[np.int64]
    trial: NDArray[np.int64]
    attempt: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.individual)

    def take(self, which: slice | NDArray[np.intp]) -> Slots:
        """Some of them, in the order asked for."""
        return Slots(self.individual[which], self.trial[which], self.attempt[which])


@dataclass(frozen=True, slots=True)
class Circumstances:
    """What is known of attempts besides their results.

    Attributes:
        operator_s: time that a person needed; None if nobody was asked.
        battery_fraction: after the attempt; None where it is not measured.
        note: an operator's words, or why it is void.
        paused_s: time that this session has spent in pauses so far.
    """

    operator_s: float | None = None
    battery_fraction: float | None = None
    note: str | None = None
    paused_s: float = 0.0


NOTHING_SPECIAL = Circumstances()


@dataclass(frozen=True, slots=True)
class FirstGeneration:
    """Generation 0 of a run that goes on from another one's population; as in `Journal.begin_generation`.

    Attributes:
        parents: ids in the other run.
    """

    state: bytes
    genomes: Bits
    parents: Sequence[int | None]
    structures: Sequence[str | None]
