"""What export, flash and verify do for a Thymio II."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager

from sceann_hil.errors import FlashFailed
from sceann_hil.firmware.aesl.document import aesl_document, image_code, life_of
from sceann_hil.firmware.aesl.node import AsebaNode
from sceann_hil.firmware.aesl.program import network_code
from sceann_hil.firmware.aesl.verify import verify_aseba
from sceann_hil.firmware.verify import Sensors, Verification
from sceann_hil.link.aseba_line import AsebaLine
from sceann_hil.network.image import ControllerImage
from sceann_hil.plugins import RobotConfig
from sceann_hil.robot import LinkError, RobotFault

_SOCKET = "socket://"


def aesl_of(image: ControllerImage, robot: RobotConfig) -> str:
    """A controller as an AESL file.

    Raises:
        FirmwareBuildFailed: a Thymio cannot run it.
    """
    return aesl_document(image, life_of(robot))


@contextmanager
def _thymio_at(port: str | None) -> Iterator[AsebaNode]:
    """A connected Thymio; the makers' simulator where no port is given.

    Raises:
        LinkError: it is not there.
        ToolMissing: the simulator is not installed.
    """
    with ExitStack() as stack:
        host = port.removeprefix(_SOCKET) if port is not None and port.startswith(_SOCKET) else None
        if port is None:
            from sceann_hil.firmware.emulated.playground import ARENA, Playground

            host = stack.enter_context(Playground(ARENA)).host
        node = AsebaNode(AsebaLine(None if host else port, host))
        stack.callback(node.close)
        node.connect()
        yield node


def verify_thymio(
    image: ControllerImage,
    robot: RobotConfig,
    port: str | None,
    sequences: Iterable[Sensors],
    progress: Callable[[int], None],
) -> Verification:
    """Every state of every neuron in the robot's own machine against the reference.

    Args:
        image: the controller.
        robot: that it was evolved on.
        port: serial port or ``socket://host:port``; None for the makers' simulator.
        sequences: sensors, recorded or random.
        progress: called with the number of finished sequences.

    Raises:
        FirmwareBuildFailed: the controller does not fit into it.
        LinkError: it is not there, or stopped answering.
    """
    life = life_of(robot)
    image_code(image, life)
    with _thymio_at(port) as node:
        code = network_code(image.size, image.dynamics, life, node.target, image.weights)
        return verify_aseba(node, image, code, sequences, progress)


def flash_thymio(image: ControllerImage, robot: RobotConfig, port: str) -> str:
    """Put a controller into a Thymio, where it runs after a press of the centre button, also after a power cut.

    Args:
        image: the controller.
        robot: that it was evolved on.
        port: serial port or ``socket://host:port``.

    Returns:
        What is now on the robot.

    Raises:
        FirmwareBuildFailed: the controller does not fit into it.
        FlashFailed: it is not there, or did not take it.
    """
    life = life_of(robot)
    image_code(image, life)
    try:
        with _thymio_at(port) as node:
            code = network_code(image.size, image.dynamics, life, node.target, image.weights)
            node.stop_motors()
            node.load(code)
            node.keep_program()
    except (LinkError, RobotFault) as error:
        raise FlashFailed(f"{error}.", "Check power, cable and dongle, then try again.") from None
    return f"{len(code.words)} words of byte code on the Thymio at {port}; its centre button starts and stops it"
