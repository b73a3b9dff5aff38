"""Does the robot drift? One genome is run again every k trials, outside selection, and its fitness is watched.

The test: Kendall's rank correlation between time and fitness over all reference runs, two-sided. It needs no
assumption about the noise, and a battery that fades or a wheel that wears gives exactly such a trend.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sceann_hil.journal import AttemptKind, Journal, Slots
from sceann_hil.network.coding import genome_from_hex
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import EmergencyStop, EndReason, Results, Robot, RobotFault, Trials
from sceann_hil.robot.task import Task
from sceann_hil.seeds import Purpose, keys
from sceann_hil.supervision.drift_settings import ReferenceConfig

LEAST_RUNS = 6
SIGNIFICANCE = 0.01
"""Probability of a warning about a robot that does not drift, each time that it is asked."""
_FIRST_ID = 2**40
"""Reference runs have attempt ids of their own, so that the robot tells them from trials."""


RunReference = Callable[[Trials, int], Results | None]


@dataclass(frozen=True, slots=True)
class Drift:
    """What the reference runs say.

    Attributes:
        runs: how many of them count.
        tau: Kendall's rank correlation of time and fitness, -1..1; 0 if there are too few.
        p_value: probability of such a correlation without drift.
        early: mean fitness of the first third.
        late: mean fitness of the last third.
    """

    runs: int
    tau: float
    p_value: float
    early: float
    late: float

    @classmethod
    def of(cls, fitness: Sequence[float]) -> Drift:
        """From the fitness of reference runs in order."""
        # SciPy takes a third of a second to import, and most runs need none of it.
        from scipy.stats import kendalltau

        n = len(fitness)
        third = max(1, n // 3)
        early, late = (float(np.mean(part)) if n else 0.0 for part in (fitness[:third], fitness[-third:]))
        if n < LEAST_RUNS or min(fitness) == max(fitness):
            return cls(n, 0.0, 1.0, early, late)
        found = kendalltau(np.arange(n), fitness)
        return cls(n, float(found.statistic), float(found.pvalue), early, late)

    @property
    def warning(self) -> str | None:
        """What to tell a person; None if there is nothing to tell."""
        if self.p_value >= SIGNIFICANCE:
            return None
        return (
            f"the robot drifts: over {self.runs} runs the reference genome went from fitness {self.early:.3g} to "
            f"{self.late:.3g} (p = {self.p_value:.1g})"
        )


class ReferenceRuns:
    """Runs the reference genome when it is due.

    Args:
        settings: how often, and which genome.
        phenotype: how it becomes a controller.
        task: what it does.
        robot: connected; one that repeats its trials needs no reference.
        root_seed: of the run's seed tree.
        journal: where the runs are kept.
    """

    def __init__(
        self,
        settings: ReferenceConfig,
        phenotype: Phenotype,
        task: Task,
        robot: Robot,
        root_seed: int,
        journal: Journal,
    ) -> None:
        self._settings = settings
        self._phenotype = phenotype
        self._task = task
        self._robot = robot
        self._root_seed = root_seed
        self._journal = journal
        run = journal.reader.run()
        self._run_id = zlib.crc32(f"reference {run.created_at} {run.root_seed}".encode())
        self._last_at: int | None = None

    def run_if_due(self, trials: int, run: RunReference) -> str | None:
        """Run the genome if so many trials have ended since the last time.

        Args:
            trials: that have ended in the run, reference runs included.
            run: runs one trial from the task's start of this number, with the operator's help where that is needed;
                None if the operator wants it later.

        Returns:
            A warning if the robot drifts.

        Raises:
            EmergencyStop, RobotFault: the run of the genome ended so.
        """
        every = self._settings.every
        if every is None or self._robot.spec.repeatable:
            return None
        rows = self._journal.reader.attempts_of_kind(AttemptKind.REFERENCE)
        last_at = self._last_at if self._last_at is not None else (trials - every if not rows else trials)
        self._last_at = last_at
        genome = self._genome(rows[0].genome if rows else None)
        if trials - last_at < every or genome is None:
            return None
        number = len(rows)
        trial = self._settings.trial % self._task.n_trials
        results = run(self._trials(genome, trial, number), trial)
        if results is None:
            return None
        # the reference run is one of the trials that will be told next time
        self._last_at = trials + 1
        self._record(genome, trial, number, results)
        if EndReason.EMERGENCY_STOP in results.end_reasons:
            raise EmergencyStop("an emergency stop ended a reference run")
        if EndReason.FAULT in results.end_reasons:
            raise RobotFault(": ".join(("a reference run ended with a fault", *self._robot.health().messages)))
        counted = [
            row.fitness
            for row in self._journal.reader.attempts_of_kind(AttemptKind.REFERENCE)
            if row.fitness is not None
        ]
        warning = Drift.of(counted).warning
        if warning:
            self._journal.note("drift", warning)
        return warning

    def _record(self, genome: str, trial: int, number: int, results: Results) -> None:
        slots = Slots(np.array([number]), np.array([trial]), np.zeros(1, np.int64))
        noise = np.array([keys(self._root_seed, Purpose.REFERENCE, number)], np.uint64).reshape(1)
        starts = self._task.starts[trial][None]
        ids = self._journal.intend(None, slots, starts, noise, AttemptKind.REFERENCE, [genome])
        self._journal.record(ids, results, self._task.fitness(results))

    def _genome(self, known: str | None) -> str | None:
        if known or self._settings.genome:
            return known or self._settings.genome
        champion = self._journal.reader.champion()
        return champion.genome if champion is not None else None

    def _trials(self, genome: str, trial: int, number: int) -> Trials:
        phenotype = self._phenotype
        bits = genome_from_hex(genome, phenotype.genome_length)
        noise = keys(self._root_seed, Purpose.REFERENCE, number)
        ids = np.array([_FIRST_ID + number])
        return self._task.trials(phenotype, phenotype.decode(bits[None]), 0, trial, noise, ids, run_id=self._run_id)
