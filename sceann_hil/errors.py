"""What can go wrong in a user's hands: one message, one hint, one exit code each, all listed here.

The command line prints `UserError.message` and `UserError.hint` and leaves with `UserError.exit_code`.
Everything else that escapes is a bug and keeps its traceback. ``docs/exit-codes.md`` is the same table for
people.
"""

from __future__ import annotations

import errno
import re
import sqlite3
from enum import IntEnum
from importlib import metadata
from pathlib import Path
from typing import ClassVar, Self

from sceann_hil.pasting import pasteable


class ExitCode(IntEnum):
    """What the `sceann` command returns to the shell. The numbers are public and never change."""

    meaning: str

    def __new__(cls, value: int, meaning: str) -> Self:
        member = int.__new__(cls, value)
        member._value_ = value
        member.meaning = meaning
        return member

    OK = 0, "Done."
    BUG = 1, "A fault in sceann itself; the traceback belongs in a bug report."
    USAGE = 2, "The command line could not be understood."
    CONFIG = 3, "The configuration is wrong; nothing was started."
    PLUGIN = 4, "A robot, task or algorithm package is missing, broken, or collides with another."
    PACKAGE_MISSING = 5, "A Python package that this command needs is not installed."
    NOT_A_RUN = 10, "The folder or file is not a run, or holds no such trial."
    RUN_EXISTS = 11, "There is something at this place already; it was not touched."
    RUN_IS_NEWER = 12, "The run was written by a newer version of sceann."
    RUN_IS_LOCKED = 13, "Another process is working on this run."
    RUN_IS_DAMAGED = 14, "The run's journal cannot be read."
    RECORDING_IS_DAMAGED = 15, "A recording is cut off or unreadable; it can be made again from the journal."
    REPLAY_DIFFERS = 16, "A replayed trial did not give the journalled bits."
    VIEWER_UNAVAILABLE = 17, "The viewer cannot run here: no display or no graphics driver."
    STUDY_CHANGED = 18, "The study in this folder was begun with another configuration; nothing was started."
    DISK_FULL = 20, "No space left; what was journalled so far is safe and can be resumed."
    CANNOT_WRITE = 21, "A place cannot be written to."
    CANNOT_READ = 22, "A file cannot be opened or read."
    OTHER_VERSIONS = 23, "A result would go on with other versions or another body than it began with."
    LINK = 30, "The robot cannot be reached; the run is paused and can be resumed."
    TRIAL_VOID = 31, "A trial failed too often without a result; the run is paused and can be resumed."
    ROBOT_FAULT = 32, "The robot reports a fault; somebody must look at it."
    EMERGENCY_STOP = 33, "Somebody pressed stop."
    WORKERS_LOST = 34, "The cluster or the worker processes of a study are gone; the study can be continued."
    INTERRUPTED = 40, "Stopped after the current generation, as asked (Ctrl-C); the run can be resumed."
    OPERATOR_FINISHED = 41, "The operator finished the run; it can be resumed."
    BUDGET_SPENT = 42, "A budget is spent; the run can be resumed with more (`--budget-robot 2h`)."
    PANEL = 43, "The operator's web panel cannot be opened; nothing was started."
    TOOL_MISSING = 50, "A compiler, upload tool or emulator is not installed, or there is no such board."
    FIRMWARE_BUILD = 51, "The firmware or a header could not be built for this controller or board."
    FLASH = 52, "The upload failed, or the board does not answer with the firmware that was sent."
    VERIFY_DIFFERS = 53, "The board did not compute what the reference computes."
    HUNG_UP = 129, "The terminal was closed (SIGHUP): the robot was stopped first; the run can be resumed."
    INTERRUPTED_NOW = 130, "Stopped at once, as asked (Ctrl-C twice); the run can be resumed."
    TERMINATED = 143, "The system asked for the end (SIGTERM): the robot was stopped first; the run can be resumed."


class UserError(Exception):
    """Something that a user can put right; the subclasses carry the exit code.

    Attributes:
        message: what is wrong: where, what was expected, what was found.
        hint: what to do next; may be empty.
    """

    exit_code: ClassVar[ExitCode] = ExitCode.BUG

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message, hint)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}\n{self.hint}" if self.hint else self.message


class ConfigError(UserError):
    """The configuration is wrong. Raised before anything moves."""

    exit_code = ExitCode.CONFIG


class PluginError(UserError):
    """A robot, task or algorithm cannot be found or loaded, or two packages claim one name."""

    exit_code = ExitCode.PLUGIN


