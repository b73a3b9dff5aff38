"""A controller as an AESL program: SCEANN-Q10 in the robot's own machine, and the life of a trial around it.

The robot keeps the clock. At every tick it looks, thinks and drives, and tells its sensors as an event. Motors stop at
the last step, when the host is silent, when it says so, and when the centre button is pressed; with no trial
running, that button lets the controller run without a host. ``docs/robots/thymio.md`` lists the events.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from sceann_hil.firmware.aesl.compiler import Code, compiled
from sceann_hil.firmware.aesl.target import THYMIO, WORDS_AT_ONCE, Target
from sceann_hil.network.coding import NetworkSize, Weights
from sceann_hil.network.controller import ONE, SENSOR_MAX, THRESHOLD, Dynamics, Neuron, sigmoid_table

EVENTS = tuple(
    f"sceann.{name}" for name in ("tick", "done", "states", "start", "beat", "halt", "drive", "feed", "calm")
)
"""Messages between robot and host, in the order of their numbers."""
SILENCE_S = 0.5
"""How long the host may be silent in a trial before the motors stop."""
TOP_TARGET = 500
"""The fastest that a motor can be told to turn."""
INFRARED, GROUND = 7, 2
OURS = 0x5CEA
"""First variable of a program of ours."""
MEMORY = ("ours", "running", "number", "steps", "most", "silent", "reason", "crc", "done")
"""The first variables of every program of ours, in their order; the last one has 4 words."""
MEMORY_WORDS = len(MEMORY) + 3
HEAD = 3
"""Words of a tick before its sensors: trial, step, state hash."""


class End(IntEnum):
    """Why a trial ended, in the robot's own words."""

    STEPS = 0
    """All its steps are done."""
    SILENCE = 1
    """The host fell silent."""
    HALT = 2
    """The host said so."""
    BUTTON = 3
    """Somebody pressed the centre button."""


class Running(IntEnum):
    """What the robot does."""

    NOTHING = 0
    TRIAL = 1
    ALONE = 2


@dataclass(frozen=True, slots=True)
class Senses:
    """Which sensors a controller gets, in this order.

    Attributes:
        infrared: the seven that see what is in front (0..4, from left to right) and behind (5 left, 6 right).
        ground: the two that look down, left and right.
    """

    infrared: bool = True
    ground: bool = False

    @property
    def count(self) -> int:
        """How many."""
        return INFRARED * self.infrared + GROUND * self.ground


@dataclass(frozen=True, slots=True)
class Life:
    """What a program does besides the network.

    Attributes:
        tick_s: control step, 0.01..1 s, in whole milliseconds.
        senses: what it looks at.
        top_target: motor target of a motor neuron at 0 or 1, 1..`TOP_TARGET`.
        ground_black: what a ground sensor says over the darkest floor; it is a sensor value of 0.
        ground_white: what it says over the lightest floor; it is a sensor value of 1. The defaults are the simulator's.
    """

    tick_s: float
    senses: Senses
    top_target: int = TOP_TARGET
    ground_black: int = 76
    ground_white: int = 938

    def __post_init__(self) -> None:
        if not (0.01 <= self.tick_s <= 1.0 and math.isclose(self.tick_ms, 1000.0 * self.tick_s, abs_tol=1e-6)):
            raise ValueError(f"tick_s: expected whole milliseconds from 0.01 to 1 s, got {self.tick_s:g}")
        if self.senses.count == 0:
            raise ValueError("sensors: expected infrared, ground or both")
        if not 1 <= self.top_target <= TOP_TARGET:
            raise ValueError(f"top_target: expected 1..{TOP_TARGET}, got {self.top_target}")
        if not 0 <= self.ground_black < self.ground_white <= SENSOR_MAX:
            raise ValueError(
                f"ground_black: expected less than ground_white and both within 0..{SENSOR_MAX}, got "
                f"{self.ground_black} and {self.ground_white}"
            )

    @property
    def tick_ms(self) -> int:
        """Control step, milliseconds."""
        return round(1000.0 * self.tick_s)

    @property
    def patience_ticks(self) -> int:
        """Ticks of silence after which the motors stop."""
        return math.ceil(SILENCE_S / self.tick_s)


