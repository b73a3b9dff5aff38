"""A Thymio against the reference: the same sensors, every state of every neuron, step by step, in its own machine."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from sceann_hil.firmware.aesl.compiler import Code
from sceann_hil.firmware.aesl.node import ANSWER_S, AsebaNode, signed
from sceann_hil.firmware.verify import Difference, Sensors, Verification
from sceann_hil.network.controller import state_hash
from sceann_hil.network.image import ControllerImage
from sceann_hil.robot import LinkError

_UNDER_WAY = 12
"""Steps that are sent before the first is answered: the simulator reads only so often."""


def verify_aseba(
    node: AsebaNode,
    image: ControllerImage,
    code: Code,
    sequences: Iterable[Sensors],
    progress: Callable[[int], None] | None = None,
) -> Verification:
    """Runs every sequence on the robot and on the reference until the first difference.

    Args:
        node: connected; its motors stand still.
        image: the controller.
        code: of its program, for this robot.
        sequences: sensors, recorded or random.
        progress: called with the number of finished sequences.

    Raises:
        LinkError: the robot stopped answering.
        RobotFault: it did not take the program.
    """
    node.stop_motors()
    node.load(code)
    steps = count = 0
    for count, sensors in enumerate(sequences, 1):
        difference = _verify_one(node, image, sensors, count - 1)
        steps += len(sensors) if difference is None else difference.step + 1
        if difference is not None:
            return Verification(count, steps, steps * image.size.n_neurons, difference)
        if progress is not None:
            progress(count)
    return Verification(count, steps, steps * image.size.n_neurons, None)


def _verify_one(node: AsebaNode, image: ControllerImage, sensors: Sensors, sequence: int) -> Difference | None:
    controller, crc, sent = image.controller(), 0xFFFF, 0
    for step, row in enumerate(sensors):
        while sent < min(step + _UNDER_WAY, len(sensors)):
            node.tell("sceann.feed", int(sent == 0), *sensors[sent].tolist())
            sent += 1
        controller.step(row)
        crc = state_hash(controller.u, crc)
        expected = (*controller.u.tolist(), signed(crc))
        got = _states(node)
        if got != expected:
            node.forget_events()
            return Difference(sequence, step, expected, got)
    return None


def _states(node: AsebaNode) -> tuple[int, ...]:
    while (event := node.heard(ANSWER_S)) is not None:
        if event[0] == "sceann.states":
            return (*event[1][1:], event[1][0])
    raise LinkError(f"{node.line.place}: the robot did not answer a step in {ANSWER_S:g} s")
