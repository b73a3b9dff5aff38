"""What other programs have left in the environment ends no command and switches nothing off."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sceann_hil.commands.inherited import set_right

SCEANN = [sys.executable, "-m", "sceann_hil.cli"]


@pytest.mark.parametrize(
    "variable",
    [
        "NUMBA_NUM_THREADS=0",
        "NUMBA_NUM_THREADS=many",
        "TERMINAL_WIDTH=wide",
        "_SCEANN_COMPLETE=garbage",
        "_SCEANN_COMPLETE=complete_bash",
        "MPLBACKEND=nonsense",
        "RERUN=off",
        "RERUN_FLUSH_NUM_BYTES=some",
        "NODE_OPTIONS=--no-such-option",
        "GCC_EXEC_PREFIX=/nowhere",
    ],
)
def test_what_was_meant_for_others_or_makes_no_sense_is_taken_out(variable: str) -> None:
    name, value = variable.split("=")
    environment = {name: value, "HOME": "/home/somebody"}
    set_right(environment)
    assert environment == {"HOME": "/home/somebody"}


def test_what_makes_sense_stays() -> None:
    asked = {"NUMBA_NUM_THREADS": "2", "TERMINAL_WIDTH": "100", "_SCEANN_COMPLETE": "complete_bash", "COMP_WORDS": "a"}
    environment = dict(asked)
    set_right(environment)
    assert environment == asked


def test_children_get_a_folder_for_temporary_files_that_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setenv("TMPDIR", "/no/such/folder")
    set_right()
    assert Path(os.environ["TMPDIR"]).is_dir()


@pytest.mark.parametrize(
    ("variables", "command"),
    [
        ({"TERMINAL_WIDTH": "wide"}, ["evolve", "--help"]),
        ({"_SCEANN_COMPLETE": "complete_bash"}, ["--version"]),
        ({"NUMBA_NUM_THREADS": "0", "COLUMNS": "none", "TERM": "no-such-terminal", "TZ": "No/Where"}, ["list"]),
        ({"NUMBA_NUM_THREADS": "0"}, ["plan", "configs/quickstart.yaml"]),
    ],
)
def test_a_command_does_its_work_all_the_same(variables: dict[str, str], command: list[str]) -> None:
    done = subprocess.run(
        [*SCEANN, *command],
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[2],
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout
