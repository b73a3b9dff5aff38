"""Files that can always be made again: where they are kept, and how damage to one is noticed.

A file is worth what its digest says: an empty, cut off or altered one (a power loss, a full disk) is thrown away by
`read` and made again by whoever needs it. Where nothing can be kept, a temporary folder takes the cache's place.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import os
import shutil
import sys
import tempfile
from functools import cache
from pathlib import Path

import platformdirs

VARIABLE = "SCEANN_CACHE_DIR"
"""Environment variable that names another folder for the cache; processes that are started from here share ours."""
_DIGEST_BYTES = 32


def folder(name: str) -> Path:
    """A folder of the cache that can be written to.

    Args:
        name: what is kept there, such as ``code``.
    """
    return _folder(_root(os.environ.get(VARIABLE)), name)


def read(path: Path) -> bytes | None:
    """What `write` wrote; None if there is no such file, or none that is whole (it is removed)."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    content = data[_DIGEST_BYTES:]
    if data[:_DIGEST_BYTES] == hashlib.sha256(content).digest():
        return content
    remove(path)
    return None


def write(path: Path, content: bytes) -> None:
    """Keep something for `read`, whole or not at all. A disk that takes nothing costs time later, not the work now."""
    try:
        descriptor, fresh = tempfile.mkstemp(dir=path.parent, prefix=path.name)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(hashlib.sha256(content).digest() + content)
                file.flush()
                os.fsync(file.fileno())
            Path(fresh).replace(path)
        except BaseException:
            remove(Path(fresh))
            raise
    except OSError as error:
        _warn(f"{path.parent}: {error.strerror or error}. What is computed here once is computed again next time.")


def seal(path: Path) -> None:
    """Note the digest of a file that others read by its path, such as a program, beside it."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
        digest = hashlib.file_digest(file, "sha256").digest()
    write(_seal(path), digest)


def is_sealed(path: Path) -> bool:
    """Whether a file is as it was when it was sealed; if not, it is removed."""
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").digest()
    except OSError:
        return False
    if read(_seal(path)) == digest:
        return True
    remove(path)
    return False


def _seal(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")


def remove(path: Path) -> None:
    """Throw a file away, if it is there and that is possible."""
    with contextlib.suppress(OSError):
        path.unlink()


@cache
def _root(asked: str | None) -> Path:
    try:
        root = Path(asked) if asked else platformdirs.user_cache_path("sceann-hil")
    except (KeyError, RuntimeError):
        # a user without an entry in the system's list
        return _temporary("this user has no home")
    if not root.is_absolute():
        return _temporary(f"{root} is not an absolute path" if asked else "this user has no home")
    try:
        root.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=root).close()
    except OSError as error:
        return _temporary(f"{root}: {error.strerror or error}")
    return root


@cache
def _folder(root: Path, name: str) -> Path:
    path = root / name
    try:
        path.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=path).close()
    except OSError as error:
        return _folder(_temporary(f"{path}: {error.strerror or error}"), name)
    return path


def _temporary(why: str) -> Path:
    root = Path(tempfile.mkdtemp(prefix="sceann-"))
    atexit.register(shutil.rmtree, root, ignore_errors=True)
    os.environ[VARIABLE] = str(root)
    _warn(f"no cache can be kept ({why}), so every start takes seconds longer. {VARIABLE} names another folder.")
    return root


@cache
def _warn(text: str) -> None:
    """Said once in every process."""
    if sys.stderr is not None:
        print(f"sceann: {text}", file=sys.stderr)
