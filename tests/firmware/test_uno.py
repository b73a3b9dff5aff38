"""The Uno's drivers in simavr: ADC, PWM, UART, BREAK, EEPROM, watchdog, asserted at the chip's pins and registers."""

from __future__ import annotations

from collections.abc import Generator, Iterator

import numpy as np
import pytest

from sceann_hil.firmware.build import AVR, Board, build_board
from sceann_hil.firmware.emulated.measure import section_sizes
from sceann_hil.firmware.emulated.simavr import HZ, UnoBoard
from sceann_hil.link.numbers import LINK_VERSION
from sceann_hil.link.vocabulary import Mode, Op, Status, Telemetry
from sceann_hil.network.controller import state_hash
from sceann_hil.network.image import ControllerImage
from tests.firmware.rig import REASON, an_image
from tests.link.oracle import Message, Refused, RobotClient

BAUD = ("-DBAUD=500000UL",)
SENSORS = [0, 100, 511, 512, 1023]
IMAGE = an_image(n_sensors=5)


def duty(motor: int) -> int:
    return 255 if motor >= 1020 else motor >> 2


@pytest.fixture
def board() -> Iterator[UnoBoard]:
    with UnoBoard(BAUD) as made:
        made.set_sensors(SENSORS)
        yield made


def loaded(board: UnoBoard, image: ControllerImage = IMAGE) -> RobotClient:
    client = RobotClient(board)
    client.hello()
    client.upload(image)
    return client


def messages(client: RobotClient, until: str, heartbeat: bool = True) -> list[Message]:
    seen = []
    for message in client.receive(20.0):
        seen.append(message)
        if message.name == until:
            return seen
        if heartbeat:
            client.heartbeat()
    raise AssertionError(f"no {until}")


def test_reads_its_inputs_and_drives_pwm_as_the_reference_computes(board: UnoBoard) -> None:
    client = loaded(board)
    client.start(1, 30, Mode.ONBOARD, 0.005, Telemetry.SENSE | Telemetry.DRIVE)
    controller, states, tick = IMAGE.controller(), [], 0
    for message in client.receive(20.0):
        if message.name == "Sense":
            assert [message.signals[f"Sensor{k}"] for k in range(5)] == SENSORS
            client.heartbeat()
        if message.name == "Drive":
            motors = controller.step(np.array(SENSORS))
            states.append(controller.u.copy())
            assert board.motors == (duty(int(motors[0])), duty(int(motors[1]))), tick
            tick += 1
        if message.name == "End":
            assert message.signals["StateHash"] == state_hash(states)
            break
    assert tick == 30
    assert board.motors == (0, 0)


