"""Fitness over the trial is the simulation's, to the bit, in every control mode that sees the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from backends.cartpole import CartPole, CartPoleConfig
from backends.remote import RemoteConfig
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.errors import PluginError
from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.robot import Trials
from sceann_hil.robot.step_task import StepTask
from sceann_hil.robot.step_value import step_value
from tests.backends.remote.trials import counted, pole_trials, virtual_config

Floats = NDArray[np.float64]
FIELDS = CartPole().spec.start_fields


@step_value
def upright(sensors: Floats, motors: Floats, state: Floats) -> float:
    return 1.0 - abs(2.0 * sensors[1] - 1.0) - 0.1 * abs(motors[0] - 0.5)  # type: ignore[no-any-return]


@step_value
def centred(sensors: Floats, motors: Floats, state: Floats) -> float:
    return -(state[0] ** 2) * sensors[0]  # type: ignore[no-any-return]


def _task(value: object) -> StepTask:
    return StepTask(value=value, max_steps=25, start_fields=FIELDS, starts=[[0.0, 0.0, 0.0175, 0.0]])  # type: ignore[arg-type]


def _trials(task: StepTask) -> Trials:
    return replace(pole_trials(4, task.max_steps), accumulation=task.accumulation)


def _simulated(trials: Trials) -> NDArray[np.float64]:
    values = CartPole().run(trials).values
    assert values is not None
    assert len(set(values.tolist())) == len(values)
    return values


@pytest.mark.parametrize("mode", ["onboard", "tethered"])
def test_a_robot_of_its_own_gives_the_same_fitness_for_the_same_sensors(virtual: VirtualPosix, mode: str) -> None:
    task = _task(upright)
    trials = _trials(task)
    expected = _simulated(trials)
    config = virtual_config(virtual, mode)
    task.check_robot(config.spec)
    with config.build() as robot:
        for k, trial in enumerate(trials.batches(1)):
            results = trial.completed(counted(robot, trial))
            assert results.values is not None
            assert results.values[0] == expected[k]
    with pytest.raises(PluginError, match=r"centred .* reads the body's state"):
        _task(centred).check_robot(config.spec)


@pytest.mark.parametrize("value", [upright, centred])
def test_so_does_a_board_in_the_loop_which_knows_the_state(board: PosixBoard, value: object) -> None:
    task = _task(value)
    trials = _trials(task)
    expected = _simulated(trials)
    config = RemoteConfig(port=str(board.port), mode="hil", body=CartPoleConfig())
    task.check_robot(config.spec)
    with config.build() as robot:
        for k, trial in enumerate(trials.batches(1)):
            results = trial.completed(counted(robot, trial))
            assert results.values is not None
            assert results.values[0] == expected[k]
