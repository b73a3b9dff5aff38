"""A simulated cart with a pole: Katada & Nakazawa, Section IV, with the standard frictionless equations."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from functools import cached_property
from typing import Annotated, Any, Literal

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
LARGEST_ANGLE_DEG = 36.0

_F = np.float32
_G = _F(GRAVITY_M_S2)
_FELL = int(EndReason.FELL)
_OUT = int(EndReason.OUT_OF_BOUNDS)
(
    _TICK,
    _IMPLICIT,
    _HALF_V,
    _HALF_W,
    _FORCE,
    _MASS,
    _POLE,
    _MOMENT,
    _LENGTH,
    _TRACK,
    _ANGLE,
    _CART_FRICTION,
    _POLE_FRICTION,
) = range(13)


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
    track, largest, half_v, half_w = parameters[_TRACK], parameters[_ANGLE], parameters[_HALF_V], parameters[_HALF_W]
    for lane in range(LANES):
        sensors[0, lane] = (state[0, lane] + track) / (_F(2.0) * track)
        sensors[1, lane] = (state[2, lane] + largest) / (_F(2.0) * largest)
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
    tick, implicit = parameters[_TICK], parameters[_IMPLICIT]
    mass, pole, moment, length = parameters[_MASS], parameters[_POLE], parameters[_MOMENT], parameters[_LENGTH]
    for lane in range(LANES):
        x, v, angle, rate = state[0, lane], state[1, lane], state[2, lane], state[3, lane]
        force = parameters[_FORCE] * (_F(2.0) * motors[0, lane] - _F(1.0)) - parameters[_CART_FRICTION] * v
        s, c = sine(angle), cosine(angle)
        thrust = (force + moment * rate * rate * s) / mass
        turning = _G * s - c * thrust - parameters[_POLE_FRICTION] * rate / moment
        angular = turning / (length * (_F(4.0 / 3.0) - pole * c * c / mass))
        linear = thrust - moment * angular * c / mass
        new_v = v + tick * linear
        new_rate = rate + tick * angular
        x = x + tick * (v + implicit * (new_v - v))
        angle = angle + tick * (rate + implicit * (new_rate - rate))
        state[0, lane], state[1, lane], state[2, lane], state[3, lane] = x, new_v, angle, new_rate
        end = np.int32(_FELL) if abs(angle) > parameters[_ANGLE] else np.int32(RUNNING)
        end_reasons[lane] = np.int32(_OUT) if abs(x) > parameters[_TRACK] else end


_USUAL: Mapping[str, Any] = {
    "gap.sensor_offset": {"normal": [0.0, 0.005]},
    "gap.sensor_gain": {"normal": [1.0, 0.02]},
    "gap.sensor_noise": 0.001,
    "gap.motor_gain": {"normal": [1.0, 0.1]},
    "gap.motor_dead_band": {"uniform": [0.0, 0.05]},
    "gap.latency_steps": {"uniform": [0.0, 1.49]},
}
"""A position and an angle by potentiometer or encoder, a belt drive; docs/transfer.md gives the reasons."""
_Positive = Annotated[float, Field(gt=0.0)]


class CartPoleConfig(RobotConfig):
    """A simulated cart with a pole."""

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
    cart_kg: _Positive = 1.0
    """Mass of the cart."""
    pole_kg: _Positive = 0.1
    """Mass of the pole, an even rod."""
    pole_half_length_m: _Positive = 0.5
    """From the pole's pivot to its middle."""
    largest_force_n: _Positive = 10.0
    """Force on the cart at motor value 1; as much the other way at 0."""
    track_m: _Positive = 2.4
    """From the middle of the track to each of its ends; positions in between are scaled to [0, 1]."""
    largest_angle_deg: Annotated[float, Field(gt=0.0, lt=90.0)] = LARGEST_ANGLE_DEG
    """From upright; beyond it the pole has fallen. Angles up to it are scaled to [0, 1]."""
    cart_friction_n_s_m: Annotated[float, Field(ge=0.0)] = 0.0
    """Force against the cart's motion for each metre per second."""
    pole_friction_n_m_s: Annotated[float, Field(ge=0.0)] = 0.0
    """Torque against the pole's turning for each radian per second."""
    gap: GapConfig = GapConfig()
    """How the body differs from the ideal one."""

    @property
    def usual_uncertainty(self) -> Mapping[str, Any]:
        return _USUAL

    def values_of(self, key: str) -> int:
        return values_of_gap(key, self.n_sensors, 1)

    @property
    def spec(self) -> RobotSpec:
        return self.build().spec

    def build(self) -> CartPole:
        return CartPole(self)


class CartPole(SimulatedRobot):
    """Cart and pole on a track. One motor: force = largest force (2 m - 1).

    Args:
        config: sensors, times, scales, masses and lengths.
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
        config = self._config
        return _drawing(config.track_m, 2.0 * config.pole_half_length_m, float(np.deg2rad(config.largest_angle_deg)))

    @cached_property
    def parameters(self) -> NDArray[np.float32]:
        config = self._config
        values = {
            _TICK: config.tick_s,
            _IMPLICIT: float(config.integrator is Integrator.SEMI_IMPLICIT_EULER),
            _HALF_V: config.velocity_range_m_s,
            _HALF_W: config.angular_velocity_range_rad_s,
            _FORCE: config.largest_force_n,
            _MASS: config.cart_kg + config.pole_kg,
            _POLE: config.pole_kg,
            _MOMENT: config.pole_kg * config.pole_half_length_m,
            _LENGTH: config.pole_half_length_m,
            _TRACK: config.track_m,
            _ANGLE: np.deg2rad(config.largest_angle_deg),
            _CART_FRICTION: config.cart_friction_n_s_m,
            _POLE_FRICTION: config.pole_friction_n_m_s,
        }
        return np.array([values[place] for place in range(len(values))], np.float32)


def _drawing(end: float, length: float, limit: float) -> Drawing:
    """Cart and pole from the side, the track's ends, and the angles at which the pole has fallen."""
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
