"""Folders that a user names: made, or refused with the reason."""

from __future__ import annotations

from pathlib import Path

from sceann_hil.errors import CannotWrite, DiskFull, as_user_error


def make_folder(path: Path) -> Path:
    """Make a folder and those above it, if they are missing.

    Raises:
        CannotWrite: none can be made there, whatever the reason.
        DiskFull: there is no room.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        told = as_user_error(error)
        if isinstance(told, DiskFull):
            raise told from error
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise CannotWrite(f"{path}: no folder can be made there: {reason}.", "Choose another place.") from error
    return path


def lacking(folder: Path, lack: str) -> str:
    """What is wrong with a place where a folder with something in it was expected, as the end of a sentence.

    Args:
        folder: the place.
        lack: what to say of a folder.
    """
    if folder.is_dir():
        return lack
    return "is a file, not a folder" if folder.exists() else "does not exist"
