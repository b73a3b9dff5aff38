"""What every robot must do: whatever it is, the same trials, results and refusals."""

from __future__ import annotations

import os
import signal
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Controller, state_hash
from sceann_hil.plugins import RobotConfig
from sceann_hil.robot import EndReason, Health, Results, Robot, RobotError, Trace, Trials
from sceann_hil.supervision.operators import Desk, Situation
from sceann_hil.supervision.signals import Signals
from sceann_hil.testing.checks import check as _check
from sceann_hil.testing.random_trials import random_trials

_VOID_ATTEMPTS = 5
_SIGNAL_S = 0.5
"""How long a robot moves before it is stopped."""
_SOON_S = 10.0
"""How long after that its trial may take to end, on a busy computer too: a third of the time that it would last."""
_ENDLESS_S = 30.0


class RobotConformance(ABC):
    """Derive from it, name the class ``Test...``, and say which robot is meant.

    Attributes:
        max_steps: length of the trials; real robots move that long, a few times.
        n_trials: how many different networks are tried.
    """

    max_steps: int = 20
    n_trials: int = 3

    @abstractmethod
    def config(self) -> RobotConfig:
        """The robot's configuration. Called once or more in every test."""

    def start(self) -> tuple[float, ...]:
        """Start values of a trial, in the order of the robot's start fields; all 0 unless this is overridden."""
        return (0.0,) * len(self.config().spec.start_fields)

    # -- what a robot is --------------------------------------------------------------------------------------------

    def test_the_spec_can_be_read_before_the_robot_is_connected(self) -> None:
        """The configuration and the robot say the same about it."""
        spec = self.config().spec
        _check(self.config().build().spec == spec, "spec: the robot says something else than its configuration")
        _check(spec.n_sensors >= 1 and spec.n_motors >= 1, "spec: expected at least one sensor and one motor")
        _check(spec.tick_s > 0.0, f"spec.tick_s: expected more than 0, got {spec.tick_s}")
        _check(spec.batch_size is None or spec.batch_size >= 1, "spec.batch_size: expected None or at least 1")
        _check(len(set(spec.start_fields)) == len(spec.start_fields), "spec.start_fields: expected different names")

    def test_a_robot_that_is_not_connected_can_be_made_safe_and_let_go(self) -> None:
        """`make_safe` never raises, whatever the robot's state."""
        robot = self.config().build()
        _check(isinstance(robot.make_safe("conformance"), bool), "make_safe: expected True or False")
        robot.disconnect()

    def test_it_can_be_connected_again_and_let_go_twice(self) -> None:
        """Connections come and go."""
        robot = self.config().build()
        for _ in range(2):
            robot.connect()
            _check(isinstance(robot.health(), Health), "health: expected a Health")
            _check(isinstance(robot.make_safe("conformance"), bool), "make_safe: expected True or False")
            robot.disconnect()
        robot.disconnect()

    # -- what a trial is --------------------------------------------------------------------------------------------

    def test_results_have_the_shapes_and_types_that_the_evaluator_expects(self) -> None:
        """One row for every trial, and end reasons that exist."""
        with self._connected() as robot:
            trials = self._trials(robot, self.max_steps)
            for batch in trials.batches(robot.spec.batch_size):
                results = self._counted(robot, batch)
                n = len(batch)
                n_state = results.final_states.shape[1]
                for name, dtype, shape in (
                    ("end_reasons", np.uint8, (n,)),
                    ("steps", np.int32, (n,)),
                    ("hashes", np.uint16, (n,)),
                    ("final_states", np.float32, (n, n_state)),
                    ("durations_s", np.float64, (n,)),
                ):
                    array = getattr(results, name)
                    _check(array.dtype == dtype, f"{name}: expected {np.dtype(dtype)}, got {array.dtype}")
                    _check(array.shape == shape, f"{name}: expected shape {shape}, got {array.shape}")
                _check(n_state in (0, len(robot.spec.state_fields)), "final_states: expected the spec's state fields")
                for reason, steps in zip(results.end_reasons, results.steps, strict=True):
                    _check(1 <= steps <= self.max_steps, f"steps: expected 1..{self.max_steps}, got {steps}")
                    if EndReason(reason) is EndReason.TIME_UP:
                        _check(steps == self.max_steps, f"time up after {steps} of {self.max_steps} steps")

    def test_the_neurons_are_sceann_q10(self) -> None:
        """Stepping the reference controller with the trace's sensors gives the trace's neurons and hash."""
        with self._connected() as robot:
            trials = self._trials(robot, self.max_steps)
            for one in trials.batches(1):
                results = self._counted(robot, one)
                if results.traces is None:
                    results = robot.trace(one)
                _check(results.traces is not None, "traces: expected them from run or from trace")
                for trace in results.traces or ():
                    self._check_trace(robot, one, results, trace)

    def test_a_trial_of_one_step(self) -> None:
        """The shortest there is."""
        with self._connected() as robot:
            one = self._trials(robot, 1).take(slice(0, 1))
            _check(self._counted(robot, one).steps.tolist() == [1], "steps: expected 1")

    def test_a_repeatable_robot_repeats_its_trials_bit_by_bit_in_any_batch(self) -> None:
        """Nothing to do for others."""
        with self._connected() as robot:
            if not robot.spec.deterministic:
                return
            trials = self._trials(robot, self.max_steps)
            batched = [robot.run(batch) for batch in trials.batches(robot.spec.batch_size)]
            single = [robot.run(one) for one in trials.batches(1)]
            for name in ("end_reasons", "steps", "hashes", "final_states"):
                together = np.concatenate([getattr(results, name) for results in batched])
                apart = np.concatenate([getattr(results, name) for results in single])
                _check(np.array_equal(together, apart), f"{name}: a batch gives other bits than single trials")

    def test_a_robot_that_cannot_repeat_delivers_its_traces_with_the_results(self) -> None:
        """And is driven one trial at a time."""
        with self._connected() as robot:
            if robot.spec.deterministic:
                return
            _check(robot.spec.batch_size == 1, "spec.batch_size: expected 1 for a robot that cannot repeat a trial")
            results = self._counted(robot, self._trials(robot, self.max_steps).take(slice(0, 1)))
            _check(results.traces is not None, "traces: expected one from run")

    def test_a_network_that_does_not_fit_is_refused(self) -> None:
        """By a ValueError, before anything moves."""
        with self._connected() as robot:
            spec = robot.spec
            size = NetworkSize(spec.n_sensors + 1, 1, spec.n_motors)
            one = self._trials(robot, self.max_steps, size).take(slice(0, 1))
            try:
                robot.run(one)
            except ValueError:
                return
            _check(False, f"run: expected a ValueError for {size.n_sensors} sensors")

    def test_a_trial_that_never_started_is_settled(self) -> None:
        """By running it, or by saying that nothing was measured; never by a made-up result."""
        with self._connected() as robot:
            one = self._trials(robot, self.max_steps, first_id=40_000).take(slice(0, 1))
            results = robot.settle(one)
            _check(len(results) == 1, f"settle: expected one result, got {len(results)}")
            if results.counts[0]:
                _check(int(results.steps[0]) >= 1, "settle: a result without a step")

    def test_a_signal_stops_it_in_the_middle_of_a_trial(self) -> None:
        """SIGTERM comes while it moves: the trial ends soon, void, with the motors safe (and never as a result).

        Give a real robot a watchdog besides: against ``kill -9`` nothing on this computer helps.
        """
        with self._connected() as robot:
            if robot.spec.deterministic:
                return
            steps = min(int(_ENDLESS_S / robot.spec.tick_s), 65_535)
            one = self._trials(robot, steps, first_id=50_000).take(slice(0, 1))
            desk, signals = Desk(asks=False), Signals(lambda _: None)
            signals.guard(robot, desk)
            timer = threading.Timer(_SIGNAL_S, os.kill, (os.getpid(), signal.SIGTERM))
            with signals.watched():
                timer.start()
                began_s = time.monotonic()
                with desk.flight(Situation(0, 0, 0, 0, ""), robot.interrupt):
                    results = robot.run(one)
                took_s = time.monotonic() - began_s
                timer.join()
            if took_s < _SIGNAL_S:
                return  # the task ended before
            _check(took_s < _SIGNAL_S + _SOON_S, f"interrupt: the trial went on for {took_s - _SIGNAL_S:.1f} s")
            _check(not results.counts[0], "interrupt: a trial that was stopped came back as a result")
            _check(robot.make_safe("conformance"), "make_safe: expected True from a robot that is connected")

    # -- tools ------------------------------------------------------------------------------------------------------

    @contextmanager
    def _connected(self) -> Iterator[Robot]:
        with self.config().build() as robot:
            yield robot

    def _trials(self, robot: Robot, max_steps: int, size: NetworkSize | None = None, first_id: int = 1) -> Trials:
        return random_trials(robot.spec, self.start(), self.n_trials, max_steps, size, first_id)

    def _counted(self, robot: Robot, trials: Trials) -> Results:
        """Results that count; a void attempt is made again under another number, as the evaluator does."""
        for attempt in range(_VOID_ATTEMPTS):
            results = robot.run(replace(trials, ids=trials.ids + 1000 * attempt))
            if results.counts.all():
                return results
        raise RobotError(f"all of {_VOID_ATTEMPTS} attempts were void: {', '.join(robot.health().messages)}")

    def _check_trace(self, robot: Robot, trial: Trials, results: Results, trace: Trace) -> None:
        steps, size = int(results.steps[0]), trial.size
        for name, shape in (
            ("sensors", (steps, size.n_sensors)),
            ("u", (steps, size.n_neurons)),
            ("x", (steps, size.n_neurons)),
            ("state", (steps + 1, trace.state.shape[1])),
        ):
            got = getattr(trace, name).shape
            _check(got == shape, f"trace.{name}: expected shape {shape}, got {got}")
        _check(int(trace.sensors.max()) <= 1023, "trace.sensors: expected wire values 0..1023")
        controller = Controller(trial.weights[trial.genome_index[0]], size, trial.dynamics)
        for step in range(steps):
            controller.step(trace.sensors[step])
            same = np.array_equal(controller.u, trace.u[step]) and np.array_equal(controller.x, trace.x[step])
            _check(same, f"step {step}: expected u = {controller.u}, x = {controller.x}, got {trace.u[step]}")
        _check(int(results.hashes[0]) == state_hash(trace.u), "hashes: expected the CRC-16 of the trace's states")
