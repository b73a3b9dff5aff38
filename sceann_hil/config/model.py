"""The configuration of one experiment, validated and frozen."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any, Self, cast

from pydantic import AfterValidator, Field, SerializeAsAny, model_validator

from sceann_hil.config.problems import shown
from sceann_hil.config.uncertainty import UncertaintyConfig
from sceann_hil.network.coding import Coding, NetworkSize, genome_from_hex
from sceann_hil.network.controller import ONE, Dynamics, Neuron
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.plugins import AlgorithmConfig, Misfit, RobotConfig, Section, TaskConfig
from sceann_hil.supervision.budget import BudgetConfig
from sceann_hil.supervision.operators import OperatorConfig
from sceann_hil.supervision.reference_settings import ReferenceConfig
from sceann_hil.supervision.saving import Racing, SavingConfig
from sceann_hil.supervision.suspenders import SuspendersConfig

if TYPE_CHECKING:
    from sceann_hil.robot.task import Task

MAX_SEED = 2**63 - 1
"""Largest seed: what the journal's database keeps as an integer."""


_NAME = re.compile(r"^[A-Za-z0-9]([A-Za-z0-9 ._-]{0,78}[A-Za-z0-9])?$")


def _checked_name(name: str) -> str:
    if not _NAME.fullmatch(name):
        raise ValueError(f"expected at most 80 letters and digits, with spaces and . _ - inside, got {shown(name)}")
    return name


Name = Annotated[str, AfterValidator(_checked_name), Field(json_schema_extra={"pattern": _NAME.pattern})]


class ControllerConfig(Section):
    """The network. Its numbers of sensor and motor neurons come from the robot."""

    coding: Coding
    """How the genome codes the connections: sceann1, sceann2 or sceann3."""
    n_hidden: Annotated[int, Field(ge=0)]
    """Hidden neurons."""
    neuron: Neuron = Neuron.ACCUMULATING
    """The reading of the paper's Eq. (1): accumulating, or memoryless."""
    initial_output: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    """Output of every neuron before the first step, 0..1; the nearest multiple of 1/1024 is used."""

    @property
    def dynamics(self) -> Dynamics:
        """The neuron in SCEANN-Q10."""
        return Dynamics(self.neuron, math.floor(self.initial_output * ONE + 0.5))


