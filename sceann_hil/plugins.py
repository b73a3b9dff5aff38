"""What a package that brings a robot, a task or an algorithm must provide: one configuration model.

A plug-in is a subclass of `RobotConfig`, `TaskConfig` or `AlgorithmConfig`, named by an entry point (see
`sceann_hil.registry`). Its fields are the keys of its section in the YAML file, their docstrings are what the
JSON schema says of them, and `build` makes the thing itself. A validator that refuses values raises a
ValueError that begins with the key at fault, ``"elites: expected ..., got ..."``, or a `Misfit`.

This module imports nothing of the framework at run time, so that every other module may import it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import BaseModel, ConfigDict

if TYPE_CHECKING:
    from sceann_hil.config import ExperimentConfig
    from sceann_hil.evolution.algorithm import Algorithm
    from sceann_hil.firmware.aesl.program import Life
    from sceann_hil.robot import Robot, RobotSpec
    from sceann_hil.robot.task import Task


def _describe(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """The docstrings of a model's fields as descriptions in its JSON schema.

    Pydantic can find them itself, but it reads the source of every model at import, and only a schema needs them.
    """
    import ast
    import inspect
    import itertools
    import textwrap

    for kind in model.__mro__:
        if kind is Section or not issubclass(kind, Section):
            continue
        body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0].body  # type: ignore[attr-defined]
        for field, said in itertools.pairwise(body):
            match field, said:
                case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(words))):
                    if name in schema["properties"]:
                        schema["properties"][name].setdefault("description", inspect.cleandoc(words))


class Section(BaseModel):
    """A mapping in the configuration: frozen, unknown keys and loosely typed values are refused."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        allow_inf_nan=False,
        validate_default=True,
        json_schema_extra=_describe,
        protected_namespaces=(),
    )


class PluginConfig(Section):
    """A section whose `type` says which plug-in it configures.

    Subclasses repeat it as ``type: Literal["name"] = "name"`` with the name of their entry point.
    """

    installed: ClassVar[bool] = True
    """False for what takes the place of a plug-in that a run was made with and that is not here."""

    type: str


class RobotConfig(PluginConfig):
    """The `robot` section."""

    @property
    def usual_uncertainty(self) -> Mapping[str, Any]:
        """What is usually not known of such a body, by key, as `uncertainty.keys` has it."""
        return {}

    def values_of(self, key: str) -> int:
        """How many values a dotted key of this section takes: one for each sensor or motor where they differ, or 1.

        Keys that run through a list of sections, such as those of several sensors, have one for each of them; nobody
        is asked for these.
        """
        return 1

    @property
    @abstractmethod
    def spec(self) -> RobotSpec:
        """What the robot is, known without building it; the numbers of sensors and motors come from here.

        Raises:
            ValueError: the values do not fit together.
        """

    @abstractmethod
    def build(self) -> Robot:
        """The robot, not yet connected."""

    @property
    def simulated(self) -> RobotConfig | None:
        """The simulated robot with the same body: itself if it is one; None if nobody has described it."""
        return self if self.spec.deterministic else None

    @property
    def aesl_life(self) -> Life | None:
        """How a controller of this robot lives in Aseba's virtual machine; None if nobody has said so."""
        return None

    def refuses_start(self, start: Mapping[str, float]) -> str:
        """Why no trial can begin there: outside of the arena, in an obstacle; empty if one can.

        Args:
            start: values by the names of the start fields.
        """
        return ""

    def on_virtual_board(self, body: RobotConfig) -> AbstractContextManager[RobotConfig | None]:
        """This robot's firmware on a virtual board of this computer, for as long as the block lasts.

        Args:
            body: simulated; it is on the pins of that board.

        Returns:
            The section that leads to it, or None: this kind of robot has no firmware to rehearse.
        """
        return nullcontext(None)


@dataclass(frozen=True, slots=True)
class StartVariation:
    """Other starts than the configured ones, from none to severe: a way to try how robust controllers are.

    Attributes:
        name: for people.
        unit: of the levels.
        levels: how far the starts are changed; the first is the configured task.
        changes: for each level, new values of the task's keys.
    """

    name: str
    unit: str
    levels: tuple[float, ...]
    changes: tuple[Mapping[str, Any], ...]


class TaskConfig(PluginConfig):
    """The `task` section."""

    usual_robot: ClassVar[str | None] = None
    """Type of a simulated robot with the keys `n_sensors` and `tick_s` that can stand in for a real one."""

    @abstractmethod
    def build(self) -> Task:
        """The task."""

    def build_for(self, robot: RobotConfig) -> Task:
        """The task for one robot; what `build` gives, unless its trials depend on the robot's surroundings."""
        return self.build()

    def check(self, robot: RobotConfig) -> None:
        """Refuse a robot that cannot do this task.

        Raises:
            ValueError: why it cannot; a `Misfit` also names the keys at fault.
        """

    def other_starts(self) -> StartVariation | None:
        """How the starts can be varied to try a controller's robustness; None if they cannot."""
        return None


class AlgorithmConfig(PluginConfig):
    """The `algorithm` section. Subclasses give the two numbers their defaults and limits."""

    compares_only: ClassVar[bool] = False
    """It uses fitness only to compare individuals, so any numbers in the same order give the same next generation."""
    conclusion: ClassVar[str | None] = None
    """``module:function`` that is called with a run's folder at the end of every session and tells what there is to
    say: an object with `lines` for people and a `document` for programs."""
    weighs_trials: ClassVar[bool] = False
    """It weighs every trial by itself, so nothing but a generation's own trials may count in it."""

    population: int
    """Individuals per generation."""
    generations: int
    """Generations after the initial one, so one more is evaluated."""

    @property
    def measures(self) -> tuple[str, ...]:
        """Names of what the algorithm is told of individuals besides fitness; none unless this is overridden.

        The task must offer them (`sceann_hil.robot.task.Task.measure_names`).
        """
        return ()

    @property
    def keeps_best(self) -> bool:
        """The best of a generation is in the next one too, unchanged; otherwise a run's champion may be of any."""
        return False

    @abstractmethod
    def build(self, genome_length: int) -> Algorithm[Any]:
        """The algorithm for genomes of `genome_length` bits.

        Raises:
            ValueError: the settings do not suit genomes of this length.
        """

    def for_experiment(self, config: ExperimentConfig, report: Callable[[str, int, int], None] | None = None) -> Any:
        """The algorithm for one experiment; what `build` gives, unless it needs to know more than a length.

        Args:
            config: the experiment, whose section this is.
            report: told what is being prepared, how much of it is done, and how much there is.
        """
        return self.build(config.genome_length)

    def prepare(self, config: ExperimentConfig, report: Callable[[str, int, int], None] | None = None) -> None:
        """Do what takes long before there is a robot to wait for it; by default nothing."""


class Misfit(ValueError):
    """Values that are right by themselves but do not go together.

    Attributes:
        keys: dotted keys of these values, seen from the section that raises it (in `TaskConfig.check`: from
            the top, such as ``task.start_m``), most likely culprit first.
    """

    def __init__(self, message: str, *keys: str) -> None:
        super().__init__(message, *keys)
        self.message = message
        self.keys = keys

    def __str__(self) -> str:
        return self.message
