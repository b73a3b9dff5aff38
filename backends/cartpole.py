"""A simulated cart with a pole: Katada & Nakazawa, Section IV, with the standard frictionless equations."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from backends.simulation.engine import SimulatedRobot
from backends.simulation.gap import Gap
from backends.simulation.lanes import RUNNING
from backends.simulation.maths import cosine, sine
from backends.simulation.settings import GapConfig, values_of_gap
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES
from sceann_hil.plugins import RobotConfig
from sceann_hil.robot import EndReason, RobotSpec
from sceann_hil.robot.drawing import Arrow, Curve, Disc, Drawing, Look, Part, Strip, Swing

GRAVITY_M_S2 = 9.8
CART_KG = 1.0
POLE_KG = 0.1
POLE_HALF_LENGTH_M = 0.5
LARGEST_FORCE_N = 10.0
TRACK_M = 2.4
LARGEST_ANGLE_RAD = np.deg2rad(36.0)

_F = np.float32
_G = _F(GRAVITY_M_S2)
_LENGTH = _F(POLE_HALF_LENGTH_M)
_POLE_MOMENT = _F(POLE_KG * POLE_HALF_LENGTH_M)
_MASS = _F(CART_KG + POLE_KG)
_TRACK = _F(TRACK_M)
_ANGLE = _F(LARGEST_ANGLE_RAD)
_FELL = int(EndReason.FELL)
_OUT = int(EndReason.OUT_OF_BOUNDS)


class Integrator(StrEnum):
    """How a tick's accelerations become motion."""

    EULER = "euler"
    """Positions move with the old velocities (the paper's "Euler's method")."""
    SEMI_IMPLICIT_EULER = "semi_implicit_euler"
    """Positions move with the new velocities."""


@compiled_part
def _sense(
    state: NDArray[np.float32],
    sensors: NDArray[np.float32],
    work: NDArray[np.float32],
    parameters: NDArray[np.float32],
) -> None:
    half_v, half_w = parameters[2], parameters[3]
    for lane in range(LANES):
        sensors[0, lane] = (state[0, lane] + _TRACK) / (_F(2.0) * _TRACK)
        sensors[1, lane] = (state[2, lane] + _ANGLE) / (_F(2.0) * _ANGLE)
    if sensors.shape[0] == 4:
        for lane in range(LANES):
            sensors[2, lane] = (state[1, lane] + half_v) / (_F(2.0) * half_v)
            sensors[3, lane] = (state[3, lane] + half_w) / (_F(2.0) * half_w)


@compiled_part
def _advance(
    state: NDArray[np.float32],
    motors: NDArray[np.float32],
    noise: NDArray[np.float32],
    end_reasons: NDArray[np.int32],
    work: NDArray[np.float32],
    parameters: NDArray[np.float32],
) -> None:
    tick = parameters[0]
    implicit = parameters[1]
    for lane in range(LANES):
        x, v, angle, rate = state[0, lane], state[1, lane], state[2, lane], state[3, lane]
        force = _F(LARGEST_FORCE_N) * (_F(2.0) * motors[0, lane] - _F(1.0))
        s, c = sine(angle), cosine(angle)
        thrust = (force + _POLE_MOMENT * rate * rate * s) / _MASS
        angular = (_G * s - c * thrust) / (_LENGTH * (_F(4.0 / 3.0) - _F(POLE_KG) * c * c / _MASS))
        linear = thrust - _POLE_MOMENT * angular * c / _MASS
        new_v = v + tick * linear
        new_rate = rate + tick * angular
        x = x + tick * (v + implicit * (new_v - v))
        angle = angle + tick * (rate + implicit * (new_rate - rate))
        state[0, lane], state[1, lane], state[2, lane], state[3, lane] = x, new_v, angle, new_rate
        end = np.int32(_FELL) if abs(angle) > _ANGLE else np.int32(RUNNING)
        end_reasons[lane] = np.int32(_OUT) if abs(x) > _TRACK else end


class CartPoleConfig(RobotConfig):
    """A simulated cart with a pole."""

    usual_uncertainty: ClassVar[Mapping[str, Any]] = {
        "gap.sensor_offset": {"normal": [0.0, 0.005]},
        "gap.sensor_gain": {"normal": [1.0, 0.02]},
        "gap.sensor_noise": 0.001,
        "gap.motor_gain": {"normal": [1.0, 0.1]},
        "gap.motor_dead_band": {"uniform": [0.0, 0.05]},
        "gap.latency_steps": {"uniform": [0.0, 1.49]},
    }
    """A position and an angle by potentiometer or encoder, a belt drive; docs/transfer.md gives the reasons."""

    type: Literal["cartpole"] = "cartpole"
    n_sensors: Literal[2, 4] = 2
    """2: position and angle; 4: also their velocities."""
    tick_s: Annotated[float, Field(gt=0.0, le=1.0)] = 0.02
    """Control step, seconds."""
    integrator: Integrator = Integrator.EULER
    """euler (the paper's) or semi_implicit_euler."""
    velocity_range_m_s: Annotated[float, Field(gt=0.0)] = 3.0
    """Cart velocities from minus to plus this are scaled to [0, 1]."""
    angular_velocity_range_rad_s: Annotated[float, Field(gt=0.0)] = 3.5
    """Pole velocities from minus to plus this are scaled to [0, 1]."""
    gap: GapConfig = GapConfig()
    """How the body differs from the ideal one."""

    def values_of(self, key: str) -> int:
        return values_of_gap(key, self.n_sensors, 1)

    @property
    def spec(self) -> RobotSpec:
        return self.build().spec

    def build(self) -> CartPole:
        return CartPole(self)


