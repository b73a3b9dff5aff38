"""Genomes on a robot outside evolution, for a question that somebody asks it: compare, repeat, transfer.

Each trial goes through `sceann_hil.run.trial_runner`: operator, suspenders, budget, lock, journal and retries hold as
they do in evolution. What the journal already holds is not run again, so an interrupted measurement goes on where it
was when the same is asked again::

    with Experiment.open(directory) as experiment, robot:
        presence = Presence(desk, stop)
        with measuring(experiment.journal, config, robot, "transfer", {"genomes": names}, n_trials, presence) as ask:
            first = ask.run(bits, trial=0)                 # one trial, which counts when this returns
            if first.fitness < 0.5:                        # a plan may be made up while it goes on
                again = ask.run(bits, trial=0, repeat=1)   # the same trial once more is another repeat
            trace = ask.trace(first)                       # what the robot sent, if it sent anything

`Measuring.run_all` is the plan of `compare` and `repeat`: every genome, all trials, several times.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig, dump_config
from sceann_hil.journal import AttemptKind, AttemptRow, Journal
from sceann_hil.network.coding import Bits, genome_from_hex, genome_to_hex
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import EndReason, Results, Robot, RobotError, Trace
from sceann_hil.robot.task import Task
from sceann_hil.run.replay import trace_from_sensors
from sceann_hil.run.session import Presence, begin_session
from sceann_hil.run.trial_runner import Places, TrialRunner, TrialSet
from sceann_hil.seeds import Purpose, keys
from sceann_hil.supervision.forecast import Forecast
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.stopping import Stopped


@dataclass(frozen=True, slots=True)
class Measurement:
    """What one robot did with g genomes in r repeats of t trials.

    Attributes:
        robot: its name.
        fitness: of every trial, float64, shape ``(g, r, t)``.
        durations_s: robot time of every trial, float64, shape ``(g, r, t)``.
        traces: step by step, in the order of `fitness`; empty if the robot delivers none.
        starts: of every trial, in the same order, shape ``(g * r * t, n_start)``.
    """

    robot: str
    fitness: NDArray[np.float64]
    durations_s: NDArray[np.float64]
    traces: tuple[Trace, ...]
    starts: NDArray[np.float64]

    @property
    def repeats(self) -> NDArray[np.float64]:
        """An individual's fitness, once for every repeat, shape ``(g, r)``."""
        return np.asarray(self.fitness.mean(axis=2), np.float64)


@dataclass(frozen=True, slots=True)
class Counted:
    """One trial that counts, as the journal has it.

    Attributes:
        id: its number in the run.
        genome: hexadecimal.
        trial: number of the task's trial.
        repeat: which time that this genome did this trial, from 0.
        fitness: of this trial.
        steps: control steps done.
        end_reason: why it ended.
        robot_s: robot time.
        start: start values.
    """

    id: int
    genome: str
    trial: int
    repeat: int
    fitness: float
    steps: int
    end_reason: EndReason
    robot_s: float
    start: tuple[float, ...]


Report = Callable[[int, int, float], object]
"""Told after every trial that counts: how many do so far, of how many, and its fitness."""


