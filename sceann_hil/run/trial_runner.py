"""The one way to run a trial on a robot: everything that moves a robot for a run goes through `TrialRunner`.

The life of a trial, whoever wants it (evolution, a resumed run, the reference genome, a measurement):

1. Whoever has a say between trials (`sceann_hil.supervision.companion`) says that it may begin: operator, suspenders,
   budget.
2. The intent is in the journal before the robot moves.
3. The robot runs it; a person may stop it and say whether it counts.
4. The result is in the journal before the next trial begins. A void trial is never a number: it is attempted again, at
   most `RETRY_LIMIT` times, not counting what an operator wanted.
5. What a process left open that was cut off is settled first: the robot is asked how it ended, after the same
   people and limits as in 1 had their say.

What is to be run is a `TrialSet`; what the journal already holds of it is never run a second time.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sceann_hil.journal import AttemptKind, AttemptRow, Journal, Slots, sound_trials, trial_arrays
from sceann_hil.network.coding import Bits, Weights, genome_to_hex
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import EmergencyStop, EndReason, Results, Robot, RobotFault, Trials, TrialVoid
from sceann_hil.robot.task import Task
from sceann_hil.supervision.companion import Alone, Attended, Companion, Upcoming

RETRY_LIMIT = 3
"""Attempts of one trial after its first that may be void, not counting an operator's, before the run pauses."""
_NOT_KNOWN = "how it ended is not known: the program was cut off while it ran"

Places = NDArray[np.int64]
"""Which trials of a `TrialSet`, shape ``(m,)``."""


@dataclass(slots=True)
class TrialSet:
    """n trials that are to count once each, of g genomes, and what is known of them; arrays of shape ``(n,)``.

    Attributes:
        weights: decoded genomes, shape ``(g, n_neurons, n_sources)``.
        genome: which of them does each trial.
        trial: which of the task's trials it is.
        noise: 64-bit noise keys for some places, told which attempt each is.
        generation: that the run is in; in evolution, the one that the trials are part of.
        kind: what they are for.
        repeat: outside evolution, which repetition of its genome each trial is.
        names: outside evolution, the genomes in hexadecimal, ``g`` of them.
        measurement: the journal's number of the measurement that they belong to.
        heading: of a place outside evolution: what people read.
        remark: what people should know of all of them.
        on_counted: called with places, their results and fitness, whenever trials counted.
        fitness: NaN where none counts yet.
        succeeded: it reached what the task asks for.
        attempts: that came to nothing, so the number of the next one.
        failures: of these, the ones in this session that no operator wanted: after earlier ones somebody looked.
    """

    weights: Weights
    genome: NDArray[np.int64]
    trial: NDArray[np.int64]
    noise: Callable[[Places, NDArray[np.int64]], NDArray[np.uint64]]
    generation: int
    kind: AttemptKind = AttemptKind.EVOLUTION
    repeat: NDArray[np.int64] | None = None
    names: Sequence[str] = ()
    measurement: int | None = None
    heading: Callable[[int], str] = lambda _: ""
    remark: str = ""
    on_counted: Callable[[Places, Results, NDArray[np.float64]], object] = lambda *_: None
    fitness: NDArray[np.float64] = field(init=False)
    succeeded: NDArray[np.bool_] = field(init=False)
    attempts: NDArray[np.int64] = field(init=False)
    failures: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.genome)
        self.fitness = np.full(n, np.nan)
        self.succeeded = np.zeros(n, np.bool_)
        self.attempts = np.zeros(n, np.int64)
        self.failures = np.zeros(n, np.int64)

    @classmethod
    def outside_evolution(
        cls,
        phenotype: Phenotype,
        genomes: Bits,
        genome: NDArray[np.int64],
        repeat: NDArray[np.int64],
        trial: NDArray[np.int64],
        noise: Callable[[Places, NDArray[np.int64]], NDArray[np.uint64]],
        generation: int,
        kind: AttemptKind,
    ) -> TrialSet:
        """Of genomes that are given as bits, shape ``(g, L)``."""
        names = [genome_to_hex(bits) for bits in genomes]
        return cls(phenotype.decode(genomes), genome, trial, noise, generation, kind, repeat, names)

    def open(self, places: Places) -> Places:
        """Those that do not count yet."""
        return places[np.isnan(self.fitness[places])]

    def slots(self, places: Places) -> Slots:
        """What the journal knows the next attempts of some places by."""
        column = self.genome if self.repeat is None else self.repeat
        return Slots(column[places], self.trial[places], self.attempts[places])

    def upcoming(self, places: Places, slots: Slots) -> Upcoming:
        """What people are told of the next attempts of some places."""
        besides = self.kind is AttemptKind.REFERENCE
        return Upcoming(slots, self.generation, self.heading(int(places[0])), self.remark, besides=besides)


