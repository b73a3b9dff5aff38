"""The trial state machine and its safety rules on the posix board, asserted at the motor driver."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.firmware.emulated.posix import Alarm, RecordKind
from sceann_hil.link.framing import encode_frame
from sceann_hil.link.numbers import LINK_VERSION
from sceann_hil.link.vocabulary import Mode, Op, Status, Telemetry
from sceann_hil.network.controller import ARITHMETIC_ID, state_hash
from sceann_hil.network.image import ControllerImage
from tests.firmware.rig import REASON, SENSORS, STATE, TICK_S, Rig, an_image
from tests.link.oracle import NoAnswer, Refused, RobotClient


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    made = Rig(tmp_path / "store")
    yield made
    made.close()


def refusal(client: RobotClient, op: Op, **arguments: int) -> Status:
    with pytest.raises(Refused) as refused:
        client.request(op, **arguments)
    return refused.value.status


START = {"MaxTicks": 10, "Telemetry": 0}


class TestOnboard:
    def test_drives_what_the_reference_computes_and_reports_its_hash(self, rig: Rig) -> None:
        rig.start(max_ticks=25)
        end = rig.wait_for("End").signals
        controller, states = an_image().controller(), []
        expected = []
        for _ in range(25):
            expected.append(tuple(int(x) for x in controller.step(np.array(SENSORS))))
            states.append(controller.u.copy())
        rig.until(rig.motors_are_safe)
        assert rig.driven() == expected
        assert end == {"TrialId": 1, "Reason": REASON["MAX_TICKS"], "Ticks": 25, "StateHash": state_hash(states)}
        rig.until(rig.motors_are_safe)

    def test_telemetry_carries_sensors_states_and_motors_of_each_tick(self, rig: Rig) -> None:
        client = rig.start(max_ticks=20, telemetry=Telemetry.SENSE | Telemetry.DRIVE | Telemetry.STATES)
        seen: dict[str, list[dict[str, int]]] = {"Sense": [], "Drive": [], "NeuronStates": []}
        for message in client.receive(2.0):
            if message.name in seen:
                seen[message.name].append(message.signals)
            if message.name == "End":
                break
            client.heartbeat()
        controller = an_image().controller()
        for tick in range(20):
            motors = controller.step(np.array(SENSORS))
            assert [seen["Sense"][tick][f"Sensor{k}"] for k in range(3)] == SENSORS
            assert [seen["Drive"][tick][f"Motor{k}"] for k in range(2)] == motors.tolist()
            first, second = seen["NeuronStates"][2 * tick : 2 * tick + 2]
            assert [first["U0"], first["U1"], first["U2"], second["U0"]] == controller.u.tolist()

    def test_max_ticks_ends_a_trial_after_its_last_whole_period(self, rig: Rig) -> None:
        rig.start(max_ticks=10)
        rig.wait_for("End")
        rig.until(rig.motors_are_safe)
        times = [r.time_us for r in rig.records if r.kind is RecordKind.DRIVE]
        safe = next(r.time_us for r in rig.records if r.kind is RecordKind.SAFE and r.time_us > times[-1])
        assert safe - times[0] >= 9.5 * TICK_S * 1e6

    def test_stop_makes_the_motors_safe_and_ends_the_trial(self, rig: Rig) -> None:
        client = rig.start()
        rig.until(lambda: len(rig.driven()) > 3)
        client.request(Op.STOP)
        assert rig.wait_for("End").signals["Reason"] == REASON["STOPPED"]
        rig.until(rig.motors_are_safe)


class TestLinkLoss:
    @pytest.mark.parametrize("mode", [Mode.ONBOARD, Mode.TETHERED])
    def test_a_silent_host_makes_the_motors_safe_within_350_ms(self, rig: Rig, mode: Mode) -> None:
        client = rig.start(mode=mode, max_ticks=10_000)
        if mode is Mode.TETHERED:
            client.expect("Sense")
            client.drive_in(0, 700, 300)
        rig.until(lambda: len(rig.driven()) > 0)
        started = rig.records[0].time_us
        reason = rig.wait_for("End", heartbeat=False).signals["Reason"]
        assert reason == (REASON["LINK_LOST"] if mode is Mode.ONBOARD else REASON["OVERRUN"])
        rig.until(rig.motors_are_safe)
        assert (rig.last_output().time_us - started) & 0xFFFFFFFF < 1_000_000
        assert rig.wait_for("Heartbeat").signals["State"] == STATE["SAFE"]

    def test_the_deadline_counts_from_the_last_heartbeat(self, rig: Rig) -> None:
        client = rig.start(max_ticks=10_000)
        for _ in range(6):
            time.sleep(0.1)
            client.heartbeat()
        before = len(rig.driven())
        rig.until(lambda: len(rig.driven()) > before)
        drive_times = [r.time_us for r in rig.records if r.kind is RecordKind.DRIVE]
        last_heartbeat = drive_times[-1]
        rig.wait_for("End", heartbeat=False)
        assert rig.last_output().time_us - last_heartbeat < 350_000 + 100_000  # + what was driven since the heartbeat

    def test_a_killed_host_process_is_a_silent_host(self, rig: Rig) -> None:
        rig.start(max_ticks=10_000)
        rig.until(lambda: len(rig.driven()) > 0)
        assert rig.board.line is not None
        rig.board.line.close()
        rig.until(rig.motors_are_safe, heartbeat=False)

    def test_heartbeats_of_another_session_do_not_count(self, rig: Rig) -> None:
        client = rig.start(max_ticks=10_000)
        assert rig.board.line is not None
        other = RobotClient(rig.board.line, session=client.session % 65535 + 1)
        for _ in range(10):
            other.heartbeat()
            time.sleep(0.05)
        assert rig.wait_for("End", heartbeat=False).signals["Reason"] == REASON["LINK_LOST"]

    def test_an_armed_robot_without_a_host_goes_safe(self, rig: Rig) -> None:
        rig.ready().request(Op.ARM)
        rig.wait_for("Event", heartbeat=False, Code=2, State=STATE["SAFE"])

    def test_safe_is_left_only_by_clear(self, rig: Rig) -> None:
        client = rig.start(max_ticks=10_000)
        rig.wait_for("Event", heartbeat=False, Code=2, State=STATE["SAFE"])
        assert refusal(client, Op.ARM) is Status.BAD_STATE
        client.request(Op.STOP)
        assert refusal(client, Op.ARM) is Status.BAD_STATE
        client.request(Op.CLEAR)
        client.request(Op.ARM)


class TestStops:
    def test_estop_is_latched_until_clear(self, rig: Rig) -> None:
        client = rig.start()
        rig.until(lambda: len(rig.driven()) > 3)
        client.send("Estop")
        assert rig.wait_for("End").signals["Reason"] == REASON["ESTOP"]
        rig.until(rig.motors_are_safe)
        assert refusal(client, Op.ARM) is Status.BAD_STATE
        assert rig.wait_for("Heartbeat").signals["State"] == STATE["ESTOP"]
        client.request(Op.CLEAR)
        client.request(Op.ARM)

    def test_estop_works_for_a_robot_of_any_node_in_any_state(self, rig: Rig) -> None:
        assert rig.board.line is not None
        rig.board.line.write(b"\0" + encode_frame(0, b"anything"))
        rig.wait_for("Heartbeat", State=STATE["ESTOP"])

    @pytest.mark.parametrize("alarm", [Alarm.BREAK, Alarm.ESTOP])
    def test_a_break_or_a_stop_button_is_an_estop(self, rig: Rig, alarm: Alarm) -> None:
        client = rig.start()
        rig.raise_alarm(alarm)
        assert rig.wait_for("End").signals["Reason"] == REASON["ESTOP"]
        rig.raise_alarm(Alarm.ESTOP)
        assert refusal(client, Op.CLEAR) is Status.ALARM
        rig.raise_alarm(Alarm.NONE)
        client.request(Op.CLEAR)

    @pytest.mark.parametrize(("alarm", "reason"), [(Alarm.BUMPER, "BUMPER"), (Alarm.BATTERY, "BATTERY")])
    def test_bumper_and_battery_end_the_trial(self, rig: Rig, alarm: Alarm, reason: str) -> None:
        client = rig.start()
        rig.raise_alarm(alarm)
        assert rig.wait_for("End").signals["Reason"] == REASON[reason]
        rig.until(rig.motors_are_safe)
        rig.wait_for("Heartbeat", State=STATE["LOADED"])
        assert refusal(client, Op.ARM) is Status.ALARM

    def test_a_body_that_does_not_answer_is_a_fault(self, rig: Rig) -> None:
        rig.start()
        rig.mute = True
        assert rig.wait_for("End").signals["Reason"] in (REASON["FAULT"], REASON["OVERRUN"])
        rig.until(rig.motors_are_safe)

    def test_the_watchdog_restarts_a_hanging_robot_with_its_motors_safe(self, rig: Rig) -> None:
        client = rig.start(max_ticks=10_000)
        rig.until(lambda: len(rig.driven()) > 3)
        os.kill(rig.board.process.pid, signal.SIGUSR1)
        boot = rig.wait_for("Event", Code=1).signals
        assert boot["Argument"] == 1  # the first start, before the trial
        boot = rig.wait_for("Event", Code=1).signals
        assert boot["Argument"] == 3
        rig.until(rig.motors_are_safe)
        with pytest.raises(Refused) as refused:
            client.request(Op.ARM)
        assert refused.value.status is Status.NO_SESSION
        assert rig.last() == (1, 255)


class TestTethered:
    def test_the_host_drives_tick_by_tick(self, rig: Rig) -> None:
        client = rig.start(mode=Mode.TETHERED, max_ticks=20)
        sent = []
        for tick in range(20):
            sense = client.expect("Sense")
            assert (sense["Tick"], sense["Sensor1"]) == (tick % 16, SENSORS[1])
            sent.append((10 * tick, 1024 - tick))
            client.drive_in(tick, *sent[-1])
            client.heartbeat()
        end = rig.wait_for("End").signals
        assert (end["Ticks"], end["Reason"], end["StateHash"]) == (20, REASON["MAX_TICKS"], 0xFFFF)
        assert rig.driven() == sent

    def test_needs_no_genome(self, rig: Rig) -> None:
        rig.client.hello()
        rig.client.start(1, 3, Mode.TETHERED, TICK_S)
        rig.client.expect("Sense")

    def test_commands_of_another_tick_or_out_of_range_move_nothing(self, rig: Rig) -> None:
        client = rig.start(mode=Mode.TETHERED, max_ticks=100)
        client.expect("Sense")
        client.drive_in(77, 1, 1)
        assert rig.wait_for("Event", Code=7).signals["Argument"] == 77
        assert rig.board.line is not None
        rig.board.line.write(encode_frame(0x301, bytes([0, client.session % 256, 0xFF, 0xFF, 0, 0, 0, 0])))
        rig.wait_for("End")
        assert rig.driven() == []

    def test_three_ticks_without_a_command_end_in_safe(self, rig: Rig) -> None:
        rig.start(mode=Mode.TETHERED, max_ticks=1000)
        end = rig.wait_for("End").signals
        assert (end["Reason"], end["Ticks"]) == (REASON["OVERRUN"], 3)
        rig.wait_for("Heartbeat", State=STATE["SAFE"])


class TestHil:
    def run(self, client: RobotClient, image: ControllerImage, n_ticks: int) -> None:
        generator, controller = np.random.default_rng(0), image.controller()
        for tick in range(n_ticks):
            sensors = generator.integers(0, 1024, image.size.n_sensors)
            u, motors, _ = client.hil_step(tick, sensors, image.size.n_neurons, image.size.n_motors)
            assert np.array_equal(motors, controller.step(sensors))
            assert np.array_equal(u, controller.u)

    @pytest.mark.parametrize("n_sensors", [1, 6, 7, 12])
    def test_one_and_two_pages_of_sensors(self, rig: Rig, n_sensors: int) -> None:
        image = an_image(n_sensors)
        client = rig.ready(image)
        client.start(1, 300, Mode.HIL, telemetry=Telemetry.STATES)
        self.run(client, image, 300)
        assert rig.wait_for("End").signals["Ticks"] == 300
        assert rig.driven() == []

    def test_a_repeated_tick_is_answered_again_and_steps_nothing(self, rig: Rig) -> None:
        client = rig.ready(an_image(7))
        client.start(1, 2, Mode.HIL)
        sensors = np.arange(7) * 100
        client.sense_in(0, sensors)
        first = client.expect("Drive")
        client.sense_in(0, sensors)
        assert client.expect("Drive") == first
        client.sense_in(1, sensors)
        last, end = client.expect("Drive"), client.expect("End")
        client.sense_in(1, sensors)
        assert client.expect("Drive") == last
        assert client.expect("End") == end

    def test_a_tick_out_of_order_is_an_event_and_steps_nothing(self, rig: Rig) -> None:
        client = rig.ready()
        client.start(1, 5, Mode.HIL)
        client.sense_in(5, np.zeros(3, int))
        assert rig.wait_for("Event", Code=7).signals["Argument"] == 5
        client.sense_in(0, np.zeros(3, int))
        assert client.expect("Drive")["Tick"] == 0

    def test_a_second_page_alone_steps_nothing(self, rig: Rig) -> None:
        client = rig.ready(an_image(8))
        client.start(1, 5, Mode.HIL)
        client.send("SenseInPage2", {**{f"Sensor{k}": 0 for k in range(6, 12)}, "Tick": 0})
        with pytest.raises(NoAnswer):
            client.expect("Drive", 0.1)
        client.sense_in(0, np.zeros(8, int))
        client.expect("Drive")


class TestCommands:
    def test_a_session_comes_first(self, rig: Rig) -> None:
        for op in (Op.LOAD, Op.COMMIT, Op.ARM, Op.START, Op.CLEAR, Op.STORE, Op.STORED):
            assert refusal(rig.client, op, **_arguments(op)) is Status.NO_SESSION
        rig.client.request(Op.STOP)
        assert rig.last() == (0, 0)

    @pytest.mark.parametrize(
        ("change", "status"),
        [({"LinkVersion": LINK_VERSION - 1}, Status.LINK_VERSION), ({"ArithmeticId": 1}, Status.ARITHMETIC)],
    )
    def test_other_versions_are_refused_but_described(self, rig: Rig, change: dict[str, int], status: Status) -> None:
        arguments = {"LinkVersion": LINK_VERSION, "Session": 9, "ArithmeticId": ARITHMETIC_ID} | change
        assert refusal(rig.client, Op.HELLO, **arguments) is status
        assert rig.client.expect("Descriptor")["ArithmeticId"] == ARITHMETIC_ID

    def test_a_second_host_is_refused_while_the_first_is_alive(self, rig: Rig) -> None:
        rig.client.hello()
        assert rig.board.line is not None
        second = RobotClient(rig.board.line, session=rig.client.session % 65535 + 1)
        with pytest.raises(Refused) as refused:
            second.hello()
        assert refused.value.status is Status.OTHER_HOST
        time.sleep(1.05)
        second.hello()

    @pytest.mark.parametrize(
        ("change", "status"),
        [
            ({"TrialId": 0}, Status.BAD_ARGUMENT),
            ({"MaxTicks": 0}, Status.BAD_ARGUMENT),
            ({"TickPeriod": 0}, Status.BAD_ARGUMENT),
            ({"TickPeriod": 2501}, Status.BAD_ARGUMENT),
            ({"Mode": 3}, Status.BAD_ARGUMENT),
        ],
    )
    def test_start_refuses_bad_arguments(self, rig: Rig, change: dict[str, int], status: Status) -> None:
        client, change = rig.ready(), dict(change)
        client.request(Op.ARM, TickPeriod=change.pop("TickPeriod", 200))
        assert refusal(client, Op.START, **({"TrialId": 1, "Mode": 0, **START} | change)) is status
        assert rig.driven() == []

    def test_start_needs_arm_a_genome_and_the_right_sizes(self, rig: Rig) -> None:
        client = rig.client
        client.hello()
        client.request(Op.ARM)
        assert refusal(client, Op.START, TrialId=1, Mode=0, **START) is Status.NO_GENOME
        client.request(Op.STOP)
        client.upload(an_image(n_sensors=4))
        assert refusal(client, Op.START, TrialId=1, Mode=0, **START) is Status.BAD_STATE
        client.request(Op.ARM)
        assert refusal(client, Op.START, TrialId=1, Mode=0, **START) is Status.WRONG_SIZE

    def test_a_trial_never_runs_twice(self, rig: Rig) -> None:
        client = rig.start(trial_id=7, max_ticks=5)
        assert client.request(Op.START, TrialId=7, Mode=0, **START)["TrialId"] == 7
        rig.wait_for("End")
        client.request(Op.ARM)
        assert refusal(client, Op.START, TrialId=7, Mode=0, **START) is Status.ALREADY_RUN

    def test_a_running_robot_takes_no_genome(self, rig: Rig) -> None:
        client = rig.start(max_ticks=10_000)
        with pytest.raises(Refused) as refused:
            client.upload(an_image(seed=2))
        assert refused.value.status is Status.BAD_STATE

    @pytest.mark.parametrize(
        ("change", "status"),
        [
            ({"Coding": 0}, Status.BAD_ARGUMENT),
            ({"Coding": 4}, Status.BAD_ARGUMENT),
            ({"Neuron": 2}, Status.BAD_ARGUMENT),
            ({"Sensors": 0}, Status.BAD_ARGUMENT),
            ({"Motors": 0}, Status.BAD_ARGUMENT),
            ({"InitialOutput": 1025}, Status.BAD_ARGUMENT),
            ({"Sensors": 13}, Status.TOO_LARGE),
            ({"Motors": 4}, Status.TOO_LARGE),
            ({"Hidden": 19}, Status.TOO_LARGE),
            ({"Hidden": 255, "Sensors": 15, "Motors": 15}, Status.TOO_LARGE),
        ],
    )
    def test_load_refuses_what_it_cannot_hold_and_keeps_the_old_genome(
        self, rig: Rig, change: dict[str, int], status: Status
    ) -> None:
        client = rig.ready()
        header = {"Coding": 2, "Neuron": 0, "Sensors": 3, "Hidden": 2, "Motors": 2, "InitialOutput": 512}
        assert refusal(client, Op.LOAD, **(header | change)) is status
        client.start(1, 5, Mode.ONBOARD, TICK_S)
        rig.wait_for("End")
        assert len(rig.driven()) == 5

    def test_an_upload_broken_off_leaves_the_old_genome(self, rig: Rig) -> None:
        client, new = rig.ready(), an_image(seed=2)
        client.request(Op.LOAD, Coding=2, Neuron=0, Sensors=3, Hidden=2, Motors=2, InitialOutput=512)
        client.send("Genome", {"Chunk": 0, **{f"Byte{k}": b for k, b in enumerate(new.packed_genome[:7])}})
        commit = {"GenomeCrc": new.record_crc}
        assert refusal(client, Op.COMMIT, **commit) is Status.MISSING_CHUNK if len(new.packed_genome) > 7 else True
        client.start(1, 3, Mode.ONBOARD, TICK_S)
        rig.wait_for("End")
        controller = an_image().controller()
        assert rig.driven() == [tuple(int(x) for x in controller.step(np.array(SENSORS))) for _ in range(3)]

    def test_a_wrong_crc_is_not_committed(self, rig: Rig) -> None:
        client, new = rig.ready(), an_image(seed=2)
        client.request(Op.LOAD, Coding=2, Neuron=0, Sensors=3, Hidden=2, Motors=2, InitialOutput=512)
        packed = new.packed_genome.ljust(14, b"\0")
        for chunk in range(2):
            part = packed[7 * chunk : 7 * chunk + 7]
            client.send("Genome", {"Chunk": chunk, **{f"Byte{k}": b for k, b in enumerate(part)}})
        with pytest.raises(Refused) as refused:
            client.request(Op.COMMIT, GenomeCrc=new.record_crc ^ 1)
        assert refused.value.status is Status.BAD_CRC
        assert refused.value.reply["Crc"] == new.record_crc

    def test_broken_frames_are_counted_and_never_acted_on(self, rig: Rig) -> None:
        rig.client.hello()
        assert rig.board.line is not None
        good = encode_frame(0, b"")
        for k in range(len(good) - 1):
            broken = bytearray(good)
            broken[k] ^= 0x10
            rig.board.line.write(bytes(broken) + b"\0")
        rig.board.line.write(bytes(range(1, 200)) + b"\0\0\0")
        beat = rig.wait_for("Heartbeat").signals
        while beat["ReceiveErrors"] == 0:
            beat = rig.wait_for("Heartbeat").signals
        assert beat["State"] == STATE["IDLE"]


class TestPowerCycle:
    def test_an_ended_trial_is_remembered(self, rig: Rig) -> None:
        rig.start(trial_id=300, max_ticks=5)
        end = rig.wait_for("End").signals
        time.sleep(0.05)
        rig.board.power_off()
        rig.board.power_on()
        rig.client.events.clear()
        assert rig.last() == (300, REASON["MAX_TICKS"])
        assert rig.wait_for("End").signals == end

    def test_a_trial_cut_off_is_unfinished(self, rig: Rig) -> None:
        rig.start(trial_id=301, max_ticks=10_000)
        rig.until(lambda: len(rig.driven()) > 5)
        rig.board.power_off()
        rig.board.power_on()
        assert rig.last() == (301, 255)
        rig.until(rig.motors_are_safe)

    def test_a_stored_genome_runs_by_itself_after_three_seconds(self, rig: Rig) -> None:
        client = rig.ready()
        assert client.store(autorun_tick_s=TICK_S) == an_image().record_crc
        rig.board.power_off()
        rig.records.clear()
        rig.board.power_on()
        rig.until(lambda: len(rig.driven()) > 20, timeout_s=8.0, heartbeat=False)
        controller = an_image().controller()
        expected = [tuple(int(x) for x in controller.step(np.array(SENSORS))) for _ in range(20)]
        assert rig.driven()[:20] == expected
        client.hello()
        rig.until(rig.motors_are_safe)
        assert client.request(Op.STORED)["StoredGenomeCrc"] == an_image().record_crc
        client.request(Op.STORE, StoreAction=0, AutorunTickPeriod=0)
        assert refusal(client, Op.STORED) is Status.NO_GENOME


def _arguments(op: Op) -> dict[str, int]:
    return {
        Op.LOAD: {"Coding": 1, "Neuron": 0, "Sensors": 1, "Hidden": 0, "Motors": 1, "InitialOutput": 512},
        Op.COMMIT: {"GenomeCrc": 0},
        Op.START: {"TrialId": 1, "Mode": 0, **START},
        Op.STORE: {"StoreAction": 1, "AutorunTickPeriod": 0},
    }.get(op, {})
