"""Obstacles that stand somewhere else in every trial, drawn from the trial's own key of the seed tree.

Their places are part of the body's state, so they are in the journal and in every trace, and pictures follow them. A
trial's start is known before they are placed: none stands where the robot begins, or on its target.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from backends.world.distances import to_box, to_round
from sceann_hil.errors import ConfigError
from sceann_hil.seeds import Purpose, keys, uniforms

Point = tuple[float, float]
Range = tuple[float, float]
Floats = NDArray[np.float64]

MOST_DRAWS = 100
"""Draws of one place; where none of them is free, the trial is refused."""
_TRIED = 500
"""Places that are tried beforehand."""
LEAST_FREE = 0.2
"""Of the places tried beforehand; then a hundred draws are all occupied once in 5 * 10^9 trials."""
_MARGIN_M = 1e-6
"""More than the rounding of the body's arithmetic, so that no trial begins with a bump."""


@dataclass(frozen=True, slots=True)
class DrawnObstacle:
    """An obstacle, and where it may stand: its centre and, of a rectangular one, how far it is turned.

    Attributes:
        number: its place in the list of obstacles; it names its fields of the state and its stream of the seed tree.
        x_m: of its centre, from and to.
        y_m: of its centre, from and to.
        radius_m: of a round one.
        size_m: width and height of a rectangular one.
        angle_rad: of a rectangular one, from and to.
    """

    number: int
    x_m: Range
    y_m: Range
    radius_m: float | None = None
    size_m: Point | None = None
    angle_rad: Range = (0.0, 0.0)

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of its fields of the body's state."""
        name = f"obstacle{self.number}"
        return (f"{name}_x_m", f"{name}_y_m", *((f"{name}_rad",) if self.size_m is not None else ()))

    def places(self, stream_keys: NDArray[np.uint64]) -> Floats:
        """A place for each key, in the order of `fields`, rounded as the body has it; shape ``(n, 2 or 3)``."""
        low, high = np.array([self.x_m, self.y_m, self.angle_rad]).T
        places = low + (high - low) * uniforms(stream_keys, 3)
        # the body's sine and cosine are for -pi..pi
        places[:, 2] -= 2.0 * np.pi * np.floor(places[:, 2] / (2.0 * np.pi) + 0.5)
        return np.asarray(places[:, : len(self.fields)].astype(np.float32), np.float64)

    def distance_m(self, places: Floats, x_m: Floats | float, y_m: Floats | float) -> Floats:
        """From its edge, when it stands at these places, to points; shape ``(n,)``."""
        dx, dy = x_m - places[:, 0], y_m - places[:, 1]
        if self.size_m is not None:
            return to_box(dx, dy, self.size_m, places[:, 2])
        return to_round(dx, dy, self.radius_m or 0.0)


@dataclass(frozen=True, slots=True)
class KeptFree:
    """Where no drawn obstacle may stand.

    Attributes:
        radius_m: of the robot, around its start.
        target_m: centre of the target; None if there is none.
        target_radius_m: its radius.
    """

    radius_m: float
    target_m: Point | None = None
    target_radius_m: float = 0.0

    def blocked(self, thing: DrawnObstacle, places: Floats, x_m: Floats | float, y_m: Floats | float) -> Floats:
        """Whether the obstacle would stand in the way, place by place, for robots that start at (x, y)."""
        blocked = thing.distance_m(places, x_m, y_m) < self.radius_m + _MARGIN_M
        if self.target_m is not None:
            blocked |= thing.distance_m(places, *self.target_m) < self.target_radius_m
        return np.asarray(blocked)

    def free(self, thing: DrawnObstacle, x_m: float, y_m: float) -> float:
        """The part of its places where the obstacle would leave a start and the target free."""
        places = thing.places(np.arange(_TRIED, dtype=np.uint64))
        return 1.0 - float(self.blocked(thing, places, x_m, y_m).mean())


def placed(
    things: Sequence[DrawnObstacle], kept: KeptFree, starts: Floats, noise: NDArray[np.uint64]
) -> tuple[Floats, ...]:
    """Where each obstacle stands in some trials, each of shape ``(n, 2 or 3)`` in the order of its fields.

    Args:
        things: the obstacles.
        kept: what they leave free.
        starts: where the robots start, x and y first, shape ``(n, 2 or more)``.
        noise: the trials' keys, shape ``(n,)``.

    Raises:
        ConfigError: `MOST_DRAWS` places of an obstacle stood in the way.
    """
    return tuple(_places(thing, kept, starts, noise) for thing in things)


def _places(thing: DrawnObstacle, kept: KeptFree, starts: Floats, noise: NDArray[np.uint64]) -> Floats:
    found = np.empty((len(starts), len(thing.fields)))
    left = np.arange(len(starts))
    for number in range(MOST_DRAWS):
        found[left] = thing.places(keys(noise[left], Purpose.OBSTACLE, thing.number, number))
        left = left[kept.blocked(thing, found[left], starts[left, 0], starts[left, 1])]
        if not len(left):
            return found
    x_m, y_m = starts[left[0], :2]
    raise ConfigError(
        f"world.obstacles[{thing.number}]: {MOST_DRAWS} places were drawn for it and none leaves the robot's start "
        f"[{x_m:g}, {y_m:g}] and the target free.",
        "The trial was not begun. Choose ranges with more free places.",
    )
