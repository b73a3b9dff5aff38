"""One writer per run: an operating-system lock that a killed process cannot leave behind."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Self

from sceann_hil.errors import CannotWrite, RunIsLocked
from sceann_hil.journal.locking import open_small_file, try_lock, write_whole

LOCK_NAME = "lock"
_LOOKS_OF_OTHERS_S = 0.5
"""A look at whether a run is being worked on holds the lock for an instant; nobody is turned away by that."""


class RunLock:
    """Held while a process may write a run; freed by the operating system when the process ends, however it ends.

    Raises:
        RunIsLocked: another process holds it.
        CannotWrite: the file system has no locks.
    """

    def __init__(self, directory: Path) -> None:
        self._path = directory / LOCK_NAME
        self._descriptor = open_small_file(self._path)
        try:
            self._take(directory)
            write_whole(self._descriptor, f"{os.getpid()}\n".encode())
        except BaseException:
            self.release()
            raise

    def _take(self, directory: Path) -> None:
        give_up_at_s = time.monotonic() + _LOOKS_OF_OTHERS_S
        while not try_lock(self._descriptor, self._path):
            if time.monotonic() > give_up_at_s:
                raise RunIsLocked(
                    f"{directory} is in use: {who_has_locked(self._path)} is working on it.",
                    "Wait until it has finished, or stop it first.",
                )
            time.sleep(0.02)

    @staticmethod
    def is_held(directory: Path) -> bool:
        """True while some process may write the run."""
        path = directory / LOCK_NAME
        try:
            descriptor = os.open(path, os.O_RDONLY)
        except OSError:
            return False
        try:
            return not try_lock(descriptor, path, shared=True)
        except CannotWrite:
            return False
        finally:
            os.close(descriptor)

    def release(self) -> None:
        """Let others write. May be called twice."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


def who_has_locked(path: Path) -> str:
    """The living process of this computer that has a lock on a file, for messages."""
    if sys.platform != "linux":
        process = _written_in(path) if path.name == LOCK_NAME else 0
        return f"process {process}" if process else "another process"
    try:
        status = path.stat()
        lines = Path("/proc/locks").read_text(encoding="ascii").splitlines()
    except OSError:
        return "another process"
    device = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"
    near = {device, *(f"{device.rpartition(':')[0]}:{inode}" for inode in _beside(path))}
    found = [
        int(words[4])
        for words in map(str.split, lines)
        if "->" not in words and len(words) > 5 and words[5] in near and words[4].isdecimal()
    ]
    found += [_written_in(path)] if path.name == LOCK_NAME else []
    alive = [pid for pid in found if pid and Path(f"/proc/{pid}").exists()]
    for pid in sorted(alive, key=lambda pid: pid == os.getpid()):
        return f"process {pid}{_name_of(pid)}"
    return "another process"


def _written_in(path: Path) -> int:
    """Whoever wrote itself into the file that is the lock."""
    try:
        return int(path.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return 0


def _beside(path: Path) -> list[int]:
    """SQLite locks its shared memory instead of the database while it keeps a write-ahead log."""
    try:
        return [path.with_name(f"{path.name}-shm").stat().st_ino]
    except OSError:
        return []


def _name_of(pid: int) -> str:
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return ""
    shown = " ".join(Path(word).name if place == 0 else word for place, word in enumerate(words[:4])).strip()
    return f" ({shown[:60]})" if shown else ""