def motor_target(output: int, top_target: int = TOP_TARGET) -> int:
    """What a motor is told by a neuron's output, 0..1024 (512 stands still), as the robot computes it."""
    off_rest = (output - ONE // 2) * top_target
    return int(math.copysign(abs(off_rest) // (ONE // 2), off_rest))


def network_program(weights: Weights, size: NetworkSize, dynamics: Dynamics, life: Life) -> str:
    """The program that runs a controller on board.

    Args:
        weights: shape ``(n_neurons, n_sources)``, -1, 0 or 1.
        size: the network's.
        dynamics: the neuron's reading and initial output.
        life: what else it does.

    Raises:
        ValueError: the network has other sensors or motors.
    """
    size.check_fits(life.senses.count, 2, "a Thymio II")
    first, last = size.n_sensors, size.n_sources - 1
    accumulating = dynamics.neuron is Neuron.ACCUMULATING
    think = [f"call math.copy(z[{first}:{last}], y)"]
    for i in range(size.n_neurons):
        begin = i * size.n_sources
        think.append(f"call math.dot(a, w[{begin}:{begin + last}], z, none)")
        think += [f"a += u[{i}]"] * accumulating
        think += ["callsub neuron", f"u[{i}] = a", f"y[{i}] = b"]
    variables = (
        ("# the sigmoid in 129 nodes; the last one twice", _array("t", sigmoid_table().tolist())),
        (f"# weights, {size.n_sources} of each neuron: sensors, hidden, motors", _array("w", np.ravel(weights))),
        ("# sources, states, outputs", f"var z[{size.n_sources}]"),
        (_array("u", [0] * size.n_neurons), _array("y", [dynamics.initial_output] * size.n_neurons)),
        (f"var said[{1 + size.n_neurons}]", "var k"),
    )
    motors = range(size.n_hidden, size.n_neurons)
    parts = [
        *_life_variables(life, size.n_sensors),
        *("\n".join(lines) for lines in variables),
        _beginning(life),
        _neuron(accumulating),
        _sub("think", think),
        _sub("fresh", _filled("u", [0] * size.n_neurons) + _filled("y", [dynamics.initial_output] * size.n_neurons)),
        *_life(life, size, ["callsub think"], [f"a = y[{motors[0]}] - 512", f"b = y[{motors[1]}] - 512"]),
        _FEED.format(wire=_wire(size.n_sensors), args=f"event.args[1:{size.n_sensors}]", last=size.n_neurons),
    ]
    return "\n\n".join(parts) + "\n"


def tethered_program(life: Life) -> str:
    """The program of a robot whose controller is on the host: the same life, driven by messages."""
    n = life.senses.count
    drive = """onevent sceann.drive
if running == 1 and event.args[0] == number then
 silent = 0
 motor.left.target = event.args[1]
 motor.right.target = event.args[2]
end"""
    parts = [*_life_variables(life, n), _beginning(life), _sub("fresh", []), *_life(life, None, [], None), drive]
    return "\n\n".join(parts) + "\n"


def network_code(
    size: NetworkSize, dynamics: Dynamics, life: Life, target: Target = THYMIO, weights: Weights | None = None
) -> Code:
    """The compiled program of networks of this size; weights are 0 unless given.

    Raises:
        ValueError: the network does not fit into the robot.
    """
    none = np.zeros((size.n_neurons, size.n_sources), np.int8)
    code = compiled(network_program(none if weights is None else weights, size, dynamics, life), target, EVENTS)
    name = f"a network of {size.n_sensors} sensors, {size.n_hidden} hidden and {size.n_motors} motor neurons"
    for got, most, what in (
        (len(code.words), target.bytecode_words, "words of byte code"),
        (code.variable_words, target.variable_words, "words of variables"),
        (max(code.longest.values()), WORDS_AT_ONCE, "instructions in a control step"),
    ):
        if got > most:
            raise ValueError(f"{name} does not fit into {target.name}: expected at most {most} {what}, got {got}")
    return code


def tethered_code(life: Life, target: Target = THYMIO) -> Code:
    """The compiled program of a tethered robot."""
    return compiled(tethered_program(life), target, EVENTS)


# -- the parts ------------------------------------------------------------------------------------------------------


def _array(name: str, values: Iterable[int]) -> str:
    numbers = [str(int(value)) for value in values]
    rows = [", ".join(numbers[k : k + 20]) for k in range(0, len(numbers), 20)]
    return f"var {name}[{len(numbers)}] = [" + ",\n ".join(rows) + "]"


def _filled(name: str, values: list[int]) -> list[str]:
    same = set(values)
    if same == {0}:
        return [f"call math.fill({name}, none)"]
    return [f"a = {same.pop()}", f"call math.fill({name}, a)"]


def _sub(name: str, lines: Iterable[str]) -> str:
    return "\n".join([f"sub {name}", *lines])


def _wire(n_sensors: int) -> str:
    return f"told[{HEAD}:{HEAD + n_sensors - 1}]"


def _life_variables(life: Life, n_sensors: int) -> tuple[str, ...]:
    return (
        f"# tells that this program is here\nvar ours = {OURS}",
        "# a trial: its number, steps done, how many there are, ticks since the host was heard, why it ended",
        "var running = 0\nvar number = 0\nvar steps = 0\nvar most = 0\nvar silent = 0\nvar reason = 0\nvar crc = -1",
        "# the last trial that ended: number, why, steps, state hash\nvar done[4] = [0, 0, 0, 0]",
        f"# what is told: trial, step, state hash, sensors\nvar told[{HEAD + n_sensors}]",
        _array("high", [SENSOR_MAX] * n_sensors) + f"\nvar low[{n_sensors}]",
        _array("floor", [life.ground_white - life.ground_black] * GROUND)
        if life.senses.ground
        else "# no ground sensors",
        f"var go[2]\n{_array('top', [life.top_target] * 2)}\n{_array('half', [ONE // 2] * 2)}",
        "var pressed = 0\nvar none = 0\nvar a\nvar b",
    )


def _beginning(life: Life) -> str:
    return f"""call math.fill(low, none)
motor.left.target = 0
motor.right.target = 0
timer.period[0] = {life.tick_ms}"""


def _neuron(accumulating: bool) -> str:
    sigmoid = ["k = (a + 8192) >> 7", "b = t[k]", "b = b + (((t[k + 1] - b) * (a & 127) + 64) >> 7)"]
    if accumulating:
        body = [f"if abs(a) > {THRESHOLD} then", " a = 0", "end", *sigmoid]
    else:
        body = [f"if abs(a) > {THRESHOLD} then", " a = 0", " b = 0", "else", *(f" {line}" for line in sigmoid), "end"]
    return _sub(
        "neuron",
        [
            "# a: the sum of what comes in; becomes the state. b: the output",
            *body,
            "# CRC-16 of the state, both bytes at once",
            "k = crc ^ ((a << 8) | ((a >> 8) & 255))",
            "crc = k ^ ((k >> 4) & 4095)",
            "crc = crc ^ ((crc >> 8) & 255) ^ ((k >> 11) & 31)",
            "crc = crc ^ (crc << 12) ^ (crc << 5)",
        ],
    )


def _look(life: Life, size: NetworkSize | None) -> list[str]:
    n = life.senses.count
    lines, at = [], HEAD
    if life.senses.infrared:
        lines += [f"told[{at + i}] = prox.horizontal[{i}] >> 2" for i in range(INFRARED)]
        at += INFRARED
    if life.senses.ground:
        lines += [f"told[{at + i}] = prox.ground.delta[{i}] - {life.ground_black}" for i in range(GROUND)]
        both = f"told[{at}:{at + GROUND - 1}]"
        lines.append(f"call math.muldiv({both}, {both}, high[0:{GROUND - 1}], floor)")
    lines.append(f"call math.clamp({_wire(n)}, {_wire(n)}, low, high)")
    return lines + ([] if size is None else ["callsub scale"])


def _life(life: Life, size: NetworkSize | None, think: list[str], outputs: list[str] | None) -> list[str]:
    n = life.senses.count
    parts = []
    if size is not None:
        parts.append(_sub("scale", [f"z[{i}] = told[{HEAD + i}] + (told[{HEAD + i}] >> 9)" for i in range(n)]))
    parts.append(_sub("look", _look(life, size)))
    act: list[str] = []
    if outputs is not None:
        act = ["callsub act"]
        lines = [*outputs, "go[0] = a", "go[1] = b", "call math.muldiv(go, go, top, half)"]
        parts.append(_sub("act", [*lines, "motor.left.target = go[0]", "motor.right.target = go[1]"]))
    parts += [_FINISH, _timer(life, think, act), _START, _BEAT, _HALT, _CALM, _BUTTON]
    return parts


def _timer(life: Life, think: list[str], act: list[str]) -> str:
    body = "\n".join(f" {line}" for line in ["callsub look", *think, *act])
    return f"""onevent timer0
if running == {Running.TRIAL} then
 silent += 1
 if silent > {life.patience_ticks} then
  reason = {End.SILENCE}
  callsub finish
 elseif steps == most then
  reason = {End.STEPS}
  callsub finish
 end
end
if running > {Running.NOTHING} then
{body}
end
if running == {Running.TRIAL} then
 told[0] = number
 told[1] = steps
 told[2] = crc
 steps += 1
 emit sceann.tick told
end"""


_FINISH = f"""sub finish
running = {Running.NOTHING}
motor.left.target = 0
motor.right.target = 0
done[0] = number
done[1] = reason
done[2] = steps
done[3] = crc
emit sceann.done done"""

_START = f"""onevent sceann.start
motor.left.target = 0
motor.right.target = 0
number = event.args[0]
most = event.args[1]
steps = 0
silent = 0
crc = -1
callsub fresh
running = {Running.TRIAL}"""

_BEAT = """onevent sceann.beat
if event.args[0] == number then
 silent = 0
end"""

_HALT = f"""onevent sceann.halt
if running == {Running.TRIAL} then
 reason = {End.HALT}
 callsub finish
else
 running = {Running.NOTHING}
 motor.left.target = 0
 motor.right.target = 0
 emit sceann.done done
end"""

_CALM = """onevent sceann.calm
emit sceann.done done"""

_BUTTON = f"""onevent buttons
if button.center == 1 and pressed == 0 then
 if running == {Running.TRIAL} then
  reason = {End.BUTTON}
  callsub finish
 elseif running == {Running.ALONE} then
  running = {Running.NOTHING}
  motor.left.target = 0
  motor.right.target = 0
 else
  crc = -1
  callsub fresh
  running = {Running.ALONE}
 end
end
pressed = button.center"""

_FEED = f"""onevent sceann.feed
if running == {Running.NOTHING} then
 if event.args[0] == 1 then
  crc = -1
  callsub fresh
 end
 call math.copy({{wire}}, {{args}})
 callsub scale
 callsub think
 said[0] = crc
 call math.copy(said[1:{{last}}], u)
 emit sceann.states said
end"""