class TrialRunner:
    """Runs trials for one run, on one robot.

    Attributes:
        robot: connected.
        task: what a trial is and what it is worth.
        phenotype: how a genome becomes a controller.
        journal: where intents and results go.
        companion: who has a say between trials.
        before: called before every batch; it may run trials of another set itself.
        perform: what an attempt is, if it is not `run` of the robot but another movement.
    """

    def __init__(
        self, phenotype: Phenotype, task: Task, robot: Robot, journal: Journal, companion: Companion | None = None
    ) -> None:
        self.phenotype = phenotype
        self.task = task
        self.robot = robot
        self.journal = journal
        self.companion: Companion = companion or Alone()
        self.before: Callable[[], object] = lambda: None
        self.perform: Callable[[Trials], Results] | None = None
        run = journal.reader.run()
        self._run_id = zlib.crc32(f"{run.created_at} {run.root_seed} {run.name}".encode())

    def recall(self, trials: TrialSet, rows: Iterable[tuple[int, AttemptRow]]) -> None:
        """Take what the journal knows, and settle what a process left open that was cut off.

        Args:
            trials: nothing is known of them yet.
            rows: their attempts in the order of their ids, each with its place.

        Raises:
            Stopped, TrialVoid, RobotError: as in `run`.
        """
        newest: dict[int, AttemptRow] = {}
        for place, row in rows:
            newest[place] = row
            trials.attempts[place] = row.attempt + 1
            if row.fitness is not None:
                trials.fitness[place] = row.fitness
                trials.succeeded[place] = self.task.succeeded(result_of(row))[0]
        cut_off = sorted((row.id, place) for place, row in newest.items() if row.end_reason is None)
        step = self.robot.spec.batch_size or max(len(cut_off), 1)
        for first in range(0, len(cut_off), step):
            part = [place for _, place in cut_off[first : first + step]]
            self._settle(trials, np.array(part, np.int64), [newest[place] for place in part])

    def run(self, trials: TrialSet, places: Places) -> None:
        """Run trials until each of them counts.

        Args:
            trials: what there is to run.
            places: which of them, in this order; those that count already are passed over.

        Raises:
            Stopped: somebody wants the run to end.
            TrialVoid: a trial was void more often than `RETRY_LIMIT` allows.
            RobotError: the robot's.
        """
        queue = trials.open(places)
        while len(queue):
            self.before()
            size = self.companion.room(min(self.robot.spec.batch_size or len(queue), len(queue)))
            batch, queue = queue[:size], queue[size:]
            attended = self._attempt(trials, batch)
            again = batch if attended is None else trials.open(batch)
            at_once = attended is not None and attended.at_once
            queue = np.concatenate((again, queue) if at_once else (queue, again))

    def run_one(self, trials: TrialSet, place: int) -> bool:
        """Run one trial until it counts; False if a person wants it later. Raises like `run`."""
        batch = np.array([place], np.int64)
        while len(trials.open(batch)):
            if self._attempt(trials, batch) is None:
                return False
        return True

    # -- one attempt ------------------------------------------------------------------------------------------------

    def _attempt(self, trials: TrialSet, places: Places) -> Attended | None:
        """One attempt of each of some trials, in one call of the robot; None if a person wants them later."""
        self._check_retries(trials, places)
        slots = trials.slots(places)
        upcoming = trials.upcoming(places, slots)
        if not self.companion.ready(upcoming):
            return None
        planned = self._planned(trials, places, trials.noise(places, slots.attempt))
        in_evolution = trials.kind is AttemptKind.EVOLUTION
        ids = self.journal.intend(
            trials.generation if in_evolution else None,
            slots,
            planned.starts,
            planned.keys,
            trials.kind,
            None if in_evolution else [trials.names[g] for g in trials.genome[places].tolist()],
            trials.measurement,
        )
        attended = self.companion.attend(
            upcoming, replace(planned, ids=ids), _completed(self.perform or self.robot.run), self.task
        )
        trials.attempts[places] += 1
        self._count(trials, places, ids, attended)
        return attended

    def _settle(self, trials: TrialSet, places: Places, rows: list[AttemptRow]) -> None:
        with sound_trials(self.journal.reader.path):
            starts, noise, ids = trial_arrays(rows)
        slots = replace(trials.slots(places), attempt=np.array([row.attempt for row in rows], np.int64))
        upcoming = replace(trials.upcoming(places, slots), settling=True)
        self.companion.clear(upcoming)
        with sound_trials(self.journal.reader.path):
            cut_off = self._planned(trials, places, noise, ids, starts)
        attended = self.companion.attend(upcoming, cut_off, _completed(self.robot.settle), self.task)
        if not attended.results.counts.any() and attended.circumstances.note is None:
            attended = replace(attended, circumstances=replace(attended.circumstances, note=_NOT_KNOWN))
        self._count(trials, places, ids, attended)

    def _planned(
        self,
        trials: TrialSet,
        places: Places,
        noise: NDArray[np.uint64],
        ids: NDArray[np.int64] | None = None,
        starts: NDArray[np.float64] | None = None,
    ) -> Trials:
        genome, trial = trials.genome[places], trials.trial[places]
        return self.task.trials(
            self.phenotype, trials.weights, genome, trial, noise, ids, starts=starts, run_id=self._run_id
        )

    def _count(self, trials: TrialSet, places: Places, ids: NDArray[np.int64], attended: Attended) -> None:
        results, circumstances = attended.results, attended.circumstances
        counts = results.counts
        if not counts.any() and circumstances.note is None:
            circumstances = replace(circumstances, note=self._why_void(results))
        fitness = self.task.fitness(results)
        self.journal.record(ids, results, fitness, circumstances)
        counted = places[counts]
        trials.fitness[counted] = fitness[counts]
        trials.succeeded[counted] = self.task.succeeded(results)[counts]
        trials.failures[places[~counts & (results.end_reasons != EndReason.OPERATOR)]] += 1
        if len(counted):
            trials.on_counted(
                counted, results if len(counted) == len(places) else _some(results, counts), fitness[counts]
            )
        if attended.then is not None:
            raise attended.then
        if EndReason.EMERGENCY_STOP in results.end_reasons:
            raise EmergencyStop(self._with_complaints("an emergency stop ended the trial; its attempt is void"))
        if EndReason.FAULT in results.end_reasons:
            raise RobotFault(self._with_complaints("the trial ended with a fault; its attempt is void"))

    def _why_void(self, results: Results) -> str | None:
        told = results.why_void or "; ".join(self.robot.health().messages)
        return told or None

    def _with_complaints(self, what: str) -> str:
        return ": ".join((what, *self.robot.health().messages))

    def _check_retries(self, trials: TrialSet, places: Places) -> None:
        failures = trials.failures[places]
        worst = int(np.argmax(failures))
        if failures[worst] > RETRY_LIMIT:
            place = int(places[worst])
            which = trials.heading(place) or f"trial {trials.trial[place]} of individual {trials.genome[place]}"
            raise TrialVoid(
                f"{which} was void {failures[worst]} times; " + self._with_complaints("no fitness was made of it")
            )


def _completed(run: Callable[[Trials], Results]) -> Callable[[Trials], Results]:
    """A robot's answers with what the task adds up over the steps."""
    return lambda trials: trials.completed(run(trials))


def _some(results: Results, which: NDArray[np.bool_]) -> Results:
    return Results(
        end_reasons=results.end_reasons[which],
        steps=results.steps[which],
        hashes=results.hashes[which],
        final_states=results.final_states[which],
        durations_s=results.durations_s[which],
        values=None if results.values is None else results.values[which],
    )


def result_of(row: AttemptRow) -> Results:
    """The result of one attempt that ended, as the journal has it."""
    return Results(
        end_reasons=np.array([row.end_reason], np.uint8),
        steps=np.array([row.steps], np.int32),
        hashes=np.array([row.state_hash], np.uint16),
        final_states=np.array([row.final_state], np.float32),
        durations_s=np.array([row.robot_s], np.float64),
        values=None if row.value is None else np.array([row.value]),
    )
