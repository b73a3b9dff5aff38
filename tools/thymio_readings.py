"""Takes readings from the makers' simulator of the Thymio II (Enki) and fits the simulated twin's response to them.

    apt-get install python3-enki2
    .venv/bin/python tools/thymio_readings.py            # writes backends/thymio/readings.py
    .venv/bin/python tools/thymio_readings.py --check    # compares it with what stands there

Infrared: at many distances and angles to a wall, and around a thin post, the sum over a sensor's three rays of a curve
of distance, one for the middle ray and one for the two beside it, found by least squares. Ground: over black and white.
Motors: the speed at a target.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from backends.thymio.geometry import INFRARED, RANGE_M, RAY_ANGLES_RAD
from backends.world.layout import NODES

OUTPUT = Path(__file__).parents[1] / "backends" / "thymio" / "readings.py"
SIZE_CM = 200.0
DISTANCES_M = np.arange(0.001, 0.17, 0.0015)
TILTS_RAD = np.deg2rad([-30.0, -10.0, 0.0, 10.0, 30.0])
SHADES = np.array([0.0, 1.0])
POST_CM = 0.5
"""Radius of the post: thinner than the gap between two rays."""
FULL = 4092.0
"""A reading of the robot that is a sensor value of 1: it is divided by 4 and ends at 1023."""
_CUT_OFF = 4480.0
"""The simulator itself ends its readings at 4505."""

IN_ENKI = """
import json, math, sys
import pyenki
asked = json.load(sys.stdin)
told = {"infrared": [], "ground": [], "speed": 0.0}
for x, y, angle, post in asked["poses"]:
    world, robot = pyenki.World(asked["size"], asked["size"]), pyenki.Thymio2()
    robot.pos, robot.angle = (x, y), angle
    world.addObject(robot)
    if post:
        thing = pyenki.CircularObject(post[2], 20, -1)
        thing.pos = (post[0], post[1])
        world.addObject(thing)
    world.step(1e-6)
    # a robot that touches something was pushed away
    told["infrared"].append([[*robot.pos, robot.angle, post], list(robot.proximitySensorValues)])
for shade in asked["shades"]:
    level = int(round(255 * shade))
    colour = 0xFF000000 | level << 16 | level << 8 | level
    values = []
    for _ in range(40):
        world = pyenki.WorldWithTexturedGround(
            asked["size"], asked["size"], asked["textures"][str(level)], pyenki.Color(0.9, 0.9, 0.9)
        )
        robot = pyenki.Thymio2()
        robot.pos = (100, 100)
        world.addObject(robot)
        world.step(1e-6)
        values.append(list(robot.groundSensorValues))
    told["ground"].append([sum(v) / len(values) for v in zip(*values)])
world, robot = pyenki.World(asked["size"], asked["size"]), pyenki.Thymio2()
robot.pos, robot.angle = (50, 100), 0.0
world.addObject(robot)
robot.leftSpeed = robot.rightSpeed = 16.6
for _ in range(100):
    world.step(0.03)
told["speed"] = (robot.pos[0] - 50) / 3.0
json.dump(told, sys.stdout)
"""


def in_enki() -> dict[str, Any]:
    """Readings from the simulator, which is a package of the system's Python."""
    nose_cm, middle = 100.0 * INFRARED[2][0][0], SIZE_CM / 2
    poses: list[tuple[float, float, float, tuple[float, float, float] | None]] = [
        (SIZE_CM - nose_cm * np.cos(tilt) - 100.0 * distance, middle, tilt, None)
        for tilt in TILTS_RAD.tolist()
        for distance in DISTANCES_M.tolist()
    ]
    poses += [
        (
            middle,
            middle,
            0.0,
            (middle + 100.0 * distance * np.cos(side), middle + 100.0 * distance * np.sin(side), POST_CM),
        )
        for side in np.deg2rad(np.arange(-80, 81, 3)).tolist()
        for distance in np.arange(0.1, 0.24, 0.004).tolist()
    ]
    with tempfile.TemporaryDirectory() as folder:
        textures = {}
        for level in {round(255 * shade) for shade in SHADES.tolist()}:
            path = Path(folder) / f"{level}.ppm"
            path.write_bytes(b"P6\n2 2\n255\n" + bytes([level] * 12))
            textures[str(level)] = str(path)
        asked = {"size": SIZE_CM, "poses": poses, "shades": SHADES.tolist(), "textures": textures}
        told = subprocess.run(
            ["/usr/bin/python3", "-c", IN_ENKI], input=json.dumps(asked), capture_output=True, text=True, check=True
        )
    return dict(json.loads(told.stdout))


