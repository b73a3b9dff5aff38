"""The Raspberry Pi Pico in rp2040js, and the Uno a second time in avr8js: whole firmware and exported headers."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.firmware.build import AVR, Board
from sceann_hil.firmware.emulated.javascript import JavaScriptBoard
from sceann_hil.firmware.emulated.measure import with_header
from sceann_hil.firmware.header import Optimize, c_header
from sceann_hil.firmware.verify import random_sequences, verify
from sceann_hil.link.framed_bus import LineBus
from sceann_hil.link.messages import LinkEnd, store_arguments
from sceann_hil.link.onboard import run_onboard
from sceann_hil.link.session import Refused, RobotLink
from sceann_hil.link.trial import Order
from sceann_hil.link.upload import upload_image
from sceann_hil.link.vocabulary import Op, State, Status, StoreAction
from sceann_hil.network.controller import state_hash
from sceann_hil.network.image import ControllerImage
from tests.firmware.rig import an_image

ROOT = Path(__file__).parents[2]
SENSORS = [100, 511, 1000]
PICO_IMAGE = an_image(n_sensors=3)


def on(board: JavaScriptBoard) -> RobotLink:
    link = RobotLink(LineBus(board))
    link.hello(2.0)
    return link


def onboard_trial(link: RobotLink, board: JavaScriptBoard, image: ControllerImage, sensors: list[int]) -> None:
    """20 steps with the body at the pins against the reference."""
    for channel, value in enumerate(sensors):
        board.set_analogue(channel, value)
    upload_image(link, image)
    follower = run_onboard(link, Order(1, 20, 0.02, len(sensors), 2), None, None)
    controller, crc = image.controller(), 0xFFFF
    for tick in range(20):
        motors = controller.step(np.array(sensors))
        crc = state_hash(controller.u, crc)
        assert follower.sensors[tick].tolist() == sensors
        assert follower.motors[tick].tolist() == motors.tolist()
    assert follower.end is not None
    assert (follower.end.reason, follower.end.state_hash) == (LinkEnd.MAX_TICKS, crc)


class TestPico:
    def test_a_trial_with_its_own_sensors_and_motors(self) -> None:
        with JavaScriptBoard(Board.PICO) as board:
            link = on(board)
            onboard_trial(link, board, PICO_IMAGE, SENSORS)
            assert board.motors == (0, 0)
            link.close()

    def test_pwm_follows_the_controller_and_the_stop_button_ends_it(self) -> None:
        with JavaScriptBoard(Board.PICO) as board:
            for channel, value in enumerate(SENSORS):
                board.set_analogue(channel, value)
            link = on(board)
            link.request(Op.ARM, b"\xc8\x00")
            link.request(Op.START, b"\x01\x00\x64\x00\x01")
            from sceann_hil.link.messages import pack_drive
            from sceann_hil.link.vocabulary import Function

            while True:
                incoming = link.receive(0.1)
                if incoming is not None and incoming.function == Function.SENSE:
                    break
            link.send(Function.DRIVE_IN, pack_drive(0, link.session, (700, 300)))
            board.run(0.004)
            assert board.motors == (700, 300)
            board.set_pin(15, False)
            board.run(0.01)
            assert board.motors == (0, 0)
            while link.receive(0.05) is not None and link.state is not State.ESTOP:
                pass
            board.set_pin(15, True)
            with pytest.raises(Refused) as refused:
                link.request(Op.ARM, b"\xc8\x00")
            assert refused.value.status is Status.BAD_STATE
            link.close()

    def test_what_it_stores_survives_a_power_cut_in_every_flash_operation(self) -> None:
        """The whole firmware, with its own driver; every byte is cut in test_flash_store."""
        other = an_image(n_sensors=3, seed=2)
        with JavaScriptBoard(Board.PICO) as board:
            link = on(board)
            upload_image(link, PICO_IMAGE)
            link.request(Op.STORE, b"\x01")
            stored = board.store
            link.close()
        operation = 0
        while True:
            operation += 1
            with JavaScriptBoard(Board.PICO, store=stored) as board:
                link = on(board)
                upload_image(link, other)
                board.cut_power_at(operation)
                try:
                    link.request(Op.STORE, b"\x01", tries=1)
                    done = not board.dark
                except Exception:
                    done = False
                left = board.store
                link._closing.set()
            with JavaScriptBoard(Board.PICO, store=left) as board:
                link = on(board)
                found = link.request(Op.STORED).u32()
                link.close()
            if done:
                assert found == other.record_crc
                break
            assert found in (PICO_IMAGE.record_crc, other.record_crc)
        assert operation > 2

    def test_a_champion_in_its_flash_runs_when_its_button_is_pressed(self) -> None:
        with JavaScriptBoard(Board.PICO) as board:
            link = on(board)
            upload_image(link, an_image(n_sensors=2))
            with pytest.raises(Refused) as refused:
                link.request(Op.STORE, store_arguments(StoreAction.BUTTON, 0.05))
            assert refused.value.status is Status.WRONG_SIZE
            upload_image(link, PICO_IMAGE)
            link.request(Op.STORE, store_arguments(StoreAction.BUTTON, 0.05))
            stored = board.store
            link.close()
        with JavaScriptBoard(Board.PICO, store=stored) as board:
            for channel, value in enumerate(SENSORS):
                board.set_analogue(channel, value)
            board.run(0.05)
            assert board.motors == (0, 0)
            for runs in (True, False):
                board.set_pin(13, False)
                board.run(0.06)
                board.set_pin(13, True)
                board.run(0.02)
                assert (board.motors != (0, 0)) is runs
                assert board.light or not runs

    def test_its_second_stage_is_what_its_source_gives(self) -> None:
        done = subprocess.run([sys.executable, ROOT / "tools" / "pico_boot2", "--check"], check=False)
        assert done.returncode == 0


class TestSecondEmulatorOfTheUno:
    def test_every_state_is_equal(self) -> None:
        image = an_image(n_sensors=5)
        with JavaScriptBoard(Board.UNO) as board:
            link = RobotLink(LineBus(board))
            result = verify(link, image, random_sequences(np.random.default_rng(5), 6, 12, 5))
            link.close()
        assert result.equal, result.difference

    def test_a_trial_with_its_own_sensors_and_motors(self) -> None:
        with JavaScriptBoard(Board.UNO) as board:
            link = on(board)
            onboard_trial(link, board, an_image(n_sensors=5), [0, 100, 511, 512, 1023])
            link.close()

    def test_a_header_passes_its_self_test(self, tmp_path: Path) -> None:
        text = c_header(PICO_IMAGE, "net", Optimize.SPEED)
        program = with_header(AVR, "header_says.c", text, tmp_path, ("-DNET_SELF_TEST", "-DBAUD=115200UL"))
        with JavaScriptBoard(Board.UNO, program) as board:
            assert board.run(0.2)[:1] == b"\x01"
