"""Switching a virtual robot on: which board, which body, which line."""

from __future__ import annotations

import os
import socket
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from backends.simulation.body import SimulatedBody
from backends.simulation.settings import Drawn
from backends.virtual.body import Battery, VirtualBody
from backends.virtual.cable import Cable
from backends.virtual.can_bridge import CanBridge
from backends.virtual.virtual_posix import VirtualPosix
from backends.virtual.virtual_uno import VirtualUno
from sceann_hil.errors import CannotWrite, ConfigError
from sceann_hil.firmware.build import Board
from sceann_hil.firmware.emulated.pseudo_terminal import needs_pseudo_terminals
from sceann_hil.firmware.emulated.qemu import QemuBoard
from sceann_hil.link.can_bus import AdapterProblem, open_can
from sceann_hil.plugins import RobotConfig

PACED_BAUD = {Board.UNO: 115_200}


@dataclass(frozen=True, slots=True)
class VirtualRobot:
    """A virtual robot that is on.

    Attributes:
        line: keys of a configuration's robot section that lead to it: ``port`` and ``baud``, or ``can``.
        body: the configuration of the robot whose body it has; None for a board that only serves mode hil.
        rig_address: ``host:port`` of its rig; None without a body.
        node: its number.
        seed: of its gap: one robot has one for its whole life, in every mode.
    """

    line: dict[str, Any]
    body: RobotConfig | None
    rig_address: str | None
    node: int = 1
    seed: int = 1

    @property
    def modes(self) -> tuple[str, ...]:
        """What it can do, the usual one first; without a body of its own, on its pins, only hil."""
        return ("hil",) if self.rig_address is None else ("onboard", "tethered", "hil")

    def section(self, mode: str | None = None) -> dict[str, Any]:
        """The robot section of a configuration.

        Args:
            mode: by default the first of `modes`.

        Raises:
            ConfigError: it is none of `modes`.
        """
        mode = self.modes[0] if mode is None else mode
        if mode not in self.modes:
            raise ConfigError(
                f"mode: expected {' or '.join(self.modes)}, got {mode!r}.",
                "The boards posix and uno get a body from the CONFIG that is named after them; the others have none.",
            )
        section: dict[str, Any] = {"type": "remote", **self.line, "mode": mode}
        if self.node != 1:
            section["node"] = self.node
        if self.body is None:
            return section
        if mode == "hil":
            return {**section, "body": _for_life(self.body, self.seed)}
        spec = self.body.spec
        return {
            **section,
            "n_sensors": spec.n_sensors,
            "n_motors": spec.n_motors,
            "tick_s": spec.tick_s,
            "start_fields": list(spec.start_fields),
            "bumper": "rig",
            "rig": self.rig_address,
            "battery_range_v": [Battery().empty_v, Battery().full_v],
        }


