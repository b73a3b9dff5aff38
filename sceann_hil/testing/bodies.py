"""What every simulated body must do: the same bits however it is run, and new code when it is edited."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.compiled import as_part, compiled_part, rebound
from sceann_hil.network.controller import ONE
from sceann_hil.network.neurons import LANES
from sceann_hil.plugins import RobotConfig
from sceann_hil.robot import EndReason, Results, Robot, Trials
from sceann_hil.testing.checks import check
from sceann_hil.testing.random_trials import random_trials

_SAME = ("end_reasons", "steps", "hashes", "final_states")
_WORK_ROWS = 12


class BodyConformance(ABC):
    """Derive from it, name the class ``Test...``, and say which body is meant. It needs no firmware and no line.

    Attributes:
        max_steps: length of the trials.
        n_trials: how many are run beside each other, with different networks and noise.
    """

    max_steps: int = 60
    n_trials: int = 2 * LANES + 5

    @abstractmethod
    def config(self) -> RobotConfig:
        """The configuration of a robot that is a `backends.simulation.engine.SimulatedRobot`."""

    def start(self) -> tuple[float, ...]:
        """Start values of a trial, in the order of the robot's start fields; all 0 unless this is overridden."""
        return (0.0,) * len(self.config().spec.start_fields)

    # -- the same bits ----------------------------------------------------------------------------------------------

    def test_a_trial_is_the_same_alone_in_a_batch_and_on_any_number_of_threads(self) -> None:
        """A lane reads nothing but its own column."""
        robot = self._robot()
        trials = self._trials(robot)
        robot.use_cores(1)
        batch = robot.run(trials)
        threaded = self._robot()
        threaded.use_cores(3)
        _check_same(threaded.run(trials), batch, "three threads give other bits than one")
        for i in (0, LANES - 1, LANES, len(trials) - 1):
            alone = robot.run(trials.take(slice(i, i + 1)))
            _check_same(alone, _one_of(batch, i), f"trial {i} gives other bits alone than in a batch")

    def test_a_traced_trial_is_the_same_as_one_that_is_not(self) -> None:
        """And its trace fits its result."""
        robot = self._robot()
        trials = self._trials(robot)
        traced = robot.trace(trials)
        _check_same(traced, robot.run(trials), "tracing gives other bits")
        for i, trace in enumerate(traced.traces or ()):
            same = np.array_equal(trace.state[-1], traced.final_states[i])
            check(same, f"trial {i}: the last state of the trace is not the final one")

    def test_moved_one_tick_at_a_time_it_is_the_same_body(self) -> None:
        """So it serves mode hil and virtual robots."""
        robot = self._robot()
        trials = self._trials(robot).take(slice(0, 3))
        results = robot.trace(trials)
        body: Any = getattr(robot, "stepwise", _no_stepwise)()
        for i, trace in enumerate(results.traces or ()):
            body.reset(trials.starts[i], trials.keys[i])
            end = None
            for step, motors in enumerate(trace.x[:, -robot.spec.n_motors :]):
                check(np.array_equal(body.state, trace.state[step]), f"trial {i}, step {step}: another state")
                check(np.array_equal(body.sense(), trace.sensors[step]), f"trial {i}, step {step}: other sensors")
                end = body.move(motors.tolist())
            check(np.array_equal(body.state, results.final_states[i]), f"trial {i}: another final state")
            check((end or EndReason.TIME_UP) == results.end_reasons[i], f"trial {i}: another end: {end}")

    def test_noise_comes_from_the_key_alone_and_the_spec_says_whether_there_is_any(self) -> None:
        """``noise_free`` lets runs save trials, so it must be true."""
        robot = self._robot()
        trials = self._trials(robot)
        first, again = robot.run(trials), robot.run(trials)
        _check_same(first, again, "the same trials give other bits the second time")
        if robot.spec.noise_free:
            others = robot.run(replace(trials, keys=trials.keys + np.uint64(1)))
            _check_same(others, first, "spec.noise_free: the noise key has an influence")

    # -- what it computes -------------------------------------------------------------------------------------------

    def test_its_states_are_numbers_and_its_ends_are_task_ends(self) -> None:
        """A state that is no number ends in a fitness that is none."""
        results = self._robot().trace(self._trials(self._robot()))
        for i, trace in enumerate(results.traces or ()):
            bad = np.flatnonzero(~np.isfinite(trace.state).all(axis=1))
            check(not len(bad), f"trial {i}: a state is no number from step {bad[:1]} on")
        check(bool(results.counts.all()), f"end reasons: expected task ends, got {set(results.end_reasons.tolist())}")

    def test_it_stays_within_its_arrays(self) -> None:
        """Compiled code does not notice an index that is too large; Python does."""
        robot = self._robot()
        spec, body = robot.spec, type(robot)
        parameters = np.asarray(getattr(robot, "parameters", np.zeros(0, np.float32)))
        arrays = {name: np.zeros((rows, LANES), np.float32) for name, rows in _rows(robot).items()}
        arrays["state"][:] = self._trace_of_one(robot).state[0][:, None]
        ends = np.zeros(LANES, np.int32)
        with np.errstate(all="ignore"):
            try:
                _python(body, "sense")(arrays["state"], arrays["sensors"], arrays["work"], parameters)
                _python(body, "advance")(
                    arrays["state"], arrays["motors"], arrays["noise"], ends, arrays["work"], parameters
                )
            except IndexError as error:
                raise AssertionError(f"{spec.name} reaches beyond its arrays: {error}") from error

    def test_a_trial_begins_where_it_is_told_to(self) -> None:
        """A state takes the start value of its own name, unless the body says otherwise in ``initial_states``."""
        robot = self._robot()
        states: Any = getattr(robot, "initial_states", None)
        expected = np.asarray(states(np.array([self.start()])), np.float32)[0]
        got = self._trace_of_one(robot).state[0]
        check(np.array_equal(got, expected), f"state: expected {expected} at the start, got {got}")

    # -- edited code is new code ------------------------------------------------------------------------------------

    def test_an_edited_body_is_another_body(self) -> None:
        """Its fingerprint changes and its machine code is made anew, while the unedited one stays what it was."""
        robot, edited = self._robot(), self._robot()
        trials = self._trials(robot).take(slice(0, 4))
        before = robot.run(trials)
        advance = compiled_part(rebound(_moved_on, before=as_part(getattr(type(edited), "advance"))))  # noqa: B009
        edited.__class__ = type("Edited", (type(edited),), {"advance": staticmethod(advance)})
        check(robot.body_fingerprint() is not None, "body_fingerprint: expected one of a simulated body")
        check(robot.body_fingerprint() == self._robot().body_fingerprint(), "body_fingerprint: it changes by itself")
        check(robot.body_fingerprint() != edited.body_fingerprint(), "body_fingerprint: an edit does not change it")
        after = edited.run(trials)
        check(not np.array_equal(before.final_states, after.final_states), "an edited body runs its old code")
        _check_same(robot.run(trials), before, "the unedited body runs the edited code")

    # -- tools ------------------------------------------------------------------------------------------------------

    def _robot(self) -> Robot:
        return self.config().build()

    def _trials(self, robot: Robot) -> Trials:
        return random_trials(robot.spec, self.start(), self.n_trials, self.max_steps)

    def _trace_of_one(self, robot: Robot) -> Any:
        traces = robot.trace(self._trials(robot).take(slice(0, 1))).traces
        check(bool(traces), "trace: expected one for each trial")
        return (traces or ())[0]


