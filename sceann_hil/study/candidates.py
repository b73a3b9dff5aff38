"""The champions of a study as candidates of a transfer."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sceann_hil.config import ExperimentConfig
from sceann_hil.run.transfer.sources import CandidateFolder, does_not_fit, misfit
from sceann_hil.study.schema import STUDY_NAME
from sceann_hil.study.store import StudyReader


class StudyFolder:
    """See `sceann_hil.run.transfer.sources.CandidateFolder`."""

    def knows(self, directory: Path) -> bool:
        """It holds a study's database."""
        return (directory / STUDY_NAME).exists()

    def genomes(self, directory: Path, config: ExperimentConfig) -> dict[str, float]:
        """The champions of all conditions with the same networks."""
        found: dict[str, float] = {}
        suited = 0
        with StudyReader(directory) as study:
            for condition in study.conditions():
                if misfit(condition.config, config) is not None:
                    continue
                suited += 1
                runs = study.runs(condition.number)
                for genome, fitness in zip(runs.genomes, runs.fitness.tolist(), strict=True):
                    found[genome] = max(fitness, found.get(genome, -np.inf))
        if not suited:
            raise does_not_fit(directory, "no condition of this study has the controller of this experiment")
        return found


STUDIES: CandidateFolder = StudyFolder()
