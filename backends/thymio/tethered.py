"""A Thymio whose controller is on this computer: it tells its sensors at every tick and takes motor targets."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from backends.thymio.connection import Connection, Done
from backends.thymio.reached import ReachedThymio
from sceann_hil.firmware.aesl.program import HEAD, End, motor_target, tethered_code
from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.robot import EndReason, LinkError, Results, RobotSpec, Trials, TrialVoid
from sceann_hil.robot.drawing import Drawing
from sceann_hil.robot.durations import Durations
from sceann_hil.robot.sensor_ends import SensorWatch
from sceann_hil.robot.stepped import SteppedRobot

ENDLESS = 0xFFFF
"""Steps that the robot is told; the host ends the trial."""
_LISTEN_S = 0.05
QUIET_S = 1.0
"""A robot that was not heard for so long in a trial is lost; by then it has stopped by itself."""


class TetheredThymio(ReachedThymio, SteppedRobot):
    """The robot keeps the clock: a control step begins when its sensors arrive.

    Args:
        spec: what it is.
        connection: the way to it.
        ends: what its sensors say of the task.
        drawing: what it and its arena look like.
    """

    def __init__(
        self, spec: RobotSpec, connection: Connection, ends: SensorWatch | None, drawing: Drawing | None
    ) -> None:
        super().__init__(spec, connection, ends, drawing)
        self._number = 0
        self._wire: NDArray[np.uint16] = np.zeros(spec.n_sensors, np.uint16)
        self._tick = -1

    @property
    def timing(self) -> dict[str, Durations]:
        return {"lateness": self.lateness} if len(self.lateness) else {}

    # -- trials -----------------------------------------------------------------------------------------------------

    def run(self, trials: Trials) -> Results:
        """Run the trials; a robot that was lost is looked for first.

        Raises:
            ValueError: the network does not fit.
            LinkError: the robot cannot be reached within the time for it.
        """
        trials.size.check_fits(self._spec.n_sensors, self._spec.n_motors, self._spec.name)
        self._connection.reach()
        return super().run(trials)

    def reset(self, start: dict[str, float], key: int) -> None:
        self._complaint, self._tick = "", -1
        self._connection.put_at(start)
        life = self._connection.life
        self._connection.load("tethered", lambda target: tethered_code(life, target))
        self._number = self._number % 0x7FFF + 1
        with self._connection.listening() as node:
            node.forget_events()
            node.tell("sceann.start", self._number, ENDLESS)

    def _wait(self, due_s: float, overruns: int) -> tuple[float, int]:
        """Until the robot's next tick, for it keeps the clock. Ticks that nobody waited for are overruns."""
        before, quiet_from_s = self._tick, time.monotonic()
        while self._interrupted is None and (self._tick <= before or self._hear(0.0)):
            if self._tick > before or self._hear(_LISTEN_S):
                continue
            if time.monotonic() - quiet_from_s > max(QUIET_S, 5.0 * self._spec.tick_s):
                self._connection.lost = True
                raise LinkError(
                    f"{self._connection.place}: the robot fell silent in mid-trial: asleep, out of reach, or its "
                    "simulator stands still"
                )
        now_s = time.monotonic()
        if before >= 0:
            self.lateness.add(max(now_s - due_s, 0.0))
        return now_s + self._spec.tick_s, overruns + 1 if self._tick > before + 1 else 0

    def _hear(self, timeout_s: float) -> bool:
        """Take the robot's next event, if one comes in time."""
        try:
            with self._connection.listening() as node:
                event = node.heard(timeout_s)
        except LinkError:
            self._connection.lost = True
            raise
        if event is None:
            return False
        name, words = event
        if name == "sceann.tick" and words[0] == self._number and len(words) == HEAD + self._spec.n_sensors:
            self._tick = words[1] & 0xFFFF
            self._wire = np.clip(words[HEAD:], 0, SENSOR_MAX).astype(np.uint16)
        elif name == "sceann.done" and (done := Done.told(words)).number == self._number:
            self._ended(done)
        return True

    def _ended(self, done: Done) -> None:
        if done.end is End.BUTTON:
            raise TrialVoid("somebody pressed the robot's centre button")
        if done.end is End.SILENCE:
            raise LinkError(f"{self._connection.place}: this computer was silent for too long, and the robot stopped")
        if self._interrupted is None:
            raise LinkError(f"{self._connection.place}: the robot ended the trial")

    def sense(self) -> NDArray[np.float64]:
        return self._wire / SENSOR_MAX

    def drive(self, motors: NDArray[np.float64]) -> None:
        top = self._connection.life.top_target
        targets = [motor_target(round(value * ONE), top) for value in motors.tolist()]
        self._connection.node.tell("sceann.drive", self._number, *targets)

    def ended(self) -> EndReason | None:
        return None if self._ends is None else self._ends(self._wire)

    def stop(self) -> None:
        """Motors to 0. A robot that is out of reach stops by itself, half a second after the last message."""
        self._connection.stop()

    def make_safe(self, reason: str) -> bool:
        return self._connection.stop()
