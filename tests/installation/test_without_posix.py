"""Nothing of POSIX stands in the way of simulated robots and robots of one's own (see `tests.as_on_windows`)."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from backends.virtual.power import switch_on
from sceann_hil.config import dump_config
from sceann_hil.errors import ExitCode
from sceann_hil.firmware.build import Board
from tests.runs import POLE, config_of, contents, evolve

ROOT = Path(__file__).parents[2]
HIDDEN = [sys.executable, "-m", "tests.as_on_windows"]
TOLD = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}


def sceann(folder: Path, line: str) -> subprocess.CompletedProcess[str]:
    """A command in a folder, without POSIX."""
    return subprocess.run(
        [*HIDDEN, *line.split()],
        cwd=folder,
        env=TOLD,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )


def test_every_module_can_be_imported_but_the_one_of_posix_terminals() -> None:
    imported = subprocess.run(
        [*HIDDEN, "--import-all", "terminal_keys"], cwd=ROOT, env=TOLD, capture_output=True, text=True, check=False
    )
    assert imported.returncode == 0, imported.stderr


def test_the_blocking_blocks() -> None:
    for code in ("import fcntl", "import os; os.pwrite", "import signal; signal.SIGKILL", "from os import fork"):
        hidden = f"import tests.as_on_windows as w; w.hide_posix(); exec({code!r}, {{'__name__': 'sceann_hil.x'}})"
        refused = subprocess.run([sys.executable, "-c", hidden], cwd=ROOT, env=TOLD, capture_output=True, check=False)
        assert refused.returncode == 1, code


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was evolved and recorded without POSIX."""
    folder = tmp_path_factory.mktemp("windows")
    (folder / "pole.yaml").write_text(POLE)
    evolved = sceann(folder, "evolve pole.yaml --out run --record best")
    assert evolved.returncode == 0, evolved.stderr
    # recording goes on behind a run that has ended
    waited = sceann(folder, "record run")
    assert waited.returncode == 0, waited.stderr
    return folder / "run"


def test_evolution_gives_the_same_run(run: Path, tmp_path: Path) -> None:
    evolve(tmp_path / "run", POLE)
    assert contents(run) == contents(tmp_path / "run")
    assert list(run.rglob("*.rrd"))


WORKING = """
status run --json
champion run
replay run --all
check run
copy run --out copied
export run -o walker.h
export-csv run --out tables
runs . --page runs.html
plan pole.yaml
rehearse pole.yaml
list
schema
"""


def test_commands_work(run: Path) -> None:
    lines = WORKING.strip().splitlines()
    done = subprocess.run(
        [*HIDDEN, "--each", *lines],
        cwd=run.parent,
        env=TOLD,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode()
    assert done.stderr.count(b"\nended well: ") == len(lines)


KEYS = """
import sys
import tests.as_on_windows as windows
typed = iter("r\\r\\xe0H\\x00\\x42\\x00\\x43\\x00\\x02\\x1a")
windows.MSVCRT.kbhit, windows.MSVCRT.getwch = lambda: True, lambda: next(typed)
windows.hide_posix()
from sceann_hil.supervision.operators.windows_keys import WindowsKeys
keys = WindowsKeys()
hits = [keys.read(1.0) for _ in range(6)]
assert [hit and hit.key for hit in hits] == ["r", "Enter", "ArrowUp", "F8", "F9", None], hits
try:
    keys.read(1.0)
except EOFError:
    sys.exit(0)
sys.exit(1)
"""


def test_keys_of_a_console_of_windows_and_its_end_of_input() -> None:
    typed = subprocess.run([sys.executable, "-c", KEYS], cwd=ROOT, env=TOLD, capture_output=True, check=False)
    assert typed.returncode == 0, typed.stderr.decode()


@pytest.mark.parametrize("line", ["virtual posix pole.yaml", "rehearse pole.yaml --firmware"])
def test_what_needs_posix_says_so(line: str, run: Path) -> None:
    refused = sceann(run.parent, line)
    assert refused.returncode in (ExitCode.TOOL_MISSING, ExitCode.CONFIG), refused.stderr
    assert "Traceback" not in refused.stderr


@pytest.mark.realtime
def test_a_person_beside_a_robot_is_heard_and_a_second_writer_is_kept_away(tmp_path: Path) -> None:
    """On a robot, with lines at the console and the page in a browser; the lock is Windows' own kind."""
    config = config_of(POLE, "algorithm.population=2", "algorithm.generations=0", "task.max_steps=20")
    with switch_on(Board.POSIX, config.robot) as virtual:
        section = json.dumps({**virtual.section("onboard"), "attended": True})
        robot = config_of(dump_config(config), f"robot={section}", "operator.confirm=true", "operator.port=0")
        (tmp_path / "robot.yaml").write_text(dump_config(robot))
        process = subprocess.Popen(
            [*HIDDEN, *["evolve", "robot.yaml", "--out", "run", "--operator", "console,web", "--record", "none"]],
            cwd=tmp_path,
            env=TOLD,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert process.stdin is not None
        assert process.stdout is not None
        shown = ""
        while not (link := re.search(r"http://\S+", shown)):
            shown += process.stdout.readline() or pytest.fail(shown)
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        with browser.open(link[0], timeout=20) as page:
            assert b"STOP" in page.read()
        assert sceann(tmp_path, "resume run").returncode == ExitCode.RUN_IS_LOCKED
        assert json.loads(sceann(tmp_path, "status run --json").stdout)["state"] == "running"
        while process.poll() is None:
            # what was typed before a question was shown is dropped, so a person says it again
            process.stdin.write("ready\naccept\n")
            process.stdin.flush()
            time.sleep(0.2)
        assert process.returncode == 0, shown + process.stdout.read()
    assert json.loads(sceann(tmp_path, "status run --json").stdout)["trials"] == 2
