"""A simulated two-wheeled robot in a walled arena with a target: Katada & Nakazawa, Section III, Eq. (4).

The paper leaves geometry, speed and sensors open; the defaults are ours, and ``docs/reproduction.md`` says what they
were chosen by. The infrared sensors see the target only: a robot that does this needs a beacon on the target. With a
`world` the same robot sees walls, obstacles, lamps and the floor (`backends.world`).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from backends.simulation.engine import SimulatedRobot
from backends.simulation.gap import Gap
from backends.simulation.lanes import RUNNING
from backends.simulation.maths import arctangent2, cosine, sine, wrap_angle
from backends.simulation.settings import GapConfig, values_of_gap
from backends.world.body import WorldDrive
from backends.world.config import WorldConfig
from backends.world.layout import Motion
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES
from sceann_hil.plugins import Misfit, RobotConfig
from sceann_hil.robot import EndReason, RobotSpec
from sceann_hil.robot.drawing import Disc, Distance, Drawing, Fan, Look, Phases, arena_walls, round_robot

_F = np.float32
_GOAL = int(EndReason.GOAL)
_STEP_M, _RADIUS, _WIDTH, _HEIGHT, _TARGET_X, _TARGET_Y, _TARGET_RADIUS, _HALF_WIDTH, _REFERENCE, _NOISE = range(10)
_FIRST_SENSOR = 10


@compiled_part
def _sense(
    state: NDArray[np.float32],
    sensors: NDArray[np.float32],
    work: NDArray[np.float32],
    parameters: NDArray[np.float32],
) -> None:
    radii = parameters[_RADIUS] + parameters[_TARGET_RADIUS]
    for lane in range(LANES):
        dx = parameters[_TARGET_X] - state[0, lane]
        dy = parameters[_TARGET_Y] - state[1, lane]
        distance = np.sqrt(dx * dx + dy * dy)
        work[0, lane] = wrap_angle(arctangent2(dy, dx) - state[2, lane])
        # the target's angular radius asin(r / d) as an arctangent, and a full half turn from inside it
        rest = distance * distance - parameters[_TARGET_RADIUS] * parameters[_TARGET_RADIUS]
        work[1, lane] = parameters[_HALF_WIDTH] + arctangent2(parameters[_TARGET_RADIUS], np.sqrt(max(rest, _F(0.0))))
        gap_m = max(distance - radii, _F(1e-6))
        work[2, lane] = min(parameters[_REFERENCE] / gap_m, _F(1.0))
    for j in range(sensors.shape[0]):
        direction = parameters[_FIRST_SENSOR + j]
        for lane in range(LANES):
            off_axis = abs(wrap_angle(work[0, lane] - direction))
            sensors[j, lane] = work[2, lane] if off_axis <= work[1, lane] else _F(0.0)


@compiled_part
def _advance(
    state: NDArray[np.float32],
    motors: NDArray[np.float32],
    noise: NDArray[np.float32],
    end_reasons: NDArray[np.int32],
    work: NDArray[np.float32],
    parameters: NDArray[np.float32],
) -> None:
    radius, level = parameters[_RADIUS], parameters[_NOISE]
    reach = radius + parameters[_TARGET_RADIUS]
    for lane in range(LANES):
        left = parameters[_STEP_M] * motors[0, lane]
        right = parameters[_STEP_M] * motors[1, lane]
        heading = state[2, lane]
        forward = _F(0.5) * (right + left)
        dx = forward * cosine(heading)
        dy = forward * sine(heading)
        turn = (right - left) / (_F(2.0) * radius)
        x = state[0, lane] + dx + level * abs(dx) * noise[0, lane]
        y = state[1, lane] + dy + level * abs(dy) * noise[1, lane]
        heading = heading + turn + level * abs(turn) * noise[2, lane]
        x = min(max(x, radius), parameters[_WIDTH] - radius)
        y = min(max(y, radius), parameters[_HEIGHT] - radius)
        state[0, lane], state[1, lane], state[2, lane] = x, y, wrap_angle(heading)
        gx, gy = parameters[_TARGET_X] - x, parameters[_TARGET_Y] - y
        at_goal = gx * gx + gy * gy <= reach * reach
        end_reasons[lane] = np.int32(_GOAL) if at_goal else np.int32(RUNNING)


_Positive = Annotated[float, Field(gt=0.0)]
_PAPER_ONLY = ("n_sensors", "sensor_field_deg", "sensor_half_width_deg", "sensor_reference_m")


_USUAL: Mapping[str, Any] = {
    "gap.sensor_offset": {"normal": [0.0, 0.01]},
    "gap.sensor_gain": {"normal": [1.0, 0.1]},
    "gap.sensor_noise": 0.01,
    "gap.motor_gain": {"uniform": [0.6, 1.2]},
    "gap.motor_dead_band": {"uniform": [0.0, 0.2]},
    "gap.latency_steps": {"uniform": [0.0, 2.49]},
    "motion_noise": {"uniform": [0.05, 0.2]},
}
"""Tolerances of cheap parts; docs/transfer.md gives the reasons."""
_USUAL_WITH_TARGET_ONLY: Mapping[str, Any] = {
    "radius_m": {"scaled": [0.85, 1.2]},
    "sensor_half_width_deg": {"scaled": [0.7, 1.4]},
    "sensor_reference_m": {"scaled": [0.6, 1.5]},
}
"""The same of the paper's sensors, and of the wheel base where the radius stands for it."""


