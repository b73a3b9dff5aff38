"""One exit code per kind of trouble, documented, and found for every error that a user can put right."""

from __future__ import annotations

import errno
import os
import pickle
import re
import sqlite3
from pathlib import Path

import pytest

from sceann_hil import errors
from sceann_hil.errors import ExitCode, UserError, as_user_error
from sceann_hil.robot import EmergencyStop, LinkError, RobotFault, TrialVoid

DOCS = Path(__file__).parent.parent / "docs"
USER_ERRORS = [
    kind
    for kind in vars(errors).values()
    if isinstance(kind, type) and issubclass(kind, UserError) and kind is not UserError
]


def test_the_documented_table_is_the_enum() -> None:
    rows = re.findall(r"^\| (\d+) \| (\w+) \| (.+) \|$", (DOCS / "exit-codes.md").read_text(), re.MULTILINE)
    assert rows == [(str(code.value), code.name, code.meaning) for code in ExitCode]


def test_every_user_error_has_a_code_of_its_own() -> None:
    codes = [kind.exit_code for kind in USER_ERRORS]
    assert len(set(codes)) == len(codes)
    assert set(ExitCode) - set(codes) == {
        ExitCode.OK,
        ExitCode.BUG,
        ExitCode.USAGE,
        ExitCode.INTERRUPTED,
        ExitCode.OPERATOR_FINISHED,
        ExitCode.BUDGET_SPENT,
        ExitCode.HUNG_UP,
        ExitCode.TERMINATED,
    }


def test_no_code_is_one_that_shells_use_for_something_else() -> None:
    # 128 + n is what a shell says of a program that signal n ended, and so do these
    by_a_signal = {ExitCode.HUNG_UP, ExitCode.INTERRUPTED_NOW, ExitCode.TERMINATED}
    assert all(code < 64 or code in by_a_signal for code in ExitCode)


@pytest.mark.parametrize("kind", USER_ERRORS)
def test_a_user_error_survives_the_way_between_processes(kind: type[UserError]) -> None:
    error = pickle.loads(pickle.dumps(kind("what is wrong", "what to do")))
    assert (type(error), error.message, error.hint) == (kind, "what is wrong", "what to do")
    assert str(error) == "what is wrong\nwhat to do"


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (LinkError("no answer"), ExitCode.LINK),
        (TrialVoid("3 attempts"), ExitCode.TRIAL_VOID),
        (RobotFault("motor driver"), ExitCode.ROBOT_FAULT),
        (EmergencyStop("button"), ExitCode.EMERGENCY_STOP),
        (KeyboardInterrupt(), ExitCode.INTERRUPTED_NOW),
        (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "run/x.rrd"), ExitCode.DISK_FULL),
        (OSError(errno.EDQUOT, os.strerror(errno.EDQUOT)), ExitCode.DISK_FULL),
        (PermissionError(errno.EACCES, os.strerror(errno.EACCES), "run"), ExitCode.CANNOT_WRITE),
        (OSError(errno.EROFS, os.strerror(errno.EROFS), "run"), ExitCode.CANNOT_WRITE),
        (FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), "run"), ExitCode.CANNOT_WRITE),
        (FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), "no_folder/x.h"), ExitCode.CANNOT_WRITE),
        (FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/tmp']"), ExitCode.CANNOT_WRITE),
    ],
)
def test_errors_of_others_become_user_errors(error: BaseException, code: ExitCode) -> None:
    told = as_user_error(error)
    assert told is not None
    assert told.exit_code is code
    assert told.hint
    assert getattr(error, "filename", None) is None or error.filename in told.message  # type: ignore[attr-defined]


def test_a_full_database_is_a_full_disk(tmp_path: Path) -> None:
    database = sqlite3.connect(tmp_path / "journal.sqlite")
    database.execute("PRAGMA max_page_count = 2")
    with pytest.raises(sqlite3.OperationalError) as caught:
        database.executescript("CREATE TABLE a (b); CREATE TABLE c (d); CREATE TABLE e (f);")
    told = as_user_error(caught.value)
    assert told is not None
    assert told.exit_code is ExitCode.DISK_FULL


def test_a_user_error_is_told_as_it_is_and_a_bug_is_not_told() -> None:
    error = errors.ConfigError("wrong")
    assert as_user_error(error) is error
    for bug in (
        ValueError("x"),
        AssertionError(),
        OSError(errno.EBADF, "bad"),
        FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), "missing_in_a_folder_that_is_there"),
        sqlite3.OperationalError("syntax"),
    ):
        assert as_user_error(bug) is None
