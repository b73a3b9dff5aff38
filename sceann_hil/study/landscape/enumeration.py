"""Trying every genome: chunks of consecutive genome numbers, made, decoded and simulated on all cores."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.journal.disk import when_there_is_room
from sceann_hil.network.coding import Bits
from sceann_hil.robot import Robot
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.seeds import Purpose, keys
from sceann_hil.study.circumstances import circumstances
from sceann_hil.study.landscape.files import Landscape, LandscapeWriter

MAX_BITS = 26
"""Longest genome: 2^26 of them fill 400 MB and take a minute on pole balancing."""
_TRIALS_AT_ONCE = 1 << 18
_SECONDS_BETWEEN_SYNCS = 5.0

Progress = Callable[[int, int], None]
"""Told how many chunks are done, and how many there are."""


def enumerate_landscape(
    config: ExperimentConfig,
    directory: Path,
    n_threads: int,
    report: Progress = lambda *_: None,
    disk_full: Callable[[], None] = lambda: None,
    *,
    accept_other_versions: bool = False,
) -> Landscape:
    """Evaluate every genome of an experiment once, going on where an earlier attempt stopped.

    With a noisy body a genome's noise comes from its number and the configuration's seed.

    Args:
        config: the experiment; of its algorithm nothing is used.
        directory: the landscape's folder, made if it is missing.
        n_threads: cores to use.
        report: told after every chunk.
        disk_full: told when the disk is full; the enumeration then waits until there is room.
        accept_other_versions: also on other versions, or with another body, than the session before.

    Raises:
        ConfigError: the genome is longer than `MAX_BITS`, or the robot takes no batches.
        StudyChanged: the folder holds another landscape.
        OtherVersions: it was begun with other versions, or another body.
    """
    check_enumerable(config)
    n = 1 << config.genome_length
    size = min(n, 1 << max(0, (_TRIALS_AT_ONCE // config.build_task().n_trials).bit_length() - 1))
    landscape = Landscape.begin_or_continue(config, directory, n // size)
    todo = [int(chunk) for chunk in np.flatnonzero(landscape.done == 0)]
    if not todo:
        return landscape
    landscape.begin_session(circumstances([config]), accept_other_versions=accept_other_versions)
    writer = LandscapeWriter(landscape)
    try:
        with config.robot.build() as robot, ThreadPoolExecutor(n_threads) as pool:
            robot.use_cores(1)
            chunks = _Chunks(config, robot, size)
            pending: dict[Future[tuple[NDArray[np.float32], NDArray[np.uint16]]], int] = {}
            synced = time.monotonic()
            while todo or pending:
                while todo and len(pending) < n_threads + 1:
                    pending[pool.submit(chunks.evaluate, todo[0])] = todo[0]
                    del todo[0]
                finished, _ = wait(pending, return_when=FIRST_COMPLETED)
                for future in finished:
                    chunk = pending.pop(future)
                    write = partial(writer.write, chunk, chunk * size, *future.result())
                    when_there_is_room(write, disk_full)
                    report(int(landscape.done.sum()), n // size)
                if time.monotonic() - synced > _SECONDS_BETWEEN_SYNCS:
                    when_there_is_room(writer.sync, disk_full)
                    synced = time.monotonic()
        when_there_is_room(writer.sync, disk_full)
    finally:
        writer.close()
    return landscape


def check_enumerable(config: ExperimentConfig) -> None:
    """Refuse what cannot be enumerated.

    Raises:
        ConfigError: the genome is too long, or the robot takes no batches.
    """
    size, spec = config.size, config.robot.spec
    if config.genome_length > MAX_BITS:
        raise ConfigError(
            f"controller.coding: {config.controller.coding.value} with {size.n_sensors} sensors, {size.n_hidden} "
            f"hidden and {size.n_motors} motor neurons has {config.genome_length} bits; expected at most {MAX_BITS}, "
            "because every genome is tried",
            "Nothing was started. Choose a smaller network, or sceann3, the shortest coding.",
        )
    if not spec.takes_batches:
        raise ConfigError(
            f"robot.type: enumeration needs a simulated robot that runs many trials at once, got {spec.name}",
            "Nothing was started.",
        )


def genomes_of(numbers: NDArray[np.int64], length: int) -> Bits:
    """The genomes with these numbers, most significant bit first, shape ``(n, length)``."""
    octets = numbers.astype(">u4").view(np.uint8).reshape(-1, 4)
    return np.unpackbits(octets, axis=1)[:, 32 - length :]


class _Chunks:
    """Evaluates chunks of one experiment; what all chunks share is made once."""

    def __init__(self, config: ExperimentConfig, robot: Robot, size: int) -> None:
        self._batch = BatchEvaluator.of(config, robot)
        self._length = config.genome_length
        self._seed = config.seed
        self._size = size

    def evaluate(self, chunk: int) -> tuple[NDArray[np.float32], NDArray[np.uint16]]:
        """Fitness and successful trials of the chunk's genomes, both of shape ``(size,)``."""
        numbers = np.arange(chunk * self._size, (chunk + 1) * self._size)
        outcomes = self._batch.evaluate(genomes_of(numbers, self._length), self._keys(numbers))
        return outcomes.mean_fitness.astype(np.float32), outcomes.successes.astype(np.uint16)

    def _keys(self, numbers: NDArray[np.int64]) -> NDArray[np.uint64] | int:
        if self._batch.robot.spec.noise_free and not self._batch.task.draws_starts:
            return 0
        return keys(self._seed, Purpose.TRIAL, 0, numbers[:, None], np.arange(self._batch.task.n_trials), 0)
