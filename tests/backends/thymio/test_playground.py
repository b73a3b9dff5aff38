"""A Thymio in the makers' simulator: trials on board and tethered, stops, faults, a champion that is left on it."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from backends.thymio import ThymioConfig
from backends.thymio.onboard import OnboardThymio, robot_number
from backends.thymio.tethered import TetheredThymio
from sceann_hil.firmware.aesl.node import AsebaNode
from sceann_hil.firmware.aesl.program import End, Life, Senses, network_code
from sceann_hil.firmware.aesl.verify import verify_aseba
from sceann_hil.firmware.emulated.playground import ARENA, Playground
from sceann_hil.firmware.verify import random_sequences
from sceann_hil.link.aseba_line import AsebaLine
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics, Neuron
from sceann_hil.network.image import ControllerImage
from sceann_hil.robot import EndReason, LinkError, Results, Trials
from sceann_hil.robot.diagnosis import Verdict
from sceann_hil.testing import RobotConformance

pytestmark = pytest.mark.realtime

SIZE = NetworkSize(7, 2, 2)
WEIGHTS = np.random.default_rng(3).integers(-1, 2, (4, 11)).astype(np.int8)
TWIN = {"type": "thymio_twin", "arena_m": [1.1, 1.1]}


def thymio(**changes: Any) -> ThymioConfig:
    return ThymioConfig.model_validate_json(json.dumps({"type": "thymio", **changes}))


@pytest.fixture
def playground() -> Iterator[Playground]:
    with Playground(ARENA) as playground:
        yield playground


def one_trial(max_steps: int = 5, number: int = 1, start: tuple[float, float, float] = (0.55, 0.55, 0.0)) -> Trials:
    return Trials(
        size=SIZE,
        dynamics=Dynamics(),
        weights=WEIGHTS[None],
        genome_index=np.zeros(1, np.int32),
        starts=np.array([start]),
        keys=np.zeros(1, np.uint64),
        max_steps=max_steps,
        ids=np.array([number]),
        run_id=4,
    )


def node_at(playground: Playground) -> AsebaNode:
    node = AsebaNode(AsebaLine(None, playground.host))
    node.connect()
    return node


def motors(node: AsebaNode) -> tuple[int, ...]:
    return node.read(node.target.address("motor.left.target"), 2)


class TestOnboard(RobotConformance):
    max_steps = 3
    n_trials = 1
    mode = "onboard"

    host: str

    @pytest.fixture(autouse=True, scope="class")
    @classmethod
    def _simulator(cls) -> Iterator[None]:
        with Playground(ARENA) as playground:
            cls.host = playground.host
            yield

    def config(self) -> ThymioConfig:
        return thymio(host=self.host, mode=self.mode, tick_s=0.06, attended=False)


class TestTethered(TestOnboard):
    mode = "tethered"


@pytest.mark.parametrize("neuron", Neuron)
def test_the_robot_s_own_machine_computes_every_state_of_the_reference(playground: Playground, neuron: Neuron) -> None:
    size = NetworkSize(7, 5, 2)
    genome = np.random.default_rng(8).integers(0, 2, Coding.SCEANN3.genome_length(size)).astype(np.uint8)
    image = ControllerImage(genome, Coding.SCEANN3, size, Dynamics(neuron))
    node = node_at(playground)
    code = network_code(size, image.dynamics, Life(0.05, Senses()), node.target, image.weights)
    sequences = list(random_sequences(np.random.default_rng(9), 10, 100, 7))
    result = verify_aseba(node, image, code, sequences)
    assert result.equal, result.difference
    assert (result.steps, result.states) == (1000, 7000)
    other = replace(image, dynamics=Dynamics(neuron, 100))
    wrong = verify_aseba(node, other, code, sequences[:2])
    assert wrong.difference is not None
    node.close()


def test_a_simulated_robot_begins_every_trial_at_its_start() -> None:
    with thymio(playground=True, twin=TWIN).build() as robot:
        first = [
            traces[0].sensors[0].tolist()
            for start in ((0.98, 0.55, 0.0), (0.55, 0.55, 0.0), (0.98, 0.55, 0.0))
            if (traces := robot.run(one_trial(2, start=start)).traces) is not None
        ]
    # what the twin sees there, but for noise
    assert first[0][2] == pytest.approx(first[2][2], abs=8)
    assert first[0][2] > 800
    assert first[1] == [0] * 7


@pytest.mark.parametrize("mode", ["onboard", "tethered"])
def test_an_operator_s_stop_reaches_the_motors(playground: Playground, mode: str) -> None:
    robot = thymio(host=playground.host, mode=mode).build()
    with robot:
        threading.Timer(0.6, robot.interrupt, [EndReason.OPERATOR]).start()
        results = robot.run(one_trial(600))
        assert results.end_reasons.tolist() == [EndReason.OPERATOR]
        assert robot.make_safe("look")
    assert motors(node_at(playground)) == (0, 0)


def test_a_host_that_dies_leaves_a_robot_that_stops_and_remembers(playground: Playground) -> None:
    config = thymio(host=playground.host, attended=False)
    robot, trials = config.build(), one_trial(600)
    robot.connect()
    assert isinstance(robot, OnboardThymio)
    dead = threading.Thread(target=lambda: results.append(robot.run(trials)))
    results: list[Results] = []
    dead.start()
    time.sleep(0.8)
    # from now on nothing of this host reaches the robot: another program took its place
    node = node_at(playground)
    dead.join(5.0)
    assert results[0].end_reasons.tolist() == [EndReason.LINK_LOST]
    assert "another program" in results[0].why_void
    time.sleep(0.8)
    assert motors(node) == (0, 0)
    node.close()
    with config.build() as found:
        # it ended by itself, which is no result; the next trial runs
        assert found.settle(trials).end_reasons.tolist() == [EndReason.LINK_LOST]
        assert found.run(one_trial(3, 2)).end_reasons.tolist() == [EndReason.TIME_UP]
    with config.build() as again:
        settled = again.settle(one_trial(3, 2))
        assert (settled.end_reasons.tolist(), settled.steps.tolist()) == ([EndReason.TIME_UP], [3])
        assert robot_number(one_trial(3, 2)) == 7


class Accident:
    """Somebody who closes the simulator in a trial's third step."""

    def __init__(self, robot: OnboardThymio | TetheredThymio) -> None:
        self._robot = robot

    def begin(self, trial_id: int) -> None:
        """Nothing yet."""

    def step(self, step: int, sensors: NDArray[np.uint16], state: NDArray[np.float32]) -> None:
        playground = self._robot._connection._playground
        if step == 2 and playground is not None:
            playground.close()

    def end(self) -> None:
        """Nothing more."""


