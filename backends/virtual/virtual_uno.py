"""The Uno in simavr as a virtual robot: real ADC, PWM and UART drivers, a simulated two-wheeled body on its pins.

Chip time keeps pace with the clock. The body moves in steps of its own tick, not in those of the control loop: like a
real robot it does not wait for its controller.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass

from backends.virtual.body import VirtualBody
from backends.virtual.rig_server import RigServer
from backends.virtual.usb_socket import Socket
from sceann_hil.firmware.emulated.simavr import HZ, UnoBoard
from sceann_hil.network.controller import ONE

SLICE_S = 0.001
_MOST_BEHIND_S = 0.1
_BATTERY_CHANNEL = 5
_MAX_SENSORS = 5
_FULL_DUTY = 255
LOG_LENGTH = 100_000


@dataclass(frozen=True, slots=True)
class PinChange:
    """The motor driver's inputs changed.

    Attributes:
        time_s: `time.monotonic`.
        duty: of motor 0 (left) and motor 1 (right), -255..255; (0, 0) is the safe output.
    """

    time_s: float
    duty: tuple[int, int]


class VirtualUno:
    """An Arduino Uno with our firmware, the boot loader that Unos ship with, and a body, on a pseudo-terminal.

    Attributes:
        body: what it drives; None for a board that only serves mode hil.
        rig: puts the body back; None without a body.
        port: path of the pseudo-terminal.
        driver_log: changes at the motor driver, oldest first.

    Args:
        body: a body with two motors and at most five sensors.
        rig_port: TCP port of the rig; 0 for any.
        node: the number that it was given.

    Raises:
        ValueError: the body does not fit an Uno.
        ToolMissing: the boot loader is not installed.
    """

    def __init__(self, body: VirtualBody | None, rig_port: int = 0, node: int = 1) -> None:
        self.body = body
        flags: tuple[str, ...] = ()
        if body is not None:
            spec = body.robot.spec
            if spec.n_motors != 2 or spec.n_sensors > _MAX_SENSORS:
                raise ValueError(
                    f"body: expected 2 motors and at most {_MAX_SENSORS} sensors for an Uno, "
                    f"got {spec.n_motors} and {spec.n_sensors}"
                )
            flags = (f"-DSCEANN_UNO_SENSORS={spec.n_sensors}",)
        self._flags = (*flags, *((f"-DSCEANN_UNO_NODE={node}",) if node != 1 else ()))
        self._board = UnoBoard(self._flags, booted=True)
        self._socket = Socket()
        self.port = self._socket.port
        self.driver_log: deque[PinChange] = deque(maxlen=LOG_LENGTH)
        self.rig = RigServer(body, rig_port) if body is not None else None
        self._power_cycle = threading.Event()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="virtual uno", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        start_s = time.monotonic()
        due_s = next_tick_s = start_s
        duty = (0, 0)
        while not self._closing.is_set():
            if self._power_cycle.is_set():
                eeprom = self._board.eeprom
                self._board.close()
                self._board = UnoBoard(self._flags, eeprom, booted=True)
                self._power_cycle.clear()
            if self._socket.opened():
                self._board.reset()
            self._board.write(self._socket.read())
            if self.body is not None and due_s >= next_tick_s:
                next_tick_s += self.body.robot.spec.tick_s
                self._exchange(self.body, duty)
            self._board.run(int(SLICE_S * HZ))
            data = self._board.read(0.0)
            if data:
                self._socket.write(data)
            if self._board.motors != duty:
                duty = self._board.motors
                self.driver_log.append(PinChange(time.monotonic(), duty))
            due_s += SLICE_S
            now_s = time.monotonic()
            if now_s - due_s > _MOST_BEHIND_S:
                # a machine that is too slow makes a slow robot, not one that hurries afterwards
                next_tick_s += now_s - due_s
                due_s = now_s
            time.sleep(max(0.0, due_s - now_s))

    def _exchange(self, body: VirtualBody, duty: tuple[int, int]) -> None:
        body.drive([max(0, ONE * value // _FULL_DUTY) for value in duty])
        self._board.set_sensors(body.sense())
        self._board.set_bumper(body.pressed)
        self._board.set_analogue(_BATTERY_CHANNEL, body.battery_mv * 1024 // 15_000)

    def power_cycle(self) -> None:
        """Off and on again; the EEPROM keeps what is in it."""
        self._power_cycle.set()
        while self._power_cycle.is_set() and self._thread.is_alive():
            time.sleep(SLICE_S)

    def close(self) -> None:
        """Switch it off."""
        self._closing.set()
        self._thread.join()
        if self.rig is not None:
            self.rig.close()
        self._board.close()
        self._socket.close()

    def __enter__(self) -> VirtualUno:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
