"""One trial under the eyes of people and suspenders, who may end it: then it is void, whatever the robot made of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sceann_hil.robot import EndReason, Results, Robot, Trials
from sceann_hil.robot.task import Task
from sceann_hil.supervision.operators import Desk, Situation
from sceann_hil.supervision.suspension import Suspension
from sceann_hil.timespans import duration_text


def run_watched(
    robot: Robot,
    desk: Desk,
    suspension: Suspension,
    situation: Situation,
    trials: Trials,
    run: Callable[[Trials], Results],
) -> tuple[Results, str]:
    """Run trials; what came of it, void where a person or a suspender ended it, and then also who or what did."""
    began_s = time.monotonic()
    with desk.flight(situation, robot.interrupt) as flight, suspension.watched() as stopped_by:
        results = run(trials)
    flight_s = time.monotonic() - began_s
    void, why = flight.void_reason, ""
    if void is not None:
        why = flight.words
    elif stopped_by:
        void, why = stopped_by[0].quantity.void_reason, f"suspended: {stopped_by[0].reason}"
    if void is not None:
        results = as_void(robot, trials, void)
    return _timed(robot, results, flight_s), why


def as_void(robot: Robot, trials: Trials, reason: EndReason, results: Results | None = None) -> Results:
    """Results that count for nothing; robot time is what `results` took, if they are given."""
    void = Results.void(len(trials), reason, len(robot.spec.state_fields))
    return void if results is None else replace(void, durations_s=results.durations_s)


def _timed(robot: Robot, results: Results, flight_s: float) -> Results:
    """A real robot's void trial took robot time too, although it has no steps to tell how much."""
    if robot.spec.deterministic or len(results) != 1 or results.durations_s[0] > 0.0:
        return results
    return replace(results, durations_s=np.array([flight_s]))


def outcome(results: Results, task: Task) -> str:
    """How trials ended, in words."""
    if len(results) != 1:
        return f"{len(results)} trials"
    reason = EndReason(int(results.end_reasons[0]))
    if not results.counts[0]:
        return f"{reason}, does not count"
    took = duration_text(float(results.durations_s[0]))
    ended = f"{reason} after {int(results.steps[0])} steps ({took})"
    if task.score_by_operator and results.values is None:
        return ended
    return f"{ended}, fitness {float(task.fitness(results)[0]):.4g}"
