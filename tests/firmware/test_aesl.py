"""Controllers as AESL programs: the arithmetic, a trial's life, and what fits into a robot."""

from __future__ import annotations

import numpy as np
import pytest

from sceann_hil.firmware.aesl.compiler import compiled
from sceann_hil.firmware.aesl.program import (
    EVENTS,
    MEMORY,
    End,
    Life,
    Senses,
    motor_target,
    network_code,
    network_program,
    tethered_code,
)
from sceann_hil.firmware.aesl.target import THYMIO, WORDS_AT_ONCE
from sceann_hil.firmware.aesl.words import AeslError
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import THRESHOLD, Controller, Dynamics, Neuron, sigmoid, state_hash
from tests.firmware.aseba_vm import Machine, signed, told
from tests.firmware.networks import random_sensors

SIZE = NetworkSize(7, 2, 2)
LIFE = Life(0.05, Senses())
WEIGHTS = np.random.default_rng(4).integers(-1, 2, (4, 11)).astype(np.int8)


def machine() -> Machine:
    return Machine(network_code(SIZE, Dynamics(), LIFE, weights=WEIGHTS))


def see(robot: Machine, wire: np.ndarray) -> None:
    robot.set("prox.horizontal", *(4 * int(value) + 3 for value in wire))


@pytest.mark.parametrize("neuron", Neuron)
def test_every_state_gives_the_reference_s_output_and_hash(neuron: Neuron) -> None:
    states = np.arange(-THRESHOLD, THRESHOLD + 1)
    # a subroutine is reached by an event of its own
    text = network_program(WEIGHTS, SIZE, Dynamics(neuron), LIFE) + "onevent motor\ncallsub neuron\n"
    robot = Machine(compiled(text, THYMIO, EVENTS))
    robot.set("crc", -1)
    outputs = []
    for state in states.tolist():
        robot.set("a", state)
        robot.event("motor")
        assert robot.get("a") == (state,)
        outputs += robot.get("b")
    assert outputs == sigmoid(states).tolist()
    assert robot.get("crc")[0] & 0xFFFF == state_hash(states.astype(np.int16))
    for state in (THRESHOLD + 1, -THRESHOLD - 1, 31744, -31744):
        robot.set("a", state)
        robot.event("motor")
        assert robot.get("a") == (0,)
        assert robot.get("b") == ((512,) if neuron is Neuron.ACCUMULATING else (0,))


@pytest.mark.parametrize("neuron", Neuron)
@pytest.mark.parametrize("size", [SIZE, NetworkSize(7, 5, 2), NetworkSize(9, 4, 2), NetworkSize(2, 3, 2)])
def test_a_trial_is_the_reference_s_bit_for_bit(neuron: Neuron, size: NetworkSize) -> None:
    rng = np.random.default_rng(size.n_sources)
    weights = rng.integers(-1, 2, (size.n_neurons, size.n_sources)).astype(np.int8)
    dynamics = Dynamics(neuron, int(rng.integers(1025)))
    # a floor whose readings are those of the wire, so that every value can be shown
    senses = Senses(infrared=size.n_sensors != 2, ground=size.n_sensors != 7)
    life = Life(0.05, senses, 400, 0, 1023)
    robot = Machine(network_code(size, dynamics, life, weights=weights))
    controller = Controller(weights, size, dynamics)
    sensors = random_sensors(rng, 200, size.n_sensors)
    robot.event("sceann.start", 77, len(sensors))
    crc, longest = 0xFFFF, 0
    for step, wire in enumerate(sensors):
        infrared = wire[:7] if life.senses.infrared else np.zeros(7)
        see(robot, infrared)
        if life.senses.ground:
            robot.set("prox.ground.delta", *map(int, wire[-2:]))
        robot.event("sceann.beat", 77)
        robot.event("timer0")
        longest = max(longest, robot.steps)
        motors = controller.step(wire)
        crc = state_hash(controller.u, crc)
        assert robot.get("u", size.n_neurons) == tuple(controller.u.tolist())
        assert told(robot, "sceann.tick")[-1] == (77, step, signed(crc), *wire.tolist())
        targets = robot.get("motor.left.target") + robot.get("motor.right.target")
        assert targets == tuple(motor_target(int(x), 400) for x in motors)
    robot.event("timer0")
    assert robot.emitted[-1] == ("sceann.done", (77, End.STEPS, 200, signed(crc)))
    assert robot.get("motor.left.target") + robot.get("motor.right.target") == (0, 0)
    assert longest <= robot.code.longest["timer0"] <= WORDS_AT_ONCE


def test_a_second_trial_begins_afresh() -> None:
    robot = machine()
    hashes = []
    for number in (1, 2):
        robot.event("sceann.start", number, 5)
        see(robot, np.arange(100, 800, 100))
        for _ in range(6):
            robot.event("timer0")
        hashes.append(told(robot, "sceann.done")[-1][2:])
    assert hashes[0] == hashes[1]


