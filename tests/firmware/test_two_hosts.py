"""Who may command a robot, on emulated boards and on a CAN bus."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from backends.virtual.can_bridge import CanBridge
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.firmware.build import FIRMWARE, HOST_GCC, Board, build_board, compile_c
from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.firmware.emulated.simavr import HZ, UnoBoard, symbols
from sceann_hil.link.framing import encode_frame
from sceann_hil.link.messages import arm_arguments, load_arguments, node_arguments, start_arguments, store_arguments
from sceann_hil.link.numbers import LINK_VERSION
from sceann_hil.link.session import Refused, RobotLink, TwoRobots
from sceann_hil.link.upload import upload_image
from sceann_hil.link.vocabulary import Mode, Op, State, Status, StoreAction, Telemetry
from sceann_hil.network.controller import ARITHMETIC_ID
from sceann_hil.robot import LinkError
from tests.firmware.rig import TICK_S, Rig, an_image
from tests.firmware.test_uno import BAUD, IMAGE
from tests.link.oracle import Refused as OracleRefused
from tests.link.oracle import RobotClient

COMMANDS = {
    Op.LOAD: load_arguments(an_image()),
    Op.COMMIT: b"",
    Op.ARM: arm_arguments(TICK_S),
    Op.START: start_arguments(77, 10, Mode.HIL, Telemetry.NONE),
    Op.CLEAR: b"",
    Op.STORE: store_arguments(StoreAction.KEEP),
    Op.STORED: b"",
    Op.NODE: node_arguments(5),
}


@pytest.fixture
def channel(request: pytest.FixtureRequest) -> Iterator[str]:
    """A CAN bus with a posix board on it."""
    name = f"two hosts {request.node.name}"
    with PosixBoard(unique_id=1) as board:
        assert board.line is not None
        bridge = CanBridge(board.line.socket, can.Bus(interface="virtual", channel=name))
        yield name
        bridge.close()


def host(channel: str, session: int, node: int = 1) -> RobotLink:
    return RobotLink(can.Bus(interface="virtual", channel=channel), node, session)


class TestOnCan:
    @pytest.mark.parametrize("op", COMMANDS)
    def test_a_host_that_was_refused_commands_nothing(self, channel: str, op: Op) -> None:
        """Regression: LOAD, ARM and START were obeyed whoever sent them."""
        first, second = host(channel, 1), host(channel, 2)
        first.hello()
        with first.exclusive(), pytest.raises(LinkError, match="another host"):
            second.hello(patience_s=0.0)
        with pytest.raises(Refused) as refused:
            second.request(op, COMMANDS[op])
        assert refused.value.status is Status.NO_SESSION
        upload_image(first, an_image())
        first.close()
        second.close()

    def test_what_another_host_was_told_is_not_taken_for_an_answer(self, channel: str) -> None:
        """Regression: one time in sixteen the number of another host's request was the same as ours."""
        first, second = host(channel, 1), host(channel, 2)
        first._sequence = second._sequence = 3
        first.hello()
        with first.exclusive(), pytest.raises(LinkError, match="another host"):
            second.hello(patience_s=0.0)
        first.close()
        second.close()

    @pytest.mark.parametrize("op", COMMANDS)
    def test_a_host_whose_robot_was_taken_over_has_no_session(self, channel: str, op: Op) -> None:
        first, second = host(channel, 1), host(channel, 2)
        first.hello()
        first.let_go()
        second.hello()
        upload_image(second, an_image())
        with second.exclusive():
            second.request(Op.ARM, arm_arguments(TICK_S))
            with pytest.raises(Refused) as refused:
                first.request(op, COMMANDS[op])
            assert refused.value.status is Status.NO_SESSION
            while second.receive(0.0):
                pass
            assert second.state is State.ARMED
        first.close()
        second.close()

    def test_whoever_sees_that_it_must_stop_may_stop_it(self, channel: str) -> None:
        first, second = host(channel, 1), host(channel, 2)
        first.hello()
        first.request(Op.ARM, arm_arguments(TICK_S))
        second.request(Op.STOP)
        second.last()
        first.close()
        second.close()

    @pytest.mark.parametrize("kind", ["is_remote_frame", "is_extended_id"])
    def test_frames_that_the_link_does_not_have_are_no_emergency_stop(self, channel: str, kind: str) -> None:
        """Regression: a remote frame with identifier 0 was one."""
        link = host(channel, 1)
        link.hello()
        stranger = can.Bus(interface="virtual", channel=channel)
        for _ in range(5):
            stranger.send(can.Message(arbitration_id=0, **{"is_extended_id": False, kind: True}))  # type: ignore[arg-type]
        deadline = time.monotonic() + 0.5
        while time.monotonic() < deadline:
            link.receive(0.05)
        assert link.state is State.IDLE
        stranger.shutdown()
        link.close()

    def test_two_robots_on_one_node_are_seen(self, channel: str) -> None:
        """Regression: both obeyed every command, and the doctor blamed the cable."""
        with PosixBoard(unique_id=2) as twin:
            assert twin.line is not None
            bridge = CanBridge(twin.line.socket, can.Bus(interface="virtual", channel=channel))
            link = host(channel, 1)
            with pytest.raises(TwoRobots, match=r"2 robots have node 1 \(ids 0+1, 0+2\)"):
                link.hello(1.0)
            link.close()
            bridge.close()


