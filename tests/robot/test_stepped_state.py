"""A simulation of one's own delivers its states and its steps, so a value may be added up over them."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics, state_hash
from sceann_hil.robot import LinkError, RobotSpec, Trials
from sceann_hil.robot.accumulation import Accumulation, Combine
from sceann_hil.robot.step_value import step_value
from sceann_hil.robot.stepped import SteppedRobot

Floats = NDArray[np.float64]
SIZE = NetworkSize(1, 1, 1)


class Slider(SteppedRobot):
    """Moves by its motor's value; may lose its line in a step."""

    paced = False
    spec: ClassVar[RobotSpec] = RobotSpec("slider", 1, 1, 0.1, ("x_m",), ("x_m", "steps"), deterministic=True)
    lost_at: int | None = None

    def reset(self, start: dict[str, float], key: int) -> None:
        self.x, self.steps = start["x_m"], 0

    def sense(self) -> list[float]:
        if self.steps == self.lost_at:
            raise LinkError("gone")
        return [self.x % 1.0]

    def drive(self, motors: Floats) -> None:
        self.x, self.steps = self.x + float(motors[0]), self.steps + 1

    def state(self) -> ArrayLike:
        return [self.x, self.steps]

    def stop(self) -> None:
        pass


@step_value
def place(sensors: Floats, motors: Floats, state: Floats) -> float:
    return state[0] + 10.0 * motors[0]  # type: ignore[no-any-return]


def _trials(n: int = 3, max_steps: int = 6) -> Trials:
    rng = np.random.default_rng(1)
    return Trials(
        size=SIZE,
        dynamics=Dynamics(),
        weights=rng.integers(-1, 2, (n, SIZE.n_neurons, SIZE.n_sources)).astype(np.int8),
        genome_index=np.arange(n),
        starts=np.arange(n, dtype=np.float64)[:, None],
        keys=np.zeros(n, np.uint64),
        max_steps=max_steps,
        ids=np.arange(n),
        accumulation=Accumulation(place, Combine.SUM, 12),
    )


def test_states_are_those_before_each_step_and_after_the_last() -> None:
    trials = _trials()
    results = trials.completed(Slider().run(trials))
    assert results.traces is not None
    assert results.values is not None
    assert results.final_states.shape == (3, 2)
    for i, trace in enumerate(results.traces):
        motors = trace.x[:, -1] / 1024.0
        expected = float(i) + np.concatenate([[0.0], np.cumsum(motors)])
        np.testing.assert_allclose(trace.state[:, 0], expected, rtol=1e-6)
        assert trace.state[:, 1].tolist() == list(range(7))
        assert trace.state[-1].tolist() == results.final_states[i].tolist()
        assert results.values[i] == pytest.approx(trace.state[:-1, 0].sum() + 10.0 * motors.sum())
        assert results.hashes[i] == state_hash(trace.u)


def test_a_repeatable_robot_keeps_its_steps_too_and_gives_them_again() -> None:
    robot, trials = Slider(), _trials()
    first, again = robot.run(trials), robot.trace(trials)
    assert first.traces is not None
    assert again.traces is not None
    for a, b in zip(first.traces, again.traces, strict=True):
        for name in ("state", "sensors", "u", "x"):
            assert np.array_equal(getattr(a, name), getattr(b, name))


def test_a_trial_that_broke_off_is_void_and_has_no_value() -> None:
    robot, trials = Slider(), _trials()
    robot.lost_at = 4
    results = trials.completed(robot.run(trials))
    assert not results.counts.any()
    assert results.values is None or np.isnan(results.values).all()
    assert "gone" in results.why_void


def test_a_robot_that_broke_off_before_its_first_step_has_no_state_and_no_value() -> None:
    robot, trials = Slider(), _trials()
    robot.lost_at = 0
    assert not trials.completed(robot.run(trials)).counts.any()


class Blind(Slider):
    """Declares states that it does not tell."""

    state = SteppedRobot.state


class Wrong(Slider):
    def state(self) -> ArrayLike:
        return [1.0]


def test_a_state_that_nobody_tells_has_no_columns() -> None:
    results = Blind().run(replace(_trials(), accumulation=None))
    assert results.final_states.shape == (3, 0)


def test_a_state_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match=r"state: expected 2 values \(x_m, steps\), got \[1\.\]"):
        Wrong().run(_trials())
