"""The loop that runs trials side by side, each lane loaded anew as soon as its trial ends.

A body joins the loop with two functions over lanes, written in plain Python that Numba compiles:

``sense(state, sensors, work, parameters)``
    writes what the sensors read, 0..1, into ``sensors`` (shape ``(n_sensors, LANES)``);
``advance(state, motors, noise, end_reasons, work, parameters)``
    moves the body by one tick and writes an `EndReason` number, or `RUNNING`, for each lane.

``state`` has shape ``(n_state, LANES)``, ``motors`` (values about 0..1) ``(n_motors, LANES)``, ``noise`` (standard
normal) ``(n_noise, LANES)``, ``work`` is scratch of shape ``(WORK_ROWS, LANES)``; all float32. A lane only ever reads
its own column, so a trial gives the same bits whatever runs beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from backends.simulation.body import Float32Array
from backends.simulation.gap import GAP_FIXED, MAX_LATENCY_STEPS, apply_motor_gap, apply_sensor_gap
from backends.simulation.noise import CHANNELS, normal_pair
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES, update_hashes, update_outputs, update_states
from sceann_hil.robot import EndReason

RUNNING = -1
WORK_ROWS = 12
_TIME_UP = int(EndReason.TIME_UP)
_F = np.float32
_U = np.uint32

sense: Any = None
"""The body's, in the globals that `SimulatedBody.bind` makes."""
advance: Any = None
accumulate: Any = None
"""`adding_up.nothing`, or what `adding_up.accumulating` makes."""


