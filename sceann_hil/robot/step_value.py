"""Fitness that adds up over a trial: one small function of what a controller saw and did in a step.

The same function is compiled into the simulation's loop and applied to the steps that a robot told of, so a formula is
written once and gives the same bits from both::

    @step_value
    def avoid(sensors, motors, state):
        left, right = motors[0], motors[1]
        return 0.5 * (left + right) * (1 - sqrt(abs(left - right))) * (1 - max_of(sensors))

`sensors` are the values that the controller saw and `motors` the ones that it asked for, each 0..1. `state` is the
body's state before the step in the order of ``RobotSpec.state_fields``; a function that reads it can only be used with
a robot that knows it. All three are float64 arrays of one axis. The functions below and those of `math` and NumPy may
be called.
"""

from __future__ import annotations

import dis
import inspect
import re
import traceback
from collections.abc import Callable, Iterator
from functools import cached_property
from math import isfinite, sqrt
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import PluginError
from sceann_hil.network.compiled import bound, compiled_part, guarded_part, rebound
from sceann_hil.robot.facts import RobotSpec

__all__ = ["Floats", "StepValue", "max_of", "mean_of", "min_of", "shown", "sqrt", "step_value", "sum_of"]

Floats = NDArray[np.float64]


_FEW = 24
"""Loops to a constant with a way out are unrolled where the number of sensors is known, and then run in vectors."""


@compiled_part
def max_of(values: Floats) -> float:
    """The largest of some sensors or motors."""
    largest = values[0]
    for i in range(1, _FEW):
        if i >= values.shape[0]:
            break
        largest = max(largest, values[i])
    for i in range(_FEW, values.shape[0]):
        largest = max(largest, values[i])
    return float(largest)


@compiled_part
def min_of(values: Floats) -> float:
    """The smallest of some sensors or motors."""
    smallest = values[0]
    for i in range(1, _FEW):
        if i >= values.shape[0]:
            break
        smallest = min(smallest, values[i])
    for i in range(_FEW, values.shape[0]):
        smallest = min(smallest, values[i])
    return float(smallest)


@compiled_part
def sum_of(values: Floats) -> float:
    """The sum of some sensors or motors."""
    total = 0.0
    for i in range(0, _FEW):
        if i >= values.shape[0]:
            break
        total += float(values[i])
    for i in range(_FEW, values.shape[0]):
        total += float(values[i])
    return float(total)


@compiled_part
def mean_of(values: Floats) -> float:
    """The mean of some sensors or motors."""
    return float(sum_of(values) / values.shape[0])


class StepValue:
    """A function of one step; made by `step_value`.

    Attributes:
        function: what its author wrote.
        uses_state: it reads the body's state.
    """

    def __init__(self, function: Any) -> None:
        if not isinstance(function, FunctionType):
            raise PluginError(f"step_value: expected a function of sensors, motors and state, got {function!r}.")
        self.function = function
        names = list(inspect.signature(function).parameters)
        if len(names) not in (2, 3):
            raise PluginError(
                f"{self}: expected the arguments sensors, motors and state, got {', '.join(names) or 'none'}.",
                "A function of sensors and motors alone may leave state out.",
            )
        self._takes_state = len(names) == 3
        self.uses_state = self._takes_state and _reads(function, names[2])

    def __call__(self, sensors: Floats, motors: Floats, state: Floats) -> float:
        """The value of one step, computed by Python."""
        arguments = (sensors, motors, state) if self._takes_state else (sensors, motors)
        value: float = self.function(*arguments)
        return value

    def __str__(self) -> str:
        code = self.function.__code__
        return f"{self.function.__name__} ({code.co_filename}, line {code.co_firstlineno})"

    @cached_property
    def part(self) -> Callable[..., float]:
        """For compiled code: ``part(sensors, motors, state)``."""
        inner = guarded_part(self.function)
        return compiled_part(rebound(_with_state if self._takes_state else _without_state, value=inner))

    def reached_too_far(self, error: IndexError) -> PluginError:
        """What to raise when a step wanted a sensor, motor or state that is not there."""
        return PluginError(
            f"{self}: {error}: in a trial it wanted a sensor, motor or state that the robot does not have.",
            "No fitness is made of it.",
        )

    def check(self, spec: RobotSpec) -> None:
        """See to it that it can be computed in every step of a robot.

        Raises:
            PluginError: it cannot; its file, line and fault.
        """
        if self.uses_state and not spec.state_fields:
            raise PluginError(
                f"{self} reads the body's state, which the robot {spec.name} does not know.",
                "Use sensors and motors only, or a robot that knows its state (a simulated one, or mode hil).",
            )
        for sensors, motors, state in _samples(spec):
            self._check_one(spec, sensors, motors, state)
        self._check_compiled(*(array.copy() for array in next(iter(_samples(spec)))))

    def _check_one(self, spec: RobotSpec, sensors: Floats, motors: Floats, state: Floats) -> None:
        told = f"sensors {shown(sensors)}, motors {shown(motors)}"
        if self.uses_state:
            told += f", state {shown(state)}"
        hint = f"The robot {spec.name} has {spec.n_sensors} sensors and {spec.n_motors} motors."
        try:
            with np.errstate(divide="raise", invalid="raise"):
                value, again = self(sensors, motors, state), self(sensors, motors, state)
        except Exception as error:
            frame = traceback.extract_tb(error.__traceback__)[-1]
            if isinstance(error, ZeroDivisionError | FloatingPointError):
                hint = "Such a step can happen in a trial; say in the function what it is worth."
            raise PluginError(
                f"{self}: {type(error).__name__} in line {frame.lineno} ({frame.line}): {error}; with {told}.", hint
            ) from error
        if not isinstance(value, int | float | np.bool_ | np.integer | np.floating):
            raise PluginError(
                f"{self}: expected one number for a step, got {_kind(value)}; with {told}.",
                "Every way through the function must end with `return` and a number.",
            )
        number = float(value)
        if isfinite(number) and value != again:
            raise PluginError(
                f"{self}: expected the same value for the same step, got {number!r} and then {float(again)!r}.",
                "A value may depend on sensors, motors and state only; trials could not be replayed otherwise.",
            )
        if not isfinite(number):
            raise PluginError(
                f"{self}: expected a finite number, got {number} with {told}.",
                "Such a step can happen in a trial; say in the function what it is worth.",
            )

    def _check_compiled(self, sensors: Floats, motors: Floats, state: Floats) -> None:
        try:
            number = self._one(sensors, motors, state)
            float(number)
        except Exception as error:
            raise PluginError(
                f"{self}: it cannot be compiled: {_complaint(error, self.function.__code__.co_filename)}.",
                "A step value may use numbers, loops, conditions, and functions of math and NumPy that Numba knows.",
            ) from error

    @cached_property
    def _one(self) -> Callable[[Floats, Floats, Floats], float]:
        return bound(_one_step, value=self.part)