def rays_m(pose: Sequence[Any], sensor: int) -> NDArray[np.float64]:
    """Distances along a sensor's rays to the wall at the right or to the post, at most its range."""
    x, y, angle, post = pose
    (at_x, at_y), direction = INFRARED[sensor]
    from_x = x / 100.0 + np.cos(angle) * at_x - np.sin(angle) * at_y
    from_y = y / 100.0 + np.sin(angle) * at_x + np.cos(angle) * at_y
    directions = angle + direction + np.array(RAY_ANGLES_RAD)
    ahead = np.cos(directions)
    met = np.where(ahead > 1e-9, (SIZE_CM / 100.0 - from_x) / np.maximum(ahead, 1e-9), RANGE_M)
    if post:
        to_x, to_y, radius = post[0] / 100.0 - from_x, post[1] / 100.0 - from_y, post[2] / 100.0
        along = to_x * ahead + to_y * np.sin(directions)
        rest = radius**2 - (to_x**2 + to_y**2 - along**2)
        met = np.where((rest >= 0.0) & (along > 0.0), along - np.sqrt(np.maximum(rest, 0.0)), met)
    return np.minimum(met, RANGE_M)


def fitted(told: dict[str, Any]) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """The curves of the middle ray and of those beside it at `NODES` equal steps of distance, and the root mean square
    of what they miss, in sensor values."""
    rows, values = [], []
    for pose, readings in told["infrared"]:
        for sensor in range(5):
            distances = rays_m(pose, sensor)
            if distances.min() <= 0.0 or not 0.0 < readings[sensor] < _CUT_OFF:
                continue
            row = np.zeros((2, NODES))
            for which, distance in zip((1, 0, 1), distances, strict=True):
                at = distance / RANGE_M * (NODES - 1)
                node = min(int(at), NODES - 2)
                row[which, node] += 1.0 - at + node
                row[which, node + 1] += at - node
            rows.append(np.ravel(row))
            values.append(readings[sensor] / FULL)
    a, b = np.array(rows), np.array(values)
    # at its range a ray sees nothing; and where few readings are, a curve is smooth
    seen = [k for k in range(2 * NODES) if k not in (NODES - 1, 2 * NODES - 1)]
    bend = np.eye(NODES)[:-2] - 2.0 * np.eye(NODES)[1:-1] + np.eye(NODES)[2:]
    smooth = 0.05 * np.kron(np.eye(2), bend[: NODES - 4])
    curves = np.zeros(2 * NODES)
    stacked = np.vstack([a, smooth])[:, seen]
    curves[seen] = np.linalg.lstsq(stacked, np.concatenate([b, np.zeros(len(smooth))]), rcond=None)[0]
    missed = np.clip(a @ curves, 0.0, 1.0) - np.minimum(b, 1.0)
    return curves[:NODES], curves[NODES:], float(np.sqrt(np.mean(missed**2)))


def module(told: dict[str, Any]) -> str:
    """The text of ``backends/thymio/readings.py``."""
    middle, beside, missed = fitted(told)
    ground = np.mean(told["ground"], axis=1)
    numbers = [
        textwrap.indent(textwrap.fill(", ".join(f"{value:.4f}" for value in curve), 112), "    ")
        for curve in (middle, beside)
    ]
    return f'''"""What a Thymio's sensors read in the makers' simulator. Written by tools/thymio_readings.py."""

MIDDLE_RAY = (
{numbers[0]},
)
"""What the middle ray of an infrared sensor adds to its reading, at {NODES} equal steps from 0 to its range."""
RAY_BESIDE = (
{numbers[1]},
)
"""What each of the two rays beside it adds."""
MISSED = {missed:.3f}
"""Root mean square of the difference to {len(told["infrared"]) * 5} readings before a wall and around a post."""
GROUND_BLACK, GROUND_WHITE = {ground[0]:.0f}, {ground[-1]:.0f}
"""What a ground sensor says over black and over white."""
TOP_SPEED_M_S = {told["speed"] / 100.0:.4f}
"""Of a wheel at motor target 500."""
'''


if __name__ == "__main__":
    text = module(in_enki())
    if "--check" in sys.argv:
        sys.exit(0 if text == OUTPUT.read_text(encoding="utf-8") else f"{OUTPUT} says something else")
    OUTPUT.write_text(text, encoding="utf-8")
    print(text)
