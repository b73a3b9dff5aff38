"""A task whose steps are worth what a formula in the configuration says: one's own fitness without a package.

The formula is an expression of Python, and of it no more than arithmetic, comparisons, conditions and the functions
below: a configuration from somebody else cannot do anything else with it.
"""

from __future__ import annotations

import ast
import math
from types import FunctionType
from typing import Any, Literal

from pydantic import field_validator

from sceann_hil.plugins import Misfit, RobotConfig
from sceann_hil.robot.step_task import StepTask
from sceann_hil.robot.step_value import StepValue, max_of, mean_of, min_of, sqrt, step_value
from sceann_hil.tasks.drawn_starts import Draw
from sceann_hil.tasks.starts import Starts
from sceann_hil.tasks.wheels import DrivingTask, wheel_speed

FUNCTIONS: dict[str, Any] = {
    **{"abs": abs, "min": min, "max": max, "sqrt": sqrt, "exp": math.exp, "sin": math.sin, "cos": math.cos},
    **{"max_of": max_of, "min_of": min_of, "mean_of": mean_of},
}
QUANTITIES = ("sensors", "motors", "left", "right", "speed", "nearest")
_ALLOWED = (
    *(ast.Expression, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.Call, ast.Name, ast.Load),
    *(ast.Constant, ast.Subscript, ast.operator, ast.unaryop, ast.boolop, ast.cmpop),
)
_LONGEST = 500
_MOST_POWER = 8


def checked(formula: str) -> str:
    """A formula in one line.

    Raises:
        ValueError: it is none, or may not say what it says.
    """
    formula = " ".join(formula.split())
    if len(formula) > _LONGEST:
        raise ValueError(f"expected at most {_LONGEST} characters, got {len(formula)}")
    try:
        tree = ast.parse(formula, mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        said = error.msg if isinstance(error, SyntaxError) else "it cannot be read"
        raise ValueError(f"expected a formula such as 'speed * (1 - nearest)', got {formula!r}: {said}") from None
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and (node.keywords or not isinstance(node.func, ast.Name)):
            raise ValueError(f"expected calls such as sqrt(speed), got {ast.unparse(node)!r}")
        if isinstance(node, ast.Name):
            known = FUNCTIONS if id(node) in called else QUANTITIES
            if node.id not in known:
                raise ValueError(f"expected one of {', '.join(known)}; got {node.id!r}")
        elif isinstance(node, ast.Constant) and type(node.value) not in (int, float):
            raise ValueError(f"expected a number, got {ast.unparse(node)!r}")
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow) and not _is_small(node.right):
            raise ValueError(f"expected a power up to {_MOST_POWER}, got {ast.unparse(node)!r}")
        elif isinstance(node, ast.Subscript) and not (
            isinstance(node.value, ast.Name) and node.value.id in ("sensors", "motors") and _is_place(node.slice)
        ):
            raise ValueError(f"expected a place such as sensors[0], got {ast.unparse(node)!r}")
        elif not isinstance(node, _ALLOWED) or isinstance(node, ast.Is | ast.IsNot | ast.In | ast.NotIn):
            raise ValueError(f"expected numbers, quantities, comparisons and functions; got {ast.unparse(node)!r}")
    return formula


def _is_small(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and 0 < node.value <= _MOST_POWER


def _is_place(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int) and node.value >= 0


def value_of(formula: str, *, forwards_only: bool) -> StepValue:
    """A step's value.

    Args:
        formula: `checked`.
        forwards_only: see `wheel_speed`.
    """
    source = f"""def formula(sensors, motors):
    left, right = speed_of(motors[0]), speed_of(motors[1])
    speed = max(0.5 * (left + right), 0.0)
    nearest = max_of(sensors)
    return 1.0 * ({formula})
"""
    names: dict[str, Any] = {**FUNCTIONS, "speed_of": wheel_speed(forwards_only)}
    exec(compile(source, "task.step", "exec"), names)
    function = names["formula"]
    if not isinstance(function, FunctionType):
        raise TypeError(f"expected a function, got {function!r}")
    return step_value(function)


class FormulaConfig(DrivingTask):
    """A fitness function of one's own: what a step is worth, as a formula."""

    type: Literal["formula"] = "formula"
    step: str = "speed * (1 - nearest)"
    """What a step is worth. Quantities: speed (forwards, 0..1), left and right (of the wheels), nearest (the strongest
    reading), sensors[0] ..., motors[0] ...; functions: abs, min, max, sqrt, exp, sin, cos, max_of, min_of, mean_of."""
    starts: Starts = ((0.15, 0.15, 45.0), (0.85, 0.15, 180.0), (0.85, 0.85, 225.0), (0.15, 0.85, 0.0))
    """One trial for each: x and y in metres, heading in degrees."""
    success: float = 0.3
    """A trial that is worth more than this counts as a success."""

    @field_validator("step")
    @classmethod
    def _is_a_formula(cls, text: str) -> str:
        return checked(text)

    def value(self) -> StepValue:
        return value_of(self.step, forwards_only=self.forwards_only)

    def task(self, draw: Draw | None) -> StepTask:
        task = super().task(draw)
        # a formula may be worth anything
        task.best_fitness, task.worst_fitness = math.inf, -math.inf
        return task

    def check(self, robot: RobotConfig) -> None:
        super().check(robot)
        n_sensors = robot.spec.n_sensors
        for node in ast.walk(ast.parse(self.step, mode="eval")):
            if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
                most = n_sensors if node.value.id == "sensors" else 2
                place = ast.literal_eval(node.slice)
                if place >= most:
                    raise Misfit(
                        f"step: expected {node.value.id}[0] to {node.value.id}[{most - 1}], got {ast.unparse(node)}",
                        "task.step",
                        "robot.type",
                    )