def run_lanes(
    weights: NDArray[np.int8],
    genome_index: NDArray[np.int32],
    states: Float32Array,
    keys: NDArray[np.uint64],
    max_steps: int,
    n_hidden: int,
    memoryless: bool,
    initial_output: int,
    n_noise: int,
    n_drawn: int,
    gap: Float32Array,
    parameters: Float32Array,
    end_reasons: NDArray[np.uint8],
    steps: NDArray[np.int32],
    hashes: NDArray[np.uint16],
    final_states: Float32Array,
    trace_state: Float32Array,
    trace_sensors: NDArray[np.uint16],
    trace_u: NDArray[np.int16],
    trace_x: NDArray[np.int16],
    first_total: float,
    totals: NDArray[np.float64],
) -> None:
    """Run every trial to its end. Traces are written if ``trace_state`` has a row for every trial."""
    n_trials, n_state = states.shape
    _, n_neurons, n_sources = weights.shape
    n_sensors = n_sources - n_neurons
    n_motors = n_neurons - n_hidden
    tracing = trace_state.shape[0] > 0
    has_gap = gap.shape[0] > 0

    state = np.zeros((n_state, LANES), np.float32)
    sensors = np.zeros((n_sensors, LANES), np.float32)
    motors = np.zeros((n_motors, LANES), np.float32)
    noise = np.zeros((n_noise, LANES), np.float32)
    work = np.zeros((WORK_ROWS, LANES), np.float32)
    lane_gap = np.zeros((GAP_FIXED + 2 * n_sensors + n_motors, LANES), np.float32)
    delayed = np.zeros((MAX_LATENCY_STEPS + 1, n_motors, LANES), np.float32)
    wire = np.zeros((n_sensors, LANES), np.uint16)
    lane_weights = np.zeros((n_neurons, n_sources, LANES), np.int16)
    sources = np.zeros((n_sources, LANES), np.int16)
    outputs = sources[n_sensors:]
    u = np.zeros((n_neurons, LANES), np.int16)
    resets = np.zeros((n_neurons, LANES), np.int16)
    lane_hashes = np.zeros(LANES, np.uint16)
    key_low = np.zeros(LANES, np.uint32)
    key_high = np.zeros(LANES, np.uint32)
    step = np.zeros(LANES, np.int32)
    ended = np.zeros(LANES, np.int32)
    trial_of = np.full(LANES, -1, np.int64)
    lane_totals = np.zeros(LANES, np.float64)
    listed = np.zeros(LANES + 1, np.uint64)
    next_trial = 0
    running = 0

    while True:
        n_ended = 0
        for lane in range(LANES):
            n_ended += 1 if ended[lane] != RUNNING else 0
        if n_ended > LANES - running or running == 0:
            # listed first without a branch: which lanes end is what no processor can predict
            n_listed = 0
            for lane in range(LANES):
                listed[n_listed] = lane
                n_listed += 1 if ended[lane] != RUNNING else 0
            for entry in range(n_listed):
                lane = listed[entry]
                trial = trial_of[lane]
                if trial >= 0:
                    end_reasons[trial] = ended[lane]
                    steps[trial] = step[lane]
                    hashes[trial] = lane_hashes[lane]
                    totals[trial] = lane_totals[lane]
                    for k in range(n_state):
                        final_states[trial, k] = state[k, lane]
                    trial_of[lane] = -1
                    running -= 1
                if next_trial < n_trials:
                    trial = next_trial
                    next_trial += 1
                    running += 1
                    trial_of[lane] = trial
                    step[lane] = 0
                    lane_hashes[lane] = 0xFFFF
                    lane_totals[lane] = first_total
                    key_low[lane] = _U(keys[trial])
                    key_high[lane] = _U(keys[trial] >> np.uint64(32))
                    for k in range(n_state):
                        state[k, lane] = states[trial, k]
                    genome = genome_index[trial]
                    for i in range(n_neurons):
                        u[i, lane] = 0
                        outputs[i, lane] = initial_output
                        for j in range(n_sources):
                            lane_weights[i, j, lane] = weights[genome, i, j]
                    if has_gap:
                        for k in range(gap.shape[1]):
                            lane_gap[k, lane] = gap[trial, k]
                        for d in range(delayed.shape[0]):
                            for m in range(n_motors):
                                delayed[d, m, lane] = lane_gap[GAP_FIXED - 1, lane]
            if running == 0:
                return

        sense(state, sensors, work, parameters)
        if has_gap:
            apply_sensor_gap(sensors, lane_gap, key_low, key_high, step)
        for j in range(n_sensors):
            for lane in range(LANES):
                clipped = min(max(sensors[j, lane], _F(0.0)), _F(1.0))
                r = np.int32(clipped * _F(1023.0) + _F(0.5))
                wire[j, lane] = np.uint16(r)
                sources[j, lane] = np.int16(r + (r >> np.int32(9)))
        if tracing:
            for lane in range(LANES):
                trial = trial_of[lane]
                if trial >= 0:
                    for k in range(n_state):
                        trace_state[trial, step[lane], k] = state[k, lane]
                    for j in range(n_sensors):
                        trace_sensors[trial, step[lane], j] = wire[j, lane]

        update_states(u, resets, lane_weights, sources, memoryless)
        update_outputs(u, resets, outputs, memoryless)
        update_hashes(u, lane_hashes)

        accumulate(state, wire, outputs, lane_totals)
        for m in range(n_motors):
            for lane in range(LANES):
                motors[m, lane] = _F(outputs[n_hidden + m, lane]) * _F(1.0 / 1024.0)
        if has_gap:
            apply_motor_gap(motors, delayed, lane_gap, n_sensors)
        for k in range(0, n_drawn, 2):
            fill_normals(noise, k, key_low, key_high, step)
        advance(state, motors, noise, ended, work, parameters)
        if tracing:
            for lane in range(LANES):
                trial = trial_of[lane]
                if trial >= 0:
                    for i in range(n_neurons):
                        trace_u[trial, step[lane], i] = u[i, lane]
                        trace_x[trial, step[lane], i] = outputs[i, lane]
                    for k in range(n_state):
                        trace_state[trial, step[lane] + 1, k] = state[k, lane]
        for lane in range(LANES):
            step[lane] = step[lane] + np.int32(1)
        for lane in range(LANES):
            time_is_up = ended[lane] == RUNNING and step[lane] >= max_steps
            ended[lane] = np.int32(_TIME_UP) if time_is_up else ended[lane]
        if running < LANES:
            for lane in range(LANES):
                ended[lane] = np.int32(_TIME_UP) if trial_of[lane] < 0 else ended[lane]


@compiled_part
def fill_normals(
    noise: Float32Array,
    row: int,
    key_low: NDArray[np.uint32],
    key_high: NDArray[np.uint32],
    step: NDArray[np.int32],
) -> None:
    """Normal deviates into two rows from `row` on; a step's deviates depend on key, step and row only."""
    for lane in range(LANES):
        counter = _U(_U(_U(step[lane]) * _U(CHANNELS)) + _U(row))
        noise[row, lane], noise[row + 1, lane] = normal_pair(key_low[lane], key_high[lane], counter)
