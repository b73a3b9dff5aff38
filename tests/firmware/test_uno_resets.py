"""What a real Uno does when its port is opened, when it hangs, and when its line is noisy: all on an emulated one."""

from __future__ import annotations

import os
import termios
import time
from collections.abc import Iterator

import pytest

from backends.virtual.virtual_uno import VirtualUno
from sceann_hil.firmware.emulated.simavr import HZ, POWER_ON, UnoBoard
from sceann_hil.firmware.flash import opened
from sceann_hil.link.numbers import BATTERY_LOW_S
from sceann_hil.link.session import Refused as LinkRefused
from sceann_hil.link.vocabulary import Mode, Op, State, Status
from tests.firmware.rig import REASON, STATE, an_image
from tests.firmware.test_uno import BAUD, IMAGE, SENSORS, loaded, messages
from tests.link.oracle import Refused, RobotClient

POWER, PIN, WATCHDOG = 1, 2, 3


@pytest.fixture
def board() -> Iterator[UnoBoard]:
    """Behind the boot loader that Unos ship with; its half second of waiting is over."""
    with UnoBoard(BAUD, booted=True) as made:
        made.set_sensors(SENSORS)
        yield made


def boot_cause(board: UnoBoard) -> int:
    """The reset cause of the next EVENT BOOT."""
    for message in RobotClient(board).receive(10.0):
        if message.name == "Event" and message.signals["Code"] == 1:
            return message.signals["Argument"]
    raise AssertionError("no EVENT BOOT")


def state(client: RobotClient) -> int:
    return messages(client, "Heartbeat", heartbeat=False)[-1].signals["State"]


