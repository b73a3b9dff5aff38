"""All that have a say between trials, in one `Companion`: operator, suspenders, budget.

Order before a trial: an operator's pause or end, suspenders, budget, and last the question to the operator, so that
nobody puts a robot in place for a trial that is not run.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sceann_hil.journal import Circumstances, Journal
from sceann_hil.robot import EmergencyStop, EndReason, Health, Results, Robot, RobotError, Trials
from sceann_hil.robot.task import Task
from sceann_hil.supervision.budget import Meter
from sceann_hil.supervision.companion import Attended, Upcoming
from sceann_hil.supervision.flight import as_void, outcome, run_watched
from sceann_hil.supervision.forecast import Forecast
from sceann_hil.supervision.operators import Desk, Finished, Phase, Press, Situation, Status, Verb
from sceann_hil.supervision.standings import Standings
from sceann_hil.supervision.stopping import Stopped, StopReason, StopRequest, nobody
from sceann_hil.supervision.suspension import Suspension

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


@dataclass(frozen=True, slots=True)
class _Judged:
    """What a person said of a trial that ended."""

    results: Results
    operator_s: float
    note: str = ""
    at_once: bool = False
    then: Stopped | RobotError | None = None


class Supervisor:
    """The people, limits and rules that hold between trials.

    Args:
        robot: connected.
        journal: where everything that was said is kept.
        desk: where the operators are.
        meter: what was spent and may be spent.
        forecast: when the run will end.
        suspension: what pauses by itself.
        facts: for the display.
        stop: what somebody outside the desk wants.
        confirm: ask after every trial whether it counts.
        whole_generations: do not begin a generation that does not fit the budget.
    """

    def __init__(
        self,
        robot: Robot,
        journal: Journal,
        desk: Desk,
        meter: Meter,
        forecast: Forecast,
        suspension: Suspension,
        facts: RunFacts,
        *,
        stop: Callable[[], StopRequest] = nobody,
        confirm: bool = True,
        whole_generations: bool = False,
    ) -> None:
        self._robot = robot
        self._journal = journal
        self._desk = desk
        self._meter = meter
        self._forecast = forecast
        self._suspension = suspension
        self._facts = facts
        self._stop = stop
        self._confirm = confirm
        self._whole_generations = whole_generations
        self._asks = desk.asks and robot.spec.attended
        self._status = Status(run=facts.name, robot=robot.spec.name, generations=facts.generations)
        self._standings: Standings | None = None
        self._warning = ""
        self._answered: Press | None = None
        self._last_s = time.monotonic()
        self._last_id = 0

    # -- the companion ----------------------------------------------------------------------------------------------

    def begin(self, generation: int, todo: int, total: int) -> None:
        self._forecast.begin(generation, todo)
        self._status = replace(self._status, generation=generation, done=total - todo, todo=total)
        # batches of simulated trials end their generation before anybody could read who leads
        self._standings = Standings() if self._robot.spec.batch_size == 1 else None
        if self._standings is not None and todo < total:
            for row in self._journal.reader.attempts(generation):
                if row.fitness is not None:
                    self._standings.add(row.individual, row.fitness)
        refusal = self._meter.refusal(todo, on_average=True) if todo else None
        if refusal and self._whole_generations:
            raise Stopped(StopReason.BUDGET, f"Generation {generation} was not begun. {refusal}")
        self._publish()

    def room(self, wanted: int) -> int:
        fitting = min(float(wanted), self._meter.trials_left() * (1.0 + 1e-9))
        return max(1, math.floor(fitting))

    def clear(self, upcoming: Upcoming) -> None:
        if (stopped := self._stop().at_once) is not None:
            raise stopped
        self._tell_journal(upcoming.generation)
        self._desk.between()
        self._suspension.wait(lambda what, why: self._suspended(what, why, upcoming.generation))
        self._pass_time()
        refusal = self._refusal(upcoming)
        if refusal:
            raise Stopped(StopReason.BUDGET, refusal)
        if not upcoming.besides:
            self._status = replace(self._status, remark=upcoming.remark)
        self._publish()

    def ready(self, upcoming: Upcoming) -> bool:
        while True:
            self.clear(upcoming)
            if not self._asks:
                return True
            self._answered = self._desk.ask(Phase.BEFORE, self._situation(upcoming))
            self._tell_journal(upcoming.generation)
            if self._answered.verb is Verb.SKIP:
                return False
            # waiting for a person takes time, in which a battery or a budget may have ended
            self._pass_time()
            if not self._suspension.reasons and not self._refusal(upcoming):
                return True

    def attend(self, upcoming: Upcoming, trials: Trials, run: Callable[[Trials], Results], task: Task) -> Attended:
        situation = self._situation(upcoming)
        results, note = run_watched(self._robot, self._desk, self._suspension, situation, trials, run)
        operator_s = self._answered.after_s if self._answered is not None else None
        at_once, then = False, None
        if self._asks and self._confirm and results.counts.any():
            judged = self._judged(situation, results, trials, task)
            results, note, at_once, then = judged.results, judged.note, judged.at_once, judged.then
            operator_s = (operator_s or 0.0) + judged.operator_s
        self._answered = None
        health = self._robot.health()
        self._account(upcoming, results, health)
        self._stand(upcoming, results, task)
        self._last_id = int(trials.ids[-1])
        self._tell_journal(upcoming.generation)
        self._show(situation, results, task, health)
        circumstances = Circumstances(
            operator_s=operator_s,
            battery_fraction=health.battery_fraction,
            note=note or None,
            paused_s=self._desk.paused_s(),
        )
        return Attended(results, circumstances, at_once, then)

    def warn(self, warning: str) -> None:
        self._warning = warning
        self._publish()

    # -- what it asks -----------------------------------------------------------------------------------------------

    def _refusal(self, upcoming: Upcoming) -> str | None:
        # a batch costs what it costs on average, not as many times the most expensive trial
        n = len(upcoming)
        return self._meter.refusal(n, on_average=n > 1, counted=upcoming.settling)

    def _judged(self, situation: Situation, results: Results, trials: Trials, task: Task) -> _Judged:
        asked = replace(situation, outcome=outcome(results, task))
        try:
            answer = self._desk.ask(Phase.AFTER, asked)
        except EmergencyStop as stop:
            void = as_void(self._robot, trials, EndReason.EMERGENCY_STOP, results)
            return _Judged(void, 0.0, "emergency stop", then=stop)
        except Stopped as stop:
            void = as_void(self._robot, trials, EndReason.OPERATOR, results)
            return _Judged(void, 0.0, "never judged", then=stop)
        if answer.verb is Verb.ACCEPT:
            if task.score_by_operator:
                results = replace(results, values=np.full(len(results), float(answer.text)))
            return _Judged(results, answer.after_s)
        why = answer.text or "to be done again"
        void = as_void(self._robot, trials, EndReason.OPERATOR, results)
        return _Judged(void, answer.after_s, f"{answer.verb.value}: {why}", answer.verb is Verb.REDO)

    def _situation(self, upcoming: Upcoming) -> Situation:
        task, slots = self._facts.task, upcoming.slots
        individual, trial, attempt = (int(column[0]) for column in (slots.individual, slots.trial, slots.attempt))
        return Situation(
            generation=upcoming.generation,
            individual=individual,
            trial=trial,
            attempt=attempt,
            instruction=task.instruction(trial),
            start=tuple(zip(task.start_fields, task.starts[trial].tolist(), strict=True)),
            goal_by_operator=task.goal_by_operator,
            score_by_operator=task.score_by_operator,
            heading=upcoming.heading,
        )

    def _suspended(self, what: str, why: str, generation: int) -> None:
        if what:
            self._journal.note(what, why, generation)
        if what != "unsuspended":
            self._publish(warnings=(f"suspended: {why}",))
        self._tell_journal(generation)

    # -- bookkeeping ------------------------------------------------------------------------------------------------

    def _pass_time(self) -> float:
        now_s = time.monotonic()
        passed_s, self._last_s = now_s - self._last_s, now_s
        self._meter.wait(passed_s)
        return passed_s

    def _account(self, upcoming: Upcoming, results: Results, health: Health) -> None:
        robot_s = results.durations_s.tolist()
        besides_s = max(0.0, self._pass_time() - sum(robot_s)) if self._robot.spec.batch_size else 0.0
        besides_each_s = besides_s / len(robot_s)
        self._meter.add(robot_s, besides_each_s, health.battery_fraction, counted=upcoming.settling)
        if not upcoming.besides:
            self._forecast.add(robot_s, besides_each_s)
            self._status = replace(self._status, done=self._status.done + int(results.counts.sum()))

    def _stand(self, upcoming: Upcoming, results: Results, task: Task) -> None:
        """Who leads now."""
        if self._standings is None or upcoming.besides or upcoming.heading:
            return
        fitness = task.fitness(results)[results.counts].tolist()
        for individual, reached in zip(upcoming.slots.individual[results.counts].tolist(), fitness, strict=True):
            self._standings.add(individual, reached)

    def _tell_journal(self, generation: int) -> None:
        for press in self._desk.said():
            words = f"{press.verb.value} by {press.by} while {press.phase.value}"
            if press.verb is Verb.NOTE and self._last_id:
                self._journal.annotate(self._last_id, press.text)
            if press.verb not in _NOT_JOURNALLED:
                self._journal.note("operator", f"{words}: {press.text}" if press.text else words, generation)

    def _show(self, situation: Situation, results: Results, task: Task, health: Health) -> None:
        fitness = float(task.fitness(results)[0]) if results.counts.any() else None
        duration_s = float(results.durations_s.sum())
        self._publish(Finished(situation.title, outcome(results, task), duration_s, fitness), health=health)

    def _publish(
        self, finished: Finished | None = None, *, health: Health | None = None, warnings: tuple[str, ...] = ()
    ) -> None:
        health = health or self._robot.health()
        wrong = () if health.ok else ("the robot is not ready: " + ", ".join(health.messages),)
        drift = (self._warning,) if self._warning else ()
        leader = self._standings.leader if self._standings is not None else None
        self._status = replace(
            self._status,
            best=leader.words if leader is not None else "",
            robot_ok=health.ok,
            robot_messages=health.messages,
            link_quality=health.link_quality,
            battery_fraction=health.battery_fraction,
            robot_s=self._meter.spent.robot_s,
            wall_s=self._meter.spent.wall_s,
            left=self._meter.left,
            todo_s=(self._status.todo - self._status.done) * self._meter.mean_trial.wall_s,
            forecast=self._forecast.text(self._meter.remaining, self._meter.mean_trial.battery_charges),
            warnings=(*warnings, *wrong, *drift),
        )
        self._desk.publish(self._status, finished)