class PackageMissing(UserError):
    """A command needs a Python package that this installation does without."""

    exit_code = ExitCode.PACKAGE_MISSING


class NotARun(UserError):
    """The place is not a run, or the run has no such trial."""

    exit_code = ExitCode.NOT_A_RUN


class RunExists(UserError):
    """A run would overwrite something."""

    exit_code = ExitCode.RUN_EXISTS


class RunIsNewer(UserError):
    """The journal's schema is newer than this version knows."""

    exit_code = ExitCode.RUN_IS_NEWER


class RunIsLocked(UserError):
    """Another process holds the run."""

    exit_code = ExitCode.RUN_IS_LOCKED


class RunIsDamaged(UserError):
    """The journal cannot be read."""

    exit_code = ExitCode.RUN_IS_DAMAGED


class RecordingIsDamaged(UserError):
    """A recording is truncated or unreadable."""

    exit_code = ExitCode.RECORDING_IS_DAMAGED


class ReplayDiffers(UserError):
    """A replay did not give the journalled bits."""

    exit_code = ExitCode.REPLAY_DIFFERS


class StudyChanged(UserError):
    """A study would go on with another configuration than it began with."""

    exit_code = ExitCode.STUDY_CHANGED


class WorkersLost(UserError):
    """Nobody is left who computes a study's runs."""

    exit_code = ExitCode.WORKERS_LOST


class ViewerUnavailable(UserError):
    """The viewer cannot run on this machine."""

    exit_code = ExitCode.VIEWER_UNAVAILABLE


class DiskFull(UserError):
    """No space left on the device, or the quota is used up."""

    exit_code = ExitCode.DISK_FULL


class CannotWrite(UserError):
    """A place cannot be written to."""

    exit_code = ExitCode.CANNOT_WRITE


class CannotRead(UserError):
    """A file cannot be opened."""

    exit_code = ExitCode.CANNOT_READ


class OtherVersions(UserError):
    """A run or study would go on with other versions than it began with, or with another body."""

    exit_code = ExitCode.OTHER_VERSIONS


class RobotUnreachable(UserError):
    """The robot cannot be reached (`LinkError`)."""

    exit_code = ExitCode.LINK


class TrialsKeepFailing(UserError):
    """A trial was void too often (`TrialVoid`)."""

    exit_code = ExitCode.TRIAL_VOID


class RobotIsFaulty(UserError):
    """The robot reports a fault (`RobotFault`)."""

    exit_code = ExitCode.ROBOT_FAULT


class RobotWasStopped(UserError):
    """Somebody pressed stop (`EmergencyStop`)."""

    exit_code = ExitCode.EMERGENCY_STOP


class ToolMissing(UserError):
    """A compiler, upload tool or emulator is not installed, or there is no such board."""

    exit_code = ExitCode.TOOL_MISSING


class FirmwareBuildFailed(UserError):
    """The firmware or an exported header cannot be made."""

    exit_code = ExitCode.FIRMWARE_BUILD


class FlashFailed(UserError):
    """An upload failed, or the board answers with something else than what was sent."""

    exit_code = ExitCode.FLASH


class VerifyDiffers(UserError):
    """A board did not compute what the reference computes."""

    exit_code = ExitCode.VERIFY_DIFFERS


class PanelUnavailable(UserError):
    """The web panel's port is in use, or its address is not this machine's."""

    exit_code = ExitCode.PANEL


class InterruptedNow(UserError):
    """Somebody pressed Ctrl-C twice."""

    exit_code = ExitCode.INTERRUPTED_NOW


class ToldAs(Exception):
    """An error inside the framework that a user is told as another one, with advice.

    Attributes:
        user_error: what it is to a user; None for a bug.
        advice: what to do about it.
    """

    user_error: ClassVar[type[UserError] | None] = None
    advice: ClassVar[str] = ""


_CANNOT_WRITE = (
    *(errno.EACCES, errno.EPERM, errno.EROFS),
    *(errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.ENAMETOOLONG),
)
_BUGS = (sqlite3.SQLITE_ERROR, sqlite3.SQLITE_MISUSE, sqlite3.SQLITE_CONSTRAINT)
"""What SQLite says about our own mistakes."""
_BACKUP = "Restore it from a backup, or read on in docs/journal.md (Damage)."
_FREE_SPACE = "Free some space, then `sceann resume` the run: what was journalled so far is safe."


