"""Pages of docs as people follow them: the commands of their blocks, one after the other."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[1]
_BLOCK = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_END = "\x1e"
_RUNNER = f"""
import json, os, sys
from sceann_hil.cli import main
for words in json.loads(sys.argv[1]):
    sys.argv = words
    code = 0
    try:
        main()
    except SystemExit as end:
        code = end.code or 0
    sys.stdout.flush()
    sys.stderr.flush()
    os.write(1, f"{{code}}{_END}".encode())
"""
"""All commands in one process: most of a short command's time goes into starting it."""


def commands_of(page: str) -> list[str]:
    """All commands of a page of docs, in its order, without their comments."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    lines = [shlex.split(line, comments=True) for block in _BLOCK.findall(text) for line in block.splitlines()]
    return [shlex.join(words) for words in lines if words]


def only_late(command: str, printed: str) -> bool:
    """A doctor whom nothing displeased but what a computer does to a virtual robot when it has no time for it."""
    bad = re.findall(r"^ +bad +(.+)$", printed, re.MULTILINE)
    return command.startswith("sceann doctor") and set(bad) <= {"frame loss", "watchdog self-test"}


def follow(
    page: str,
    folder: Path,
    shorter: Callable[[list[str]], list[str]] = lambda words: words,
    excused: Callable[[str, str], bool] = lambda *_: False,
) -> str:
    """Run every command of a page that is one of `sceann`; each must work.

    Args:
        page: below docs.
        folder: where.
        shorter: the words of a command as the test runs them: ports replaced, budgets added; none to leave it out.
        excused: whether a command that failed did so because this computer is too busy for an emulator.

    Returns:
        What they printed.
    """
    commands = [one for one in commands_of(page) if one.startswith("sceann ") and shorter(shlex.split(one))]
    done = subprocess.run(
        [sys.executable, "-c", _RUNNER, json.dumps([shorter(shlex.split(command)) for command in commands])],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "160"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        timeout=280,
    )
    *parts, rest = done.stdout.split(_END)
    for command, part in zip(commands, parts, strict=False):
        printed, code = re.fullmatch(r"(.*?)(\d+)", part, re.DOTALL).groups()  # type: ignore[union-attr]
        assert code == "0" or excused(command, printed), f"{page}: {command}: exit code {code}\n{printed}"
    assert (len(parts), rest.strip()) == (len(commands), ""), rest
    return done.stdout
