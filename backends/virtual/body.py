"""A simulated body on a virtual robot's pins: it moves while the firmware drives it, and a rig can put it back."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from backends.simulation.body import SimulatedBody
from backends.simulation.stepwise import StepwiseBody
from sceann_hil.firmware.emulated.posix import Alarm
from sceann_hil.network.controller import ONE
from sceann_hil.robot import EndReason
from sceann_hil.seeds import Purpose, keys


@dataclass(frozen=True, slots=True)
class Battery:
    """A battery that drains while the motors are driven.

    Attributes:
        full_v: voltage when full.
        empty_v: voltage at which the board raises its alarm.
        lasts_s: driven time from full to empty.
    """

    full_v: float = 8.4
    empty_v: float = 6.0
    lasts_s: float = 3600.0

    def volts(self, driven_s: float) -> float:
        """Voltage after so much driven time."""
        return max(0.0, self.full_v - (self.full_v - self.empty_v) * driven_s / self.lasts_s)


class VirtualBody:
    """What hangs on the pins of one virtual robot. All methods may be called from any thread.

    When the body comes to the end of its task (it touches the target, falls over, leaves the track) its bumper or end
    switch is pressed, until somebody puts it back.

    Args:
        robot: whose body and gap.
        seed: of its noise, and of its gap: one robot has one gap for its whole life.
        battery: see `Battery`.
        start: where it stands when it is switched on, in the order of the robot's start fields; all zero by default.
    """

    def __init__(
        self, robot: SimulatedBody, seed: int = 1, battery: Battery = Battery(), start: Sequence[float] | None = None
    ) -> None:
        self._body = StepwiseBody(robot, robot.gap.of_robot(seed))
        self._body.prepare()
        self._neutral = [round(robot.neutral_motor * ONE)] * robot.spec.n_motors
        self._motors = self._neutral
        self._seed = seed
        self._battery = battery
        self._lock = threading.Lock()
        self._placings = 0
        self._driven_s = 0.0
        self._moved = True
        self._ended: EndReason | None = None
        self.place(np.zeros(len(robot.spec.start_fields)).tolist() if start is None else start)

    @property
    def robot(self) -> SimulatedBody:
        """Whose body it is."""
        return self._body.robot

    def place(self, start: Sequence[float]) -> None:
        """Put it at a start, in the order of the robot's start fields, and release its switch."""
        with self._lock:
            self._placings += 1
            key = keys(self._seed, Purpose.TRIAL, self._placings)[0]
            self._body.reset(np.asarray(start, np.float64), key)
            self._ended, self._moved = None, True

    def change_battery(self) -> None:
        """A full one."""
        with self._lock:
            self._driven_s = 0.0

    def sense(self) -> list[int]:
        """Wire values at the start of a control tick; the time since the last one passes first if no DRIVE did it."""
        with self._lock:
            if not self._moved:
                self._move()
            self._moved = False
            return [int(value) for value in self._body.sense()]

    def drive(self, motors: Sequence[int]) -> None:
        """Motor values in Q10 for one control tick."""
        with self._lock:
            self._motors = list(motors)
            if not self._moved:
                self._move()

    def hold(self) -> None:
        """One more control tick with the motors as they are."""
        with self._lock:
            self._body.sense()
            self._move()

    def safe(self) -> None:
        """The safe output: nothing moves any more."""
        with self._lock:
            self._motors = self._neutral
            self._moved = True

    def _move(self) -> None:
        self._moved = True
        if self._ended is None:
            self._ended = self._body.move(self._motors)
        if self._motors != self._neutral:
            self._driven_s += self.robot.spec.tick_s

    @property
    def battery_mv(self) -> int:
        """What the board measures."""
        return round(1000.0 * self._battery.volts(self._driven_s))

    @property
    def pressed(self) -> bool:
        """The bumper or end switch."""
        return self._ended is not None

    @property
    def ended(self) -> EndReason | None:
        """Why the body's task has ended since it was placed; None if it has not."""
        return self._ended

    @property
    def alarms(self) -> Alarm:
        """What the board's inputs say."""
        low = self._driven_s >= self._battery.lasts_s
        return (Alarm.BUMPER if self.pressed else Alarm.NONE) | (Alarm.BATTERY if low else Alarm.NONE)
