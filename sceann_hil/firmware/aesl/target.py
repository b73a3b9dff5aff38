"""What a program for Aseba's virtual machine is compiled for: a robot's variables, functions and memory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

WORDS_AT_ONCE = 1000
"""Instructions that a robot runs in one go; a handler that needs more can be interrupted by the next event."""
NATIVES: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {
        "math.copy": (-1, -1),
        "math.fill": (-1, 1),
        "math.clamp": (-1, -1, -1, -1),
        "math.dot": (1, -1, -1, 1),
        "math.muldiv": (-1, -1, -1, -1),
    }
)
"""Functions of the machine that our programs call, and how many words each argument has; -1: all as long."""


@dataclass(frozen=True, slots=True)
class Target:
    """A kind of robot, as it describes itself.

    Attributes:
        name: what nodes of this kind are called.
        bytecode_words: memory for the program.
        variable_words: memory for all variables.
        variables: names and lengths of the robot's own variables, in their order from address 0.
        local_events: names of what happens to the robot, in their order.
        functions: names of its native functions, in their order.
    """

    name: str
    bytecode_words: int
    variable_words: int
    variables: Mapping[str, int]
    local_events: tuple[str, ...]
    functions: tuple[str, ...]

    @property
    def free_from(self) -> int:
        """Address of the first variable that a program may have."""
        return sum(self.variables.values())

    def address(self, name: str) -> int:
        """Where one of the robot's own variables is.

        Raises:
            KeyError: it has none of this name.
        """
        address = 0
        for each, length in self.variables.items():
            if each == name:
                return address
            address += length
        raise KeyError(name)


THYMIO = Target(
    name="thymio-II",
    bytecode_words=1534,
    variable_words=586,
    variables=MappingProxyType(
        {
            "_id": 1,
            "event.source": 1,
            "event.args": 32,
            "_productId": 1,
            "_fwversion": 2,
            "button.backward": 1,
            "button.left": 1,
            "button.center": 1,
            "button.forward": 1,
            "button.right": 1,
            "prox.horizontal": 7,
            "prox.comm.rx": 1,
            "prox.comm.tx": 1,
            "prox.ground.ambiant": 2,
            "prox.ground.reflected": 2,
            "prox.ground.delta": 2,
            "motor.left.target": 1,
            "motor.right.target": 1,
            "motor.left.speed": 1,
            "motor.right.speed": 1,
            "motor.left.pwm": 1,
            "motor.right.pwm": 1,
            "acc": 3,
            "temperature": 1,
            "rc5.address": 1,
            "rc5.command": 1,
            "mic.intensity": 1,
            "mic.threshold": 1,
            "timer.period": 2,
            "sd.present": 1,
        }
    ),
    local_events=(
        "button.backward",
        "button.left",
        "button.center",
        "button.forward",
        "button.right",
        "buttons",
        "prox",
        "prox.comm",
        "tap",
        "acc",
        "mic",
        "sound.finished",
        "temperature",
        "rc5",
        "motor",
        "timer0",
        "timer1",
    ),
    functions=(
        "math.copy",
        "math.fill",
        "math.addscalar",
        "math.add",
        "math.sub",
        "math.mul",
        "math.div",
        "math.min",
        "math.max",
        "math.clamp",
        "math.dot",
        "math.stat",
        "math.argbounds",
        "math.sort",
        "math.muldiv",
    ),
)
"""A Thymio II with firmware 11, as the makers' simulator describes it; a connected robot describes itself."""
