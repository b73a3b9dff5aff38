"""A landscape's folder: NumPy arrays that grow chunk by chunk and survive a killed process.

    config.yaml      the experiment whose genomes were tried; its algorithm only gives the budget for comparisons
    fitness.npy      float32, shape (2**L,): fitness of genome g
    successes.npy    uint16, shape (2**L,): its trials that reached what the task asks for
    done.npy         uint8, one per chunk: 1 when the chunk is in both arrays
    sessions.json    when it was worked on, and on which versions and bodies
    solutions.npy    int64: the genomes that succeeded in every trial (written by the analysis)
    summary.json     what the analysis found

All but the last are read with ``numpy.load(path, mmap_mode="r")``.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig, config_difference, dump_config, load_config
from sceann_hil.errors import NotARun, OtherVersions, RunIsDamaged, StudyChanged
from sceann_hil.places import make_folder
from sceann_hil.versions import version_differences

_CONFIG, _FITNESS, _SUCCESSES, _DONE = "config.yaml", "fitness.npy", "successes.npy", "done.npy"
_SESSIONS = "sessions.json"


class Landscape:
    """A landscape on disk, finished or not.

    Attributes:
        directory: the folder.
        config: the experiment.

    Raises:
        NotARun: the folder holds no landscape.
    """

    def __init__(self, directory: Path) -> None:
        if not (directory / _CONFIG).is_file() or not (directory / _DONE).is_file():
            raise NotARun(f"{directory} is not a landscape.", "Name a folder that `sceann enumerate` made.")
        self.directory = directory
        self.config: ExperimentConfig = load_config(directory / _CONFIG)

    @classmethod
    def begin_or_continue(cls, config: ExperimentConfig, directory: Path, n_chunks: int) -> Self:
        """Open the landscape in a folder, or make an empty one there.

        Raises:
            StudyChanged: the folder holds the landscape of another experiment.
        """
        if not (directory / _DONE).is_file():
            make_folder(directory)
            n = 1 << config.genome_length
            _reserve(directory / _FITNESS, np.dtype("<f4"), n)
            _reserve(directory / _SUCCESSES, np.dtype("<u2"), n)
            (directory / _CONFIG).write_text(dump_config(config), encoding="utf-8")
            np.save(directory / _DONE, np.zeros(n_chunks, np.uint8))
        landscape = cls(directory)
        differences = config_difference(landscape.config, config)
        if differences:
            lines = "\n".join(f"  {difference}" for difference in differences)
            raise StudyChanged(
                f"{directory} holds the landscape of another experiment:\n{lines}",
                "Undo the change, or choose another --out.",
            )
        if len(landscape.done) != n_chunks:
            raise RunIsDamaged(
                f"{directory / _DONE}: expected {n_chunks} chunks, got {len(landscape.done)}.",
                "Remove the folder and enumerate again.",
            )
        return landscape

    def begin_session(self, now: dict[str, str], *, accept_other_versions: bool) -> None:
        """Note on what the next chunks are computed.

        Args:
            now: see `sceann_hil.study.circumstances`.
            accept_other_versions: also on others than the session before.

        Raises:
            OtherVersions: the session before ran on others.
            RunIsDamaged: the file of sessions cannot be read.
        """
        sessions = self.sessions()
        others = version_differences(sessions[-1]["versions"], now) if sessions else []
        if others and not accept_other_versions:
            raise OtherVersions(
                f"{self.directory} would go on with other versions than before: {'; '.join(others)}.",
                "Go on with the versions of before, choose another --out, or give --accept-versions: then "
                f"{_SESSIONS} says which versions were used.",
            )
        session = {"started_at": datetime.now(UTC).isoformat(timespec="seconds"), "versions": now}
        path = self.directory / _SESSIONS
        unfinished = path.with_suffix(".new.json")
        unfinished.write_text(json.dumps([*sessions, session], indent=2) + "\n", encoding="utf-8")
        unfinished.replace(path)

    def sessions(self) -> list[dict[str, Any]]:
        """When it was worked on, and on which versions; empty for a landscape that was begun before this was noted.

        Raises:
            RunIsDamaged: the file cannot be read.
        """
        path = self.directory / _SESSIONS
        if not path.exists():
            return []
        try:
            sessions = json.loads(path.read_bytes())
            if not all(isinstance(session["versions"], dict) for session in sessions):
                raise ValueError("expected a list of sessions with their versions")
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise RunIsDamaged(f"{path} cannot be read: {error}.", "Remove the folder and enumerate again.") from None
        return list(sessions)

    @cached_property
    def done(self) -> NDArray[np.uint8]:
        """1 for each chunk that is on disk, shape ``(n_chunks,)``."""
        return np.asarray(np.load(self.directory / _DONE))

    @property
    def is_complete(self) -> bool:
        """Every genome was tried."""
        return bool(self.done.all())

    @property
    def fitness(self) -> NDArray[np.float32]:
        """Fitness of every genome, on disk, shape ``(2**L,)``."""
        return self._mapped(_FITNESS)

    @property
    def successes(self) -> NDArray[np.uint16]:
        """Successful trials of every genome, on disk, shape ``(2**L,)``."""
        return self._mapped(_SUCCESSES)

    def _mapped(self, name: str) -> NDArray[Any]:
        try:
            array: NDArray[Any] = np.load(self.directory / name, mmap_mode="r")
        except (OSError, ValueError) as error:
            raise RunIsDamaged(
                f"{self.directory / name} cannot be read: {error}.", "Remove the folder and enumerate again."
            ) from None
        return array


class LandscapeWriter:
    """Writes chunks, and now and then which of them are safely on disk."""

    def __init__(self, landscape: Landscape) -> None:
        self._landscape = landscape
        self._files = [(landscape.directory / name).open("r+b") for name in (_FITNESS, _SUCCESSES)]
        self._offsets = [_data_offset(landscape.directory / name) for name in (_FITNESS, _SUCCESSES)]

    def write(self, chunk: int, first: int, fitness: NDArray[np.float32], successes: NDArray[np.uint16]) -> None:
        """Put one chunk, which begins with genome `first`, into both arrays.

        Raises:
            OSError: the disk is full, or whatever else it has to say.
        """
        for file, offset, raw in zip(
            self._files,
            self._offsets,
            (fitness.astype("<f4").tobytes(), successes.astype("<u2").tobytes()),
            strict=True,
        ):
            file.seek(offset + first * len(raw) // len(fitness))
            file.write(raw)
        self._landscape.done[chunk] = 1

    def sync(self) -> None:
        """Make sure of the data, then say so."""
        for file in self._files:
            file.flush()
            os.fsync(file.fileno())
        path = self._landscape.directory / _DONE
        unfinished = path.with_suffix(".new.npy")
        np.save(unfinished, self._landscape.done)
        unfinished.replace(path)

    def close(self) -> None:
        """Let go of the files; what was not synchronised is done again."""
        for file in self._files:
            file.close()


def landscapes_in(directory: Path) -> Sequence[Landscape]:
    """All complete landscapes in a folder and below, by name."""
    found = (Landscape(path.parent) for path in sorted(directory.rglob(_DONE)))
    return [landscape for landscape in found if landscape.is_complete]


def _reserve(path: Path, dtype: np.dtype[Any], n: int) -> None:
    """An array of zeros; the operating system gives it room as it fills."""
    with path.open("wb") as file:
        header = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": (n,)}
        np.lib.format.write_array_header_1_0(file, header)
        file.truncate(file.tell() + n * dtype.itemsize)


def _data_offset(path: Path) -> int:
    with path.open("rb") as file:
        np.lib.format.read_magic(file)
        np.lib.format.read_array_header_1_0(file)
        return file.tell()
