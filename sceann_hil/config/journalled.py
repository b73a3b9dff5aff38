"""The configuration that a run was made with, as its journal or a study keeps it.

A run outlives the packages that made it. Where one is not installed, a stand-in takes its section's place: it knows
what was written down, so that the run can be looked at, counted and exported, and says what to install when somebody
wants to run it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import ConfigDict

from sceann_hil import registry
from sceann_hil.config.load import StandIn, parse_config
from sceann_hil.config.model import ExperimentConfig
from sceann_hil.errors import PackageMissing, PluginError
from sceann_hil.journal import JournalReader
from sceann_hil.plugins import AlgorithmConfig, PluginConfig, RobotConfig, TaskConfig
from sceann_hil.registry import Group
from sceann_hil.robot import Robot, RobotSpec
from sceann_hil.robot.task import Task
from sceann_hil.versions import running_versions


class _MissingTask(TaskConfig):
    model_config = ConfigDict(extra="allow")
    installed = False
    why: ClassVar[PackageMissing]

    def build(self) -> Task:
        raise self.why


class _MissingRobot(RobotConfig):
    model_config = ConfigDict(extra="allow")
    installed = False
    why: ClassVar[PackageMissing]
    known: ClassVar[RobotSpec | None]

    @property
    def spec(self) -> RobotSpec:
        if self.known is not None:
            return self.known
        # older journals tell no more than the section does
        told = self.model_extra or {}
        if not all(isinstance(told.get(key), int) for key in ("n_sensors", "n_motors")):
            raise self.why
        return RobotSpec(self.type, told["n_sensors"], told["n_motors"], float(told.get("tick_s", 1.0)), (), ())

    def build(self) -> Robot:
        raise self.why


class _MissingAlgorithm(AlgorithmConfig):
    model_config = ConfigDict(extra="allow")
    installed = False
    why: ClassVar[PackageMissing]

    def build(self, genome_length: int) -> Any:
        raise self.why


def journalled_config(reader: JournalReader) -> ExperimentConfig:
    """The configuration of a run that is to be run here, all or part of it.

    Raises:
        ConfigError: a package that is installed reads it differently by now.
        PackageMissing: a package that made it is not installed here.
    """
    config = noted_config(reader)
    require_installed(config)
    return config


def require_installed(config: ExperimentConfig) -> None:
    """Refuse to run what was only to be looked at.

    Raises:
        PackageMissing: what is not installed here.
    """
    for section in (config.robot, config.task, config.algorithm):
        if isinstance(section, _MissingTask | _MissingRobot | _MissingAlgorithm):
            raise section.why


def noted_config(reader: JournalReader) -> ExperimentConfig:
    """The same of a run that is only looked at: whatever of it is not installed here is known, but cannot be built.

    Raises:
        ConfigError: a package that is installed reads it differently by now.
        PackageMissing: by `build` of what is not installed, and by the robot's `spec` where nobody has noted it.
    """
    run = reader.run()
    rows = reader.rows("robot")
    spec = _spec_from(rows[0][1]) if rows else None
    return config_as_made(run.config, f"{reader.directory}: journalled configuration", run.versions, spec)


def config_as_made(
    text: str, source: str, versions: Mapping[str, str], spec: RobotSpec | None = None
) -> ExperimentConfig:
    """The same for a configuration that is kept elsewhere.

    Args:
        text: YAML.
        source: what messages call it.
        versions: that it was made with, by package.
        spec: what was noted of its robot.
    """
    return parse_config(text, source, stand_in=_stand_ins(versions, spec))


def _spec_from(text: str) -> RobotSpec:
    told: Any = {name: tuple(value) if isinstance(value, list) else value for name, value in json.loads(text).items()}
    return RobotSpec(**told)


def _stand_ins(versions: Mapping[str, str], spec: RobotSpec | None) -> StandIn:
    def stand_in(group: Group, kind: str) -> type[PluginConfig] | None:
        try:
            registry.load(group, kind)
        except PluginError as error:
            reason = _why(group, kind, versions, error)
        else:
            return None
        if group is Group.TASKS:

            class MissingTask(_MissingTask):
                why = reason

            return MissingTask
        if group is Group.ROBOTS:

            class MissingRobot(_MissingRobot):
                why = reason
                known = spec

            return MissingRobot

        class MissingAlgorithm(_MissingAlgorithm):
            why = reason

        return MissingAlgorithm

    return stand_in


def _why(group: Group, kind: str, versions: Mapping[str, str], error: PluginError) -> PackageMissing:
    if kind in registry.available(group):
        return PackageMissing(error.message, error.hint)
    here = running_versions()
    packages = [f"{name}=={version}" for name, version in versions.items() if name not in here]
    origin = f", which came with {' or '.join(packages)}," if packages else ""
    return PackageMissing(
        f"The {group.singular} {kind!r}{origin} is not installed here.",
        f"Install it: pip install {packages[0]}" if len(packages) == 1 else "Install the package that provides it.",
    )