@pytest.mark.parametrize("mode", ["onboard", "tethered"])
def test_a_simulator_that_goes_ends_the_trial_and_is_started_again(mode: str) -> None:
    with thymio(playground=True, twin=TWIN, mode=mode).build() as robot:
        robot.observe(Accident(robot))
        lost = robot.run(one_trial(600))
        assert lost.end_reasons.tolist() == [EndReason.LINK_LOST]
        assert "its simulator, was switched off" in lost.why_void
        assert not robot.health().ok
        assert robot.run(one_trial(2, 3)).end_reasons.tolist() == [EndReason.TIME_UP]


def test_a_champion_runs_without_a_host_after_a_press_of_the_button(playground: Playground) -> None:
    node = node_at(playground)
    # whatever it sees, it turns
    weights = np.zeros((4, 11), np.int8)
    weights[2, 9], weights[3, 10] = 1, -1
    node.load(network_code(SIZE, Dynamics(), Life(0.06, Senses()), node.target, weights))
    button = node.target.address("button.center")

    def press() -> None:
        for value in (1, 0):
            node.write(button, [value])
            time.sleep(0.25)

    assert motors(node) == (0, 0)
    press()
    time.sleep(0.3)
    assert motors(node) != (0, 0)
    press()
    assert motors(node) == (0, 0)
    node.close()


def test_the_doctor_looks_at_everything_and_moves_when_allowed(playground: Playground) -> None:
    robot = thymio(host=playground.host, tick_s=0.06).build()
    findings = {finding.check: finding for finding in robot.diagnose(lambda _, movement: movement())}
    assert set(findings) == {"serial ports", "robot", "answers", "beat", "sensors", "silence", "motors"}
    assert {name: finding.detail for name, finding in findings.items() if finding.verdict is Verdict.BAD} == {}


def test_the_button_voids_a_trial(playground: Playground) -> None:
    config = thymio(host=playground.host)
    with config.build() as robot:

        def press() -> None:
            node = robot._connection.node
            node.write(node.target.address("button.center"), [1])

        threading.Timer(0.6, press).start()
        results = robot.run(one_trial(600))
    assert results.end_reasons.tolist() == [EndReason.OPERATOR]
    assert "centre button" in results.why_void
    assert End.BUTTON == 3


def test_a_robot_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"the robot cannot be reached.*Is the simulator"):
        thymio(host="127.0.0.1:9").build().connect()
    with pytest.raises(LinkError, match="there is no such port"):
        thymio(port=str(tmp_path / "ttyACM9")).build().connect()
