"""A transfer's configuration, from a robot's file and the runs that candidates come from."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sceann_hil.config import ExperimentConfig, journalled_config, load_config
from sceann_hil.config.data import with_robot_of
from sceann_hil.config.document import parse
from sceann_hil.config.file import read_text
from sceann_hil.errors import ConfigError
from sceann_hil.journal import JournalReader
from sceann_hil.run.transfer.preparation import simulated_body
from sceann_hil.run.transfer.settings import TransferConfig
from sceann_hil.run.transfer.sources import kind_of


def transfer_config(
    robot: Path | ExperimentConfig,
    sources: Sequence[Path] = (),
    *,
    trials: int | None = None,
    rounds: int | None = None,
    target: float | None = None,
    evolve: int | None = None,
    again: Path | None = None,
    settings: Sequence[str] = (),
) -> ExperimentConfig:
    """The configuration of a transfer, self-contained but for the sources' genomes.

    Args:
        robot: a whole experiment on the robot, or its YAML file, or one of no more than its section `robot`: the rest
            is then as in the first source that is a run, or in the transfer that is gone on from.
        sources: folders of runs and studies whose genomes are candidates.
        trials: most trials to choose by; None for the file's, or 40.
        rounds: measurements of the recommended controller in all trials of the task.
        target: fitness that is enough.
        evolve: runs of evolution in simulated robots that give candidates.
        again: folder of an earlier transfer on the same robot.
        settings: ``key.sub=value`` texts, as ``--set`` gives them.

    Raises:
        ConfigError: what is wrong.
    """
    config = _experiment(robot, sources, again, settings)
    given: dict[str, Any] = {"type": "transfer"}
    if isinstance(config.algorithm, TransferConfig):
        given = config.algorithm.model_dump(mode="json", exclude={"generations"})
    named = {"trials": trials, "rounds": rounds, "target": target, "evolve": evolve}
    given |= {name: value for name, value in named.items() if value is not None}
    if sources:
        given["sources"] = [str(source.resolve()) for source in sources]
    if again is not None:
        given["again"] = str(again.resolve())
    body = simulated_body(config, tuple(sources))
    # what saves trials in evolution would mix them here
    return config.with_changes(
        {"algorithm": given, "saving": {}, "uncertainty.body": body.model_dump(mode="json")}, settings=settings
    )


def _experiment(
    robot: Path | ExperimentConfig, sources: Sequence[Path], again: Path | None, settings: Sequence[str]
) -> ExperimentConfig:
    if isinstance(robot, ExperimentConfig):
        return robot
    data = parse(read_text(robot), str(robot)).data
    if isinstance(data, dict) and "task" in data:
        keep = [text for text in settings if not text.startswith("algorithm")]
        return load_config(robot, keep)
    runs = [*([again] if again is not None else []), *(source for source in sources if kind_of(source) is None)]
    if not runs:
        raise ConfigError(
            f"{robot}: expected a whole experiment, or a run to take all but the section robot from.",
            "Nothing was started. Name a run of the same task: --from RUN.",
        )
    reader = JournalReader(runs[0])
    try:
        theirs = journalled_config(reader)
    finally:
        reader.close()
    return with_robot_of(theirs.with_changes({"name": None, "uncertainty.body": None}), robot)
