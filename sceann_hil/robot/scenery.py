"""What a robot and its surroundings look like: geometry for viewers and start-pose pictures, nothing that moves."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ArenaScenery:
    """A round robot in a rectangle ``[0, width] x [0, height]`` with a round target.

    Attributes:
        arena_m: width and height.
        target_m: centre of the target.
        target_radius_m: its radius.
        body_radius_m: the robot's radius; half the wheel interval.
        sensor_directions_rad: middles of the sensors' cones, counter-clockwise from straight ahead.
        sensor_half_width_rad: half opening of a cone.
    """

    arena_m: tuple[float, float]
    target_m: tuple[float, float]
    target_radius_m: float
    body_radius_m: float
    sensor_directions_rad: tuple[float, ...]
    sensor_half_width_rad: float


@dataclass(frozen=True, slots=True)
class CartPoleScenery:
    """A cart on a track with a pole.

    Attributes:
        track_m: the cart's position may be from minus to plus this.
        largest_angle_rad: beyond it the pole has fallen.
        pole_m: full length of the pole.
        largest_force_n: force at motor value 1 (and minus that at 0).
    """

    track_m: float
    largest_angle_rad: float
    pole_m: float
    largest_force_n: float


Scenery = ArenaScenery | CartPoleScenery
