"""Folders and files may be called anything: no name is taken for markup, and what is to be pasted can be pasted."""

from __future__ import annotations

import shlex
import subprocess
from pathlib import Path

import pytest

from tests.commands.test_cli import CONFIGS, sceann

NAMES = ["d[/e] it's [bold]"]


def _pasted(output: str, command: str) -> list[str]:
    (line,) = [line for line in output.splitlines() if line.startswith(f"  sceann {command} ")]
    return shlex.split(line)


@pytest.mark.parametrize("name", NAMES)
def test_a_run_of_any_name(name: str, tmp_path: Path) -> None:
    out = tmp_path / name
    config = tmp_path / f"{name.replace('/', '')}.yaml"
    config.write_text((CONFIGS / "quickstart.yaml").read_text())
    done = sceann("evolve", config, "--out", out, "--set", "algorithm.generations=0", "--record", "none")
    assert done.returncode == 0, done.stderr
    assert f"Run {out}: finished" in done.stdout
    assert _pasted(done.stdout, "status") == ["sceann", "status", str(out)]
    status = sceann("status", out)
    assert status.returncode == 0, status.stderr
    assert str(out) in status.stdout
    for command in (("plan", config), ("champion", out), ("replay", out, "1"), ("rehearse", config, "--seed", "3")):
        done = sceann(*command, *(["--set", "algorithm.generations=0"] if command[0] == "rehearse" else []))
        assert done.returncode == 0, done.stderr


def test_a_title_does_not_wrap_with_its_table(tmp_path: Path) -> None:
    out = tmp_path / ("a-run-with-a-very-long-name-" * 4).strip("-")
    done: subprocess.CompletedProcess[str] = sceann(
        "evolve",
        CONFIGS / "quickstart.yaml",
        "--out",
        out,
        "--set",
        "algorithm.generations=0",
        "--record",
        "none",
        COLUMNS="80",
    )
    assert f"Run {out}: finished" in done.stdout
