"""Everything that is done before the robot moves: simulated robots, candidates, their fitness in every robot."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from sceann_hil import registry
from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.network.coding import Bits
from sceann_hil.plugins import RobotConfig, TaskConfig
from sceann_hil.registry import Group
from sceann_hil.robot.task import Task
from sceann_hil.run.transfer import candidates as pool
from sceann_hil.run.transfer.ensemble import (
    Compute,
    Ensemble,
    Report,
    World,
    check_scale,
    here,
    make_ensemble,
    silent,
)
from sceann_hil.run.transfer.model import Model
from sceann_hil.run.transfer.robots import draw_robots
from sceann_hil.run.transfer.sources import body_of, read_source

LEAST_SPREAD = 0.005
"""Of the task's range of fitness: an ensemble in which all robots do the same is still not believed to the letter."""


@dataclass(frozen=True)
class Prepared:
    """An ensemble, and the models of fitness and of success that follow from it.

    Attributes:
        ensemble: the candidates' fitness in every robot.
        fitness_range: of the task, worst to best.
    """

    ensemble: Ensemble
    fitness_range: float

    @cached_property
    def fitness(self) -> Model:
        """Of a trial's fitness."""
        return Model(self.ensemble.fitness, LEAST_SPREAD * self.fitness_range)

    @cached_property
    def success(self) -> Model | None:
        """Of whether a trial succeeds, 0 or 1; None if success is not a matter of fitness."""
        level = self.ensemble.level
        if level is None:
            return None
        return Model((self.ensemble.fitness >= level).astype(np.float32), 0.05)


class Preparation:
    """Prepares one experiment; what was prepared once is not prepared again.

    Args:
        config: of the experiment.
        sources: folders of runs and studies whose genomes are candidates.
        evolve: runs of evolution in simulated robots that give more of them.
        count: K, candidates that are kept.
        report: told what is being done.
    """

    def __init__(
        self,
        config: ExperimentConfig,
        sources: tuple[Path, ...],
        evolve: int,
        count: int,
        report: Report = silent,
    ) -> None:
        self.config = config
        self.sources = sources
        self.evolve = evolve
        self.count = count
        self.report = report
        self.compute: Compute = here
        """What computes the ensemble: this machine, or somebody else."""
        self._prepared: dict[bytes, Prepared] = {}

    @cached_property
    def world(self) -> World:
        """Task and simulated robots.

        Raises:
            ConfigError: there is no simulated body, or a range is wider than it allows.
        """
        config = self.config
        task = config.build_task()
        check_scale(task)
        body = simulated_body(config, self.sources)
        if not body.spec.takes_batches:
            raise ConfigError(
                f"uncertainty.body: expected a simulated robot that runs many trials at once, got {body.type}.",
                "Nothing was started.",
            )
        if (body.spec.n_sensors, body.spec.n_motors) != (config.size.n_sensors, config.size.n_motors):
            raise ConfigError(
                f"uncertainty.body: expected {config.size.n_sensors} sensors and {config.size.n_motors} motors, as the "
                f"robot has them, got {body.spec.n_sensors} and {body.spec.n_motors}.",
                "Nothing was started.",
            )
        section = config.uncertainty.task or config.task
        simulated = _task_for(section, body, task)
        robots = draw_robots(body, config.uncertainty.keys, config.uncertainty.robots)
        text = json.dumps(section.model_dump(mode="json"), sort_keys=True)
        if simulated.n_trials != task.n_trials:
            text += f" for {task.n_trials} trials"
        return World(config.phenotype, simulated, text, robots, task.n_trials)

    def candidates(self, more: Bits | None = None, in_robots: tuple[int, ...] = ()) -> Bits:
        """Controllers to choose from, shape ``(K, L)``.

        Args:
            more: genomes that must be among them.
            in_robots: numbers of the simulated robots to evolve in; all by default.

        Raises:
            ConfigError: there are none, or a source's genomes mean something else.
        """
        length = self.config.genome_length
        found = [read_source(source, self.config) for source in self.sources]
        if self.evolve:
            found.append(pool.evolve(self.world, self.evolve, self.report, in_robots))
        different = pool.different(found, length)
        if not len(different) and more is None:
            raise pool.nothing_to_choose(self.sources)
        kept = pool.screen(self.world, different, self.count, self.report, in_robots)
        if more is None:
            return kept
        return np.unique(np.concatenate([more, kept]), axis=0)

    def prepared(self, candidates: Bits) -> Prepared:
        """The ensemble for these candidates."""
        key = np.packbits(candidates).tobytes()
        if key not in self._prepared:
            task = self.world.task
            ensemble = make_ensemble(self.world, candidates, self.report, self.compute)
            self._prepared = {key: Prepared(ensemble, task.best_fitness - task.worst_fitness)}
        return self._prepared[key]


def _task_for(section: TaskConfig, body: RobotConfig, real: Task) -> Task:
    """What the simulated robots do.

    Raises:
        ConfigError: they cannot, or it is not comparable with what the robot does.
    """
    hint = "Nothing was started. Give the simulated robots a task of their own: uncertainty.task."
    try:
        section.check(body)
        task = section.build_for(body)
        task.check_robot(body.spec)
    except ValueError as error:
        raise ConfigError(f"The simulated robots ({body.type}) cannot do task {section.type}: {error}.", hint) from None
    ours, theirs = (real.worst_fitness, real.best_fitness), (task.worst_fitness, task.best_fitness)
    if ours != theirs:
        raise ConfigError(
            f"uncertainty.task: expected fitness from {ours[0]:g} to {ours[1]:g}, as on the robot, got {theirs[0]:g} "
            f"to {theirs[1]:g}: simulated and measured trials need one scale.",
            "Nothing was started.",
        )
    if task.n_trials not in (1, real.n_trials):
        raise ConfigError(
            f"uncertainty.task: expected {real.n_trials} trials, as on the robot, or 1 that stands for all of them, "
            f"got {task.n_trials}.",
            "Nothing was started.",
        )
    return task


def simulated_body(config: ExperimentConfig, sources: tuple[Path, ...] = ()) -> RobotConfig:
    """The body that robots are drawn around.

    It is the `uncertainty` section's, or the one of the first run that candidates come from, or the robot's own one, or
    the task's usual one with as many sensors.

    Raises:
        ConfigError: there is none.
    """
    if config.uncertainty.body is not None:
        return config.uncertainty.body
    for source in sources:
        body = body_of(source)
        if body is not None:
            return body
    own = config.robot.simulated
    if own is not None:
        return own
    kind = config.task.usual_robot
    if kind is None:
        raise ConfigError(
            f"task {config.task.type}: there is no simulated body to draw robots around.",
            "Nothing was started. Name one: uncertainty.body, with the keys of a simulated robot.",
        )
    spec = config.robot.spec
    return registry.load(Group.ROBOTS, kind).model_validate(
        {"type": kind, "n_sensors": spec.n_sensors, "tick_s": spec.tick_s}
    )
