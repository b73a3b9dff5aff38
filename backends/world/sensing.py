"""What the robot's sensors read in a world: infrared along rays, the floor's shade, lamps and their shadows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from backends.world.layout import (
    AT_GROUND,
    AT_LAMPS,
    AT_LIGHT,
    AT_RAYS,
    AT_RESPONSES,
    AT_SHADES,
    FIRST_GROUND,
    FIRST_LIGHT,
    GROUND_ROW,
    LAMP_ROW,
    LIGHT_ROW,
    N_GROUND,
    N_LAMPS,
    N_LIGHT,
    N_RAYS,
    NODES,
    RAY_ROW,
    SHADE_COLUMNS,
    SHADE_COLUMNS_PER_M,
    SHADE_ROWS,
    SHADE_ROWS_PER_M,
)
from backends.world.rays import DX, DY, NEAR, OX, OY, SPARE, aim, meet_arena, meet_things, take_pose
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES

_F = np.float32
BRIGHT, AWAY = SPARE, SPARE + LANES
"""A lamp's brightness without shadow, its distance."""

Float32Array = NDArray[np.float32]


@compiled_part
def sense(state: Float32Array, sensors: Float32Array, work: Float32Array, parameters: Float32Array) -> None:
    """All sensors, in the order infrared, ground, light."""
    w = work.ravel()
    take_pose(state, w)
    for j in range(sensors.shape[0]):
        for lane in range(LANES):
            sensors[j, lane] = _F(0.0)
    for k in range(np.int64(parameters[N_RAYS])):
        row = np.int64(parameters[AT_RAYS]) + RAY_ROW * k
        reach = parameters[row + 6]
        aim(w, parameters[row + 2], parameters[row + 3], parameters[row + 4], parameters[row + 5])
        meet_arena(w, parameters, reach)
        meet_things(state, w, parameters)
        sensor, weight = np.int64(parameters[row]), parameters[row + 1]
        response = np.int64(parameters[AT_RESPONSES]) + np.int64(parameters[row + 7])
        if np.int64(parameters[row + 7]) < 0:
            # the default response needs no table, and looking one up costs more than meeting the walls
            per_m = weight / reach
            for lane in range(LANES):
                sensors[sensor, lane] += weight - per_m * w[NEAR + lane]
        else:
            _respond(sensors, w, parameters, sensor, weight, response, _F(NODES - 1) / reach)
    _sense_ground(sensors, w, parameters)
    _sense_light(state, sensors, w, parameters)


@compiled_part
def _respond(
    sensors: Float32Array,
    w: Float32Array,
    parameters: Float32Array,
    sensor: np.int64,
    weight: np.float32,
    response: np.int64,
    per_m: np.float32,
) -> None:
    """Add what a ray reads at its distance: between two nodes of the table that begins at `response`."""
    for lane in range(LANES):
        at = w[NEAR + lane] * per_m
        node = min(np.int32(at), np.int32(NODES - 2))
        low = parameters[response + node]
        sensors[sensor, lane] += weight * (low + (at - _F(node)) * (parameters[response + node + 1] - low))


@compiled_part
def _sense_ground(sensors: Float32Array, w: Float32Array, parameters: Float32Array) -> None:
    columns, rows = np.int32(parameters[SHADE_COLUMNS]), np.int32(parameters[SHADE_ROWS])
    first = np.int32(parameters[AT_SHADES])
    columns_per_m, rows_per_m = parameters[SHADE_COLUMNS_PER_M], parameters[SHADE_ROWS_PER_M]
    for k in range(np.int64(parameters[N_GROUND])):
        row = np.int64(parameters[AT_GROUND]) + GROUND_ROW * k
        aim(w, parameters[row], parameters[row + 1], _F(1.0), _F(0.0))
        sensor = np.int64(parameters[FIRST_GROUND]) + k
        for lane in range(LANES):
            # between the middles of four cells
            x = min(max(w[OX + lane] * columns_per_m - _F(0.5), _F(0.0)), _F(columns - 1))
            y = min(max(w[OY + lane] * rows_per_m - _F(0.5), _F(0.0)), _F(rows - 1))
            column, line = min(np.int32(x), columns - np.int32(2)), min(np.int32(y), rows - np.int32(2))
            fx, fy = x - _F(column), y - _F(line)
            cell = first + line * columns + column
            below = parameters[cell] + fx * (parameters[cell + 1] - parameters[cell])
            upper = cell + columns
            above = parameters[upper] + fx * (parameters[upper + 1] - parameters[upper])
            sensors[sensor, lane] = _F(1.0) - (below + fy * (above - below))


@compiled_part
def _sense_light(state: Float32Array, sensors: Float32Array, w: Float32Array, parameters: Float32Array) -> None:
    for k in range(np.int64(parameters[N_LIGHT])):
        row = np.int64(parameters[AT_LIGHT]) + LIGHT_ROW * k
        sensor = np.int64(parameters[FIRST_LIGHT]) + k
        for lamp in range(np.int64(parameters[N_LAMPS])):
            at = np.int64(parameters[AT_LAMPS]) + LAMP_ROW * lamp
            x, y, reference = parameters[at], parameters[at + 1], parameters[at + 2]
            aim(w, parameters[row], parameters[row + 1], parameters[row + 2], parameters[row + 3])
            for lane in range(LANES):
                to_x, to_y = x - w[OX + lane], y - w[OY + lane]
                away = max(np.sqrt(to_x * to_x + to_y * to_y), _F(1e-6))
                facing = max((to_x * w[DX + lane] + to_y * w[DY + lane]) / away, _F(0.0))
                near = reference / away
                w[BRIGHT + lane] = min(near * near, _F(1.0)) * facing
                # now the ray runs towards the lamp, and what it meets on its way throws a shadow
                w[DX + lane], w[DY + lane] = to_x / away, to_y / away
                w[AWAY + lane], w[NEAR + lane] = away, away
            meet_things(state, w, parameters)
            for lane in range(LANES):
                sensors[sensor, lane] += w[BRIGHT + lane] if w[NEAR + lane] >= w[AWAY + lane] else _F(0.0)