class DifferentialDriveConfig(RobotConfig):
    """A simulated two-wheeled robot in a walled arena with a target."""

    type: Literal["diffdrive"] = "diffdrive"
    n_sensors: Annotated[int, Field(ge=1, le=20)] = 7
    """Infrared sensors, spread over the frontal field."""
    tick_s: Annotated[float, Field(gt=0.0, le=10.0)] = 0.2
    """Control step, seconds."""
    radius_m: _Positive = 0.0275
    """Radius of the robot; half the distance between its wheels."""
    top_speed_m_s: _Positive = 0.08
    """Speed of a wheel at motor value 1."""
    arena_m: tuple[_Positive, _Positive] = (0.6, 0.6)
    """Width and height of the arena."""
    target_m: tuple[float, float] = (0.55, 0.55)
    """Centre of the target."""
    target_radius_m: _Positive = 0.05
    """Radius of the target."""
    sensor_field_deg: Annotated[float, Field(gt=0.0, le=360.0)] = 120.0
    """Frontal field; each sensor looks along the middle of an equal part of it."""
    sensor_half_width_deg: Annotated[float, Field(gt=0.0, le=180.0)] = 15.0
    """Half opening of a sensor's cone; the target's angular radius is added."""
    sensor_reference_m: _Positive = 0.05
    """Distance D0 up to which a sensor reads 1; beyond, it reads D0 / distance."""
    motion_noise: Annotated[float, Field(ge=0.0, le=1.0)] = 0.1
    """Standard deviation of the motion errors, as a part of each step's displacement."""
    world: WorldConfig | None = None
    """What stands in the arena and what the robot feels of it, instead of the paper's sensors for the target."""
    gap: GapConfig = GapConfig()
    """How the body differs from the ideal one."""

    @property
    def usual_uncertainty(self) -> Mapping[str, Any]:
        if self.world is not None:
            return {**_USUAL, **self.world.usual_uncertainty(self.radius_m)}
        return {**_USUAL, **_USUAL_WITH_TARGET_ONLY}

    def values_of(self, key: str) -> int:
        return values_of_gap(key, self.spec.n_sensors, 2)

    @property
    def spec(self) -> RobotSpec:
        for axis, centre, length in zip("xy", self.target_m, self.arena_m, strict=True):
            if not 0.0 <= centre <= length:
                raise Misfit(
                    f"target_m: expected {axis} in 0..{length:g} m (inside the arena), got {centre:g}", "target_m"
                )
        if 2.0 * self.radius_m > min(self.arena_m):
            raise Misfit(f"arena_m: expected more than the robot's diameter {2 * self.radius_m:g} m", "arena_m")
        if self.world is not None:
            fields = type(self).model_fields
            given = [name for name in _PAPER_ONLY if getattr(self, name) != fields[name].default]
            if given:
                raise Misfit(f"{given[0]}: expected nothing here beside world, which has the sensors", *given)
            self.world.check(self.arena_m, self.target_m, self.target_radius_m)
        return self.build().spec

    def refuses_start(self, start: Mapping[str, float]) -> str:
        point = (start["x_m"], start["y_m"])
        for axis, value, length in zip("xy", point, self.arena_m, strict=True):
            low, high = self.radius_m, length - self.radius_m
            if not low <= value <= high:
                return f"expected {axis} in {low:g}..{high:g} m (inside the arena), got {value:g}"
        if self.world is None:
            return ""
        thing = self.world.standing_in(point, self.radius_m, self.target_m, self.target_radius_m)
        return f"expected a free place, got [{point[0]:g}, {point[1]:g}], where {thing}" if thing else ""

    def build(self) -> DifferentialDrive | WorldDrive:
        if self.world is not None:
            return self._in_world(self.world)
        return DifferentialDrive(self)

    def _in_world(self, world: WorldConfig) -> WorldDrive:
        senses = world.senses(self.radius_m)
        motion = Motion(
            step_m=self.top_speed_m_s * self.tick_s,
            radius_m=self.radius_m,
            wheel_interval_m=world.wheel_interval_m or 2.0 * self.radius_m,
            noise=self.motion_noise,
            backwards=world.backwards,
            bump_ends=world.bump == "end",
        )
        return WorldDrive(
            world.world(self.arena_m, self.target_m, self.target_radius_m),
            senses,
            motion,
            self.tick_s,
            self.gap.build(senses.count, 2),
        )


