"""Runs the reference genome when it is due: every so many trials, counted over all sessions of a run."""

from __future__ import annotations

import numpy as np

from sceann_hil.journal import AttemptKind, AttemptRow
from sceann_hil.network.coding import genome_from_hex
from sceann_hil.run.trial_runner import TrialRunner, TrialSet
from sceann_hil.seeds import Purpose, keys
from sceann_hil.supervision.drift import Drift
from sceann_hil.supervision.reference_settings import ReferenceConfig


class ReferenceRuns:
    """The reference genome on a robot that cannot repeat a trial; one that can needs no reference.

    Args:
        settings: how often, and which genome.
        runner: runs the trials.
        root_seed: of the run's seed tree.
    """

    def __init__(self, settings: ReferenceConfig, runner: TrialRunner, root_seed: int) -> None:
        self._settings = settings
        self._runner = runner
        self._root_seed = root_seed

    def run_if_due(self) -> None:
        """Run the genome if so many trials of evolution have ended since it last counted, or it never has.

        A run of it that came to nothing is done again. A person may put it off until after the next trial.

        Raises:
            Stopped, TrialVoid, RobotError: as in `TrialRunner.run`.
        """
        every, reader = self._settings.every, self._runner.journal.reader
        if every is None or self._runner.robot.spec.deterministic:
            return
        rows = reader.attempts_of_kind(AttemptKind.REFERENCE)
        counted_last = bool(rows) and rows[-1].fitness is not None
        if counted_last and reader.attempts_since_reference() < every:
            return
        genome = self._genome(rows)
        if genome is None:
            return
        number = rows[-1].individual + counted_last if rows else 0
        trials = self._trials(genome, number)
        self._runner.recall(trials, ((0, row) for row in rows if row.individual == number))
        if self._runner.run_one(trials, 0):
            self._look_for_drift()

    def _genome(self, rows: list[AttemptRow]) -> str | None:
        known = rows[0].genome if rows else self._settings.genome
        if known is not None:
            return known
        champion = self._runner.journal.reader.champion()
        return champion.genome if champion is not None else None

    def _trials(self, genome: str, number: int) -> TrialSet:
        runner = self._runner
        last = runner.journal.reader.last_generation()
        generation = last.number if last is not None else 0
        trials = TrialSet.outside_evolution(
            runner.phenotype,
            genome_from_hex(genome, runner.phenotype.genome_length)[None],
            genome=np.zeros(1, np.int64),
            repeat=np.array([number], np.int64),
            trial=np.array([self._settings.trial % runner.task.n_trials], np.int64),
            noise=lambda _places, _attempts: keys(self._root_seed, Purpose.REFERENCE, number),
            generation=generation,
            kind=AttemptKind.REFERENCE,
        )
        trials.heading = lambda _: f"generation {generation}, reference genome"
        return trials

    def _look_for_drift(self) -> None:
        rows = self._runner.journal.reader.attempts_of_kind(AttemptKind.REFERENCE)
        warning = Drift.of([row.fitness for row in rows if row.fitness is not None]).warning
        if warning:
            self._runner.journal.note("drift", warning)
            self._runner.companion.warn(warning)
