"""A controller onto a board, and what the board then says that is on it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from sceann_hil.errors import FlashFailed
from sceann_hil.firmware.flash_plan import FlashPlan, check_size, upload_firmware
from sceann_hil.link.descriptor import Capability, Descriptor
from sceann_hil.link.messages import store_arguments
from sceann_hil.link.numbers import AUTORUN_S, FIRMWARE_VERSION
from sceann_hil.link.ports import PortProblem
from sceann_hil.link.serial_bus import BAUD, SceannSerialBus
from sceann_hil.link.session import NoAnswer, Refused, RobotLink
from sceann_hil.link.upload import upload_image
from sceann_hil.link.vocabulary import Op, Status, StoreAction
from sceann_hil.network.image import ControllerImage
from sceann_hil.robot import LinkError, RobotFault

START_S = 6.0
"""How long a robot may take to answer: opening its port resets an Arduino, whose boot loader waits first."""


@dataclass(frozen=True, slots=True)
class OnRobot:
    """What is on a robot now.

    Attributes:
        descriptor: what it says that it is.
        genome_crc: CRC-32 of the genome record it uses.
        stored: the genome survives power loss.
        unplugged: what it does without a host.
    """

    descriptor: Descriptor
    genome_crc: int
    stored: bool
    unplugged: StoreAction = StoreAction.KEEP

    def __str__(self) -> str:
        d = self.descriptor
        version = ".".join(map(str, d.firmware))
        kept = "kept over power loss" if self.stored else "until it is switched off"
        kept += {
            StoreAction.AUTORUN: f", run {AUTORUN_S:g} s after it is switched on",
            StoreAction.BUTTON: ", run when its start button is pressed",
        }.get(self.unplugged, "")
        return (
            f"{d.name} ({d.unique_id:014x}): firmware {version}, link {d.link_version}, "
            f"arithmetic {d.arithmetic_id:08x}, genome {self.genome_crc:08x}, {kept}"
        )


@dataclass(frozen=True, slots=True)
class Unplugged:
    """What a robot does with the genome when no host is there.

    Attributes:
        action: keep it, run it after the start, or run it when the start button is pressed.
        tick_s: control period.
    """

    action: StoreAction = StoreAction.KEEP
    tick_s: float = 0.0


def handshake(link: RobotLink, place: str) -> Descriptor:
    """Take the robot, and say what is wrong when there is none of ours.

    Raises:
        FlashFailed: silence, another firmware, another version, or another host in charge.
    """
    try:
        return link.hello(START_S)
    except LinkError as error:
        raise FlashFailed(f"{place}: {error}.", "Check power, cable, port and --baud; `sceann flash` first.") from None


def upload_genome(link: RobotLink, image: ControllerImage, place: str, unplugged: Unplugged = Unplugged()) -> OnRobot:
    """Meets the robot, gives it the genome, has it stored where it has a store, and asks what is there now.

    Nothing is half-written: the robot uses and keeps the old genome until all of the new one has arrived.

    Raises:
        FlashFailed: no robot of ours, it refuses, or what it holds is not what was sent.
    """
    check_size(image)
    descriptor = handshake(link, place)
    if descriptor.firmware != FIRMWARE_VERSION:
        raise FlashFailed(
            f"{place}: expected firmware {FIRMWARE_VERSION}, the robot has {descriptor.firmware}.", "Flash the board."
        )
    if unplugged.action is not StoreAction.KEEP:
        _check_unplugged(descriptor, image, unplugged, place)
    try:
        upload_image(link, image)
        if not descriptor.capabilities & Capability.STORE:
            return OnRobot(descriptor, image.record_crc, stored=False)
        link.request(Op.STORE, store_arguments(unplugged.action, unplugged.tick_s))
        stored = link.request(Op.STORED).u32()
    except Refused as refused:
        advice = {
            Status.TOO_LARGE: f"This robot takes at most {descriptor.max_sources} sources; evolve a smaller network.",
            Status.BAD_STATE: "It runs a trial or was stopped: wait, or CLEAR it, then try again.",
            Status.STORE_FAILED: "Its memory does not hold what is written; the genome in use before is still stored.",
        }
        raise FlashFailed(f"{place}: {refused}.", advice.get(refused.status, "")) from None
    except NoAnswer as silence:
        raise FlashFailed(f"{place}: {silence}. The robot keeps its old genome.", "Try again.") from None
    except (LinkError, RobotFault) as error:
        raise FlashFailed(f"{place}: {error}.", "Check the cable, then try again.") from None
    if stored != image.record_crc:
        raise FlashFailed(f"{place}: expected genome {image.record_crc:08x} in the store, found {stored:08x}.")
    return OnRobot(descriptor, stored, stored=True, unplugged=unplugged.action)


def _check_unplugged(robot: Descriptor, image: ControllerImage, unplugged: Unplugged, place: str) -> None:
    """Refuse before anything is sent what the robot would refuse afterwards.

    Raises:
        FlashFailed: it cannot run this network by itself.
    """
    if Capability.AUTORUN not in robot.capabilities:
        raise FlashFailed(f"{place}: --autorun: {robot.name} cannot run without a host.", "Leave --autorun out.")
    if unplugged.action is StoreAction.BUTTON and Capability.BUTTON not in robot.capabilities:
        raise FlashFailed(
            f"{place}: {robot.name} has no start button.", "Leave --on-button out: it then starts by itself."
        )
    try:
        image.size.check_fits(robot.n_sensors, robot.n_motors, robot.name)
    except ValueError as error:
        raise FlashFailed(
            f"{place}: {error}.", "Evolve for this robot, or flash firmware for as many sensors."
        ) from None
    if not robot.tick_min_s <= unplugged.tick_s <= robot.tick_max_s:
        raise FlashFailed(
            f"{place}: --autorun: expected {robot.tick_min_s * 1e3:g} to {robot.tick_max_s * 1e3:g} ms, "
            f"got {unplugged.tick_s * 1e3:g}.",
            "Give the control period that the controller was evolved with.",
        )


@contextmanager
def opened(port: str, baud: int = BAUD, node: int = 1) -> Iterator[RobotLink]:
    """The link to a robot on a serial port.

    Raises:
        FlashFailed: the port cannot be opened.
    """
    try:
        bus = SceannSerialBus(port, baud)
    except PortProblem as problem:
        raise FlashFailed(problem.message, problem.hint) from None
    link = RobotLink(bus, node)
    try:
        yield link
    finally:
        link.close()


def flash(
    image: ControllerImage,
    plan: FlashPlan,
    port: str,
    baud: int = BAUD,
    node: int = 1,
    unplugged: Unplugged = Unplugged(),
) -> OnRobot:
    """Uploads firmware and genome, and reads back what is on the board, which keeps its node number.

    Raises:
        ToolMissing, FlashFailed: see `upload_firmware` and `upload_genome`.
    """
    upload_firmware(plan)
    return flash_genome(image, port, baud, node, unplugged)


def flash_genome(
    image: ControllerImage, port: str, baud: int = BAUD, node: int = 1, unplugged: Unplugged = Unplugged()
) -> OnRobot:
    """The fast way: only the genome, over the link, into a robot that has the firmware already.

    Raises:
        FlashFailed: see `upload_genome`.
    """
    with opened(port, baud, node) as link:
        return upload_genome(link, image, port, unplugged)