class DifferentialDrive(SimulatedRobot):
    """A round robot with two wheels, wheel interval 2R. Motors: left, right; speed = top speed * m, m in 0..1.

    A wall is slid along: the coordinate that would leave the arena is clamped. The goal is reached when the bodies of
    robot and target touch.

    Args:
        config: the robot, its arena and the target; without a `world`, whose body is another one.
        gap: the body's imperfections, where they are not those of `config`.
        threads: cores to use; None for all.

    Raises:
        ValueError: `config` has a world; its `build` makes that body.
    """

    sense = staticmethod(_sense)
    advance = staticmethod(_advance)
    n_noise = 3

    def __init__(
        self,
        config: DifferentialDriveConfig = DifferentialDriveConfig(),  # noqa: B008
        *,
        gap: Gap | None = None,
        threads: int | None = None,
    ) -> None:
        if config.world is not None:
            raise ValueError("world: expected none for this body; build() of the configuration makes the one with it")
        super().__init__(config.gap.build(config.n_sensors, 2) if gap is None else gap, threads)
        self._config, self.draws_noise = config, config.motion_noise > 0.0
        n_sensors = config.n_sensors
        self._spec = RobotSpec(
            name="diffdrive",
            n_sensors=n_sensors,
            n_motors=2,
            tick_s=config.tick_s,
            start_fields=("x_m", "y_m", "heading_rad"),
            state_fields=("x_m", "y_m", "heading_rad"),
            noise_free=self.gap.is_none and config.motion_noise == 0.0,
        )
        self._half_width_rad = float(np.deg2rad(config.sensor_half_width_deg))
        part = np.deg2rad(config.sensor_field_deg) / n_sensors
        self._directions_rad = (np.arange(n_sensors) - (n_sensors - 1) / 2) * part

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    @property
    def drawing(self) -> Drawing:
        config, (width, height) = self._config, self._config.arena_m
        directions = self._directions_rad.tolist()
        fans = (Fan((0.0, 0.0), a, self._half_width_rad, 0.3 * max(config.arena_m)) for a in directions)
        curves = Distance("distance to the target [m]", config.target_m)
        margin = max(config.arena_m) / 40
        return Drawing(
            title="Arena",
            bounds_m=(-margin, width + margin, -margin, height + margin),
            fixed=(arena_walls(width, height), Disc(config.target_m, config.target_radius_m, Look.TARGET)),
            parts=(round_robot(config.radius_m, tuple(fans), curves=curves),),
            from_above=True,
            phases=Phases("target in sight", "blind", "at the target"),
            sensor_names=tuple(f"{np.rad2deg(a):+.0f}°" if abs(a) > 1e-9 else "0°" for a in directions),
            motor_names=("left", "right"),
        )

    @cached_property
    def parameters(self) -> NDArray[np.float32]:
        config = self._config
        fixed = (
            config.top_speed_m_s * config.tick_s,
            config.radius_m,
            *config.arena_m,
            *config.target_m,
            config.target_radius_m,
            self._half_width_rad,
            config.sensor_reference_m,
            config.motion_noise,
        )
        return np.array([*fixed, *self._directions_rad], np.float32)
