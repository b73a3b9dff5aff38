"""Going on elsewhere: the population of one run as the first generation of another, perhaps on another robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from sceann_hil.config import ExperimentConfig, journalled_config
from sceann_hil.errors import ConfigError, NotARun
from sceann_hil.evolution import Algorithm, State
from sceann_hil.journal import FirstGeneration, IndividualRow, JournalReader
from sceann_hil.network.coding import Bits
from sceann_hil.seeds import Purpose, generator


class Take(StrEnum):
    """What is taken of a run."""

    POPULATION = "population"
    """Its last finished generation, unchanged, with all that the algorithm keeps if algorithm and size are the same."""
    BEST = "best"
    """The best individual of that generation, unchanged, and children of it."""


@dataclass(frozen=True, slots=True)
class Ancestor:
    """A run that another one goes on from.

    Attributes:
        directory: its folder.
        take: what of it.
    """

    directory: Path
    take: Take = Take.POPULATION

    def first_generation(self, config: ExperimentConfig) -> FirstGeneration:
        """Generation 0 of a run with this configuration; every individual's parent is one of the ancestor's.

        Raises:
            NotARun: there is no such run, or none of its generations is finished.
            ConfigError: its genomes mean something else under `config`.
        """
        reader = JournalReader(self.directory)
        try:
            return self._first_generation(reader, config)
        finally:
            reader.close()

    def _first_generation(self, reader: JournalReader, config: ExperimentConfig) -> FirstGeneration:
        theirs = journalled_config(reader)
        self._check(theirs, config)
        finished = reader.generations(finished=True)
        if not finished:
            raise NotARun(
                f"{self.directory} has no finished generation to go on from.",
                f"`sceann resume {self.directory}` first.",
            )
        number = finished[-1].number
        rows = reader.individuals(number)
        algorithm: Algorithm[Any] = config.algorithm.for_experiment(config)
        if self.take is Take.BEST:
            state, parents = self._best(algorithm, config, rows)
        else:
            genomes = _heirs(theirs, reader.algorithm_state(number), rows)
            state = self._population(algorithm, config, genomes, reader.algorithm_state(number))
            parents = [rows[i % len(rows)].id for i in range(len(state.genomes))]
        return FirstGeneration(algorithm.dump(state), state.genomes, parents, algorithm.structures(state))

    def _check(self, theirs: ExperimentConfig, ours: ExperimentConfig) -> None:
        for name, expected, got in (
            ("coding", theirs.controller.coding.value, ours.controller.coding.value),
            ("neuron", theirs.controller.neuron.value, ours.controller.neuron.value),
            ("initial_output", theirs.controller.initial_output, ours.controller.initial_output),
            ("n_hidden", theirs.size.n_hidden, ours.size.n_hidden),
            ("sensors of the robot", theirs.size.n_sensors, ours.size.n_sensors),
            ("motors of the robot", theirs.size.n_motors, ours.size.n_motors),
        ):
            if expected != got:
                raise ConfigError(
                    f"{name}: expected {expected}, as in {self.directory}, got {got}.",
                    "A population can go on only where its genomes make the same networks.",
                )

    def _population(self, algorithm: Algorithm[Any], config: ExperimentConfig, genomes: Bits, dumped: bytes) -> State:
        try:
            state: State = algorithm.load(dumped)
        except ValueError:
            # another algorithm, or another number of individuals: their expressed bits are what can be taken
            state = algorithm.adopt(genomes, generator(config.seed, Purpose.ALGORITHM, 0))
        return replace(state, parents=np.full(len(state.genomes), -1, np.int32))

    def _best(
        self, algorithm: Algorithm[Any], config: ExperimentConfig, rows: list[IndividualRow]
    ) -> tuple[State, list[int | None]]:
        best = max(rows, key=lambda row: (row.fitness if row.fitness is not None else -np.inf, -row.number))
        rng = generator(config.seed, Purpose.ALGORITHM, 0)
        same: State = algorithm.adopt(best.genome_bits(config.genome_length)[None], rng)
        if config.algorithm.weighs_trials:
            # it has no children, and would take the zeros below for a trial
            return same, [best.id] * len(same.genomes)
        nothing = np.zeros(len(same.genomes))
        measures = np.zeros((len(same.genomes), len(config.algorithm.measures)))
        children: State = algorithm.tell_with_measures(same, nothing, measures, rng)
        return replace(children, parents=np.full(len(children.genomes), -1, np.int32)), [best.id] * len(
            children.genomes
        )


def _heirs(config: ExperimentConfig, dumped: bytes, rows: list[IndividualRow]) -> Bits:
    """Genomes of a run to go on from, best first: what its algorithm says, or its last finished generation."""
    algorithm: Algorithm[Any] = config.algorithm.build(config.genome_length)
    heirs = algorithm.heirs(algorithm.load(dumped))
    return np.stack([row.genome_bits(config.genome_length) for row in rows]) if heirs is None else heirs
