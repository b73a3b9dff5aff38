"""Small plug-ins of every shape that the configuration must cope with; conftest.py installs them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from sceann_hil.plugins import AlgorithmConfig, Misfit, RobotConfig, Section, TaskConfig
from sceann_hil.robot import Robot, RobotSpec


class Uniform(Section):
    uniform: tuple[float, float]
    """Lowest and highest value."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.uniform[0] > self.uniform[1]:
            raise ValueError(f"uniform: expected [lowest, highest], got {list(self.uniform)}")
        return self


class Normal(Section):
    normal: tuple[float, float]
    """Mean and standard deviation."""


Spread = float | Uniform | Normal


class Gap(Section):
    sensor_offset: Spread = 0.0
    """Added to every sensor."""
    motor_gain: Spread = 1.0
    """Factor on every motor."""
    latency_steps: Annotated[int, Field(ge=0)] = 0
    """Steps by which sensors are late."""

    @model_validator(mode="after")
    def _not_everything_late(self) -> Self:
        if self.latency_steps > 100:
            raise Misfit(f"latency_steps: expected at most 100, got {self.latency_steps}", "latency_steps")
        if self.latency_steps == 99:
            raise Misfit("ninety-nine is too beautiful")
        return self


class RoverConfig(RobotConfig):
    """A rover."""

    type: Literal["rover"] = "rover"
    n_sensors: Annotated[int, Field(ge=1)] = 3
    """Sensors."""
    tick_s: Annotated[float, Field(gt=0.0)] = 0.1
    """Control step."""
    attended: bool = False
    """Somebody stands beside it."""
    port: str = "loop"
    """Where it is connected."""
    gap: Gap = Gap()
    """What differs from the ideal body."""

    @property
    def spec(self) -> RobotSpec:
        return RobotSpec("rover", self.n_sensors, 2, self.tick_s, ("x_m", "y_m"), ("x_m", "y_m"), self.attended)

    def build(self) -> Robot:
        raise NotImplementedError


class StiltConfig(RobotConfig):
    """A robot whose number of sensors is not a key."""

    type: Literal["stilt"] = "stilt"

    @property
    def spec(self) -> RobotSpec:
        return RobotSpec("stilt", 4, 1, 0.02, ("angle_rad",), ("angle_rad",))

    def build(self) -> Robot:
        raise NotImplementedError


class ReachConfig(TaskConfig):
    """Reach something, with a rover."""

    type: Literal["reach"] = "reach"
    max_steps: Annotated[int, Field(ge=1, le=10_000)] = 200
    """Steps."""
    start_m: tuple[float, float] = (0.0275, 0.0275)
    """Where it starts."""
    headings_deg: Annotated[tuple[float, ...], Field(min_length=1, max_length=8)] = (0.0, 90.0)
    """How it starts."""

    def build(self) -> Any:
        raise NotImplementedError

    def check(self, robot: RobotConfig) -> None:
        if robot.spec.start_fields != ("x_m", "y_m"):
            raise ValueError(f"reach needs a robot that drives in the plane, got {robot.type}")
        if isinstance(robot, RoverConfig) and robot.tick_s > self.max_steps:
            raise Misfit("one step would be longer than the trial", "robot.tick_s", "task.max_steps")


class StandConfig(TaskConfig):
    """Stand still, with anything."""

    type: Literal["stand"] = "stand"
    max_steps: Annotated[int, Field(ge=1)]
    """Steps; there is no default."""

    def build(self) -> Any:
        raise NotImplementedError


class ClimbConfig(AlgorithmConfig):
    """Climb."""

    type: Literal["climb"] = "climb"
    population: Annotated[int, Field(ge=2)] = 25
    generations: Annotated[int, Field(ge=0)] = 50
    tournament: Annotated[int, Field(ge=1)] = 2
    """Contestants."""
    elites: Annotated[int, Field(ge=0)] = 1
    """Unchanged individuals."""
    mutation_rate: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    """Probability of a flip; null means 1/L."""
    step_bits: int = 1
    """Must divide the genome's length."""

    @model_validator(mode="after")
    def _elites_leave_room(self) -> Self:
        if self.elites >= self.population:
            raise ValueError(f"elites: expected fewer than population ({self.population}), got {self.elites}")
        return self

    def build(self, genome_length: int) -> Any:
        if genome_length % self.step_bits:
            raise ValueError(
                f"step_bits: expected a divisor of the genome's {genome_length} bits, got {self.step_bits}"
            )
