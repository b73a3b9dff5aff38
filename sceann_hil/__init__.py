"""Hardware-in-the-loop evolution of tiny neural controllers.

The public names; ``docs/python.md`` shows them at work::

    import sceann_hil as sh

    config = sh.config(seed=3, task="goal_reach", robot="diffdrive", controller={"coding": "sceann3", "n_hidden": 2},
                       algorithm={"type": "sga", "generations": 50})
    run = sh.evolve(config, "runs/goal", progress=True)
    best = run.champion()

* `config`, `evolve`, `transfer`, `open`, `simulate`, `export`: from a configuration to a C header.
* `Run`, `Individual`, `Trial`: what they give back.
* `BatchEvaluator`: genomes to fitness without a journal, for loops of one's own.
* `RobotConfig`, `TaskConfig`, `AlgorithmConfig`, `Robot`, `Task`, `Algorithm`: what a package of one's own subclasses.
* `UserError`: what all of them raise when something can be put right; it has a message and a hint.

Nothing is imported before it is used. The way of the data, in one direction::

    configuration -> experiment -> algorithm -> genomes -> task -> trials -> robot -> results -> fitness -> algorithm
                                                             (beside it: journal, recording, operator, progress)

The rooms, from the bottom up; a room imports only from the rooms before it:

* `network`: genome codings, the neuron's exact arithmetic, compiled neurons, one controller as an image.
* `robot`: what a body, a trial, a result and a task are. `tasks` has the shipped tasks; `backends` the robots.
* `evolution`: the algorithms, ask and tell.
* `journal`: the record of truth of one run.
* `link`: the host's side of the robot protocol.
* `supervision`: who has a say between trials: operator, budget, forecast, suspenders, drift, saving.
* `config`, `plugins`, `registry`: configuration, and what other packages may add.
* `run`: trials to results to fitness; evolve, resume, replay, rehearse, plan.
* `firmware`: header, build, flash, verify; `firmware.emulated` has the boards without hardware.
* `recording`: every trial in the rerun viewer, made from the journal.
* `study`: many runs, landscapes, disturbed bodies, simulation against robot, the report.
* `commands`, `cli`: the `sceann` command. `api`: the public names.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sceann_hil.lazily import lazily

if TYPE_CHECKING:
    from sceann_hil import config
    from sceann_hil.api import Individual, Run, Trial, evolve, export, open, simulate, transfer
    from sceann_hil.config import ExperimentConfig
    from sceann_hil.errors import UserError
    from sceann_hil.evolution import Algorithm
    from sceann_hil.plugins import AlgorithmConfig, RobotConfig, TaskConfig
    from sceann_hil.robot import EndReason, Robot
    from sceann_hil.robot.task import Task
    from sceann_hil.run.batch import BatchEvaluator

__all__ = [
    "Algorithm",
    "AlgorithmConfig",
    "BatchEvaluator",
    "EndReason",
    "ExperimentConfig",
    "Individual",
    "Robot",
    "RobotConfig",
    "Run",
    "Task",
    "TaskConfig",
    "Trial",
    "UserError",
    "config",
    "evolve",
    "export",
    "open",
    "simulate",
    "transfer",
]

_get = lazily(
    __name__,
    {
        "api": ("Individual", "Run", "Trial", "evolve", "export", "open", "simulate", "transfer"),
        "config": ("ExperimentConfig",),
        "errors": ("UserError",),
        "evolution": ("Algorithm",),
        "plugins": ("AlgorithmConfig", "RobotConfig", "TaskConfig"),
        "robot": ("EndReason", "Robot"),
        "robot.task": ("Task",),
        "run.batch": ("BatchEvaluator",),
    },
)


def __getattr__(name: str) -> Any:
    # the room of this name is the function too
    return import_module("sceann_hil.config") if name == "config" else _get(name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]