class TestResetCauses:
    def test_power_reset_pin_and_watchdog_are_told_apart_behind_the_boot_loader(self, board: UnoBoard) -> None:
        """Regression: optiboot clears MCUSR, and every cause was 0."""
        assert boot_cause(board) == POWER
        board.reset()
        assert boot_cause(board) == PIN
        client = loaded(board)
        client.start(9, 1000, Mode.ONBOARD, 0.02)
        board.run(HZ // 10)
        board.hang()
        assert boot_cause(board) == WATCHDOG
        board.reset()
        assert boot_cause(board) == PIN

    def test_without_a_boot_loader_the_chip_tells_itself(self) -> None:
        with UnoBoard(BAUD, reset_flags=POWER_ON) as board:
            assert boot_cause(board) == POWER


class TestLatchedStop:
    def test_a_reset_does_not_clear_it(self, board: UnoBoard) -> None:
        """Regression: opening the port resets an Uno, and ESTOP became LOADED, ready to drive."""
        client = loaded(board)
        client.store()
        client.send("Estop")
        assert state(client) == STATE["ESTOP"]
        for _ in range(2):
            board.reset()
            client = RobotClient(board)
            client.hello()
            assert state(client) == STATE["ESTOP"]
            with pytest.raises(Refused) as refused:
                client.request(Op.ARM)
            assert refused.value.status is Status.BAD_STATE
        client.request(Op.CLEAR)
        board.reset()
        client = RobotClient(board)
        client.hello()
        assert state(client) == STATE["LOADED"]

    def test_it_does_not_run_by_itself_either(self, board: UnoBoard) -> None:
        client = loaded(board)
        client.store(autorun_tick_s=0.02)
        client.send("Estop")
        board.run(HZ // 10)
        board.reset()
        board.run(6 * HZ)
        assert board.motors == (0, 0)

    def test_opening_the_port_of_a_virtual_uno_resets_it_and_reconnecting_does_not(self) -> None:
        with VirtualUno(None) as uno:
            with opened(uno.port) as link:
                link.hello(6.0)
                link.emergency_stop()
                deadline = time.monotonic() + 3.0
                while link.state is not State.ESTOP and time.monotonic() < deadline:
                    link.receive(0.05)
            with opened(uno.port) as link:
                link.hello(6.0)
                uptime = link.uptime_ms
                assert link.boots == 0
                with pytest.raises(LinkRefused):
                    link.request(Op.ARM)
            assert uptime == 0 or uptime > 500
            # a program that knows nothing of this lets DTR fall, and the next one resets the board
            terminal = os.open(uno.port, os.O_RDWR | os.O_NOCTTY)
            settings = termios.tcgetattr(terminal)
            settings[2] |= termios.HUPCL
            termios.tcsetattr(terminal, termios.TCSANOW, settings)
            time.sleep(0.1)
            os.close(terminal)
            time.sleep(0.2)
            with opened(uno.port) as link:
                link.hello(6.0)
                deadline = time.monotonic() + 3.0
                while link.state is None and time.monotonic() < deadline:
                    link.receive(0.05)
                assert link.state is State.ESTOP


class TestBreak:
    def test_one_bad_stop_bit_is_no_stop_and_loses_nothing(self, board: UnoBoard) -> None:
        """Regression: every frame ends in a zero byte; with a bad stop bit it was a latched emergency stop."""
        client = loaded(board)
        client.start(1, 1000, Mode.ONBOARD, 0.02)
        for _ in range(20):
            board.bad_stop_bit()
            board.run(HZ // 50)
            client.heartbeat()
        assert state(client) == STATE["RUNNING"]

    def test_a_break_is(self, board: UnoBoard) -> None:
        client = loaded(board)
        client.start(1, 1000, Mode.ONBOARD, 0.02)
        board.run(HZ // 20)
        board.send_break()
        board.run(HZ // 50)
        assert board.motors == (0, 0)
        assert messages(client, "End")[-1].signals["Reason"] == REASON["ESTOP"]


class TestBattery:
    def test_it_is_measured_right_when_the_supply_sags_with_it(self, board: UnoBoard) -> None:
        """Regression: the reference sags with the battery, and 4.5 V read 6.6 V."""
        client = loaded(board)
        for battery_mv, supply_mv in ((8400, 5000), (6000, 5000), (5000, 4000), (4500, 3400)):
            board.set_supply(supply_mv)
            board.set_millivolts(5, battery_mv // 3)
            board.run(HZ // 5)
            board.read(0.0)
            told = [m.signals["Battery"] for m in messages(client, "Heartbeat") if m.name == "Heartbeat"]
            assert abs(told[-1] - battery_mv) < 0.02 * battery_mv

    def test_a_dip_of_a_starting_motor_ends_no_trial_and_an_empty_battery_does(self, board: UnoBoard) -> None:
        board.set_millivolts(5, 7000 // 3)
        client = loaded(board)
        client.start(1, 10_000, Mode.ONBOARD, 0.02)
        for _ in range(10):
            board.set_millivolts(5, 4000 // 3)
            board.run(int(0.5 * BATTERY_LOW_S * HZ))
            board.set_millivolts(5, 7000 // 3)
            board.run(int(0.5 * BATTERY_LOW_S * HZ))
            client.heartbeat()
        assert state(client) == STATE["RUNNING"]
        board.set_supply(3400)
        board.set_millivolts(5, 4500 // 3)
        assert messages(client, "End")[-1].signals["Reason"] == REASON["BATTERY"]


def test_byte_0_of_the_eeprom_is_never_written() -> None:
    """It is the first to be lost in a brown-out."""
    with UnoBoard(BAUD) as board:
        client = loaded(board)
        for _ in range(2):
            client.store()
        client.request(Op.NODE, NewNode=1)
        client.start(1, 3, Mode.ONBOARD, 0.02)
        messages(client, "End")
        client.request(Op.STORE, StoreAction=0)
        board.run(HZ)
        assert board.eeprom[0] == 0xFF
        assert board.eeprom[1:] != b"\xff" * 1023


@pytest.mark.parametrize("baud", [115_200, 500_000])
def test_the_shortest_period_that_it_names_is_one_that_it_keeps(baud: int) -> None:
    """With the telemetry of an onboard trial and the largest network that drives it."""
    import numpy as np

    from sceann_hil.network.coding import Coding, NetworkSize
    from tests.firmware.networks import ControllerImage

    size = NetworkSize(5, 16, 2)
    genome = np.ones(Coding.SCEANN2.genome_length(size), np.uint8)
    image = ControllerImage(genome, Coding.SCEANN2, size)
    with UnoBoard((f"-DBAUD={baud}UL",)) as board:
        board.set_sensors(SENSORS)
        client = RobotClient(board)
        shortest_s = client.hello().tick_min_s
        client.upload(image)
        client.start(1, 400, Mode.ONBOARD, shortest_s, 3)  # type: ignore[arg-type]
        for message in client.receive(20.0):
            assert not (message.name == "Event" and message.signals["Code"] == 3), "an overrun"
            if message.name == "Heartbeat":
                client.heartbeat()
            if message.name == "End":
                assert message.signals["Reason"] == REASON["MAX_TICKS"]
                return
    raise AssertionError("no END")


def test_a_network_with_one_motor_never_drives_a_body_with_two() -> None:
    image = an_image(n_sensors=5, n_motors=1)
    with UnoBoard(BAUD) as board:
        client = loaded(board, image)
        with pytest.raises(Refused) as refused:
            client.store(autorun_tick_s=0.02)
        assert refused.value.status is Status.WRONG_SIZE
        assert client.store() == image.record_crc
        assert IMAGE.record_crc != image.record_crc