@contextmanager
def switch_on(
    board: Board,
    robot: RobotConfig | None,
    *,
    port: Path | None = None,
    can: str | None = None,
    baud: int | None = None,
    store: Path | None = None,
    rig_port: int = 0,
    battery_s: float = 3600.0,
    seed: int = 1,
    node: int = 1,
    start: Sequence[float] | None = None,
) -> Iterator[VirtualRobot]:
    """A virtual robot for as long as the block lasts.

    Args:
        board: which firmware.
        robot: simulated; its body and gap. None for a board without a body.
        port: where a link to its serial port appears.
        can: ``INTERFACE:CHANNEL`` instead of a serial port.
        baud: pace of the posix board's line.
        store: file that keeps what an EEPROM keeps.
        rig_port: TCP port of its rig; 0 for any.
        battery_s: driven time that its battery lasts.
        seed: of noise and gap.
        node: its number.
        start: where its body stands, in the order of the robot's start fields.

    Raises:
        ConfigError: the board cannot have this body, line or store.
        ToolMissing: this system has no pseudo-terminals.
        CannotWrite: there is something else at `port`, or `store` cannot be kept.
    """
    needs_pseudo_terminals()
    if can is not None and board is Board.UNO:
        raise ConfigError("--can: expected a board on a line of its own, got uno.", "Leave --can out.")
    if node != 1 and board not in (Board.POSIX, Board.UNO):
        raise ConfigError(f"--node: expected a posix or uno board, got {board.value}.", "Leave --node out.")
    if board is Board.PICO:
        raise ConfigError(
            "BOARD: the emulated pico runs slower than real time and has no port.",
            "`sceann verify RUN --board pico` tries it; for a robot take posix or uno.",
        )
    if store is not None and board not in (Board.POSIX, Board.LM3S6965):
        raise ConfigError(f"--store: expected a posix or lm3s6965 board, got {board.value}.", "Leave --store out.")
    _check_store(store)
    with ExitStack() as stack:
        body = _body(robot, seed, battery_s, board, start)
        rig = None
        if board is Board.UNO:
            try:
                uno = stack.enter_context(VirtualUno(body, rig_port, node))
            except ValueError as error:
                raise ConfigError(f"{error}.", "Take another CONFIG, or the posix board.") from error
            line: dict[str, Any] = {"port": _linked(stack, uno.port, port), "baud": PACED_BAUD[board]}
            rig = uno.rig
        else:
            if board is Board.POSIX:
                posix = stack.enter_context(
                    VirtualPosix(body, baud=baud, store=store, terminal=False, rig_port=rig_port, node=node)
                )
                end, rig = posix.socket, posix.rig
            else:
                end = stack.enter_context(QemuBoard(board, eeprom=store)).line.socket
            line = _line(stack, end, port, can, baud)
        yield VirtualRobot(line, robot, rig.address if rig is not None else None, node, seed)


def _for_life(body: RobotConfig, number: int) -> dict[str, Any]:
    """The section of a body whose gap is one robot's, as on a board that has the body on its pins."""
    section = body.model_dump(mode="json")
    gap = section.get("gap") or {}
    drawn = [one for it in gap.values() for one in (it if isinstance(it, list) else [it]) if isinstance(one, dict)]
    if drawn and gap.get("drawn") == Drawn.PER_TRIAL:
        gap.update(drawn=Drawn.PER_ROBOT.value, robot=number)
    return section


def _body(
    robot: RobotConfig | None, seed: int, battery_s: float, board: Board, start: Sequence[float] | None
) -> VirtualBody | None:
    if robot is None or board not in (Board.POSIX, Board.UNO):
        return None
    simulated = robot.build()
    if not isinstance(simulated, SimulatedBody):
        raise ConfigError(f"robot.type: expected a simulated robot, got {robot.type}.", "Name another CONFIG.")
    return VirtualBody(simulated, seed, Battery(lasts_s=battery_s), start)


def _line(stack: ExitStack, end: socket.socket, port: Path | None, can: str | None, baud: int | None) -> dict[str, Any]:
    if can is not None:
        interface, _, channel = can.partition(":")
        # frames for machines of one's own stay on it
        options: dict[str, Any] = {"hop_limit": 0} if interface == "udp_multicast" else {}
        try:
            bus = open_can(interface, channel, **options)
        except AdapterProblem as error:
            raise ConfigError(f"--can {can}: {error}.", "Try udp_multicast:239.74.163.2.") from error
        stack.callback(CanBridge(end, bus).close)
        return {"can": {"interface": interface, "channel": channel, **({"options": options} if options else {})}}
    if port is None:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="sceann-")))
        port = folder / "port"
    _check_free(port)
    stack.callback(Cable(end, port).close)
    return {"port": str(port), "baud": baud or 115_200}


def _linked(stack: ExitStack, terminal: str, port: Path | None) -> str:
    if port is None:
        return terminal
    _check_free(port)
    port.symlink_to(terminal)
    stack.callback(port.unlink, missing_ok=True)
    return str(port)


def _check_store(store: Path | None) -> None:
    """The board's program would give up by itself, behind a robot that says that it is on."""
    if store is None:
        return
    if store.is_dir() or not os.access(store if store.exists() else store.parent, os.W_OK):
        raise CannotWrite(f"--store: expected a file that can be written, got {store}.", "Choose another --store.")


def _check_free(port: Path) -> None:
    if port.is_symlink() and not port.exists():
        port.unlink()
    if port.exists() or port.is_symlink():
        raise CannotWrite(f"{port}: there is something at this place already.", "Choose another --port.")
