"""The doctor's look at a robot. What moves it goes through the one trial runner, as every other movement does.

A movement is the one trial of a measurement of the kind "doctor": operator, suspenders, budget, lock, journal and
retries hold for it. No controller takes part in it, so its genome is zeros.
"""

from __future__ import annotations

import json
import time
from collections.abc import Generator
from contextlib import ExitStack
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig, dump_config
from sceann_hil.errors import ConfigError
from sceann_hil.journal import AttemptKind, Journal
from sceann_hil.robot import EndReason, Results, Robot, RobotError, RobotFault, Trials
from sceann_hil.robot.diagnosis import Finding, Movement, Verdict
from sceann_hil.robot.task import Task
from sceann_hil.run.session import Presence, begin_session
from sceann_hil.run.trial_runner import Places, TrialRunner, TrialSet
from sceann_hil.supervision.forecast import Forecast
from sceann_hil.supervision.operators import Desk, Situation
from sceann_hil.supervision.operators.desk import Flight
from sceann_hil.supervision.stopping import Stopped
from sceann_hil.supervision.suspension import Suspension

KIND = "doctor"
"""Of the measurements in the journal."""
_SITUATION = Situation(0, 0, 0, 0, "", heading="examination by the doctor")


def examined(
    robot: Robot, config: ExperimentConfig, presence: Presence, journal: Journal | None
) -> Generator[Finding, None, None]:
    """All findings; the motors are not tried while a suspender of the configuration would pause a run.

    Args:
        robot: not connected.
        config: whose operator, suspenders and budget hold.
        presence: who is there; whoever stops a check ends the examination.
        journal: open for writing, and the caller holds its lock: movements are kept there; None: nothing is moved.
    """
    desk = presence.desk or Desk(asks=False, stop=presence.stop)
    presence = Presence(desk, presence.stop, presence.more)
    checks = _Checks(robot, desk)
    mover = None if journal is None else _Mover(robot, config, presence, journal, checks)
    if mover is not None and config.suspenders.build():
        found = mover.suspended()
        if found is not None:
            yield found
            mover = mover if found.verdict is Verdict.GOOD else None
    with checks.watched:
        checks.begin()
        for finding in robot.diagnose(mover):
            yield finding
            if checks.cut_off:
                return


class _Checks:
    """What goes on between movements: anybody may stop it."""

    def __init__(self, robot: Robot, desk: Desk) -> None:
        self.watched = ExitStack()
        self._robot = robot
        self._desk = desk
        self._flight = Flight()

    @property
    def cut_off(self) -> bool:
        """Somebody stopped it."""
        return self._flight.void_reason is not None

    def begin(self) -> None:
        """Watch from now on, until `watched` is closed."""
        self._flight = self.watched.enter_context(self._desk.flight(_SITUATION, self._robot.interrupt))


