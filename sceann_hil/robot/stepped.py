"""Level 2 of a robot: bring `reset`, `sense` and `drive`, and this class closes the loop with the controller.

``docs/adding-a-robot.md`` shows a whole robot in this style.
"""

from __future__ import annotations

import time
from abc import abstractmethod

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sceann_hil.network.controller import state_hash
from sceann_hil.network.single import SingleNetwork
from sceann_hil.robot import (
    UNKNOWN_STATE,
    EmergencyStop,
    EndReason,
    LinkError,
    Results,
    Robot,
    RobotFault,
    Trace,
    TrialObserver,
    Trials,
    TrialVoid,
)
from sceann_hil.robot.durations import Durations

OVERRUN_LIMIT = 3
"""Ticks in a row that begin a whole period late before a trial is void."""

_VOID: tuple[tuple[type[Exception], EndReason], ...] = (
    (LinkError, EndReason.LINK_LOST),
    (TrialVoid, EndReason.OPERATOR),
    (RobotFault, EndReason.FAULT),
    (EmergencyStop, EndReason.EMERGENCY_STOP),
)


class SteppedRobot(Robot):
    """A robot that is read and driven one control step at a time, with the controller on this computer.

    A subclass gives `spec` (with ``batch_size=1`` and ``deterministic=False`` for anything real) and the four methods
    below. Any of them may raise a `RobotError`: the motors are made safe and the attempt is void, never a number.

    Attributes:
        paced: ticks keep to the clock (``spec.tick_s``); False for a simulation of one's own.
        lateness: how late ticks began, since the robot was made.
    """

    paced: bool = True

    def __init__(self) -> None:
        self.lateness = Durations()
        self._observer: TrialObserver | None = None
        self._interrupted: EndReason | None = None
        self._why_void = ""

    def observe(self, observer: TrialObserver | None) -> None:
        self._observer = observer

    @abstractmethod
    def reset(self, start: dict[str, float], key: int) -> None:
        """Make the robot ready for a trial; it must not move yet.

        Args:
            start: values by the names of ``spec.start_fields``.
            key: 64 bits to seed whatever is random in a simulation.
        """

    @abstractmethod
    def sense(self) -> ArrayLike:
        """Sensor values now, each 0..1, shape ``(n_sensors,)``."""

    @abstractmethod
    def drive(self, motors: NDArray[np.float64]) -> None:
        """Apply motor values, each 0..1, shape ``(n_motors,)``, until the next call."""

    @abstractmethod
    def stop(self) -> None:
        """Bring the motors to their safe output. Called after every trial, at any error, and at any other time."""

    def state(self) -> ArrayLike:
        """The body's state now, shape ``(n_state,)`` in the order of ``spec.state_fields``; none if nobody knows it.

        Asked after `sense` in every step, and once more at the end.
        """
        return UNKNOWN_STATE

    def ended(self) -> EndReason | None:
        """Asked after every step: why the task has ended, or None."""
        return None

    def make_safe(self, reason: str) -> bool:
        try:
            self.stop()
        except Exception:
            # whatever a user's driver raises here, the answer to "is it safe?" is no
            return False
        return True

    def interrupt(self, reason: EndReason) -> None:
        """Motors safe now; the loop, which may be about to drive them, drives no further step."""
        self._interrupted = reason
        self.make_safe(str(reason))

    def run(self, trials: Trials) -> Results:
        """Run the trials one after the other, and keep every step of them.

        Raises:
            ValueError: the network does not fit, or sensors have another shape than ``spec`` says.
        """
        return self._run_all(trials)

    def trace(self, trials: Trials) -> Results:
        """Run the trials of a deterministic robot again; see `run`."""
        return self._run_all(trials) if self.spec.deterministic else super().trace(trials)

    def _run_all(self, trials: Trials) -> Results:
        spec, size = self.spec, trials.size
        size.check_fits(spec.n_sensors, spec.n_motors, spec.name)
        if spec.batch_size is not None and len(trials) > spec.batch_size:
            raise ValueError(f"trials: expected at most {spec.batch_size} at a time, got {len(trials)}")
        ends, traces = [], []
        self._why_void = ""
        try:
            for one in trials.batches(1):
                end, trace = self._run_one(one)
                ends.append(end)
                traces.append(trace)
        finally:
            self._interrupted = None
        steps = np.array([len(trace.sensors) for trace in traces], np.int32)
        return Results(
            end_reasons=np.array(ends, np.uint8),
            steps=steps,
            hashes=np.array([state_hash(trace.u) for trace in traces], np.uint16),
            final_states=_final_states(traces),
            durations_s=steps.astype(np.float64) * spec.tick_s,
            traces=traces,
            why_void=self._why_void,
        )

    def _run_one(self, trial: Trials) -> tuple[EndReason, Trace]:
        spec, observer = self.spec, self._observer
        network = SingleNetwork(trial.weights[trial.genome_index[0]], trial.size, trial.dynamics, trial.max_steps)
        states = np.zeros((trial.max_steps + 1, 0), np.float32)
        step, end, expected = 0, None, (spec.n_sensors,)
        if observer is not None:
            observer.begin(int(trial.ids[0]))
        try:
            start = dict(zip(spec.start_fields, trial.starts[0].tolist(), strict=True))
            if self._interrupted is None:
                self.reset(start, int(trial.keys[0]))
            if self._interrupted is not None:
                # before its first step no goal is reached either
                end = self._interrupted if self._interrupted.is_void else EndReason.OPERATOR
            elif len(state := self._state_now()):
                states = np.zeros((trial.max_steps + 1, len(state)), np.float32)
            knows = states.shape[1] > 0
            due_s, overruns = time.monotonic(), 0
            while end is None and step < trial.max_steps:
                if self.paced:
                    due_s, overruns = self._wait(due_s, overruns)
                    if overruns >= OVERRUN_LIMIT:
                        end = EndReason.OVERRUN
                        self._why_void = f"{OVERRUN_LIMIT} control steps in a row began a whole period late"
                        break
                values = np.asarray(self.sense(), np.float64)
                if values.shape != expected:
                    raise ValueError(f"sense: expected {spec.n_sensors} finite values, got {values}")
                motors = network.step(step, values)
                if motors is None:
                    raise RobotFault(f"sense: expected {spec.n_sensors} finite values, got {values}")
                if knows:
                    states[step] = self.state()
                if self._interrupted is not None:
                    end = self._interrupted
                    break
                self.drive(motors)
                if observer is not None:
                    observer.step(step, network.sensors[step], states[step])
                step += 1
                end = self._interrupted or self.ended()
            if end is None and self.paced:
                # the last motor values also act for one whole period
                time.sleep(max(0.0, due_s - time.monotonic()))
            if knows:
                states[step] = self.state()
        except tuple(error for error, _ in _VOID) as error:
            end = next(reason for kind, reason in _VOID if isinstance(error, kind))
            self._why_void = str(error)
        except Exception:
            if self._interrupted is None:
                raise
            # the stop has spoken on the line in the middle of a question, and its answer was taken for the question's
            end = self._interrupted
        finally:
            self.stop()
            if self._observer is not None:
                self._observer.end()
        # copies, because most trials are shorter than they may be
        told = (network.sensors[:step].copy(), network.u[:step].copy(), network.x[:step].copy())
        return end or EndReason.TIME_UP, Trace(states[: step + 1].copy(), *told)

    def _wait(self, due_s: float, overruns: int) -> tuple[float, int]:
        """Until the next tick is due; when the one after it is, and how many ticks in a row were a period late.

        A robot that keeps the clock itself waits for its tick here instead.
        """
        tick_s = self.spec.tick_s
        time.sleep(max(0.0, due_s - time.monotonic()))
        now_s = time.monotonic()
        self.lateness.add(now_s - due_s)
        if now_s - due_s >= tick_s:
            return now_s + tick_s, overruns + 1
        return due_s + tick_s, 0

    def _state_now(self) -> NDArray[np.float32]:
        fields, values = self.spec.state_fields, np.asarray(self.state(), np.float32)
        if values.shape not in ((0,), (len(fields),)):
            raise ValueError(f"state: expected {len(fields)} values ({', '.join(fields)}), got {values}")
        return values


def _final_states(traces: list[Trace]) -> NDArray[np.float32]:
    """One row for each trial; 0 where a trial failed before its state was known."""
    states = np.zeros((len(traces), max((trace.state.shape[1] for trace in traces), default=0)), np.float32)
    for row, trace in zip(states, traces, strict=True):
        row[: trace.state.shape[1]] = trace.state[-1]
    return states
