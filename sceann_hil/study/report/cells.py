"""A study's runs by the paper's coordinates: coding, algorithm, numbers of sensors and hidden neurons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Bits, Coding, genome_from_hex
from sceann_hil.study import STUDY_NAME, Condition, Effort, Runs, StudyReader


class Key(NamedTuple):
    """Where a condition stands in the paper's grids."""

    coding: Coding
    algorithm: str
    n_sensors: int
    n_hidden: int


@dataclass(frozen=True)
class Cell:
    """One condition and its runs.

    Attributes:
        condition: the experiment.
        runs: what came out.
        n_trials: of each individual.
    """

    condition: Condition
    runs: Runs
    n_trials: int

    @property
    def n(self) -> int:
        """Runs."""
        return len(self.runs)

    @property
    def fitness(self) -> NDArray[np.float64]:
        """Of the champions, shape ``(n,)``."""
        return self.runs.fitness

    @property
    def succeeded(self) -> NDArray[np.bool_]:
        """Whose champion succeeded in every trial, shape ``(n,)``."""
        return np.asarray(self.runs.successes == self.n_trials)

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Whose champion succeeded in at least one trial, shape ``(n,)``."""
        return np.asarray(self.runs.successes > 0)

    @property
    def rate(self) -> tuple[int, int]:
        """Runs that succeeded, and all runs."""
        return int(self.succeeded.sum()), self.n

    def genome(self, place: int) -> Bits:
        """The champion of the run at this place."""
        return genome_from_hex(self.runs.genomes[place], self.condition.config.genome_length)


@dataclass(frozen=True)
class StudyData:
    """Everything a report needs of one study.

    Attributes:
        name, about: of the study.
        seed: of the study.
        cells: every condition that has runs, in order.
        missing: how many conditions have none.
        effort: what it cost.
        versions: of the software that began it.
        written: its seed, base and grid as they were written.
    """

    name: str
    about: str
    seed: int
    cells: tuple[Cell, ...]
    missing: int
    effort: Effort
    versions: Mapping[str, str]
    written: Mapping[str, Any]

    @classmethod
    def read(cls, directory: Path) -> StudyData:
        """All of a study's database."""
        with StudyReader(directory) as reader:
            conditions = reader.conditions()
            cells = [Cell(c, reader.runs(c.number), c.config.build_task().n_trials) for c in conditions]
            filled = tuple(cell for cell in cells if cell.n > 0)
            return cls(
                reader.name,
                reader.about,
                reader.seed,
                filled,
                len(cells) - len(filled),
                reader.effort(),
                reader.versions,
                reader.written,
            )

    @property
    def by_key(self) -> dict[Key, Cell]:
        """The cells by the paper's coordinates."""
        return {key_of(cell.condition): cell for cell in self.cells}

    @property
    def n_runs(self) -> str:
        """Runs per condition, for people."""
        counts = sorted({cell.n for cell in self.cells})
        if not counts:
            return "no"
        return f"{counts[0]:,}" if len(counts) == 1 else f"{counts[0]:,} to {counts[-1]:,}"


def key_of(condition: Condition) -> Key:
    """A condition's coordinates."""
    config = condition.config
    size = config.size
    return Key(config.controller.coding, config.algorithm.type, size.n_sensors, size.n_hidden)


def studies_in(directory: Path) -> dict[str, StudyData]:
    """The studies in a folder and below, by name."""
    found = (StudyData.read(path.parent) for path in sorted(directory.rglob(STUDY_NAME)))
    return {study.name: study for study in found}