def test_reversing_motors_go_both_ways() -> None:
    with UnoBoard((*BAUD, "-DSCEANN_UNO_REVERSE=1")) as board:
        client = RobotClient(board)
        client.hello()
        client.start(1, 100, Mode.TETHERED, 0.02)
        for tick, (motors, expected) in enumerate(
            [((0, 1024), (-255, 255)), ((512, 512), (0, 0)), ((256, 768), (-128, 128)), ((511, 513), (0, 0))]
        ):
            client.expect("Sense")
            client.heartbeat()
            client.drive_in(tick, *motors)
            board.run(HZ // 200)
            assert board.motors == expected


def test_a_silent_host_makes_the_pins_safe_within_350_ms(board: UnoBoard) -> None:
    client = loaded(board)
    client.start(1, 1000, Mode.ONBOARD, 0.02)
    while board.motors == (0, 0):
        board.run(HZ // 1000)
    client.heartbeat()
    began = board.cycles
    while board.motors != (0, 0):
        board.run(HZ // 1000)
    assert 0.25 * HZ < board.cycles - began < 0.35 * HZ
    assert messages(client, "End", heartbeat=False)[-1].signals["Reason"] == REASON["LINK_LOST"]


@pytest.mark.parametrize("cause", ["break", "button", "estop"])
def test_every_stop_acts_within_one_tick(board: UnoBoard, cause: str) -> None:
    client = loaded(board)
    client.start(1, 1000, Mode.ONBOARD, 0.02)
    while board.motors == (0, 0):
        board.run(HZ // 1000)
    match cause:
        case "break":
            board.send_break()
        case "button":
            board.set_stop_button(True)
        case "estop":
            client.send("Estop")
    board.run(HZ // 50)
    assert board.motors == (0, 0)
    assert messages(client, "End")[-1].signals["Reason"] == REASON["ESTOP"]
    board.set_stop_button(False)
    client.request(Op.CLEAR)
    client.request(Op.ARM)


def test_the_bumper_ends_a_trial(board: UnoBoard) -> None:
    client = loaded(board)
    client.start(1, 1000, Mode.ONBOARD, 0.02)
    board.set_bumper(True)
    assert messages(client, "End")[-1].signals["Reason"] == REASON["BUMPER"]
    assert board.motors == (0, 0)


def test_the_battery_is_measured_and_ends_a_trial_when_low(board: UnoBoard) -> None:
    board.set_analogue(5, 500)
    client = loaded(board)
    assert abs(messages(client, "Heartbeat")[-1].signals["Battery"] - 500 * 15000 // 1024) < 20
    client.start(1, 1000, Mode.ONBOARD, 0.02)
    board.set_analogue(5, 300)
    assert messages(client, "End")[-1].signals["Reason"] == REASON["BATTERY"]


def test_a_hanging_program_is_restarted_by_the_watchdog_with_its_motors_off(board: UnoBoard) -> None:
    client = loaded(board)
    client.start(9, 1000, Mode.ONBOARD, 0.02)
    while board.motors == (0, 0):
        board.run(HZ // 1000)
    board.hang()
    board.run(HZ)
    assert board.motors == (0, 0)
    boot = next(m for m in messages(RobotClient(board), "Heartbeat") if m.name == "Event" and m.signals["Code"] == 1)
    assert boot.signals["Argument"] == 3
    reply = RobotClient(board).request(Op.LAST)
    assert (reply["LastTrialId"], reply["LastReason"]) == (9, 255)


def test_genome_and_last_trial_survive_power_loss(board: UnoBoard) -> None:
    client = loaded(board)
    assert client.store() == IMAGE.record_crc
    client.start(700, 3, Mode.ONBOARD, 0.02)
    messages(client, "End")
    board.run(HZ // 10)
    with UnoBoard(BAUD, eeprom=board.eeprom) as again:
        client = RobotClient(again)
        client.hello()
        assert client.request(Op.STORED)["StoredGenomeCrc"] == IMAGE.record_crc
        assert client.request(Op.LAST)["LastTrialId"] == 700


WATCHED_CYCLES = 16
"""The simulated EEPROM takes a byte at once, and between two of them the program does more than this."""


def watched(board: UnoBoard, client: RobotClient, **command: int) -> Generator[bytes, None, int]:
    """Sends a command; then every content that the EEPROM has until the robot replies, the first one included.

    Returns:
        The reply's status.
    """
    seen = board.eeprom
    yield seen
    client.send("Command", {"Sequence": 9, "Session": client.session, **command})
    for _ in range(HZ // WATCHED_CYCLES):
        board.run(WATCHED_CYCLES)
        if board.eeprom != seen:
            seen = board.eeprom
            yield seen
        for message in client.at_hand():
            if message.name == "Reply":
                return message.signals["Status"]
    raise AssertionError("no reply within a second")


def test_a_store_cut_off_at_any_byte_leaves_the_old_genome() -> None:
    other = an_image(n_sensors=5, seed=2)
    with UnoBoard(BAUD) as board:
        client = loaded(board)
        client.store()
        client.upload(other)
        contents = list(watched(board, client, Op=8, StoreAction=1, AutorunTickPeriod=0))
    assert len(contents) > len(other.record)
    kept = []
    for content in contents:
        with UnoBoard(BAUD, eeprom=content) as again:
            client = RobotClient(again)
            client.hello()
            kept.append(client.request(Op.STORED)["StoredGenomeCrc"])
    changes = kept.index(other.record_crc)
    assert kept == [IMAGE.record_crc] * changes + [other.record_crc] * (len(kept) - changes)


def test_a_network_too_large_is_refused(board: UnoBoard) -> None:
    client = RobotClient(board)
    client.hello()
    with pytest.raises(Refused) as refused:
        client.request(Op.LOAD, Coding=3, Neuron=0, Sensors=12, Hidden=9, Motors=3, InitialOutput=0)
    assert refused.value.status is Status.TOO_LARGE


def test_two_runs_agree_to_the_cycle() -> None:
    def signature() -> tuple[int, bytes]:
        with UnoBoard(BAUD) as board:
            board.set_sensors(SENSORS)
            client = RobotClient(board, session=5)
            client.request(Op.HELLO, LinkVersion=LINK_VERSION, ArithmeticId=0x2557477E)
            board.run(HZ // 10)
            return board.cycles, board.read(0.0)

    assert signature() == signature()


def test_the_whole_firmware_fits_its_budget() -> None:
    flash, ram = section_sizes(build_board(Board.UNO), AVR.package, "avr-size")
    assert flash <= 12.5 * 1024
    assert ram <= 1024
