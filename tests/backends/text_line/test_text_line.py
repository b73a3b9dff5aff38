"""A robot of text lines: what it is told, what is believed of its answers, and how it is stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from backends.text_line import TextLineConfig
from backends.text_line.answers import Pattern
from sceann_hil.config import load_config
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import EndReason, LinkError, Results, Trials
from sceann_hil.robot.diagnosis import Verdict
from sceann_hil.testing import RobotConformance
from tests.backends.text_line.sketch import Answer, Sketch, right_answer, rover

SIZE = NetworkSize(3, 1, 2)


@pytest.fixture
def sketch() -> Iterator[Sketch]:
    with Sketch() as sketch:
        yield sketch


def one_trial(max_steps: int = 5) -> Trials:
    return Trials(
        size=SIZE,
        dynamics=Dynamics(),
        weights=np.ones((1, SIZE.n_neurons, SIZE.n_sources), np.int8),
        genome_index=np.zeros(1, np.int32),
        starts=np.zeros((1, 3)),
        keys=np.zeros(1, np.uint64),
        max_steps=max_steps,
        ids=np.array([1]),
    )


def run(config: TextLineConfig, trials: Trials | None = None) -> tuple[Results, tuple[str, ...]]:
    with config.build() as robot:
        results = robot.run(trials or one_trial())
        return results, robot.health().messages


class TestTextLine(RobotConformance):
    max_steps = 8
    n_trials = 2

    @pytest.fixture(autouse=True)
    def _rover(self) -> Iterator[None]:
        with Sketch() as self.sketch:
            yield
            assert not self.sketch.wheels or self.sketch.wheels[-1] == "m 0 0"

    def config(self) -> TextLineConfig:
        return rover(self.sketch.port)


def test_sensors_and_motors_are_scaled(sketch: Sketch) -> None:
    config = rover(
        sketch.port,
        sensors=[{"at_0": 0, "at_1": 1023}, {"at_0": 1023, "at_1": 0}, {"at_0": 200, "at_1": 600, "most": 1023}],
        motors=[{"at_0": -1, "at_1": 1}, {"at_0": 0, "at_1": 255}],
        decimals=2,
    )
    results, _ = run(config, one_trial(1))
    assert results.traces is not None
    assert results.traces[0].sensors.tolist() == [[300, 511, 1023]]
    x = results.traces[0].x[0, -2:] / 1024.0
    driven = [line for line in sketch.wheels if line != "m 0 0"]
    assert driven == [f"m {2 * x[0] - 1:.2f} {255 * x[1]:.2f}"]


def test_the_robot_may_take_its_time_to_start() -> None:
    with Sketch(silent_s=0.4) as sketch:
        assert run(rover(sketch.port))[0].end_reasons.tolist() == [EndReason.TIME_UP]


def test_silence_at_the_start_is_a_link_error() -> None:
    with Sketch(lambda _: "") as sketch, pytest.raises(LinkError, match="to 's' it answered nothing within"):
        rover(sketch.port, start_s=0.2).build().connect()


def test_another_robot_is_not_taken_for_this_one() -> None:
    hello = {"say": "?", "answer": "light seeker {}"}
    with (
        Sketch(lambda said: "vacuum 3\n" if said == "?" else right_answer(said)) as sketch,
        pytest.raises(LinkError, match=r"to '\?' it expected an answer like 'light seeker {}', got 'vacuum 3'"),
    ):
        rover(sketch.port, start_s=0.2, hello=hello).build().connect()


def late(said: str) -> str:
    time.sleep(0.3)
    return right_answer(said)


@pytest.mark.parametrize(
    ("spoilt", "message"),
    [
        (lambda _: "", "answered nothing"),
        (lambda _: "300 51", "only '300 51', no whole line"),
        (lambda _: "300 512\n", "expected an answer like"),
        (lambda _: "300 512 700 9\n", "expected an answer like"),
        (lambda _: "300 512 7x0\n", "expected an answer like"),
        (lambda _: "300 512 nan\n", "expected an answer like"),
        (lambda _: "300 512 70000\n", "sensor 2: expected 0..1023, got 70000"),
        (lambda _: "\xff\xfe\n", "expected an answer like"),
        (lambda _: "300 512 700\n300 512 700\n", "without being asked"),
        (lambda _: 2000 * "9", "more than 1024 bytes"),
        (late, "answered nothing"),
    ],
)
def test_a_spoilt_answer_makes_the_trial_void_and_the_next_one_counts(spoilt: Answer, message: str) -> None:
    with Sketch() as sketch, rover(sketch.port).build() as robot:
        asked = 0

        def answer(said: str) -> str:
            nonlocal asked
            asked += said == "s"
            return spoilt(said) if said == "s" and asked == 3 else right_answer(said)

        sketch.answer = answer
        results = robot.run(one_trial())
        assert EndReason(results.end_reasons[0]) is EndReason.LINK_LOST
        assert any(message in told for told in robot.health().messages)
        assert sketch.wheels[-1] == "m 0 0"
        again = robot.run(one_trial())
        assert EndReason(again.end_reasons[0]) is EndReason.TIME_UP
        assert again.traces is not None
        assert again.traces[0].sensors.tolist() == [[300, 512, 700]] * 5


def test_an_answer_that_comes_late_is_not_taken_for_the_next_one() -> None:
    readings = iter(range(1000))

    def answer(said: str) -> str:
        if said != "s":
            return right_answer(said)
        number = next(readings)
        time.sleep(0.3 if number == 3 else 0.0)
        return f"{number} {number} {number}\n"

    with Sketch(answer) as sketch, rover(sketch.port).build() as robot:
        assert EndReason(robot.run(one_trial()).end_reasons[0]) is EndReason.LINK_LOST
        again = robot.run(one_trial())
        assert again.traces is not None
        first = int(again.traces[0].sensors[0, 0])
        assert again.traces[0].sensors[:, 0].tolist() == list(range(first, first + 5))


def test_a_person_stops_it_in_the_middle_of_an_answer(sketch: Sketch) -> None:
    asked = threading.Event()

    def slow(said: str) -> str:
        if said == "s":
            asked.set()
            time.sleep(0.03)
        return right_answer(said)

    with rover(sketch.port).build() as robot:
        sketch.answer = slow
        stopper = threading.Thread(target=lambda: (asked.wait(), robot.interrupt(EndReason.OPERATOR)))
        stopper.start()
        results = robot.run(one_trial(1000))
        stopper.join()
        assert EndReason(results.end_reasons[0]) is EndReason.OPERATOR
        assert sketch.wheels[-1] == "m 0 0"


def test_a_robot_that_does_not_confirm_its_stop_is_not_called_safe(sketch: Sketch) -> None:
    with rover(sketch.port).build() as robot:
        sketch.answer = lambda said: "" if said == "m 0 0" else right_answer(said)
        assert not robot.make_safe("test")
        sketch.answer = right_answer
        assert robot.make_safe("test")


def test_the_task_ends_where_the_sensors_say_so(sketch: Sketch) -> None:
    ends = [{"reason": "goal", "sensor": 2, "above": 0.6}]
    results, _ = run(rover(sketch.port, ends=ends))
    assert (EndReason(results.end_reasons[0]), int(results.steps[0])) == (EndReason.GOAL, 1)


def test_the_battery_is_asked_for_between_trials(sketch: Sketch) -> None:
    battery = {"say": "b", "answer": "{}", "range_v": [6.4, 8.4]}
    with rover(sketch.port, battery=battery).build() as robot:
        fraction = robot.health().battery_fraction
        assert fraction is not None
        assert fraction == pytest.approx(0.5)
    assert rover(sketch.port).build().health().battery_fraction is None


def test_a_port_that_is_not_there() -> None:
    with pytest.raises(LinkError, match="cannot be opened"):
        rover("/dev/there-is-no-such-port").build().connect()


def test_the_doctor_looks_at_line_sensors_and_motors(sketch: Sketch) -> None:
    findings = list(rover(sketch.port, tick_s=1.0).build().diagnose(lambda _, movement: movement()))
    assert [finding.check for finding in findings] == ["connection", "timing", "sensors", "motors"]
    assert all(finding.verdict is Verdict.GOOD for finding in findings)
    assert "m 76 0" in sketch.wheels
    assert "m 0 76" in sketch.wheels


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sensors": [{"at_0": 0, "at_1": 1023}]}, "sense.answer: expected 1 times {}"),
        ({"drive": {"say": "m {}"}}, "drive.say: expected 2 times {}"),
        ({"sense": {"say": "s", "answer": "{}{}{}"}}, "expected something between two numbers"),
        ({"motors": [{"at_0": 3, "at_1": 3}] * 2}, "at_1: expected another number than at_0"),
        ({"motors": [{"at_0": 0, "at_1": 255, "most": 100}] * 2}, "least: expected at_0 and at_1 within 0..100"),
        ({"ends": [{"reason": "goal", "sensor": 3, "above": 0.5}]}, "ends: expected a sensor 0..2, got 3"),
        ({"battery": {"say": "b", "answer": "full", "range_v": [6, 8]}}, "battery.answer: expected one"),
        ({"battery": {"say": "b", "answer": "{}", "range_v": [8, 6]}}, "battery.range_v: expected"),
        ({"sense": {"say": "s\nm 255 255", "answer": "{} {} {}"}}, "say"),
    ],
)
def test_a_section_that_cannot_work_is_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match="validation error") as error:
        rover("/dev/null", **change)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("pattern", "line", "numbers"),
    [
        ("{} {}", "  -3   4.5 ", (-3.0, 4.5)),
        ("l={},r={}", "l=+1,r=-2", (1.0, -2.0)),
        ("ok", "ok", ()),
        ("(a.b) {}%", "(a.b) 50%", (50.0,)),
    ],
)
def test_patterns_read_numbers(pattern: str, line: str, numbers: tuple[float, ...]) -> None:
    assert Pattern(pattern).read(line) == numbers


def test_the_example_is_this_robot() -> None:
    config = load_config(Path(__file__).parents[3] / "examples" / "light_seeker.yaml")
    assert isinstance(config.robot, TextLineConfig)
    assert config.robot.spec.n_sensors == 3
