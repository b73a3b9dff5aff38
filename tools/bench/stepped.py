"""A simulation of one's own, stepped from Python: what the loop costs beside the environment, and a step's value."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import ClassVar

import numpy as np
from figures import Figure, median_s
from numpy.typing import NDArray
from simulation import one_each

from backends.diffdrive import DifferentialDrive
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.robot import EndReason, RobotSpec, Trials
from sceann_hil.robot.accumulation import Accumulation, Combine
from sceann_hil.robot.step_value import max_of, sqrt, step_value
from sceann_hil.robot.stepped import SteppedRobot

ALONE_PER_S = 130_000
"""Steps per second of Gymnasium's CartPole-v1 with its usual wrappers, alone, on the machine where it was promised."""
PROMISED_PER_S = 70_000
MOST_LOOP_S = 1 / PROMISED_PER_S - 1 / ALONE_PER_S
"""So this is what the loop around it may cost per step."""


class Pole:
    """The step of Gymnasium's CartPole-v1 without its wrappers, written as it is there."""

    def reset(self, angle_rad: float) -> NDArray[np.float32]:
        self.state = np.array([0.0, 0.0, angle_rad, 0.0])
        return np.array(self.state, dtype=np.float32)

    def step(self, action: int) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, object]]:
        x, x_dot, theta, theta_dot = self.state
        force = 10.0 if action == 1 else -10.0
        costheta, sintheta = np.cos(theta), np.sin(theta)
        temp = (force + 0.05 * np.square(theta_dot) * sintheta) / 1.1
        thetaacc = (9.8 * sintheta - costheta * temp) / (0.5 * (4.0 / 3.0 - 0.1 * np.square(costheta) / 1.1))
        xacc = temp - 0.05 * thetaacc * costheta / 1.1
        self.state = np.array(
            (x + 0.02 * x_dot, x_dot + 0.02 * xacc, theta + 0.02 * theta_dot, theta_dot + 0.02 * thetaacc)
        )
        fallen = bool(abs(self.state[0]) > 2.4 or abs(self.state[2]) > 0.7)
        return np.array(self.state, dtype=np.float32), 1.0, fallen, False, {}


class PoleRobot(SteppedRobot):
    """The same as a robot that knows its state."""

    paced = False
    spec: ClassVar[RobotSpec] = RobotSpec("pole", 4, 1, 0.02, ("angle_rad",), ("x", "v", "angle", "rate"))

    def __init__(self) -> None:
        super().__init__()
        self._pole = Pole()

    def reset(self, start: dict[str, float], key: int) -> None:
        self._seen, self._fallen = self._pole.reset(start["angle_rad"]), False

    def sense(self) -> NDArray[np.float32]:
        return 0.2 * self._seen + 0.5

    def drive(self, motors: NDArray[np.float64]) -> None:
        self._seen, _, self._fallen, _, _ = self._pole.step(1 if motors[0] > 0.5 else 0)

    def state(self) -> NDArray[np.float32]:
        return self._seen

    def stop(self) -> None:
        pass

    def ended(self) -> EndReason | None:
        return EndReason.FELL if self._fallen else None


@step_value
def avoid(sensors, motors, state):  # type: ignore[no-untyped-def]
    left, right = motors[0], motors[1]
    return 0.5 * (left + right) * (1 - sqrt(abs(left - right))) * (1 - max_of(sensors))


def run() -> list[Figure]:
    """Both in steps per second and as a ratio to the same without us."""
    return [*_python_loop(), *_value_of_a_step()]


def _python_loop() -> list[Figure]:
    robot, pole = PoleRobot(), Pole()
    trials = _trials(NetworkSize(4, 2, 1), 300, np.full((300, 1), 0.01), 500)
    n_steps = int(robot.run(trials).steps.sum())
    ours_s = median_s(lambda: robot.run(trials), clock=time.thread_time) / n_steps

    def alone() -> None:
        for step in range(n_steps):
            if step % 20 == 0:
                pole.reset(0.01)
            pole.step(step & 1)

    alone_s = median_s(alone, clock=time.thread_time) / n_steps
    loop_s = ours_s - alone_s
    promised = f"<= {1e6 * MOST_LOOP_S:.1f} us, so that Gymnasium's 130,000 steps/s become 70,000"
    return [
        Figure("a pole in Python, alone", f"{1 / alone_s:,.0f} steps/s"),
        Figure("the same as a SteppedRobot", f"{1 / ours_s:,.0f} steps/s"),
        Figure("what the loop costs per step", f"{1e6 * loop_s:.1f} us", promised, loop_s <= MOST_LOOP_S),
    ]


def _value_of_a_step() -> list[Figure]:
    robot = DifferentialDrive(threads=1)
    plain = _trials(NetworkSize(7, 2, 2), 20_000, np.tile([0.1, 0.1, 0.5], (20_000, 1)), 200)
    valued = replace(plain, accumulation=Accumulation(avoid, Combine.MEAN, 200))
    n_steps = int(robot.run(plain).steps.sum())
    plain_rate = n_steps / median_s(lambda: robot.run(plain), clock=time.thread_time)
    valued_rate = n_steps / median_s(lambda: robot.run(valued), clock=time.thread_time)
    return [
        Figure("two wheels, 7 sensors, no value", f"{plain_rate / 1e6:.0f} million steps/s"),
        Figure("the same with a step value added up", f"{valued_rate / 1e6:.0f} million steps/s"),
        Figure("with / without", f"{valued_rate / plain_rate:.2f} x"),
    ]


def _trials(size: NetworkSize, n: int, starts: NDArray[np.float64], max_steps: int) -> Trials:
    genomes = np.random.default_rng(0).integers(0, 2, (n, Coding.SCEANN3.genome_length(size)), dtype=np.uint8)
    return one_each(size, Coding.SCEANN3.decode(genomes, size), starts, max_steps)