def test_silence_of_the_host_stops_the_motors() -> None:
    robot = machine()
    robot.event("sceann.start", 5, 1000)
    for _ in range(LIFE.patience_ticks):
        robot.event("sceann.beat", 4)
        robot.event("timer0")
    assert told(robot, "sceann.done") == []
    robot.event("timer0")
    assert told(robot, "sceann.done")[-1][:3] == (5, End.SILENCE, LIFE.patience_ticks)
    assert robot.get("motor.left.target") + robot.get("motor.right.target") == (0, 0)
    robot.event("timer0")
    assert len(told(robot, "sceann.tick")) == LIFE.patience_ticks


def test_the_host_stops_it_and_is_answered_also_when_nothing_runs() -> None:
    robot = machine()
    robot.event("sceann.start", 9, 1000)
    robot.event("timer0")
    robot.event("sceann.halt")
    assert told(robot, "sceann.done")[-1][:3] == (9, End.HALT, 1)
    robot.set("motor.left.target", 100)
    robot.event("sceann.halt")
    assert len(told(robot, "sceann.done")) == 2
    assert robot.get("motor.left.target") == (0,)


def test_the_button_ends_a_trial_and_lets_the_champion_run_alone() -> None:
    robot = machine()
    press, release = (
        (lambda: (robot.set("button.center", 1), robot.event("buttons"))),
        (lambda: (robot.set("button.center", 0), robot.event("buttons"))),
    )
    robot.event("sceann.start", 3, 1000)
    robot.event("timer0")
    press()
    assert told(robot, "sceann.done")[-1][:3] == (3, End.BUTTON, 1)
    press()
    release()
    assert robot.get("running") == (0,)
    press()
    release()
    controller = Controller(WEIGHTS, SIZE)
    for wire in random_sensors(np.random.default_rng(1), 50, 7):
        see(robot, wire)
        robot.event("timer0")
        motors = controller.step(wire)
        assert robot.get("motor.left.target") == (motor_target(int(motors[0])),)
    assert len(told(robot, "sceann.tick")) == 1
    press()
    robot.event("timer0")
    assert robot.get("motor.left.target") + robot.get("motor.right.target") == (0, 0)


def test_sensors_that_are_fed_give_every_state() -> None:
    robot, controller = machine(), Controller(WEIGHTS, SIZE)
    crc = 0xFFFF
    for step, wire in enumerate(random_sensors(np.random.default_rng(2), 40, 7)):
        robot.event("sceann.feed", int(step == 0), *wire.tolist())
        controller.step(wire)
        crc = state_hash(controller.u, crc)
        assert told(robot, "sceann.states")[-1] == (signed(crc), *controller.u.tolist())
    assert robot.get("motor.left.target") + robot.get("motor.right.target") == (0, 0)


def test_a_tethered_robot_is_driven_by_its_own_trial_s_messages_only() -> None:
    robot = Machine(tethered_code(Life(0.1, Senses(True, True))))
    robot.event("sceann.drive", 8, 100, 200)
    assert robot.get("motor.left.target") == (0,)
    robot.event("sceann.start", 8, 0xFFFF)
    robot.set("prox.horizontal", *range(0, 7000, 1000))
    robot.set("prox.ground.delta", 900, -3)
    robot.event("timer0")
    assert told(robot, "sceann.tick") == [(8, 0, -1, 0, 250, 500, 750, 1000, 1023, 1023, (900 - 76) * 1023 // 862, 0)]
    robot.event("sceann.drive", 8, 100, -200)
    assert robot.get("motor.left.target") + robot.get("motor.right.target") == (100, -200)
    for _ in range(6):
        robot.event("timer0")
    assert told(robot, "sceann.done")[-1][:2] == (8, End.SILENCE)
    robot.event("sceann.drive", 8, 100, 200)
    assert robot.get("motor.left.target") == (0,)


def test_what_does_not_fit_into_the_robot_is_refused() -> None:
    with pytest.raises(ValueError, match="at most 1000 instructions in a control step, got"):
        network_code(NetworkSize(7, 9, 2), Dynamics(), LIFE)
    with pytest.raises(ValueError, match="tick_s: expected whole milliseconds"):
        Life(0.0505, Senses())
    with pytest.raises(ValueError, match="ground_black: expected less than ground_white"):
        Life(0.05, Senses(), ground_black=800, ground_white=700)


def test_every_program_begins_with_the_same_memory() -> None:
    for code in (tethered_code(LIFE), network_code(SIZE, Dynamics(), LIFE)):
        assert [code.addresses[name] - THYMIO.free_from for name in MEMORY] == list(range(len(MEMORY)))
        assert code.lengths["done"] == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("var a = 40000", "16 bits"),
        ("b = 1", "line 1: expected a name that is known here, got 'b'"),
        ("var a[2]\na = 1", "expected one element of a"),
        ("var a[2]\n\na[2] = 1", "line 3: expected a part of a, which has 2 elements"),
        ("var a\nif a then\nend", "expected a comparison"),
        ("var a\ncall math.sin(a, a)", "has no function math.sin"),
        ("var a\ncall math.copy(a, event.args)", "arguments of lengths"),
        ("var a$", "expected a word of AESL, got '\\$'"),
        ("onevent never\n", "known here"),
    ],
)
def test_a_program_that_is_none_is_refused_with_its_line(text: str, message: str) -> None:
    with pytest.raises(AeslError, match=message):
        compiled(text, THYMIO, EVENTS)
