"""A board against the reference: the same sensors, every state of every neuron, step by step, over the link.

The board runs in HIL mode with telemetry STATES, so its own firmware computes; nothing is built in for the test.
Works on a robot on a serial port and on every emulated board alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.firmware.flash import handshake
from sceann_hil.firmware.flash_plan import check_size
from sceann_hil.link.hil import run_hil_trial
from sceann_hil.link.messages import LinkEnd
from sceann_hil.link.session import RobotLink
from sceann_hil.link.trial import NO_STATE, Follower, Order, TrialLost
from sceann_hil.link.upload import upload_image
from sceann_hil.link.vocabulary import Op, Telemetry
from sceann_hil.network.controller import SENSOR_MAX, state_hash
from sceann_hil.network.image import ControllerImage
from sceann_hil.robot import EndReason, LinkError

TRIES = 5
"""Of one sequence, before the line counts as broken."""
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
    link: RobotLink,
    image: ControllerImage,
    sequences: Iterable[Sensors],
    place: str = "the board",
    progress: Callable[[int], None] | None = None,
) -> Verification:
    """Runs every sequence on the board and on the reference until the first difference.

    A sequence that the line spoilt, or that a busy computer was too slow for, is run again.

    Args:
        link: to the board.
        image: the controller.
        sequences: sensors, recorded or random.
        place: what to call the board in messages.
        progress: called with the number of finished sequences.

    Raises:
        FlashFailed: no robot of ours at the other end.
        LinkError: it stopped answering or refuses.
    """
    check_size(image)
    handshake(link, place)
    upload_image(link, image)
    trial_id = link.last().trial_id
    steps = 0
    count = 0
    for count, sensors in enumerate(sequences, 1):
        difference = None
        for attempt in range(TRIES):
            trial_id = trial_id % 0xFFFF + 1
            try:
                difference = _verify_one(link, image, sensors, trial_id, count - 1)
                break
            except LinkError:
                if attempt + 1 == TRIES:
                    raise
                link.hello()
                link.request(Op.STOP)
                link.request(Op.CLEAR)
                upload_image(link, image)
        steps += len(sensors) if difference is None else min(difference.step + 1, len(sensors))
        if difference is not None:
            return Verification(count, steps, steps * image.size.n_neurons, difference)
        if progress is not None:
            progress(count)
    return Verification(count, steps, steps * image.size.n_neurons, None)


class _Recorded:
    """A body that says what it is told to say, whatever the motors do."""

    def __init__(self, sensors: Sensors) -> None:
        self.state = np.zeros(0, np.float32)
        self._rows = iter(sensors)

    def sense(self) -> NDArray[np.uint16]:
        """The next row."""
        return next(self._rows)

    def move(self, motors: tuple[int, ...]) -> EndReason | None:
        """It never arrives anywhere."""
        return None


def _verify_one(
    link: RobotLink, image: ControllerImage, sensors: Sensors, trial_id: int, sequence: int
) -> Difference | None:
    size = image.size
    order = Order(trial_id, len(sensors), 0.02, size.n_sensors, size.n_motors, size.n_neurons)
    follower, _ = run_hil_trial(link, order, _Recorded(sensors), telemetry=Telemetry.STATES)
    end = follower.end
    if end is None or end.reason is not LinkEnd.MAX_TICKS:
        raise TrialLost(f"sequence {sequence}: the board ended it ({'silent' if end is None else end.reason.name})")
    if (follower.neurons == NO_STATE).any():
        raise TrialLost(f"sequence {sequence}: the line lost a part of the states")
    return _first_difference(follower, image, end.state_hash, sequence)


def _first_difference(follower: Follower, image: ControllerImage, final_hash: int, sequence: int) -> Difference | None:
    """What the reference computes, step by step, against everything that the board told."""
    controller, crc = image.controller(), 0xFFFF
    for step, row in enumerate(follower.sensors):
        motors = controller.step(row)
        crc = state_hash(controller.u, crc)
        states = follower.neurons[step]
        if not np.array_equal(states, controller.u):
            return Difference(sequence, step, tuple(controller.u.tolist()), tuple(states.tolist()))
        if not np.array_equal(follower.motors[step], motors) or follower.hash_bytes[step] != crc & 0xFF:
            expected = (*motors.tolist(), crc & 0xFF)
            got = (*follower.motors[step].tolist(), int(follower.hash_bytes[step]))
            return Difference(sequence, step, expected, got)
    if final_hash != crc:
        return Difference(sequence, len(follower.sensors), (crc,), (final_hash,))
    return None
