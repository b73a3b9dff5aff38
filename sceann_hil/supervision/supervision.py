"""Everybody who has a say between trials, in one `Companion`: operator, suspenders, budget, reference runs.

Order before a trial: an operator's pause or end, suspenders, budget, a reference run if one is due, and last the
question to the operator, so that nobody puts a robot in place for a trial that is not run.
"""

from __future__ import annotations

import math
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from sceann_hil.journal import Circumstances, Journal, Slots
from sceann_hil.robot import EmergencyStop, EndReason, Health, Results, Robot, RobotError, Trials
from sceann_hil.robot.task import Task
from sceann_hil.supervision.budget import Meter
from sceann_hil.supervision.companion import Attended
from sceann_hil.supervision.drift import RunReference
from sceann_hil.supervision.forecast import Forecast
from sceann_hil.supervision.operators import Desk, Finished, Phase, Press, Situation, Status, Verb
from sceann_hil.supervision.stopping import Stopped, StopReason
from sceann_hil.supervision.suspenders import Quantity, Suspender
from sceann_hil.timespans import duration_text

LOOK_S = 0.5
"""How often a suspended run looks whether it may go on."""
WATCH_S = 0.2
"""How often suspenders are looked at during a trial."""
_NOT_JOURNALLED = frozenset({Verb.READY, Verb.ACCEPT})
"""Said for every trial; the journal has their time in `operator_s`."""


@dataclass(frozen=True, slots=True)
class RunFacts:
    """What the display says of the run and does not change.

    Attributes:
        name: of the run.
        task: whose trials are run.
        generations: number of the last generation.
    """

    name: str
    task: Task
    generations: int


