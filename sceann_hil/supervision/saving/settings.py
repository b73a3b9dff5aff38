"""The `saving` section of a configuration."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from sceann_hil.plugins import Section


class Racing(StrEnum):
    """When an individual's trials end early."""

    OFF = "off"
    EXACT = "exact"
    APPROXIMATE = "approximate"


class SavingConfig(Section):
    """Ways to need less robot time; all off by default."""

    reuse: bool = False
    """Where noise has no influence on a trial, run identical genomes once in the whole run."""
    pool: Annotated[int, Field(ge=1, le=1000)] | None = None
    """Where it has, pool the evaluations of identical genomes: the fitness of all of them is the mean over all their
    evaluations in the run, and once there are so many, no more are made, but of the best of a generation."""
    racing: Racing = Racing.OFF
    """End an individual's trials when the rest cannot change the selection: exact (proven), or approximate (it could,
    but hardly would)."""
    shuffle: bool = False
    """Run a generation's trials in random order, so that drift favours nobody."""

    def evaluations(self, *, noise_free: bool) -> int | None:
        """After how many evaluations a genome is not run any more; None if it always is."""
        if noise_free:
            return 1 if self.reuse else None
        return self.pool
