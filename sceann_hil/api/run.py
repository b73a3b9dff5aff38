"""A run on disk: its tables, its individuals, its trials."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from functools import cached_property
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sceann_hil.api.frames import frame_of, split_tuples, table
from sceann_hil.api.individual import Individual
from sceann_hil.api.simulating import simulate
from sceann_hil.api.trial import Trial, trials_of
from sceann_hil.config import ExperimentConfig, noted_config
from sceann_hil.errors import NotARun
from sceann_hil.journal import AttemptKind, AttemptRow, GenerationRow, IndividualRow, JournalReader, trial_arrays
from sceann_hil.network.coding import genome_to_hex
from sceann_hil.robot import Results
from sceann_hil.run.archive import archive_of
from sceann_hil.run.champion import champion_or_best_so_far
from sceann_hil.run.replay import journalled_trials, trace_from_sensors

if TYPE_CHECKING:
    import pandas


class Run:
    """A run that is read, also while another process works on it.

    Args:
        directory: its folder.

    Raises:
        NotARun, RunIsNewer, RunIsDamaged: why it cannot be read.

    Attributes:
        directory: its folder.
    """

    def __init__(self, directory: Path | str) -> None:
        self.directory = Path(directory)
        self._reader = JournalReader(self.directory)
        self._row = self._reader.run()

    @property
    def name(self) -> str:
        """What it is called."""
        return self._row.name

    @cached_property
    def config(self) -> ExperimentConfig:
        """What it was made with.

        Raises:
            ConfigError: a package that it was made with reads it differently by now.
        """
        return noted_config(self._reader)

    @property
    def finished(self) -> bool:
        """All its generations are evaluated, or its algorithm has found that there is no more to do."""
        last = self._reader.last_generation()
        if last is None or last.finished_at is None:
            return False
        if last.number >= self.config.algorithm.generations:
            return True
        algorithm = self.config.algorithm.build(self.config.genome_length)
        return bool(algorithm.is_last(algorithm.load(self._reader.algorithm_state(last.number))))

    def conclusion(self) -> dict[str, Any]:
        """What its algorithm has to say at the end, or so far: of a transfer, its recommendation and what it expects.

        A report is written into the run's folder.

        Raises:
            NotARun: its algorithm concludes nothing, or none of its generations is finished.
        """
        where = self.config.algorithm.conclusion
        if where is None:
            raise NotARun(f"{self.directory}: the algorithm {self.config.algorithm.type} draws no conclusion.", "")
        module, _, function = where.partition(":")
        document: dict[str, Any] = getattr(import_module(module), function)(self.directory).document
        return document

    def generations(self) -> pandas.DataFrame:
        """One row per generation, by its number: best, mean and worst fitness, success rate, times."""
        return frame_of(GenerationRow, self._reader.generations(), index="number")

    def individuals(self) -> pandas.DataFrame:
        """One row per individual, by its id: generation, genome in hexadecimal, parent's id, fitness."""
        generations = self._reader.generations()
        rows = (row for generation in generations for row in self._reader.individuals(generation.number))
        return frame_of(IndividualRow, rows, index="id")

    def trials(self) -> pandas.DataFrame:
        """One row per attempt of a trial, by its id, void ones too; start and final state have a column per field."""
        rows = [row for generation in self._reader.generations() for row in self._reader.attempts(generation.number)]
        for kind in AttemptKind:
            rows += self._reader.attempts_of_kind(kind)
        rows.sort(key=lambda row: row.id)
        spec = self.config.robot.spec
        frame = frame_of(AttemptRow, rows, index="id")
        return split_tuples(split_tuples(frame, "start", spec.start_fields), "final_state", spec.state_fields)

    def events(self) -> pandas.DataFrame:
        """What happened to the run, in order: started, stopped, resumed, suspended, ..."""
        return table(("at", "generation", "kind", "message"), self._reader.events())

    def champion(self) -> Individual:
        """The best individual, as `sceann status` and `sceann export` mean it; in the first generation, so far.

        Raises:
            NotARun: none of its trials counts yet.
        """
        row, _ = champion_or_best_so_far(self._reader, keeps_best=self.config.algorithm.keeps_best)
        return self._individual(row)

    def individual(self, identity: int) -> Individual:
        """One individual by its id.

        Raises:
            NotARun: the run has no such individual.
        """
        return self._individual(self._reader.individual(identity))

    def archive(self) -> pandas.DataFrame:
        """What an algorithm like MAP-Elites keeps: one row per filled cell of its map, the best controller there.

        Columns: each axis' cell and measure by name (``cell_x_m``, ``x_m``, ...), ``fitness``, ``genome``.

        Raises:
            NotARun: the run's algorithm keeps none, or none of its generations has begun.
        """
        archive = archive_of(self._reader, self.config)
        if archive is None:
            raise NotARun(f"{self.directory}: the algorithm {self.config.algorithm.type} keeps no archive.", "")
        cells = [f"cell_{name}" for name in archive.names]
        rows = [
            (*place, *measured, fitness, genome_to_hex(genome))
            for place, measured, fitness, genome in zip(
                archive.places.tolist(),
                archive.measures.tolist(),
                archive.fitness.tolist(),
                archive.genomes,
                strict=True,
            )
        ]
        return table((*cells, *archive.names, "fitness", "genome"), rows)

    def lineage(self, individual: Individual) -> pandas.DataFrame:
        """The line of descent, from `individual` back to the first generation of this run; one row each.

        Column ``changed`` counts the bits in which each differs from its parent.

        Raises:
            ValueError: the individual is of no run.
        """
        if individual.id is None:
            raise ValueError("individual: expected one of a run, which has an id and parents")
        line = [individual]
        while line[-1].parent is not None and line[-1].generation:
            line.append(self.individual(line[-1].parent))
        changed = [int((one.genome != other.genome).sum()) for one, other in pairwise(line)]
        rows = [
            (one.id, one.generation, one.fitness, one.hex, difference)
            for one, difference in zip(line, [*changed, 0], strict=True)
        ]
        return table(("id", "generation", "fitness", "genome", "changed"), rows, index="id")

    def simulate(
        self,
        individual: Individual,
        *,
        gap: Mapping[str, Any] | None = None,
        changes: Mapping[str, Any] | None = None,
        repeats: int = 1,
        seed: int = 0,
    ) -> list[Trial]:
        """Trials of an individual on this run's simulated body; see `sceann_hil.simulate`."""
        return simulate(self.config, individual, gap=gap, changes=changes, repeats=repeats, seed=seed)

    def trials_of(self, individual: Individual) -> list[Trial]:
        """The journalled trials of an individual of this run, step by step.

        Simulated ones are run again and give the same bits; of a real robot's the journal has the sensors.

        Raises:
            ValueError: the individual is of no run.
        """
        if individual.id is None:
            raise ValueError("individual: expected one of a run; `simulate` runs any controller")
        row = self._reader.individual(individual.id)
        attempts = [
            attempt
            for attempt in self._reader.attempts(row.generation)
            if attempt.individual == row.number and attempt.fitness is not None
        ]
        return self._traced(individual, attempts) if attempts else []

    def show(
        self,
        individual: Individual | None = None,
        *,
        trial: int = 0,
        picture: Path | str | None = None,
        browser: bool = False,
    ) -> Any:
        """Show a trial of an individual in the viewer, or, without one, the gallery of all trials.

        In a notebook it is drawn as a picture, elsewhere this returns when the viewer is closed.

        Args:
            individual: of this run.
            trial: which of its trials, from 0.
            picture: draw it into this PNG file instead; needs no display.
            browser: in the web browser instead of a window.

        Returns:
            The picture's path, or in a notebook the picture; else None.

        Raises:
            ViewerUnavailable: the viewer does not start here, and why.
            NotARun: the individual has no such trial.
        """
        from sceann_hil.api.showing import show_run

        attempt = None if individual is None else self._attempt(individual, trial).id
        return show_run(self.directory, attempt, None if picture is None else Path(picture), browser=browser)

    def close(self) -> None:
        """Let go of the journal. May be called twice."""
        self._reader.close()

    def __repr__(self) -> str:
        last = self._reader.last_generation()
        how_far = "not begun" if last is None else f"generation {last.number}"
        return f"<Run {self.name} in {self.directory}: {how_far}>"

    def _individual(self, row: IndividualRow) -> Individual:
        phenotype = self.config.phenotype
        return Individual(
            phenotype=phenotype,
            genome=row.genome_bits(phenotype.genome_length),
            fitness=row.fitness,
            id=row.id,
            generation=row.generation,
            parent=row.parent,
            provenance=f"sceann export {shlex.quote(self.name)} --genome {row.id}",
        )

    def _attempt(self, individual: Individual, trial: int) -> AttemptRow:
        if individual.id is None:
            raise ValueError("individual: expected one of this run, whose trials are recorded")
        row = self._reader.individual(individual.id)
        for attempt in self._reader.attempts(row.generation):
            if attempt.individual == row.number and attempt.trial == trial and attempt.fitness is not None:
                return attempt
        raise NotARun(f"individual {row.id} has no counted trial {trial}.", "Trials are numbered from 0.")

    def _traced(self, individual: Individual, attempts: list[AttemptRow]) -> list[Trial]:
        config, task, phenotype = self.config, self.config.build_task(), individual.phenotype
        spec = config.robot.spec
        if spec.deterministic:
            with config.robot.build() as robot:
                results = robot.trace(journalled_trials(self._reader, config, attempts))
        else:
            found = [
                (row, trace)
                for row in attempts
                if (trace := trace_from_sensors(self._reader, row.id, individual.weight_matrix, phenotype)) is not None
            ]
            attempts = [row for row, _ in found]
            results = Results(
                end_reasons=np.array([row.end_reason for row in attempts], np.uint8),
                steps=np.array([row.steps for row in attempts], np.int32),
                hashes=np.array([row.state_hash for row in attempts], np.uint16),
                final_states=np.zeros((len(attempts), 0), np.float32),
                durations_s=np.array([row.robot_s for row in attempts], np.float64),
                traces=[trace for _, trace in found],
                values=np.array([row.value for row in attempts], np.float64),
            )
        starts, _, _ = trial_arrays(attempts)
        return trials_of(
            results,
            np.array([row.fitness for row in attempts], np.float64),
            task.succeeded(results),
            np.array([row.trial for row in attempts], np.int64),
            [dict(zip(task.start_fields, start, strict=True)) for start in starts.tolist()],
            spec.tick_s,
            phenotype.size,
            spec.state_fields,
        )


def open_run(directory: Path | str) -> Run:
    """A run for reading.

    Raises:
        NotARun, RunIsNewer, RunIsDamaged: why it cannot be read.
    """
    return Run(directory)
