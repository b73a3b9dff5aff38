"""Files in rerun's format: written whole or not at all, joined, checked."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import subprocess
import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import rerun as rr
import rerun_cli  # type: ignore[import-untyped]
from rerun.chunk import Chunk, LazyChunkStream, RrdReader

from sceann_hil.errors import DiskFull, RecordingIsDamaged
from sceann_hil.journal.seal import file_sha256

VIEWER = Path(rerun_cli.__file__).parent / ("rerun.exe" if os.name == "nt" else "rerun")
"""The program itself: the `rerun` script is a wrapper that does not pass signals on."""

_MAGIC = b"RRF2"
_END = b"RRF2FOOT"
"""What a file begins with, and what stands in its last bytes."""


def quiet_environment() -> dict[str, str]:
    """For rerun's programs: no usage statistics, no banner, nothing written to the user's settings; errors only."""
    return {**os.environ, "CI": "true", "RUST_LOG": "error", "NO_COLOR": "1"}


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary name beside `path` that becomes `path` at the end of the block, or nothing at all.

    The SHA-256 of the file is written beside it, in the format of `sha256sum`, before the file gets its name.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield part
        _digest_path(path).write_text(f"{file_sha256(part)}  {path.name}\n", encoding="ascii")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def write_recording(path: Path, chunks: Iterable[Chunk], *, application_id: str, recording_id: str) -> None:
    """One recording in one file.

    Raises:
        DiskFull: no space left.
        OSError: `path` cannot be written.
    """
    whole = list(chunks)  # made here: an error inside rerun's pipeline loses its type
    try:
        LazyChunkStream.from_iter(whole).write_rrd(path, application_id=application_id, recording_id=recording_id)
    except (OSError, ValueError, RuntimeError) as error:
        raise _disk_full(str(error), path) or error from error


def join(parts: Sequence[Path], path: Path) -> None:
    """Recordings of several files in one file, without decoding them; the parts stay.

    Args:
        parts: files with one recording each (rerun 0.41 cannot join what is joined already).
        path: the file.

    Raises:
        DiskFull: no space left.
        OSError: rerun refuses, with what it said.
    """
    with replacing(path) as part:
        _rrd("route", parts, part)


def merge(parts: Sequence[Path], path: Path) -> None:
    """Parts of the same recording as one recording; the parts stay.

    Raises:
        DiskFull, OSError: as in `join`.
    """
    with replacing(path) as part:
        _rrd("merge", parts, part)


def _rrd(command: str, parts: Sequence[Path], path: Path) -> None:
    done = subprocess.run(
        [VIEWER, "rrd", command, *parts, "-o", path],
        env=quiet_environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    said = done.stderr.strip()
    if done.returncode:
        raise _disk_full(said, path) or OSError(errno.EIO, f"rerun rrd {command} failed: {said[:400]}", str(path))
    if not _has_end(path):
        # rerun does not notice when the last of its output finds no room
        raise _no_room(path)


def _has_end(path: Path) -> bool:
    length = len(_END) + 4
    with path.open("rb") as file:
        file.seek(max(file.seek(0, os.SEEK_END) - length, 0))
        return _END in file.read(length)


def _disk_full(said: str, path: Path) -> DiskFull | None:
    """rerun passes the operating system's errors on as text."""
    full = any(f"os error {number}" in said for number in (errno.ENOSPC, errno.EDQUOT))
    return _no_room(path) if full else None


def _no_room(path: Path) -> DiskFull:
    return DiskFull(
        f"The disk is full: {path.parent} cannot take more recordings.",
        "Free some space, then `sceann record DIR` makes the missing ones. The run itself is not harmed.",
    )


def remove_leftovers(folder: Path) -> None:
    """What a process that was killed while it wrote has left: parts of files, and digests of files that never came."""
    for leftover in (*folder.rglob(".*.part"), *folder.rglob(".parts-*")):
        shutil.rmtree(leftover) if leftover.is_dir() else leftover.unlink()
    for digest in folder.rglob(".*.sha256"):
        if not digest.with_name(digest.name[1:].removesuffix(".sha256")).exists():
            digest.unlink()


def _digest_path(path: Path) -> Path:
    return path.with_name(f".{path.name}.sha256")


def _is_as_written(path: Path) -> bool:
    """False if a file differs from what its digest beside it says; recordings of older versions have none."""
    try:
        known = _digest_path(path).read_text(encoding="ascii").split()
    except (OSError, UnicodeDecodeError):
        return True
    return known[:1] == [file_sha256(path)]


def check(path: Path, remedy: str) -> int:
    """Refuse a file that a viewer could not show, or in which a byte has changed since it was written.

    Args:
        path: a file that exists.
        remedy: what a user should do about a damaged one.

    Returns:
        The number of recordings in it.

    Raises:
        RecordingIsDamaged: it is empty, cut off, of another kind, changed, or its index is wrong.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        start = file.read(len(_MAGIC))
    if not size:
        raise RecordingIsDamaged(f"{path} is empty.", remedy)
    if start != _MAGIC:
        raise RecordingIsDamaged(f"{path} is not a recording: it begins with {start!r} instead of {_MAGIC!r}.", remedy)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rr.error_utils.RerunWarning)
            reader = RrdReader(path)
            recordings = reader.recordings()
            if recordings:
                reader.store(store=recordings[0])
    except (OSError, ValueError, RuntimeError) as error:
        wrong_sum = "CRC" in str(error)
        what = "is damaged: the checksum of its index is wrong" if wrong_sum else "is cut off: it ends without an index"
        raise RecordingIsDamaged(f"{path} {what} ({size} bytes).", remedy) from None
    if not recordings:
        raise RecordingIsDamaged(f"{path} is cut off: it ends before its first recording ({size} bytes).", remedy)
    if not _is_as_written(path):
        raise RecordingIsDamaged(f"{path} is damaged: its bytes are not those that were written ({size}).", remedy)
    return len(recordings)