def as_user_error(error: BaseException) -> UserError | None:
    """What a user should be told about an error of the operating system, the database or a robot.

    Returns:
        `error` itself if it is a `UserError` already; None if it is none of these, that is, a bug.
    """
    if isinstance(error, UserError):
        return error
    if isinstance(error, ToldAs) and error.user_error is not None:
        return error.user_error(str(error), error.advice)
    if isinstance(error, ModuleNotFoundError) and (requirement := requirement_of(error.name or "")):
        return PackageMissing(
            f"This needs the Python package {requirement.partition(';')[0]}, which is not installed here.",
            f"pip install '{requirement.partition(';')[0]}'",
        )
    if isinstance(error, KeyboardInterrupt):
        return InterruptedNow(ExitCode.INTERRUPTED_NOW.meaning, "`sceann resume` continues the run.")
    if isinstance(error, sqlite3.Error) and _primary_code(error) not in _BUGS:
        return database_error(error)
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return DiskFull(f"The disk is full: {_where(error)} could not be written.", _FREE_SPACE)
    if isinstance(error, OSError) and error.errno in _CANNOT_WRITE:
        return CannotWrite(f"{_where(error)}: {error.strerror}.", "Choose another place, or change its permissions.")
    if isinstance(error, OSError) and error.filename is None and "temporary directory" in str(error):
        # in the words of Python's `tempfile`, or of matplotlib
        return CannotWrite(
            "No temporary folder can be made: nothing can be written on this computer.",
            "Let the environment variable TMPDIR name a folder that can be written to.",
        )
    if isinstance(error, FileNotFoundError) and error.filename is not None:
        # a file that is missing in a folder that is there is a bug; whoever wants to write elsewhere may have mistyped
        folder = Path(_where(error)).parent
        if not folder.is_dir():
            return CannotWrite(f"{_where(error)}: there is no folder {folder}.", "Make it, or choose another place.")
    return None


_DISTRIBUTIONS = {
    "can": "python-can",
    "markdown_it": "markdown-it-py",
    "rerun": "rerun-sdk",
    "serial": "pyserial",
    "yaml": "pyyaml",
}
"""Of modules whose name is not that of the package that has to be installed."""


def requirement_of(module: str) -> str:
    """What to install for a module, such as ``scipy>=1.14``; empty if it is none that this package asks for."""
    top = module.partition(".")[0]
    name = _DISTRIBUTIONS.get(top, top.replace("_", "-"))
    for requirement in metadata.requires("sceann-hil") or []:
        if re.match(rf"{re.escape(name)}\b(?!-)", requirement):
            return requirement
    return ""


def database_error(error: sqlite3.Error, path: Path | None = None, what: str = "journal") -> UserError:
    """What a user should be told about an error of SQLite."""
    primary = _primary_code(error)
    place = path or "a database"
    if primary == sqlite3.SQLITE_FULL:
        return DiskFull(
            f"The disk is full: {place} cannot grow.", "Free some space there; what was recorded so far is safe."
        )
    if primary == sqlite3.SQLITE_IOERR:
        return DiskFull(
            f"The disk or network that holds {place} fails: {error} ({getattr(error, 'sqlite_errorname', '')}).",
            "Is there room and quota, is the network file system there? What was recorded so far is safe.",
        )
    if primary in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_PERM, sqlite3.SQLITE_AUTH):
        return CannotWrite(f"{place} cannot be written to: {error}.", "Change its permissions, or work on a copy.")
    if primary == sqlite3.SQLITE_CANTOPEN:
        return CannotRead(f"{place} cannot be opened: {error}.", "Are the folder and the file there, and readable?")
    if primary == sqlite3.SQLITE_NOTADB:
        return RunIsDamaged(f"{place} cannot be read: {error}.", _BACKUP)
    return RunIsDamaged(f"{place} is damaged: {error}.", way_out_of_damage(path, what))


def _primary_code(error: sqlite3.Error) -> int:
    return getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF


def way_out_of_damage(path: Path | None, what: str = "journal") -> str:
    """What to do about a damaged database."""
    if what != "journal" or path is None:
        return _BACKUP
    return (
        f"`sceann check {pasteable(path.parent)}` names the last generation that is sound; "
        f"`sceann resume {pasteable(path.parent)} --from-generation N` goes on from it and keeps the damaged file."
    )


def _where(error: OSError) -> str:
    """The place that was to be written; of a link or a move, the second one."""
    place = error.filename2 if error.filename2 is not None else error.filename
    return str(place) if place is not None else "a file"
