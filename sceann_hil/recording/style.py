"""Colours of everything that is drawn: one palette for all screens, on a dark background."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.robot.drawing import Look

BACKGROUND = (18, 20, 24)
NOTHING = 0x121418FF
"""The background's colour."""

WALL = 0xB8C0CCFF
MARK = 0x8A93A0FF
TARGET = 0x2FA84FFF
TARGET_FILL = 0x1F6B35FF
PATH = 0x41638CFF
TRAIL = 0x5BC0EBFF
BODY = 0xF2A65AFF
BODY_DARK = 0x8A6A3CFF
NOSE = 0x1B1B1BFF
WHEEL = 0x3A4048FF
BLIND = 0x4A4F58FF
SOLID_WALL = 0x8B95A5FF
FLOOR = 0x23272EFF
LIMIT = 0x5A3A3AFF
CHAMPION = 0xFFF3B0FF
LABEL = 0xC9D1D9FF
FORCE = 0xE4572EFF

EXCITATORY = 0x59ABE3FF
INHIBITORY = 0xEE6352FF

BEST = 0x9AE66EFF
MEAN = 0x5BC0EBFF
EVERYONE = 0x7A8494FF
SUCCESS = 0xFFD670FF

_SIGNALS = (
    0xFF5D8FFF,
    0xFF9770FF,
    0xFFD670FF,
    0xE9FF70FF,
    0x70FFB5FF,
    0x70D6FFFF,
    0x9B8CFFFF,
    0xF4A259FF,
    0x5B8E7DFF,
    0x8CB3FFFF,
)
_MOTORS = (0xFF6B6BFF, 0x4ECDC4FF, 0xFFD670FF, 0x9B8CFFFF)

_RESTING = np.array([52, 56, 62])
_ACTIVE = np.array([255, 209, 102])


_LOOKS = {
    Look.WALL: WALL,
    Look.OBSTACLE: SOLID_WALL,
    Look.TARGET: TARGET_FILL,
    Look.LAMP: SUCCESS,
    Look.LINE: 0x05070AFF,
    Look.MARK: MARK,
    Look.LIMIT: LIMIT,
    Look.BODY: BODY,
    Look.NOSE: NOSE,
    Look.WHEEL: WHEEL,
    Look.CART: PATH,
    Look.TIP: FORCE,
}


def look_colour(look: Look) -> NDArray[np.uint32]:
    """The colour of a shape."""
    return colours(_LOOKS[look])


def shade_image(rows: NDArray[np.floating]) -> NDArray[np.uint8]:
    """A floor, 0 white to 1 black, as dark greys that leave the path visible; RGB, shape ``(*rows.shape, 3)``."""
    grey = (96.0 - 88.0 * np.clip(rows, 0.0, 1.0)).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=-1)


def colours(*values: int) -> NDArray[np.uint32]:
    """0xRRGGBBAA values as rerun takes them without guessing."""
    return np.array(values, np.uint32)


def signal_colours(count: int) -> NDArray[np.uint32]:
    """Colours of `count` sensor or neuron curves; they repeat after ten."""
    return colours(*(_SIGNALS[i % len(_SIGNALS)] for i in range(count)))


def motor_colours(count: int) -> NDArray[np.uint32]:
    """Colours of `count` motor curves; they repeat after four."""
    return colours(*(_MOTORS[i % len(_MOTORS)] for i in range(count)))


def part_colours(count: int) -> NDArray[np.uint32]:
    """Colours of `count` curves of a part that moves; they repeat after four."""
    palette = (BODY, TRAIL, BEST, SUCCESS)
    return colours(*(palette[i % len(palette)] for i in range(count)))


def packed(rgb: NDArray[np.floating | np.integer], alpha: int = 255) -> NDArray[np.uint32]:
    """Red, green and blue (0..255, last axis) as 0xRRGGBBAA, shape ``rgb.shape[:-1]``."""
    c = np.asarray(rgb).astype(np.uint32)
    return ((c[..., 0] << 24) | (c[..., 1] << 16) | (c[..., 2] << 8) | alpha).astype(np.uint32)


def activation_colours(values: NDArray[np.floating]) -> NDArray[np.uint32]:
    """Dark grey for 0 to bright amber for 1; any shape."""
    a = np.clip(values, 0.0, 1.0)[..., None]
    return packed(_RESTING * (1.0 - a) + _ACTIVE * a)


def resting_colour() -> NDArray[np.uint32]:
    """The colour of a node that says 0."""
    return activation_colours(np.zeros(1))


def rank_colours(count: int) -> NDArray[np.uint32]:
    """From red for the worst to blue for the best, shape ``(count,)``."""
    q = np.linspace(0.0, 1.0, max(count, 1))[:, None]
    return packed(np.array([238, 99, 82]) * (1.0 - q) + np.array([89, 171, 227]) * q)[:count]


_MAP = np.array([[68, 30, 110], [48, 104, 142], [53, 183, 121], [253, 231, 37]], np.float64)
_EMPTY = np.array([30, 33, 38], np.uint8)


def map_image(values: NDArray[np.floating], low: float, high: float) -> NDArray[np.uint8]:
    """From violet for `low` over green to yellow for `high`, dark for NaN; RGB, shape ``(*values.shape, 3)``."""
    place = np.clip((np.nan_to_num(values, nan=low) - low) / max(high - low, 1e-12), 0.0, 1.0) * (len(_MAP) - 1)
    image = np.stack([np.interp(place, np.arange(len(_MAP)), _MAP[:, c]) for c in range(3)], axis=-1)
    return np.where(np.isnan(values)[..., None], _EMPTY, image.round().astype(np.uint8))


def weight_image(weights: NDArray[np.integer]) -> NDArray[np.uint8]:
    """Blue for +1, red for -1, dark for 0; RGB, shape ``(*weights.shape, 3)``."""
    table = np.array([[238, 99, 82], [30, 33, 38], [89, 171, 227]], np.uint8)
    return np.asarray(table[np.asarray(weights) + 1])
