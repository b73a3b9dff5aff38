"""The controller that a run evolved, and the sensors that it saw there."""

from __future__ import annotations

import shlex
from collections.abc import Callable

from sceann_hil.config import ExperimentConfig, noted_config
from sceann_hil.firmware.verify import Sensors
from sceann_hil.journal import IndividualRow, JournalReader
from sceann_hil.network.image import ControllerImage
from sceann_hil.run.chosen import BEST, chosen_individual
from sceann_hil.run.replay import journalled_trials


def image_of(reader: JournalReader, config: ExperimentConfig, row: IndividualRow, command: str) -> ControllerImage:
    """An individual as an image.

    Args:
        reader: the run's journal.
        config: the run's configuration.
        row: the individual.
        command: what follows the run and the genome in the command that makes the header again.
    """
    return ControllerImage(
        genome=row.genome_bits(config.genome_length),
        coding=config.controller.coding,
        size=config.size,
        dynamics=config.controller.dynamics,
        fitness=row.fitness,
        provenance=f"sceann export {shlex.quote(reader.run().name)} --genome {row.short_place} {command}".rstrip(),
    )


def load_image(
    reader: JournalReader, genome: str = BEST, command: str = "", note: Callable[[str], object] = lambda _: None
) -> ControllerImage:
    """The image of ``--genome``; see `chosen_individual` and `image_of`.

    Args:
        reader: the run's journal.
        genome: which individual.
        command: as for `image_of`.
        note: told what people should know of it.
    """
    chosen = chosen_individual(reader, genome)
    if chosen.note:
        note(chosen.note)
    return image_of(reader, noted_config(reader), chosen.individual, command)


def recorded_sensors(reader: JournalReader, genome: str = BEST) -> list[Sensors]:
    """The sensor sequences of the individual's trials, replayed on the run's robot.

    Returns:
        One sequence per trial, shape ``(n_steps, n_sensors)``; none if the robot cannot repeat the past.
    """
    config, row = noted_config(reader), chosen_individual(reader, genome).individual
    attempts = [
        attempt
        for attempt in reader.attempts(row.generation)
        if attempt.individual == row.number and attempt.fitness is not None
    ]
    with config.robot.build() as robot:
        if not robot.spec.deterministic or not attempts:
            return []
        traces = robot.trace(journalled_trials(reader, config, attempts)).traces
    return [trace.sensors for trace in traces or () if len(trace.sensors)]