def test_virtual_robots_differ_and_a_store_keeps_their_number(tmp_path: Path) -> None:
    ids = set()
    for store in (None, None, tmp_path / "a", tmp_path / "b", tmp_path / "a"):
        with VirtualPosix(None, store=store, terminal=False, node=9) as robot:
            link = RobotLinkOver(robot)
            ids.add(link.hello().unique_id)
            link.close()
    assert len(ids) == 4


def RobotLinkOver(robot: VirtualPosix) -> RobotLink:  # noqa: N802 - reads like a constructor
    from sceann_hil.firmware.emulated.sockets import SocketLine
    from sceann_hil.link.framed_bus import LineBus

    return RobotLink(LineBus(SocketLine(robot.socket)), node=9)


class TestTethered:
    def test_a_drive_in_of_another_host_moves_nothing(self) -> None:
        rig = Rig()
        try:
            client = rig.start(mode=Mode.TETHERED, max_ticks=20)
            assert rig.board.line is not None
            other = RobotClient(rig.board.line, session=client.session ^ 0x55)
            client.expect("Sense")
            other.drive_in(0, 900, 900)
            client.drive_in(0, 10, 20)
            rig.until(lambda: len(rig.driven()) > 0)
            assert set(rig.driven()) == {(10, 20)}
        finally:
            rig.close()


class TestUploads:
    """On the emulated Uno."""

    def test_a_refused_commit_changes_nothing_that_store_keeps(self) -> None:
        """Regression: the initial output was written before the check sum was looked at."""
        other = an_image(n_sensors=5, seed=2)
        with UnoBoard(BAUD) as board:
            client = RobotClient(board)
            client.hello()
            client.upload(IMAGE)
            with pytest.raises(OracleRefused):
                client.request(Op.COMMIT, GenomeCrc=IMAGE.record_crc ^ 1)
            assert client.store() == IMAGE.record_crc
            for part in ("load", "chunk", "commit"):
                client.request(Op.LOAD, **_load(other))
                if part != "load":
                    client.send("Genome", {"Chunk": 0, **{f"Byte{k}": 0 for k in range(7)}})
                if part == "commit":
                    with pytest.raises(OracleRefused):
                        client.request(Op.COMMIT, GenomeCrc=1)
                assert client.store() == IMAGE.record_crc, part
            client.start(1, 5, Mode.ONBOARD, 0.02)

    def test_a_silence_of_71_minutes_is_no_other_host(self) -> None:
        """Regression: the time since the host was heard wraps, and for a second it seemed to be there again."""
        sources = [Path(__file__).parent / "c" / "silence.c", *sorted((FIRMWARE / "src").glob("*.c"))]
        program = compile_c(HOST_GCC, sources, include=[FIRMWARE / "src"])
        assert subprocess.run([program], check=False, timeout=60).returncode == 0

    def test_nor_is_it_on_an_uno_whose_clock_has_wrapped(self) -> None:
        with UnoBoard(BAUD) as board:
            RobotClient(board).hello()
            board.run(2 * HZ)
            second = RobotClient(board)
            hello = bytes(
                [1, LINK_VERSION, *ARITHMETIC_ID.to_bytes(4, "little"), *second.session.to_bytes(2, "little")]
            )
            frame = encode_frame(0x401, hello)
            board.write(frame[:-1])
            board.run(HZ // 1000)
            # in the moment before the last byte the clock is once round: 0.3 s after the first host was heard
            overflows = symbols(build_board(Board.UNO, BAUD))["timer1_overflows"]
            count = int.from_bytes(board.peek(overflows, 4), "little") - round(1.7 / 0.032768)
            board.poke(overflows, (count % 2**32).to_bytes(4, "little"))
            board.write(frame[-1:])
            assert second.expect("Reply")["Status"] == Status.OK


def _load(image) -> dict[str, int]:
    return {
        "Coding": 2,
        "Neuron": 0,
        "Sensors": image.size.n_sensors,
        "Hidden": image.size.n_hidden,
        "Motors": image.size.n_motors,
        "InitialOutput": 7,
    }


class TestStoresThatFail:
    """A board whose store takes nothing, or not what it is given."""

    def test_a_trial_that_could_not_be_remembered_does_not_start(self, tmp_path: Path) -> None:
        rig = Rig(tmp_path / "store")
        try:
            client = rig.ready()
            rig.start(trial_id=3, max_ticks=5)
            rig.wait_for("End")
            (tmp_path / "store").chmod(0o600)
            fd = _limit_file_size(rig.board.process.pid, 0)
            assert fd
            client.request(Op.ARM)
            with pytest.raises(OracleRefused) as refused:
                client.request(Op.START, TrialId=4, MaxTicks=5, Mode=0, Telemetry=0)
            assert refused.value.status is Status.STORE_FAILED
            with pytest.raises(OracleRefused) as refused:
                client.request(Op.START, TrialId=4, MaxTicks=5, Mode=0, Telemetry=0)
            assert refused.value.status is Status.STORE_FAILED
            client.request(Op.STOP)
            with pytest.raises(OracleRefused) as refused:
                client.store()
            assert refused.value.status is Status.STORE_FAILED
            assert rig.last()[0] == 3
        finally:
            rig.close()


def _limit_file_size(pid: int, most: int) -> bool:
    """From now on the process can write no file beyond so many bytes, as on a full disk."""
    import resource

    resource.prlimit(pid, resource.RLIMIT_FSIZE, (most, most))
    return True
