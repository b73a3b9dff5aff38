"""From the journal to trials with traces: finished generations are run again and must give the journalled bits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import journalled_config
from sceann_hil.errors import ReplayDiffers
from sceann_hil.evolution.algorithm import Archive
from sceann_hil.journal import AttemptRow, GenerationRow, JournalReader, RunRow
from sceann_hil.journal.again import sound_trials, trial_arrays
from sceann_hil.network.coding import Weights
from sceann_hil.network.controller import Dynamics, state_hash
from sceann_hil.recording.trial import RecordedRun, RecordedTrial, as_id
from sceann_hil.robot import EndReason, Trace
from sceann_hil.run.archive import archive_of, empty_archive
from sceann_hil.run.champion import best_so_far
from sceann_hil.run.replay import trace_from_sensors


@dataclass(frozen=True, slots=True)
class RecordedGeneration:
    """A finished generation.

    Attributes:
        row: its figures.
        fitness: of each individual, shape ``(population,)``.
        weights: of each individual, shape ``(population, n_neurons, n_sources)``.
        champion: the best individual; the first of equals.
        trials: all trials that were counted, in the order of their ids.
        notes: what the journal noted in it: kind and message.
        archive: the map that it came from; None if its algorithm keeps none.
    """

    row: GenerationRow
    fitness: NDArray[np.float64]
    weights: Weights
    champion: int
    trials: Sequence[RecordedTrial]
    notes: Sequence[tuple[str, str]]
    archive: Archive | None = None


def recorded_name(run: RunRow) -> str:
    """What recordings call a run."""
    return as_id(f"{run.name}-{run.root_seed}")


class RunSource:
    """The trials of one run, read from its journal while it may still be running.

    Attributes:
        run: what its trials share.
        config: its configuration as YAML.
        seed: root of its seed tree.
    """

    def __init__(self, run_dir: Path) -> None:
        """Open the journal.

        Raises:
            NotARun, RunIsNewer, RunIsDamaged: it cannot be read.
            PackageMissing, ConfigError: its configuration needs a package that is not there, or in another version.
        """
        self._reader = JournalReader(run_dir)
        row = self._reader.run()
        self.config, self.seed = row.config, row.root_seed
        config = self._config = journalled_config(self._reader)
        self._robot, self._task = config.robot.build(), config.build_task()
        self._phenotype = config.phenotype
        spec = self._robot.spec
        self.run = RecordedRun(
            name=recorded_name(row),
            experiment=as_id(row.name),
            robot=spec.name,
            size=config.size,
            tick_s=spec.tick_s,
            max_steps=self._task.max_steps,
            best_fitness=self._task.best_fitness,
            drawing=self._robot.drawing,
            start_fields=spec.start_fields,
            state_fields=self._robot.spec.state_fields,
            accumulation=self._task.accumulation,
            has_map=bool(config.algorithm.measures),
        )
        if spec.deterministic:
            self._robot.connect()

    def close(self) -> None:
        """Let go of journal and robot."""
        if self._robot.spec.deterministic:
            self._robot.disconnect()
        self._reader.close()

    @property
    def dynamics(self) -> Dynamics:
        """What the networks do besides their weights."""
        return self._phenotype.dynamics

    def weights_of(self, row: AttemptRow) -> Weights:
        """The network of one attempt, shape ``(n_neurons, n_sources)``."""
        individual = self._reader.individuals(row.own_generation)[row.individual]
        return self._phenotype.decode(individual.genome_bits(self._phenotype.genome_length))

    def finished(self) -> list[int]:
        """Numbers of the generations that are finished by now."""
        return [row.number for row in self._reader.generations(finished=True)]

    def attempt(self, number: int) -> AttemptRow:
        """One trial by the number that users see.

        Raises:
            NotARun: the run has no such trial.
        """
        return self._reader.attempt(number)

    def generation(self, number: int) -> RecordedGeneration:
        """A finished generation, with a trace of every trial.

        Raises:
            ReplayDiffers: a trial did not end as the journal says.
        """
        row = next(row for row in self._reader.generations(finished=True) if row.number == number)
        fitness, weights, champion = self._population(number)
        notes = [(kind, message) for _, generation, kind, message in self._reader.events() if generation == number]
        trials = self._with_traces(self._drawable(number), weights, champion)
        return RecordedGeneration(
            row, fitness, weights, champion, trials, notes, archive_of(self._reader, self._config, number)
        )

    @property
    def empty_archive(self) -> Archive | None:
        """The axes of the map; None if the algorithm keeps none."""
        return empty_archive(self._config)

    def trials_of_best(self, number: int) -> list[RecordedTrial]:
        """The counted trials of a finished generation's best individual, in the order of their ids, with traces.

        Trials of which only the result is known are left out.

        Raises:
            ReplayDiffers: a trial did not end as the journal says.
        """
        _, weights, champion = self._population(number)
        rows = [row for row in self._drawable(number) if row.individual == champion]
        return self._with_traces(rows, weights, champion)

    def trials_so_far(self) -> list[RecordedTrial]:
        """The counted trials of the newest generation while it is not finished, with traces; the leader's as the best.

        Raises:
            ReplayDiffers: a trial did not end as the journal says.
        """
        leading = best_so_far(self._reader)
        if leading is None:
            return []
        number = leading.individual.generation
        _, weights, _ = self._population(number)
        return self._with_traces(self._drawable(number), weights, leading.individual.number)

    def _population(self, number: int) -> tuple[NDArray[np.float64], Weights, int]:
        """Fitness and networks of a generation, and its champion; no fitness while it is not finished."""
        individuals = self._reader.individuals(number)
        length = self._phenotype.genome_length
        genomes = np.stack([individual.genome_bits(length) for individual in individuals])
        fitness = np.array([individual.fitness for individual in individuals], np.float64)
        return fitness, self._phenotype.decode(genomes), int(fitness.argmax())

    def _with_traces(self, attempts: list[AttemptRow], weights: Weights, champion: int) -> list[RecordedTrial]:
        traced = self._traced if self._robot.spec.deterministic else self._measured
        return traced(attempts, weights, champion)

    def expected_trials(self, number: int) -> int:
        """How many trials of a finished generation were counted."""
        if self._robot.spec.deterministic:
            return self._reader.count_counted(number)
        return len(self._drawable(number))

    def _counted(self, generation: int) -> list[AttemptRow]:
        return [row for row in self._reader.attempts(generation) if row.fitness is not None]

    def _drawable(self, generation: int) -> list[AttemptRow]:
        """Counted attempts of which more is known than their result."""
        counted = self._counted(generation)
        if self._robot.spec.deterministic:
            return counted
        return [row for row in counted if self._reader.sensor_trace(row.id) is not None]

    def _measured(self, attempts: list[AttemptRow], weights: Weights, champion: int) -> list[RecordedTrial]:
        """Trials that nobody can repeat, from what the robot sent: it must agree with what the journal says."""
        recorded = []
        for row in attempts:
            trace = trace_from_sensors(self._reader, row.id, weights[row.individual], self._phenotype)
            if trace is not None and row.end_reason is not None:
                _must_agree(row, (row.end_reason, len(trace.sensors), state_hash(trace.u)))
                recorded.append(_recorded(row, trace, weights, champion))
        return recorded

    def _traced(self, attempts: list[AttemptRow], weights: Weights, champion: int) -> list[RecordedTrial]:
        individual, trial = [row.individual for row in attempts], [row.trial for row in attempts]
        with sound_trials(self._reader.path):
            starts, keys, ids = trial_arrays(attempts)
            trials = self._task.trials(self._phenotype, weights, individual, trial, keys, ids, starts=starts)
        recorded = []
        for first in range(0, len(attempts), _BATCH):
            part = slice(first, first + _BATCH)
            results = self._robot.trace(trials.take(part))
            if results.traces is None:
                raise ReplayDiffers(f"robot {self.run.robot} gave no traces.", "Tell the authors of its package.")
            ends = zip(
                results.end_reasons.tolist(),
                results.steps.tolist(),
                results.hashes.tolist(),
                results.traces,
                strict=True,
            )
            for row, (reason, steps, crc, trace) in zip(attempts[part], ends, strict=True):
                _must_agree(row, (EndReason(reason), steps, crc))
                recorded.append(_recorded(row, trace, weights, champion))
        return recorded


def _recorded(row: AttemptRow, trace: Trace, weights: Weights, champion: int) -> RecordedTrial:
    if row.end_reason is None:
        raise ValueError(f"trial {row.id}: expected one with a result")
    return RecordedTrial.of(row, row.end_reason, trace, weights[row.individual], champion=row.individual == champion)


_BATCH = 1000
"""Trials traced at once: bounds the memory for traces."""


def _must_agree(row: AttemptRow, replayed: tuple[EndReason, int, int]) -> None:
    journalled = (row.end_reason, row.steps, row.state_hash)
    if journalled != replayed:
        raise ReplayDiffers(
            f"Trial {row.id} (generation {row.generation}, individual {row.individual}, trial {row.trial}) cannot be "
            f"recorded: the journal says {_outcome(*journalled)}, running it again gives {_outcome(*replayed)}.",
            "The program, its compiler or the machine computes differently than in the run: use the versions that "
            "the journal names (`sceann status DIR`). No picture was made of this generation.",
        )


def _outcome(reason: EndReason | None, steps: int | None, crc: int | None) -> str:
    return f"{reason.name.lower() if reason is not None else 'no end'} after {steps} steps with state hash {crc}"