class ExperimentConfig(Section):
    """Everything that decides what a run does.

    Raises:
        pydantic.ValidationError: the network is too large, or the task refuses the robot.
    """

    name: Name | None = None
    """What the run is called: letters, digits, spaces and . _ - inside."""
    seed: Annotated[int, Field(ge=0, le=MAX_SEED)] = 1
    """Root of the seed tree: equal seeds give equal runs."""
    task: SerializeAsAny[TaskConfig]
    """What a trial is: starts, step limit, fitness."""
    robot: SerializeAsAny[RobotConfig]
    """The body, simulated or real."""
    controller: ControllerConfig
    """The network that drives it."""
    algorithm: SerializeAsAny[AlgorithmConfig]
    """What makes the next generation."""
    operator: OperatorConfig = OperatorConfig()
    """Who stands beside the robot."""
    budget: BudgetConfig = BudgetConfig()
    """What the run may cost."""
    suspenders: SuspendersConfig = SuspendersConfig()
    """What pauses the run by itself."""
    saving: SavingConfig = SavingConfig()
    """Ways to need less robot time."""
    reference: ReferenceConfig = ReferenceConfig()
    """A genome that is run again and again, to see the robot drift."""
    uncertainty: UncertaintyConfig = UncertaintyConfig()
    """What nobody knows of the robot, for `sceann transfer`."""

    @property
    def size(self) -> NetworkSize:
        """The network's size, from the robot and the controller."""
        spec = self.robot.spec
        return NetworkSize(spec.n_sensors, self.controller.n_hidden, spec.n_motors)

    @property
    def phenotype(self) -> Phenotype:
        """How this experiment's genomes become controllers."""
        return Phenotype(self.controller.coding, self.size, self.controller.dynamics)

    @property
    def genome_length(self) -> int:
        """L, bits of a genome."""
        return self.phenotype.genome_length

    def build_task(self) -> Task:
        """The task, for this experiment's robot."""
        return self.task.build_for(self.robot)

    def with_changes(
        self, changes: Mapping[str, Any] | None = None, /, *, settings: Sequence[str] = (), **sections: Any
    ) -> Self:
        """This configuration with some values replaced, checked as a whole like a file.

        Args:
            changes: new values by dotted key, such as ``{"algorithm.population": 50, "seed": 3}``. A value replaces
                what stands there: a section's value is the whole section.
            settings: ``key.sub=value`` texts, as ``--set`` gives them.
            sections: further changes whose keys are words: ``robot={"type": "cartpole"}``, ``seed=3``.

        Raises:
            ConfigError: what is wrong with the result.
        """
        from sceann_hil.config.data import changed  # it checks with this model

        return cast(Self, changed(self, {**(changes or {}), **sections}, settings))

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if not (self.robot.installed and self.task.installed and self.algorithm.installed):
            return self  # it did when the run was made
        with _blaming(self, "robot"):
            _ = self.robot.spec
        try:
            _ = self.size
        except ValueError as error:
            sensors = "robot.n_sensors" if "n_sensors" in type(self.robot).model_fields else "robot.type"
            raise Misfit(str(error), sensors, "controller.n_hidden") from error
        with _blaming(self, "algorithm"):
            self.algorithm.build(self.genome_length)
        with _blaming(self, "task", "robot"):
            self.task.check(self.robot)
            self._check_robot_and_task()
        if self.reference.genome is not None:
            try:
                genome_from_hex(self.reference.genome, self.genome_length)
            except ValueError as error:
                raise Misfit(f"genome: {str(error).removeprefix('genome: ')}", "reference.genome") from error
        self._check_measures()
        if self.algorithm.weighs_trials and self.saving != SavingConfig():
            raise Misfit(
                f"saving: expected nothing to be saved with algorithm {self.algorithm.type}, which weighs every trial",
                "saving",
                "algorithm.type",
            )
        if self.saving.racing is not Racing.OFF and not self.algorithm.compares_only:
            raise Misfit(
                f"racing: expected an algorithm that only compares fitness, got {self.algorithm.type}",
                "saving.racing",
                "algorithm.type",
            )
        return self

    def _check_robot_and_task(self) -> None:
        try:
            task = self.build_task()
        except NotImplementedError:
            return  # a plug-in that is only a section yet: its keys can be checked, its trials cannot be run
        task.check_robot(self.robot.spec)
        if task.draws_starts and self.operator.resolved(attended=self.robot.spec.attended):
            raise Misfit(
                "starts_drawn: expected a simulated robot and no operator, because nobody can put a robot at another "
                "place to the millimetre for every trial",
                "task.starts_drawn",
                "operator.who",
            )
        asked = self.operator.resolved(attended=self.robot.spec.attended) and self.operator.confirm
        if task.score_by_operator and not asked:
            raise Misfit(
                "who: expected somebody who is asked after every trial (operator.confirm), because with "
                "task.score_by_operator a person says how good it was",
                "operator.who",
                "operator.confirm",
            )
        if task.score_by_operator and self.reference.every is not None:
            raise Misfit("reference: expected none, because its runs are not judged by a person", "reference.every")
        if self.saving.racing is not Racing.OFF and not math.isfinite(task.best_fitness - task.worst_fitness):
            raise Misfit(
                f"racing: expected a task that says what its trials can be worth, got {self.task.type}",
                "saving.racing",
                "task.type",
            )

    def _check_measures(self) -> None:
        """Measures must be offered, and be those of all trials.

        Raises:
            Misfit: they are not.
        """
        wanted = self.algorithm.measures
        if not wanted:
            return
        offered = self.build_task().measure_names(self.robot.spec)
        for name in wanted:
            if name not in offered:
                raise Misfit(
                    f"the algorithm {self.algorithm.type} wants the measure {name}; task {self.task.type} on robot "
                    f"{self.robot.type} offers {', '.join(offered) or 'none'}",
                    "algorithm",
                    "task.type",
                )
        saving = self.saving
        if saving.reuse or saving.pool or saving.racing is not Racing.OFF:
            raise Misfit(
                f"saving: expected that every trial is run, because {self.algorithm.type} is told measures of all",
                "saving",
                "algorithm.type",
            )


@contextmanager
def _blaming(config: ExperimentConfig, section: str, *others: str) -> Iterator[None]:
    """Turn a ValueError about a section's values into a `Misfit` that names keys as seen from the top.

    A `Misfit` about several sections names its keys so already; an error that names no key is about all `type` keys.
    """
    try:
        yield
    except ValueError as error:
        key = str(error).partition(": ")[0]
        if isinstance(error, Misfit) and error.keys:
            keys = error.keys if others else tuple(f"{section}.{key}" for key in error.keys)
        elif key in type(getattr(config, section)).model_fields:
            keys = (f"{section}.{key}",)
        else:
            keys = tuple(f"{name}.type" for name in (section, *others))
        raise Misfit(str(error), *keys) from error
