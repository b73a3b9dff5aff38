"""The robot behind the lines: read, driven and stopped one control step at a time by `SteppedRobot`."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from backends.text_line.line import Question, TextLine
from sceann_hil.network.controller import quantise_sensors
from sceann_hil.robot import EndReason, Health, LinkError, RobotError, RobotSpec
from sceann_hil.robot.diagnosis import Finding, Mover, Verdict
from sceann_hil.robot.durations import Durations
from sceann_hil.robot.sensor_ends import SensorWatch
from sceann_hil.robot.stepped import SteppedRobot

_STOPS = 3
"""How often the robot is told to stop before it counts as out of reach."""
_LOOKS = 20
_MOVE_S = 0.5
_MOVE = 0.3
"""How far from rest the doctor drives a motor, as a part of the way to its end."""


@dataclass(frozen=True, slots=True)
class Scale:
    """A number on the line against a value 0..1; the robot says no number outside ``least..most``."""

    at_0: float
    at_1: float
    least: float
    most: float

    def value(self, number: float) -> float:
        """0..1; a number beyond `at_0` or `at_1` is as much as they are."""
        return float(np.clip((number - self.at_0) / (self.at_1 - self.at_0), 0.0, 1.0))

    def number(self, value: float) -> float:
        """What stands for a value 0..1."""
        return self.at_0 + value * (self.at_1 - self.at_0)


@dataclass(frozen=True, slots=True)
class Dialogue:
    """What is said, and what it means."""

    hello: Question | None
    sense: Question
    drive: Question
    stop: Question
    reset: Question | None
    battery: Question | None
    battery_range_v: tuple[float, float] | None
    sensors: tuple[Scale, ...]
    motors: tuple[Scale, ...]
    decimals: int


class TextLineRobot(SteppedRobot):
    """A robot that answers lines of text.

    Args:
        spec: what it is.
        dialogue: what is said to it.
        port: path or pyserial URL.
        baud: speed.
        line_end: of a line to the robot.
        answer_s: how long an answer may take.
        start_s: how long the first one may take after the port was opened.
        ends: what its sensors say of the task.
    """

    def __init__(
        self,
        spec: RobotSpec,
        dialogue: Dialogue,
        *,
        port: str,
        baud: int,
        line_end: str,
        answer_s: float,
        start_s: float,
        ends: SensorWatch | None,
    ) -> None:
        super().__init__()
        self._spec = spec
        self._dialogue = dialogue
        self._line = TextLine(port, baud, line_end, answer_s)
        self._start_s = start_s
        self._ends = ends
        self._connected = False
        self._sensors: NDArray[np.float64] = np.zeros(spec.n_sensors)
        self._battery_v: float | None = None
        self._complaint = ""
        self._in_trial = False

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    # -- the connection ---------------------------------------------------------------------------------------------

    def connect(self) -> None:
        """Open the line and wait until the robot answers.

        Raises:
            LinkError: no port, silence, or another robot.
        """
        self._line.open()
        self._connected = True
        deadline_s = time.monotonic() + self._start_s
        first = self._dialogue.hello or self._dialogue.sense
        while True:
            try:
                self._line.clear()
                self._line.ask(first)
                break
            except LinkError:
                if time.monotonic() > deadline_s:
                    self._close()
                    raise
        self.stop()
        self._ask_battery()

    def disconnect(self) -> None:
        if self._connected:
            self.make_safe("disconnect")
        self._close()

    def _close(self) -> None:
        self._connected = False
        self._line.close()

    @property
    def timing(self) -> dict[str, Durations]:
        return {"answers": self._line.answered, "lateness": self.lateness}

    def health(self) -> Health:
        """What was heard last; between trials the battery is asked again."""
        if self._connected and not self._in_trial:
            with suppress(LinkError):
                self._ask_battery()
        complaints = (self._complaint,) if self._complaint else ()
        fraction = None
        if self._battery_v is not None and self._dialogue.battery_range_v is not None:
            empty_v, full_v = self._dialogue.battery_range_v
            fraction = float(np.clip((self._battery_v - empty_v) / (full_v - empty_v), 0.0, 1.0))
        return Health(battery_fraction=fraction, messages=complaints)

    # -- one trial --------------------------------------------------------------------------------------------------

    def reset(self, start: dict[str, float], key: int) -> None:
        """A person has put it back; old answers are thrown away."""
        self._in_trial = True
        self._line.clear()
        if self._dialogue.reset is not None:
            self._ask(self._dialogue.reset)
        self._ask_battery()
        self._complaint = ""

    def sense(self) -> NDArray[np.float64]:
        numbers = self._ask(self._dialogue.sense)
        for place, (number, scale) in enumerate(zip(numbers, self._dialogue.sensors, strict=True)):
            if not scale.least <= number <= scale.most:
                self._complaint = (
                    f"{self._line.port}: sensor {place}: expected {scale.least:g}..{scale.most:g}, got {number:g}"
                )
                raise LinkError(self._complaint)
        self._sensors = np.array(
            [scale.value(number) for number, scale in zip(numbers, self._dialogue.sensors, strict=True)]
        )
        return self._sensors

    def drive(self, motors: NDArray[np.float64]) -> None:
        numbers = (scale.number(value) for value, scale in zip(motors.tolist(), self._dialogue.motors, strict=True))
        # rounding must not write -0
        self._ask(self._dialogue.drive, *(f"{number:z.{self._dialogue.decimals}f}" for number in numbers))

    def ended(self) -> EndReason | None:
        return None if self._ends is None else self._ends(quantise_sensors(self._sensors))

    def stop(self) -> None:
        """The motors' safe output, said again until it is answered.

        Raises:
            LinkError: the robot does not answer; it may still be driving.
        """
        if not self._connected:
            raise LinkError(f"{self._line.port}: not connected")
        if self._line.busy():
            # a person presses stop while the loop waits for an answer: the loop hears no more, and stops it again
            self._line.write(self._dialogue.stop.say)
            return
        for left in reversed(range(_STOPS)):
            try:
                self._line.write(self._dialogue.stop.say)
                self._line.clear()
                self._line.ask(self._dialogue.stop)
                self._in_trial = False
                return
            except LinkError as error:
                if left == 0:
                    raise LinkError(f"{error}; it may still be driving") from error

    def _ask(self, question: Question, *numbers: str) -> tuple[float, ...]:
        try:
            return self._line.ask(question, *numbers)
        except LinkError as error:
            self._complaint = str(error)
            raise

    def _ask_battery(self) -> None:
        if self._dialogue.battery is not None:
            self._battery_v = self._ask(self._dialogue.battery)[0]

    # -- the doctor -------------------------------------------------------------------------------------------------

    def diagnose(self, mover: Mover | None = None) -> Iterator[Finding]:
        try:
            self.connect()
        except RobotError as error:
            advice = "Check power, cable, port and baud rate, and that no other program has the port open."
            yield Finding("connection", Verdict.BAD, str(error), advice)
            return
        try:
            yield Finding("connection", Verdict.GOOD, f"{self._line.port}: it answers and stops when told to")
            yield from self._look(mover)
        except LinkError as error:
            yield Finding("answers", Verdict.BAD, str(error), "Compare the sketch with sense, drive and stop.")
        finally:
            self.disconnect()

    def _look(self, mover: Mover | None) -> Iterator[Finding]:
        seen = []
        for _ in range(_LOOKS):
            self.sense()
            seen.append(self._sensors)
        longest_s = 2.0 * self._line.answered.largest_s
        fits = longest_s < self.spec.tick_s
        yield Finding(
            "timing",
            Verdict.GOOD if fits else Verdict.BAD,
            f"two answers take at most {1000.0 * longest_s:.1f} ms, a control step {1000.0 * self.spec.tick_s:g} ms",
            "" if fits else "Make tick_s longer, baud higher, or the sketch quicker.",
        )
        low, high = np.min(seen, axis=0), np.max(seen, axis=0)
        text = "\n".join(f"sensor {i}: from {low[i]:.3f} to {high[i]:.3f} of 1" for i in range(self.spec.n_sensors))
        yield Finding("sensors", Verdict.GOOD, text, "Cover one after the other: does the right value change?")
        if self._battery_v is not None:
            yield Finding("battery", Verdict.GOOD, f"{self._battery_v:.2f} V")
        if mover is None:
            advice = "Lift its wheels and add --move to try them."
            yield Finding("motors", Verdict.NOT_DONE, "the robot was not moved", advice)
            return
        yield mover("motors", self._try_motors)

    def _try_motors(self) -> Finding:
        rest = np.array([scale.value(0.0) for scale in self._dialogue.motors])
        for motor in range(self.spec.n_motors):
            values = rest.copy()
            values[motor] += _MOVE if rest[motor] < 1.0 - _MOVE else -_MOVE
            self.drive(values)
            time.sleep(_MOVE_S)
            self.stop()
        text = "each was driven for half a second, one after the other, then stopped"
        return Finding("motors", Verdict.GOOD, text, "Did the right wheel turn, and forwards?")