def _rows(robot: Robot) -> dict[str, int]:
    spec = robot.spec
    n_noise = int(getattr(robot, "n_noise", 0))
    return {
        "state": len(spec.state_fields),
        "sensors": spec.n_sensors,
        "motors": spec.n_motors,
        "noise": n_noise + n_noise % 2,
        "work": _WORK_ROWS,
    }


def _python(body: type, name: str) -> Callable[..., None]:
    function: Any = getattr(body, name)
    plain: Callable[..., None] = getattr(function, "py_func", function)
    return plain


def _no_stepwise() -> None:
    raise AssertionError("expected a backends.simulation.engine.SimulatedRobot")


def _one_of(results: Results, i: int) -> Results:
    part = slice(i, i + 1)
    return Results(
        end_reasons=results.end_reasons[part],
        steps=results.steps[part],
        hashes=results.hashes[part],
        final_states=results.final_states[part],
        durations_s=results.durations_s[part],
    )


def _check_same(a: Results, b: Results, otherwise: str) -> None:
    for name in _SAME:
        check(np.array_equal(getattr(a, name), getattr(b, name)), f"{name}: {otherwise}")


before: Any = None


def _moved_on(
    state: NDArray[np.float32],
    motors: NDArray[np.float32],
    noise: NDArray[np.float32],
    end_reasons: NDArray[np.int32],
    work: NDArray[np.float32],
    parameters: NDArray[np.float32],
) -> None:
    """An edit: the body's own motion, and a little more."""
    before(state, motors, noise, end_reasons, work, parameters)
    for lane in range(LANES):
        state[0, lane] = state[0, lane] + np.float32(1.0 / ONE)
