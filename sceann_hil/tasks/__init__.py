"""The paper's two tasks, and what an author needs for one of one's own (``docs/adding-a-task.md``)::

from sceann_hil.tasks import StepTask, max_of, sqrt, step_value
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sceann_hil.robot.step_task import StepTask
    from sceann_hil.robot.step_value import max_of, mean_of, min_of, sqrt, step_value, sum_of

__all__ = ["StepTask", "max_of", "mean_of", "min_of", "sqrt", "step_value", "sum_of"]


def __getattr__(name: str) -> Any:
    # the shipped tasks need no compiler, which takes half a second to import
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = "sceann_hil.robot.step_task" if name == "StepTask" else "sceann_hil.robot.step_value"
    return getattr(import_module(module), name)
