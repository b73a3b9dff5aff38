"""Places, names and amounts that cannot be, or look like something else: one message, or simply the right thing."""

from __future__ import annotations

import os
import subprocess
import sys
from datetime import UTC, datetime, tzinfo
from pathlib import Path

import pytest

from sceann_hil.commands.evolve import new_run
from sceann_hil.errors import CannotWrite, ExitCode
from sceann_hil.pasting import pasteable
from sceann_hil.places import make_folder
from sceann_hil.timespans import duration_text
from tests.commands.many_commands import Call, call_all
from tests.runs import POLE, config_of

QUICK = Path(__file__).parents[2] / "configs" / "quickstart.yaml"


def sceann(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "sceann_hil.cli", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        cwd=cwd,
    )


@pytest.mark.parametrize("place", ["/proc/nowhere/run", "/dev/null/run", "a" * 300, "loop/run", "null\0byte"])
def test_where_no_folder_can_be_made(place: str, tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(CannotWrite, match="no folder can be made there"):
        make_folder(tmp_path / place)


def test_names_that_look_like_markup_or_options_are_names(tmp_path: Path) -> None:
    small = ("--set", "algorithm.generations=1", "--record", "none")
    made = sceann("evolve", QUICK, "--out", "d[/e]", *small, cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    assert "sceann status 'd[/e]'" in made.stdout
    for command in ("status", "check", "champion", "export-csv"):
        told = sceann(command, "d[/e]", cwd=tmp_path)
        assert told.returncode == 0, told.stderr
    (tmp_path / "d[" / "e]" / "journal.sqlite").rename(tmp_path / "gone")
    assert "d[/e]" in sceann("status", "d[/e]", cwd=tmp_path).stderr
    assert pasteable("-x y") == "'./-x y'"


def test_a_budget_of_ages_is_a_budget(tmp_path: Path) -> None:
    small = ("--set", "algorithm.generations=0", "--record", "none", "--budget-robot", "99999999999999h")
    assert sceann("evolve", QUICK, "--out", "run", *small, cwd=tmp_path).returncode == 0
    assert duration_text(3.6e17) == "1.14e+10 years"
    assert duration_text(float("inf")) == "without end"


def test_a_folder_that_cannot_be_made_ends_a_command_with_its_code(tmp_path: Path) -> None:
    told = sceann("evolve", QUICK, "--out", "/proc/nowhere/run", cwd=tmp_path)
    assert told.returncode == ExitCode.CANNOT_WRITE
    assert "Traceback" not in told.stderr


def test_whoever_starts_in_the_same_second_gets_another_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Stopped(datetime):
        @classmethod
        def now(cls, _tz: tzinfo | None = None) -> Stopped:
            return cls(2026, 1, 2, 3, 4, 5, tzinfo=UTC)

    monkeypatch.setattr("sceann_hil.commands.evolve.datetime", Stopped)
    monkeypatch.chdir(tmp_path)
    names = []
    for _ in range(3):
        with new_run(config_of(POLE), None, "pole") as experiment:
            names.append(experiment.directory.name[len("pole-20260102-") :])
            with new_run(config_of(POLE), None, "pole") as beside:
                names.append(beside.directory.name[len("pole-20260102-") :])
    assert [name[6:] for name in names] == ["", "-2", "-3", "-4", "-5", "-6"]


def test_names_that_are_no_utf_8_are_names(tmp_path: Path) -> None:
    ours = tmp_path / os.fsdecode(b"caf\xe9")
    ours.mkdir()
    small = ["--set", "algorithm.generations=1", "--record", "none"]
    first, second, header = (str(ours / os.fsdecode(name)) for name in (b"r\xe9", b"s\xe9", b"h\xe9.h"))
    lines = [
        ["evolve", str(QUICK), "--out", first, *small],
        ["evolve", str(QUICK), "--from", first, "--out", second, *small],
        ["status", second],
        ["export", second, "-o", header],
        ["record", first],
        ["view", first, "--picture", str(ours / "p.png")],
    ]
    calls = [*(Call(words, str(ours)) for words in lines), Call(["record", "."], first)]
    ended = [(end.code, end.errors) for end in call_all(calls, os.environ, at_once=1)]
    refused = ExitCode.CANNOT_WRITE
    assert [code for code, _ in ended] == [0, 0, 0, 0, refused, refused, 0], ended
    assert all("not UTF-8" in errors for code, errors in ended if code == refused)