class Measuring:
    """A measurement that goes on; made by `measuring`.

    Attributes:
        known: how many of its trials counted before, in a session that was interrupted.

    Args:
        identity: the journal's number of the measurement.
        kind: what for, in a word.
        runner: runs the trials.
        root_seed: of the noise.
    """

    def __init__(self, identity: int, kind: str, runner: TrialRunner, root_seed: int) -> None:
        self._identity = identity
        self._kind = kind
        self._runner = runner
        self._root_seed = root_seed
        self.known = len(self._counted())

    def run(self, genome: Bits, trial: int, repeat: int = 0) -> Counted:
        """Run one trial until it counts, or take it from the journal if it does already.

        Args:
            genome: bits, shape ``(L,)``.
            trial: which of the task's trials.
            repeat: which time that this genome does this trial.

        Raises:
            Stopped, TrialVoid, RobotError: as in `TrialRunner.run`.
        """
        trials = self._set(genome[None], np.zeros(1, np.int64), np.array([repeat]), np.array([trial]))
        self._recall(trials)
        # a trial that is put off has nothing here to come after, so it is asked for again
        while not self._runner.run_one(trials, 0):
            pass
        return self._counted()[genome_to_hex(genome), repeat, trial]

    def run_all(self, genomes: Bits, repeats: int, report: Report = lambda *_: None) -> Measurement:
        """Run every genome `repeats` times through all trials of the task.

        Args:
            genomes: different ones, bits, shape ``(g, L)``.
            repeats: how often.
            report: told of every trial that counts.

        Raises:
            Stopped, TrialVoid, RobotError: as in `TrialRunner.run`.
        """
        shape = (len(genomes), repeats, self._runner.task.n_trials)
        genome, repeat, trial = (axis.ravel().astype(np.int64) for axis in np.indices(shape))
        trials = self._set(genomes, genome, repeat, trial)

        def told(_: Places, __: Results, fitness: NDArray[np.float64]) -> None:
            report(int((~np.isnan(trials.fitness)).sum()), len(trials.fitness), float(fitness[-1]))

        trials.on_counted = told
        self._recall(trials)
        everything = np.arange(len(trials.genome))
        n_open = len(trials.open(everything))
        self._runner.companion.begin(trials.generation, n_open, len(everything))
        self._runner.run(trials, everything)
        return self._gathered(trials, shape)

    def trace(self, counted: Counted) -> Trace | None:
        """What the robot sent in a trial, and the neurons computed from it; None if it sends nothing."""
        phenotype = self._runner.phenotype
        bits = genome_from_hex(counted.genome, phenotype.genome_length)
        return trace_from_sensors(self._runner.journal.reader, counted.id, phenotype.decode(bits[None])[0], phenotype)

    def _set(
        self, genomes: Bits, genome: NDArray[np.int64], repeat: NDArray[np.int64], trial: NDArray[np.int64]
    ) -> TrialSet:
        last = self._runner.journal.reader.last_generation()
        n_genomes = len(genomes)

        def noise(places: Places, _: NDArray[np.int64]) -> NDArray[np.uint64]:
            return keys(self._root_seed, Purpose.REPEAT, genome[places], repeat[places], trial[places])

        trials = TrialSet.outside_evolution(
            self._runner.phenotype,
            genomes,
            genome,
            repeat,
            trial,
            noise,
            generation=last.number if last is not None else 0,
            kind=AttemptKind.MEASUREMENT,
        )
        trials.measurement = self._identity
        trials.heading = lambda place: (
            f"{self._kind}: genome {genome[place] + 1} of {n_genomes}, repeat {repeat[place]}, trial {trial[place]}"
        )
        return trials

    def _recall(self, trials: TrialSet) -> None:
        if trials.repeat is None:
            raise ValueError("trials: expected some outside evolution")
        columns = zip(trials.genome.tolist(), trials.repeat.tolist(), trials.trial.tolist(), strict=True)
        place_of = {(trials.names[genome], repeat, trial): i for i, (genome, repeat, trial) in enumerate(columns)}
        if len(place_of) != len(trials.genome):
            raise ValueError("genomes: expected different ones")
        rows = ((place_of.get(_which(row)), row) for row in self._rows())
        self._runner.recall(trials, ((place, row) for place, row in rows if place is not None))

    def _rows(self) -> list[AttemptRow]:
        return self._runner.journal.reader.attempts_of_measurement(self._identity)

    def _counted(self) -> dict[tuple[str, int, int], Counted]:
        return {_which(row): _as_counted(row) for row in self._rows() if row.fitness is not None}

    def _gathered(self, trials: TrialSet, shape: tuple[int, int, int]) -> Measurement:
        counted = self._counted()
        genome, repeat, trial = np.indices(shape).reshape(3, -1).tolist()
        rows = [counted[trials.names[g], r, t] for g, r, t in zip(genome, repeat, trial, strict=True)]
        traces = tuple(trace for row in rows if (trace := self.trace(row)) is not None)
        return Measurement(
            robot=self._runner.robot.spec.name,
            fitness=np.array([row.fitness for row in rows]).reshape(shape),
            durations_s=np.array([row.robot_s for row in rows]).reshape(shape),
            traces=traces if len(traces) == len(rows) else (),
            starts=np.array([row.start for row in rows], np.float64),
        )