class Supervisor:
    """The company in which an `Evaluator` works.

    Args:
        robot: connected.
        journal: where everything that was said is kept.
        desk: where the operators are.
        meter: what was spent and may be spent.
        forecast: when the run will end.
        suspenders: what pauses by itself.
        facts: for the display.
        confirm: ask after every trial whether it counts.
        whole_generations: do not begin a generation that does not fit the budget.
        reference: runs the reference genome if that is due; told how many trials have ended, and how to run one.
    """

    def __init__(
        self,
        robot: Robot,
        journal: Journal,
        desk: Desk,
        meter: Meter,
        forecast: Forecast,
        suspenders: tuple[Suspender, ...],
        facts: RunFacts,
        *,
        confirm: bool = True,
        whole_generations: bool = False,
        reference: Callable[[int, RunReference], str | None] = lambda _trials, _run: None,
    ) -> None:
        self._robot = robot
        self._journal = journal
        self._desk = desk
        self._meter = meter
        self._forecast = forecast
        self._suspenders = suspenders
        self._facts = facts
        self._confirm = confirm
        self._whole_generations = whole_generations
        self._reference = reference
        self._asks = desk.asks and robot.spec.attended
        self._status = Status(run=facts.name, robot=robot.spec.name, generations=facts.generations)
        self._warning = ""
        self._answered: Press | None = None
        self._last_s = time.monotonic()
        self._last_id = 0

    # -- the companion ----------------------------------------------------------------------------------------------

    def begin(self, generation: int, todo: int, total: int) -> None:
        self._forecast.begin(generation, todo)
        self._status = replace(self._status, generation=generation, done=total - todo, todo=total)
        refusal = self._meter.refusal(todo, on_average=True) if todo else None
        if refusal and self._whole_generations:
            raise Stopped(StopReason.BUDGET, f"generation {generation} does not fit: {refusal}")
        self._publish()

    def room(self, wanted: int) -> int:
        fitting = min(float(wanted), self._meter.trials_left() * (1.0 + 1e-9))
        return max(1, math.floor(fitting))

    def ready(self, generation: int, slots: Slots) -> bool:
        self._tell_journal(generation)
        while True:
            self._desk.between()
            self._suspend(generation)
            self._pass_time()
            # a batch costs what it costs on average, not as many times the most expensive trial
            refusal = self._meter.refusal(len(slots), on_average=len(slots) > 1)
            if refusal:
                raise Stopped(StopReason.BUDGET, refusal)
            trials = int(self._meter.spent.trials)
            self._warning = self._reference(trials, partial(self._run_reference, generation)) or self._warning
            if int(self._meter.spent.trials) != trials:
                # that run cost something too: is there still room for the trial?
                continue
            self._publish()
            if not self._asks:
                return True
            self._answered = self._desk.ask(Phase.BEFORE, self._situation(generation, slots))
            self._tell_journal(generation)
            if self._answered.verb is Verb.SKIP:
                return False
            if not any(self._looks(suspender) for suspender in self._suspenders):
                return True

    def attend(
        self, generation: int, slots: Slots, trials: Trials, run: Callable[[Trials], Results], task: Task
    ) -> Attended:
        situation = self._situation(generation, slots)
        results, note = self._fly(situation, trials, run)
        operator_s = self._answered.after_s if self._answered is not None else None
        at_once, then = False, None
        if self._asks and self._confirm and not _is_void(results):
            results, verdict_s, note, at_once, then = self._judged(situation, results, trials, task)
            operator_s = (operator_s or 0.0) + verdict_s
        self._answered = None
        health = self._robot.health()
        self._account(results, health)
        self._last_id = int(trials.ids[-1])
        self._tell_journal(generation)
        self._show(situation, results, task, health)
        circumstances = Circumstances(
            operator_s=operator_s,
            battery_fraction=health.battery_fraction,
            note=note or None,
            paused_s=self._desk.paused_s(),
        )
        return Attended(results, circumstances, at_once, then)

    def _run_reference(self, generation: int, trials: Trials, trial: int) -> Results | None:
        """One run of the reference genome; it is asked for like any other trial, and never judged."""
        situation = replace(self._describe(generation, 0, trial, 0), reference=True)
        if self._asks and self._desk.ask(Phase.BEFORE, situation).verb is Verb.SKIP:
            return None
        results, _ = self._fly(situation, trials, self._robot.run)
        self._meter.add(float(results.durations_s[0]), 0.0, self._robot.health().battery_fraction)
        return results

    def _fly(self, situation: Situation, trials: Trials, run: Callable[[Trials], Results]) -> tuple[Results, str]:
        """What came of it, void where a person or a suspender ended it; then also who or what did."""
        began_s = time.monotonic()
        with self._desk.flight(situation, self._robot.interrupt) as flight, self._watched() as stopped_by:
            results = run(trials)
        flight_s = time.monotonic() - began_s
        void, why = flight.void_reason, ""
        if void is not None:
            why = f"{flight.ended_by.value.replace('_', ' ')} by an operator" if flight.ended_by else ""
        elif stopped_by:
            void, why = stopped_by[0].quantity.void_reason, f"suspended: {stopped_by[0].reason}"
        if void is not None:
            results = self._void(trials, void)
        return self._timed(results, flight_s), why

    # -- what it asks -----------------------------------------------------------------------------------------------

    def _judged(
        self, situation: Situation, results: Results, trials: Trials, task: Task
    ) -> tuple[Results, float, str, bool, Stopped | RobotError | None]:
        """Results, operator's seconds, note, whether to run it again at once, what to raise afterwards."""
        asked = replace(situation, outcome=_outcome(results, task))
        try:
            answer = self._desk.ask(Phase.AFTER, asked)
        except EmergencyStop as stop:
            return self._void(trials, EndReason.EMERGENCY_STOP, results), 0.0, "emergency stop", False, stop
        except Stopped as stop:
            return self._void(trials, EndReason.OPERATOR, results), 0.0, "never judged", False, stop
        if answer.verb is Verb.ACCEPT:
            return results, answer.after_s, "", False, None
        why = answer.text or "to be done again"
        void = self._void(trials, EndReason.OPERATOR, results)
        return void, answer.after_s, f"{answer.verb.value}: {why}", answer.verb is Verb.REDO, None

    def _void(self, trials: Trials, reason: EndReason, results: Results | None = None) -> Results:
        void = Results.void(len(trials), reason, len(self._robot.spec.state_fields))
        return void if results is None else replace(void, durations_s=results.durations_s)

    def _timed(self, results: Results, flight_s: float) -> Results:
        """A real robot's void trial took robot time too, although it has no steps to tell how much."""
        if self._robot.spec.repeatable or len(results) != 1 or results.durations_s[0] > 0.0:
            return results
        return replace(results, durations_s=np.array([flight_s]))

    def _situation(self, generation: int, slots: Slots) -> Situation:
        individual, trial, attempt = (int(column[0]) for column in (slots.individual, slots.trial, slots.attempt))
        return self._describe(generation, individual, trial, attempt)

    def _describe(self, generation: int, individual: int, trial: int, attempt: int) -> Situation:
        task = self._facts.task
        return Situation(
            generation=generation,
            individual=individual,
            trial=trial,
            attempt=attempt,
            instruction=task.instruction(trial),
            start=tuple(zip(task.start_fields, task.starts[trial].tolist(), strict=True)),
            goal_by_operator=task.goal_by_operator,
        )

    # -- suspenders -------------------------------------------------------------------------------------------------

    def _suspend(self, generation: int) -> None:
        """Wait until no suspender has a reason."""
        told: set[Quantity] = set()
        while reasons := [suspender.reason for suspender in self._suspenders if self._looks(suspender)]:
            reason = ", ".join(reasons)
            quantities = {suspender.quantity for suspender in self._suspenders if suspender.reason}
            if quantities != told:
                told = quantities
                self._journal.note("suspended", reason, generation)
            self._publish(warnings=(f"suspended: {reason}",))
            self._desk.suspend(", ".join(sorted(quantity.value for quantity in quantities)), LOOK_S)
            self._tell_journal(generation)
        if told:
            self._journal.note("unsuspended", "all values are good again", generation)
            self._desk.unsuspend()

    def _looks(self, suspender: Suspender) -> bool:
        return suspender.look(self._value(suspender.quantity, self._robot.health()), time.monotonic())

    def _value(self, quantity: Quantity, health: Health) -> float | None:
        if quantity is Quantity.BATTERY:
            return health.battery_fraction
        if quantity is Quantity.TEMPERATURE:
            return health.temperature_c
        if quantity is Quantity.LINK_QUALITY:
            return health.link_quality
        if quantity is Quantity.DISK:
            return shutil.disk_usage(self._journal.reader.directory).free / 1e6
        return self._desk.absent_s if self._desk.asks else None

    @contextmanager
    def _watched(self) -> Iterator[list[Suspender]]:
        """Look at suspenders that may stop a trial; whoever did is in the list."""
        stopped_by: list[Suspender] = []
        watching = [suspender for suspender in self._suspenders if suspender.watches_trials]
        if not watching:
            yield stopped_by
            return
        over = threading.Event()

        def watch() -> None:
            while not over.wait(WATCH_S):
                health = self._robot.health()
                for suspender in watching:
                    value = self._value(suspender.quantity, health)
                    if suspender.voids(value):
                        suspender.look(value, time.monotonic())
                        stopped_by.append(suspender)
                        self._robot.interrupt(suspender.quantity.void_reason)
                        return

        watcher = threading.Thread(target=watch, name="suspenders", daemon=True)
        watcher.start()
        try:
            yield stopped_by
        finally:
            over.set()
            watcher.join()

    # -- bookkeeping ------------------------------------------------------------------------------------------------

    def _pass_time(self) -> float:
        now_s = time.monotonic()
        passed_s, self._last_s = now_s - self._last_s, now_s
        self._meter.wait(passed_s)
        return passed_s

    def _account(self, results: Results, health: Health) -> None:
        robot_s = results.durations_s.tolist()
        besides_s = max(0.0, self._pass_time() - sum(robot_s)) if self._robot.spec.batch_size else 0.0
        for duration_s in robot_s:
            self._meter.add(duration_s, besides_s / len(robot_s), health.battery_fraction)
            self._forecast.add(duration_s, besides_s / len(robot_s))
        counted = int(results.counts.sum())
        self._status = replace(self._status, done=self._status.done + counted)

    def _tell_journal(self, generation: int) -> None:
        for press in self._desk.said():
            words = f"{press.verb.value} by {press.by} while {press.phase.value}"
            if press.verb is Verb.NOTE and self._last_id:
                self._journal.annotate(self._last_id, press.text)
            if press.verb not in _NOT_JOURNALLED:
                self._journal.note("operator", f"{words}: {press.text}" if press.text else words, generation)

    def _show(self, situation: Situation, results: Results, task: Task, health: Health) -> None:
        fitness = float(task.fitness(results)[0]) if not _is_void(results) else None
        outcome = _outcome(results, task)
        duration_s = float(results.durations_s.sum())
        self._publish(Finished(situation.title, outcome, duration_s, fitness), health=health)

    def _publish(
        self, finished: Finished | None = None, *, health: Health | None = None, warnings: tuple[str, ...] = ()
    ) -> None:
        health = health or self._robot.health()
        wrong = () if health.ok else ("the robot is not ready: " + ", ".join(health.messages),)
        drift = (self._warning,) if self._warning else ()
        self._status = replace(
            self._status,
            robot_ok=health.ok,
            robot_messages=health.messages,
            link_quality=health.link_quality,
            battery_fraction=health.battery_fraction,
            robot_s=self._meter.spent.robot_s,
            wall_s=self._meter.spent.wall_s,
            left=self._meter.left,
            forecast=self._forecast.text(self._meter.remaining, self._meter.mean_trial.battery_charges),
            warnings=(*warnings, *wrong, *drift),
        )
        self._desk.publish(self._status, finished)


def _is_void(results: Results) -> bool:
    return not results.counts.any()


def _outcome(results: Results, task: Task) -> str:
    if len(results) != 1:
        return f"{len(results)} trials"
    reason = EndReason(int(results.end_reasons[0]))
    if reason.is_void:
        return f"{reason}, does not count"
    fitness = float(task.fitness(results)[0])
    took = duration_text(float(results.durations_s[0]))
    return f"{reason} after {int(results.steps[0])} steps ({took}), fitness {fitness:.4g}"