def step_value(function: Callable[..., float]) -> StepValue:
    """Make a function of ``(sensors, motors, state)`` the value of a step; see the module.

    Raises:
        PluginError: it takes other arguments.
    """
    return StepValue(function)


value: Any = None
"""A `StepValue.part`, in the globals that `rebound` makes."""


def _with_state(sensors: Floats, motors: Floats, state: Floats) -> float:
    # of truth values too, which Numba's float does not know
    return 1.0 * value(sensors, motors, state)  # type: ignore[no-any-return]


def _without_state(sensors: Floats, motors: Floats, state: Floats) -> float:
    return 1.0 * value(sensors, motors)  # type: ignore[no-any-return]


def _one_step(sensors: Floats, motors: Floats, state: Floats) -> float:
    return float(value(sensors, motors, state))


def _samples(spec: RobotSpec) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Steps that can happen: everything dark, bright, still, at full speed, and some between."""
    rng = np.random.default_rng(1)
    state = rng.uniform(0.1, 1.0, len(spec.state_fields))
    for sensors in (np.zeros(spec.n_sensors), np.ones(spec.n_sensors), rng.uniform(size=spec.n_sensors)):
        for motors in (np.zeros(spec.n_motors), np.ones(spec.n_motors), rng.uniform(size=spec.n_motors)):
            for array in (sensors, motors, state):
                # a function that changes what it is given would change what the next one sees
                array.flags.writeable = False
            yield sensors, motors, state


def _kind(value: object) -> str:
    """What somebody returned, for a message."""
    return "nothing (None)" if value is None else f"{type(value).__name__} {value!r}"


def _reads(function: Callable[..., float], name: str) -> bool:
    for instruction in dis.get_instructions(function):
        named = instruction.argval if isinstance(instruction.argval, tuple) else (instruction.argval,)
        if instruction.opname.startswith("LOAD") and name in named:
            return True
    return False


def shown(values: Floats) -> str:
    """Sensors, motors or states for a message."""
    return "[" + ", ".join(f"{value:.3g}" for value in values) + "]"


def _complaint(error: Exception, file: str) -> str:
    """The sentence and the line of the author's own file in what Numba says."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    sentences = [line.strip() for line in text.splitlines() if line.strip()]
    lines = [
        line for path, line in re.findall(r'File "([^"]+)", line (\d+)', text) if Path(path).name == Path(file).name
    ]
    said = next((line for line in sentences if not line.startswith(("Failed in", "File ", "During", "-"))), text)
    return f"{said.rstrip('.')} (line {lines[-1]})" if lines else said.rstrip(".")