@contextmanager
def measuring(
    journal: Journal,
    config: ExperimentConfig,
    robot: Robot,
    kind: str,
    plan: dict[str, object],
    n_trials: int,
    presence: Presence,
) -> Iterator[Measuring]:
    """Ask a robot something for a run; it is finished when the block ends without an error.

    Args:
        journal: the run's, open for writing; the caller holds the run's lock.
        config: the run's, with the robot that is asked.
        robot: connected.
        kind: what for, in a word.
        plan: what is asked for, as JSON; an unfinished measurement of the same kind and plan is gone on with.
        n_trials: how many trials there will be, about, for the forecast.
        presence: who is there.

    Raises:
        ConfigError: a suspender would never see its value; nothing has moved.
    """
    text = json.dumps({"asked": plan, **_circumstances(config, robot)}, sort_keys=True)
    begun = [
        row.id for row in journal.reader.measurements() if (row.kind, row.plan, row.finished_at) == (kind, text, None)
    ]
    presence = Presence(presence.desk or Desk(asks=False, stop=presence.stop), presence.stop, presence.more)
    forecast = Forecast(0, n_trials, config.build_task().max_steps * robot.spec.tick_s)
    runner = begin_session(journal, config, robot, forecast, presence)
    identity = begun[-1] if begun else journal.begin_measurement(kind, robot.spec.name, dump_config(config), text)
    journal.note("measuring", f"{kind} on {robot.spec.name}, measurement {identity}{', gone on with' if begun else ''}")
    try:
        yield Measuring(identity, kind, runner, config.seed)
    except (Stopped, RobotError) as stopped:
        journal.note("stopped", f"{kind}: {stopped}")
        raise
    journal.finish_measurement(identity)
    journal.note("measured", f"{kind}, measurement {identity}")


def _circumstances(config: ExperimentConfig, robot: Robot) -> dict[str, object]:
    """What trials must have in common to belong to one measurement; a port may have another name the next day."""
    spec = asdict(robot.spec)
    # journals know it by this name, and what was begun under it goes on
    spec["repeatable"] = spec.pop("deterministic")
    return {
        "task": config.task.model_dump(mode="json"),
        "controller": config.controller.model_dump(mode="json"),
        "robot": spec,
        "seed": config.seed,
    }


def simulate(
    robot: Robot,
    phenotype: Phenotype,
    task: Task,
    genomes: Bits,
    repeats: int,
    root_seed: int,
    report: Report = lambda *_: None,
) -> Measurement:
    """The same plan as `Measuring.run_all` on a simulated robot, which needs no person, no budget and no journal.

    Args:
        robot: connected; it repeats its trials.
        phenotype: how a genome becomes a controller.
        task: whose trials they do.
        genomes: bits, shape ``(g, L)``.
        repeats: how often each does all trials.
        root_seed: of the noise.
        report: told now and then.

    Raises:
        TrialVoid: a trial ended without a result.
    """
    shape = (len(genomes), repeats, task.n_trials)
    genome, repeat, trial = np.indices(shape)
    noise = keys(root_seed, Purpose.REPEAT, genome, repeat, trial)
    trials = task.trials(phenotype, phenotype.decode(genomes), genome, trial, noise)
    fitness: list[float] = []
    durations_s: list[float] = []
    traces: list[Trace] = []
    for part in trials.batches(robot.spec.batch_size):
        results = part.completed(robot.trace(part))
        results.must_count()
        fitness += task.fitness(results).tolist()
        durations_s += results.durations_s.tolist()
        traces += results.traces or ()
        report(len(fitness), genome.size, fitness[-1])
    return Measurement(
        robot=robot.spec.name,
        fitness=np.array(fitness).reshape(shape),
        durations_s=np.array(durations_s).reshape(shape),
        traces=tuple(traces) if len(traces) == genome.size else (),
        starts=trials.starts,
    )


def _which(row: AttemptRow) -> tuple[str, int, int]:
    return row.genome or "", row.individual, row.trial


def _as_counted(row: AttemptRow) -> Counted:
    if row.fitness is None or row.end_reason is None or row.steps is None or row.robot_s is None:
        raise ValueError(f"trial {row.id}: expected one that counts")
    return Counted(
        row.id,
        row.genome or "",
        row.trial,
        row.individual,
        row.fitness,
        row.steps,
        row.end_reason,
        row.robot_s,
        row.start,
    )
