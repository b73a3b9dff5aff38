"""Genomes of a run, each run several times on one robot, outside any evolution."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import count, islice

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Bits
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import EmergencyStop, EndReason, Results, Robot, RobotFault, Trace, Trials, TrialVoid
from sceann_hil.robot.task import Task
from sceann_hil.run.evaluator import RETRY_LIMIT
from sceann_hil.seeds import Purpose, keys
from sceann_hil.supervision.operators import Desk, Phase, Situation, Verb

_FIRST_ID = 2**41
"""These trials are no attempts of the run; a robot must not take one for the other."""


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
class Measured:
    """One trial that counts, told as soon as it is over.

    Attributes:
        genome: its index.
        repeat: which repeat.
        trial: number of the task's trial.
        fitness: of this trial.
        steps: control steps done.
        end_reason: why it ended.
        robot_s: robot time.
    """

    genome: int
    repeat: int
    trial: int
    fitness: float
    steps: int
    end_reason: EndReason
    robot_s: float


def measure(
    robot: Robot,
    phenotype: Phenotype,
    task: Task,
    genomes: Bits,
    repeats: int,
    root_seed: int,
    desk: Desk | None = None,
    report: Callable[[Measured], object] = lambda _: None,
) -> Measurement:
    """Run every genome `repeats` times through all trials of the task.

    Args:
        robot: connected.
        phenotype: how a genome becomes a controller.
        task: whose trials they do.
        genomes: bits, shape ``(g, L)``.
        repeats: how often.
        root_seed: of the noise.
        desk: where the operators are, for a robot that needs somebody.
        report: told of every trial that counts.

    Raises:
        TrialVoid: a trial came to nothing too often.
        Stopped, RobotError: see `Desk` and `Robot.run`.
    """
    shape = (len(genomes), repeats, task.n_trials)
    genome, repeat, trial = (axis.ravel() for axis in np.indices(shape))
    noise = keys(root_seed, Purpose.REPEAT, genome, repeat, trial)
    # every attempt gets a number of its own later
    trials = task.trials(phenotype, phenotype.decode(genomes), genome, trial, noise, run_id=root_seed % 65_521)
    asks = desk is not None and desk.asks and robot.spec.attended
    # a robot refuses the number that it ran last, be it of an attempt that was void or of a measurement before this one
    numbers = count(_FIRST_ID + secrets.randbelow(65_535))
    results: list[Results] = []
    fitness: list[NDArray[np.float64]] = []
    done = 0
    for number, part in enumerate(trials.batches(robot.spec.batch_size)):
        result = _one(robot, task, part, desk if asks else None, int(trial[number]), numbers)
        results.append(result)
        fitness.append(task.fitness(result))
        for i, value in enumerate(fitness[-1].tolist()):
            which = (int(genome[done + i]), int(repeat[done + i]), int(trial[done + i]))
            ended = (int(result.steps[i]), EndReason(int(result.end_reasons[i])), float(result.durations_s[i]))
            report(Measured(*which, value, *ended))
        done += len(result)
    traces = tuple(trace for result in results for trace in result.traces or ())
    return Measurement(
        robot=robot.spec.name,
        fitness=np.concatenate(fitness).reshape(shape),
        durations_s=np.concatenate([result.durations_s for result in results]).reshape(shape),
        traces=traces if len(traces) == genome.size else (),
        starts=trials.starts,
    )


def _one(robot: Robot, task: Task, trials: Trials, desk: Desk | None, trial: int, numbers: Iterator[int]) -> Results:
    """One batch whose results count; every attempt takes new `numbers`."""
    told = ""
    for attempt in range(RETRY_LIMIT + 1):
        named = replace(trials, ids=np.fromiter(islice(numbers, len(trials)), np.int64))
        results = _attempt(robot, task, named, desk, trial, attempt)
        reasons = [EndReason(reason) for reason in results.end_reasons.tolist()]
        if EndReason.EMERGENCY_STOP in reasons:
            raise EmergencyStop("an emergency stop ended the trial")
        if EndReason.FAULT in reasons:
            raise RobotFault("the trial ended with a fault")
        if results.counts.all():
            return results
        told = "; ".join((*map(str, set(reasons)), *robot.health().messages))
    raise TrialVoid(
        f"a trial of genome {trials.genome_index[0]} was void {RETRY_LIMIT + 1} times, the last time: {told}"
    )


def _attempt(robot: Robot, task: Task, trials: Trials, desk: Desk | None, trial: int, attempt: int) -> Results:
    if desk is None:
        return robot.trace(trials) if robot.spec.repeatable else robot.run(trials)
    start = tuple(zip(task.start_fields, trials.starts[0].tolist(), strict=True))
    genome = int(trials.genome_index[0])
    situation = Situation(0, genome, trial, attempt, task.instruction(trial), start, task.goal_by_operator)
    # a trial that is skipped here has nothing to come after, so it is asked for again
    while desk.ask(Phase.BEFORE, situation).verb is Verb.SKIP:
        pass
    with desk.flight(situation, robot.interrupt) as flight:
        results = robot.run(trials)
    void = flight.void_reason
    return results if void is None else Results.void(len(trials), void, len(robot.spec.state_fields))
