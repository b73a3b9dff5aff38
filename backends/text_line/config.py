"""The ``robot`` section of type ``text_line``: questions, answers and scales."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from backends.text_line.answers import Pattern
from backends.text_line.line import Question
from backends.text_line.robot import Dialogue, Scale, TextLineRobot
from sceann_hil.plugins import Misfit, RobotConfig, Section
from sceann_hil.robot import RobotSpec
from sceann_hil.robot.sensor_ends import SensorEnd, SensorWatch

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]


class ScaleConfig(Section):
    """How a number on the line becomes a value 0..1, or the other way round."""

    at_0: float
    """The number that stands for 0."""
    at_1: float
    """The number that stands for 1. It may be the smaller one: a sensor that reads less when it sees more."""
    least: float | None = None
    """The smallest number that the robot can say; less is a spoilt answer. Default: the smaller of at_0 and at_1."""
    most: float | None = None
    """The largest number that the robot can say. Default: the larger of at_0 and at_1."""

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        if self.at_0 == self.at_1:
            raise Misfit(f"at_1: expected another number than at_0, got {self.at_1:g}", "at_1", "at_0")
        scale = self.scale
        if not (scale.least <= min(self.at_0, self.at_1) and max(self.at_0, self.at_1) <= scale.most):
            raise Misfit(
                f"least: expected at_0 and at_1 within {scale.least:g}..{scale.most:g}, got {self.at_0:g} and "
                f"{self.at_1:g}",
                "least",
                "most",
            )
        return self

    @property
    def scale(self) -> Scale:
        """The same with its defaults filled in."""
        low, high = sorted((self.at_0, self.at_1))
        return Scale(
            self.at_0,
            self.at_1,
            low if self.least is None else self.least,
            high if self.most is None else self.most,
        )


class QuestionConfig(Section):
    """A line to the robot, and what it answers."""

    say: Annotated[str, Field(min_length=1, pattern=r"^[ -~]+$")]
    """The line without its end. In `drive`, {} stands for each motor's number."""
    answer: Annotated[str, Field(min_length=1, pattern=r"^[ -~]+$")] | None = None
    """What the robot answers, {} where a number stands; without it the robot must not answer at all."""

    @field_validator("answer")
    @classmethod
    def _can_be_read(cls, value: str | None) -> str | None:
        if value is not None:
            Pattern(value)
        return value

    @property
    def question(self) -> Question:
        """Ready to be asked."""
        return Question(self.say, None if self.answer is None else Pattern(self.answer))

    @property
    def numbers(self) -> int:
        """How many numbers its answer has."""
        return 0 if self.answer is None else Pattern(self.answer).n_numbers


class BatteryConfig(QuestionConfig):
    """How the battery's voltage is asked for, before every trial."""

    range_v: tuple[float, float]
    """Volts of an empty and a full battery."""

    @model_validator(mode="after")
    def _tells_a_voltage(self) -> Self:
        if self.numbers != 1:
            raise Misfit(f"battery.answer: expected one {{}}, got {self.numbers}", "answer")
        if self.range_v[0] >= self.range_v[1]:
            raise Misfit("battery.range_v: expected [empty, full]", "range_v")
        return self


class TextLineConfig(RobotConfig):
    """A robot that answers lines of text: no program on this side, only this section."""

    type: Literal["text_line"] = "text_line"
    port: str
    """Serial port, by a path that stays the same (/dev/serial/by-id/...), or a pyserial URL (socket://host:port)."""
    baud: Annotated[int, Field(gt=0)] = 115_200
    """Speed of the serial port."""
    line_end: Literal["lf", "crlf", "cr"] = "lf"
    """What ends a line to the robot; its answers may end with lf or crlf."""
    answer_s: Annotated[float, Field(gt=0.0, le=10.0)] = 0.1
    """How long an answer may take, seconds."""
    start_s: Annotated[float, Field(gt=0.0, le=60.0)] = 6.0
    """How long the robot may take to answer at first, seconds: opening its port resets an Arduino."""
    tick_s: Annotated[float, Field(ge=0.001, le=6.5)]
    """Control step, seconds; longer than both answers take together."""
    start_fields: tuple[Name, ...]
    """Names of a trial's start values, which the task must have too."""
    hello: QuestionConfig | None = None
    """Asked when the line is opened, to know that it is this robot."""
    sense: QuestionConfig
    """How the sensors are asked for; a {} in the answer for each."""
    sensors: Annotated[tuple[ScaleConfig, ...], Field(min_length=1, max_length=64)]
    """What each number of that answer means."""
    drive: QuestionConfig
    """How the motors are driven; a {} for each."""
    motors: Annotated[tuple[ScaleConfig, ...], Field(min_length=1, max_length=16)]
    """Which number drives each motor."""
    decimals: Annotated[int, Field(ge=0, le=6)] = 0
    """Decimals of a motor's number."""
    stop: QuestionConfig
    """The line that stops all motors. It is sent after every trial, at every fault, and when a person presses stop."""
    reset: QuestionConfig | None = None
    """Said before every trial, if the robot has something to prepare."""
    battery: BatteryConfig | None = None
    """How the battery is asked for; without it nobody can watch it."""
    ends: tuple[SensorEnd, ...] = ()
    """Task ends that the sensors tell."""
    attended: bool = True
    """Somebody stands beside it and puts it back."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.sense.numbers != len(self.sensors):
            raise Misfit(
                f"sense.answer: expected {len(self.sensors)} times {{}}, one for each of the sensors, got "
                f"{self.sense.numbers}",
                "sense",
                "sensors",
            )
        places = self.drive.say.count("{}")
        if places != len(self.motors):
            raise Misfit(
                f"drive.say: expected {len(self.motors)} times {{}}, one for each of the motors, got {places}",
                "drive",
                "motors",
            )
        for end in self.ends:
            if end.sensor is not None and end.sensor >= len(self.sensors):
                raise Misfit(f"ends: expected a sensor 0..{len(self.sensors) - 1}, got {end.sensor}", "ends")
        return self

    @property
    def spec(self) -> RobotSpec:
        return RobotSpec(
            name="text line",
            n_sensors=len(self.sensors),
            n_motors=len(self.motors),
            tick_s=self.tick_s,
            start_fields=self.start_fields,
            state_fields=(),
            attended=self.attended,
            batch_size=1,
            deterministic=False,
        )

    def build(self) -> TextLineRobot:
        return TextLineRobot(
            self.spec,
            Dialogue(
                hello=None if self.hello is None else self.hello.question,
                sense=self.sense.question,
                drive=self.drive.question,
                stop=self.stop.question,
                reset=None if self.reset is None else self.reset.question,
                battery=None if self.battery is None else self.battery.question,
                battery_range_v=None if self.battery is None else self.battery.range_v,
                sensors=tuple(sensor.scale for sensor in self.sensors),
                motors=tuple(motor.scale for motor in self.motors),
                decimals=self.decimals,
            ),
            port=self.port,
            baud=self.baud,
            line_end={"lf": "\n", "crlf": "\r\n", "cr": "\r"}[self.line_end],
            answer_s=self.answer_s,
            start_s=self.start_s,
            ends=SensorWatch(self.ends) if self.ends else None,
        )
