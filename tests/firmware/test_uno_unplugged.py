"""What an emulated Uno does without a host, and what it keeps without power."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from sceann_hil.firmware.emulated.simavr import HZ, UnoBoard
from sceann_hil.link.framing import Deframer
from sceann_hil.link.vocabulary import Mode, Op, Status, StoreAction
from tests.firmware.rig import STATE, an_image
from tests.firmware.test_uno import BAUD, IMAGE, SENSORS, loaded, messages, watched
from tests.link.oracle import Refused, RobotClient


@pytest.fixture
def board() -> Iterator[UnoBoard]:
    with UnoBoard(BAUD) as made:
        made.set_sensors(SENSORS)
        yield made


def state(client: RobotClient) -> int:
    return messages(client, "Heartbeat", heartbeat=False)[-1].signals["State"]


def press_and_let_go(board: UnoBoard) -> None:
    board.set_start_button(True)
    board.run(HZ // 5)
    board.set_start_button(False)
    board.run(HZ // 5)


class TestUnplugged:
    def test_a_network_of_another_body_is_not_run(self) -> None:
        """Regression: a board that was flashed with other sensors keeps its EEPROM."""
        with UnoBoard((*BAUD, "-DSCEANN_UNO_SENSORS=3u")) as board:
            client = loaded(board, an_image(n_sensors=3))
            client.store(autorun_tick_s=0.02)
            eeprom = board.eeprom
        with UnoBoard(BAUD, eeprom=eeprom) as board:
            board.set_sensors(SENSORS)
            client = RobotClient(board)
            seen = [m for m in client.receive(5.0) if m.name == "Event"]
            assert any(m.signals["Code"] == 9 for m in seen)
            assert board.motors == (0, 0)
            assert state(client) == STATE["LOADED"]

    def test_the_start_button_starts_and_ends_a_champion_and_the_light_tells(self, board: UnoBoard) -> None:
        client = loaded(board)
        client.store(0.02, StoreAction.BUTTON)
        board.reset()
        board.run(8 * HZ)
        assert board.motors == (0, 0)
        board.set_start_button(True)
        board.run(HZ // 5)
        assert board.motors != (0, 0)
        assert board.light
        board.set_start_button(False)
        board.run(2 * HZ)
        assert board.motors != (0, 0)
        board.set_start_button(True)
        board.run(HZ // 5)
        assert board.motors == (0, 0)

    def test_a_button_that_is_held_does_not_start_a_robot_that_has_a_host(self, board: UnoBoard) -> None:
        client = loaded(board)
        client.store(0.02, StoreAction.BUTTON)
        client.heartbeat()
        board.set_start_button(True)
        board.run(HZ // 5)
        assert board.motors == (0, 0)

    def test_a_hello_ends_it_also_from_the_host_that_it_had(self, board: UnoBoard) -> None:
        """Regression: the host that had fallen silent came back and took a robot that went on driving by itself."""
        client = loaded(board)
        client.store(0.02, StoreAction.BUTTON)
        board.run(2 * HZ)
        press_and_let_go(board)
        assert board.motors != (0, 0)
        client.hello()
        assert board.motors == (0, 0)
        assert state(client) == STATE["LOADED"]

    def test_a_button_that_is_held_when_power_comes_on_starts_nothing(self, board: UnoBoard) -> None:
        """Regression: a stuck button was a press."""
        loaded(board).store(0.02, StoreAction.BUTTON)
        with UnoBoard(BAUD, eeprom=board.eeprom) as again:
            again.set_sensors(SENSORS)
            again.set_start_button(True)
            again.run(5 * HZ)
            assert again.motors == (0, 0)
            again.set_start_button(False)
            again.run(HZ // 5)
            press_and_let_go(again)
            assert again.motors != (0, 0)

    def test_a_button_pressed_against_a_wall_starts_nothing_when_the_wall_goes(self, board: UnoBoard) -> None:
        """Regression: letting the bumper go was a press."""
        loaded(board).store(0.02, StoreAction.BUTTON)
        board.run(2 * HZ)
        board.set_bumper(True)
        board.set_start_button(True)
        board.run(HZ // 5)
        board.set_bumper(False)
        board.run(HZ // 5)
        assert board.motors == (0, 0)


class TestNode:
    def test_a_number_is_kept_without_power(self) -> None:
        with UnoBoard(BAUD) as board:
            client = RobotClient(board)
            client.hello()
            client.request(Op.NODE, NewNode=42)
            again = RobotClient(board, node=42)
            again.session = client.session
            again.hello()
            eeprom = board.eeprom
        with UnoBoard(BAUD, eeprom=eeprom) as board:
            assert RobotClient(board, node=42).hello().node == 42

    @pytest.mark.parametrize("number", [0, 128, 255])
    def test_no_such_number(self, number: int) -> None:
        with UnoBoard(BAUD) as board:
            client = RobotClient(board)
            client.hello()
            with pytest.raises(Refused) as refused:
                client.request(Op.NODE, NewNode=number)
            assert refused.value.status is Status.BAD_ARGUMENT

    def test_a_write_cut_off_leaves_the_old_number_or_the_new_one(self) -> None:
        """Regression: the robot fell back to number 1, which another one on its bus may have."""
        with UnoBoard(BAUD) as board:
            client = RobotClient(board)
            client.hello()
            client.request(Op.NODE, NewNode=42)
            moved = RobotClient(board, node=42, session=client.session)
            contents = list(watched(board, moved, Op=11, NewNode=43))
        assert len(contents) == 5  # number and its check, twice
        nodes = [node_after(content) for content in contents]
        assert nodes == [42, 42, 43, 43, 43]


def node_after(eeprom: bytes) -> int:
    """The number that a robot with this memory speaks from."""
    with UnoBoard(BAUD, eeprom=eeprom) as board:
        board.run(HZ // 10)
        (node,) = {identifier & 0x7F for identifier, _ in Deframer().feed(board.read(0.5))}
    return node


class TestMemoryThatDoesNotHold:
    """Cells that fall back to what they were."""

    @staticmethod
    def refusal(board: UnoBoard, client: RobotClient, **command: int) -> int:
        """The status of a command whose writes do not last."""
        contents = watched(board, client, **command)
        before = next(contents)
        while True:
            try:
                next(contents)
            except StopIteration as end:
                return int(end.value)
            board.eeprom = before

    def test_a_genome_is_not_said_to_be_kept(self, board: UnoBoard) -> None:
        client = loaded(board)
        client.store()
        client.upload(an_image(n_sensors=5, seed=2))
        assert self.refusal(board, client, Op=8, StoreAction=1, AutorunTickPeriod=0) == Status.STORE_FAILED
        assert client.request(Op.STORED)["StoredGenomeCrc"] == IMAGE.record_crc

    def test_a_number_is_not_either(self, board: UnoBoard) -> None:
        client = loaded(board)
        assert self.refusal(board, client, Op=11, NewNode=9) == Status.STORE_FAILED
        assert client.hello().node == 1

    def test_a_trial_that_could_not_be_noted_does_not_start(self, board: UnoBoard) -> None:
        client = loaded(board)
        client.request(Op.ARM, TickPeriod=200)
        status = self.refusal(board, client, Op=5, TrialId=7, MaxTicks=9, Mode=int(Mode.ONBOARD), Telemetry=0)
        assert status == Status.STORE_FAILED
        assert board.motors == (0, 0)
