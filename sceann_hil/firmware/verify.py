"""A board against the reference: the same sensors, every state of every neuron, step by step, over the link.

The board runs in HIL mode with telemetry STATES, so its own firmware computes; nothing is built in for the test.
Works on a robot on a serial port and on every emulated board alike.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.firmware.flash import check_size
from sceann_hil.link.client import RobotClient
from sceann_hil.link.serial_line import meet
from sceann_hil.link.vocabulary import Mode, Op, Telemetry
from sceann_hil.network.controller import SENSOR_MAX, state_hash
from sceann_hil.network.image import ControllerImage

HEARTBEAT_S = 0.05
HEARTBEAT_STEPS = 20
Sensors = NDArray[np.uint16]
"""One sequence of wire values, shape ``(n_steps, n_sensors)``."""


@dataclass(frozen=True, slots=True)
class Difference:
    """The first step in which board and reference disagree.

    Attributes:
        sequence: which sequence, from 0.
        step: which step of it, from 0; the number of its steps if only the final hash differs.
        expected: the reference's states (int16), or its state hash.
        got: the board's.
    """

    sequence: int
    step: int
    expected: tuple[int, ...]
    got: tuple[int, ...]

    def __str__(self) -> str:
        return f"sequence {self.sequence}, step {self.step}: expected {self.expected}, got {self.got}"


@dataclass(frozen=True, slots=True)
class Verification:
    """What was compared, and whether it was equal.

    Attributes:
        sequences: sensor sequences that ran.
        steps: control steps in them.
        states: neuron states that were compared.
        difference: the first difference; None if every state was equal.
    """

    sequences: int
    steps: int
    states: int
    difference: Difference | None

    @property
    def equal(self) -> bool:
        """Every state was equal."""
        return self.difference is None


def random_sequences(
    generator: np.random.Generator, n_sequences: int, n_steps: int, n_sensors: int
) -> Iterable[Sensors]:
    """Drifting sensors, white noise and extremes in turn."""
    for kind in range(n_sequences):
        if kind % 3 == 0:
            yield generator.integers(0, SENSOR_MAX + 1, (n_steps, n_sensors)).astype(np.uint16)
        elif kind % 3 == 1:
            yield generator.choice(np.array([0, 511, 512, SENSOR_MAX], np.uint16), (n_steps, n_sensors))
        else:
            start = generator.integers(0, SENSOR_MAX + 1, n_sensors)
            drift = start + np.cumsum(generator.integers(-60, 61, (n_steps, n_sensors)), axis=0)
            yield np.clip(drift, 0, SENSOR_MAX).astype(np.uint16)


def verify(
    client: RobotClient,
    image: ControllerImage,
    sequences: Iterable[Sensors],
    place: str = "the board",
    progress: Callable[[int], None] | None = None,
) -> Verification:
    """Runs every sequence on the board and on the reference until the first difference.

    Args:
        client: the board's line.
        image: the controller.
        sequences: sensors, recorded or random.
        place: what to call the board in messages.
        progress: called with the number of finished sequences.

    Raises:
        FlashFailed: no robot of ours at the other end.
        LinkError: it stopped answering or refuses.
    """
    check_size(image)
    meet(client, place)
    client.upload(image)
    trial_id = client.request(Op.LAST)["LastTrialId"]
    steps = 0
    count = 0
    for count, sensors in enumerate(sequences, 1):
        trial_id = trial_id % 0xFFFF + 1
        difference = _verify_one(client, image, sensors, trial_id, count - 1)
        steps += len(sensors) if difference is None else min(difference.step + 1, len(sensors))
        if difference is not None:
            return Verification(count, steps, steps * image.size.n_neurons, difference)
        if progress is not None:
            progress(count)
    return Verification(count, steps, steps * image.size.n_neurons, None)


def _verify_one(
    client: RobotClient, image: ControllerImage, sensors: Sensors, trial_id: int, sequence: int
) -> Difference | None:
    size, controller = image.size, image.controller()
    client.start(trial_id, len(sensors), Mode.HIL, telemetry=Telemetry.STATES)
    crc, beat = 0xFFFF, time.monotonic()
    for step, row in enumerate(sensors):
        if step % HEARTBEAT_STEPS == 0 or time.monotonic() - beat > HEARTBEAT_S:
            client.heartbeat()
            beat = time.monotonic()
        states, motors, low_hash = client.hil_step(step, row, size.n_neurons, size.n_motors)
        expected_motors = controller.step(row)
        crc = state_hash(controller.u, crc)
        if not np.array_equal(states, controller.u):
            client.request(Op.STOP)
            return Difference(sequence, step, tuple(controller.u.tolist()), tuple(states.tolist()))
        if not np.array_equal(motors, expected_motors) or low_hash != crc & 0xFF:
            client.request(Op.STOP)
            expected, got = (*expected_motors.tolist(), crc & 0xFF), (*motors.tolist(), low_hash)
            return Difference(sequence, step, expected, got)
    end = client.expect("End")
    if end["StateHash"] != crc:
        return Difference(sequence, len(sensors), (crc,), (end["StateHash"],))
    return None