class _Mover:
    """Lets a robot do its movements: see `sceann_hil.robot.diagnosis.Mover`."""

    def __init__(
        self, robot: Robot, config: ExperimentConfig, presence: Presence, journal: Journal, checks: _Checks
    ) -> None:
        self._robot = robot
        # whether it went well is for the movement to tell; a person is asked before it, and may stop it
        operator = config.operator.model_copy(update={"confirm": False})
        self._config = config.model_copy(update={"operator": operator})
        self._presence = presence
        self._journal = journal
        self._checks = checks

    def suspended(self) -> Finding | None:
        """What the suspenders say; None if the robot cannot be asked, which the examination finds out anyway."""
        desk = self._presence.desk or Desk(asks=False)
        folder = self._journal.reader.directory
        suspension = Suspension(self._config.suspenders.build(), self._robot, desk, folder)
        try:
            with self._robot:
                suspension.check()
                reasons = [suspender.reason for suspender in suspension.reasons]
        except ConfigError as error:
            return Finding("suspenders", Verdict.BAD, error.message, error.hint)
        except RobotError:
            return None
        if reasons:
            told = f"a run would be suspended now ({', '.join(reasons)}), so the motors are not tried"
            return Finding("suspenders", Verdict.BAD, told, "Put that right first.")
        return Finding("suspenders", Verdict.GOOD, "none would pause a run now")

    def __call__(self, what: str, movement: Movement) -> Finding:
        tried = _Tried(what, movement, self._robot)
        self._checks.watched.close()
        try:
            self._run(tried)
        except Stopped as stopped:
            return Finding(what, Verdict.NOT_DONE, f"the robot was not moved: {stopped.message}")
        except RobotFault:
            if tried.error is not None:
                raise tried.error from None
            raise
        finally:
            self._checks.begin()
        return tried.finding

    def _run(self, tried: _Tried) -> None:
        config, journal, spec = self._config, self._journal, self._robot.spec
        forecast = Forecast(0, 1, spec.tick_s)
        runner = begin_session(journal, config, self._robot, forecast, self._presence, tried)
        runner.perform = tried.perform
        plan = json.dumps({"movement": tried.name, "at": datetime.now(UTC).isoformat(timespec="microseconds")})
        identity = journal.begin_measurement(KIND, spec.name, dump_config(config), plan)
        try:
            runner.run(self._trials(runner, tried, identity), np.zeros(1, np.int64))
        except (Stopped, RobotError) as error:
            journal.note("stopped", f"{KIND}: {tried.error or error}")
            raise
        journal.finish_measurement(identity)
        told = f"{tried.finding.verdict.value}: {tried.finding.detail}"
        journal.note("examined", f"{KIND}, measurement {identity}: {tried.name}: {told}")

    def _trials(self, runner: TrialRunner, tried: _Tried, identity: int) -> TrialSet:
        one = np.zeros(1, np.int64)
        last = self._journal.reader.last_generation()
        trials = TrialSet.outside_evolution(
            runner.phenotype,
            np.zeros((1, runner.phenotype.genome_length), np.uint8),
            one,
            one,
            one,
            _no_noise,
            generation=last.number if last is not None else 0,
            kind=AttemptKind.MEASUREMENT,
        )
        trials.measurement = identity
        trials.heading = lambda _: f"{KIND}: {tried.name}"
        return trials


def _no_noise(places: Places, _: NDArray[np.int64]) -> NDArray[np.uint64]:
    return np.zeros(len(places), np.uint64)


class _Tried(Task):
    """One movement, as the task of which it is the one trial: worth 1 if all was well, 0 if not.

    Attributes:
        finding: of the last attempt.
        error: what ended the last attempt, so that nothing was found.
    """

    max_steps = 1
    start_fields = ()
    best_fitness = 1.0

    def __init__(self, name: str, movement: Movement, robot: Robot) -> None:
        self.name = name
        self._movement = movement
        self._robot = robot
        self.finding = Finding(name, Verdict.NOT_DONE, "the robot was not moved")
        self.error: RobotError | None = None

    @property
    def starts(self) -> NDArray[np.float64]:
        return np.zeros((1, 0))

    def fitness(self, results: Results) -> NDArray[np.float64]:
        return self.succeeded(results).astype(np.float64)

    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        return np.full(len(results), self.finding.verdict is Verdict.GOOD)

    def instruction(self, trial: int) -> str:
        return "See that its wheels are off the ground and that nobody is in its way: it moves next."

    def perform(self, trials: Trials) -> Results:
        """The movement, in place of the robot's own trial."""
        began_s = time.monotonic()
        self.error, n_state = None, len(self._robot.spec.state_fields)
        try:
            self.finding = self._movement()
        except RobotError as error:
            self._robot.make_safe(str(error))
            self.error = error
            return Results.void(len(trials), EndReason.FAULT, n_state, why=str(error))
        return Results(
            end_reasons=np.full(len(trials), EndReason.TIME_UP, np.uint8),
            steps=np.ones(len(trials), np.int32),
            hashes=np.zeros(len(trials), np.uint16),
            final_states=np.zeros((len(trials), n_state), np.float32),
            durations_s=np.full(len(trials), time.monotonic() - began_s),
        )