class CartPole(SimulatedRobot):
    """Cart and pole on a track of 4.8 m. One motor: force = 10 N (2 m - 1).

    Args:
        config: sensors, times and scales.
        gap: the body's imperfections, where they are not those of `config`.
        threads: cores to use; None for all.
    """

    sense = staticmethod(_sense)
    advance = staticmethod(_advance)
    neutral_motor = 0.5

    def __init__(
        self,
        config: CartPoleConfig = CartPoleConfig(),  # noqa: B008
        *,
        gap: Gap | None = None,
        threads: int | None = None,
    ) -> None:
        super().__init__(config.gap.build(config.n_sensors, 1) if gap is None else gap, threads)
        self._config = config
        self._spec = RobotSpec(
            name="cartpole",
            n_sensors=config.n_sensors,
            n_motors=1,
            tick_s=config.tick_s,
            start_fields=("x_m", "velocity_m_s", "angle_rad", "angular_velocity_rad_s"),
            state_fields=("x_m", "velocity_m_s", "angle_rad", "angular_velocity_rad_s"),
            noise_free=self.gap.is_none,
        )

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    @property
    def drawing(self) -> Drawing:
        return _drawing()

    @cached_property
    def parameters(self) -> NDArray[np.float32]:
        config = self._config
        implicit = float(config.integrator is Integrator.SEMI_IMPLICIT_EULER)
        ranges = (config.velocity_range_m_s, config.angular_velocity_range_rad_s)
        return np.array([config.tick_s, implicit, *ranges], np.float32)


def _drawing() -> Drawing:
    """Cart and pole from the side, the track's ends, and the angles at which the pole has fallen."""
    end, length, limit = TRACK_M, 2.0 * POLE_HALF_LENGTH_M, float(LARGEST_ANGLE_RAD)
    rail_y = -0.11
    posts = (Strip(((s * end, rail_y - 0.1), (s * end, 0.15)), 0.024, Look.WALL) for s in (-1.0, 1.0))
    marks = (
        Strip(((x, rail_y), (x, rail_y - 0.05)), 0.01, Look.MARK)
        for x in (np.arange(np.ceil(-end / 0.5), np.floor(end / 0.5) + 1) * 0.5).tolist()
    )
    rays = (
        Strip(((0.0, 0.0), (1.15 * length * float(np.sin(a)), 1.15 * length * float(np.cos(a)))), 0.012, Look.LIMIT)
        for a in (-limit, limit)
    )
    cart = Part(
        "cart",
        (
            *rays,
            Strip(((-0.16, 0.0), (0.16, 0.0)), 0.15, Look.CART),
            Disc((-0.12, -0.07), 0.035, Look.MARK),
            Disc((0.12, -0.07), 0.035, Look.MARK),
        ),
        x="x_m",
        arrow=Arrow(motor=0, length_m=0.6),
        curves=(Curve("x [m]", "x_m"), Curve("speed [m/s]", "velocity_m_s")),
    )
    to_deg = 180.0 / np.pi
    pole = Part(
        "pole",
        (
            Strip(((0.0, 0.0), (0.0, length)), 0.044, Look.BODY),
            Disc((0.0, length), 0.045, Look.TIP),
            Disc((0.0, 0.0), 0.03, Look.WALL),
        ),
        turn="angle_rad",
        clockwise=True,
        on="cart",
        curves=(
            Curve("angle [deg]", "angle_rad", to_deg),
            Curve("rate [10 deg/s]", "angular_velocity_rad_s", to_deg / 10.0),
        ),
    )
    return Drawing(
        title="Cart and pole",
        bounds_m=(-end - 0.2, end + 0.2, -0.35 * length, 1.35 * length),
        fixed=(Strip(((-end, rail_y), (end, rail_y)), 0.024, Look.WALL), *posts, *marks),
        parts=(cart, pole),
        swing=Swing("Pole angle over time", "angle_rad", limit, f"{np.rad2deg(limit):.0f}°"),
        sensor_names=("x", "angle", "speed", "rate"),
        motor_names=("force",),
    )
