"""What a command inherits: closed streams, readers that have gone, terminals of few characters; Ctrl-C early."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.terminal import REPOSITORY, terminal

SCEANN = f"{sys.executable} -m sceann_hil.cli"
RUN = """
task: {type: goal_reach, max_steps: 20, headings_deg: [0]}
robot: {type: diffdrive, n_sensors: 2}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga, population: 4, generations: 3}
"""


def shell(line: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[bytes]:
    told = {**os.environ, "PYTHONPATH": str(REPOSITORY), **environment}
    return subprocess.run(["bash", "-o", "pipefail", "-c", line], cwd=cwd, capture_output=True, env=told)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("streams")
    (folder / "run.yaml").write_text(RUN)
    done = shell(f"{SCEANN} evolve run.yaml --out r --record none", folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize(
    "line",
    [
        "status r | head -n 1",
        "export-csv r | head -c 10",
        "schema | head -n 1",
        "--help | head -n 1",
        "evolve run.yaml --out $(mktemp -d)/r --record none --json | true",
        "status r >&-",
        "status r <&- >&- 2>&-",
        "evolve run.yaml --out $(mktemp -d)/r --record none <&- >&- 2>&-",
    ],
)
def test_output_that_nobody_reads_is_no_error(run: Path, line: str) -> None:
    done = shell(f"{SCEANN} {line}", run)
    assert done.returncode == 0, (done.stdout, done.stderr)
    assert b"Traceback" not in done.stderr
    assert b"BrokenPipe" not in done.stderr


def test_a_closed_output_is_not_given_to_the_journal(run: Path) -> None:
    done = shell(f"{SCEANN} evolve run.yaml --out closed --record none >&- 2>&- && {SCEANN} replay closed --all", run)
    assert done.returncode == 0, done.stderr


def test_a_full_disk_behind_the_output_is_told(run: Path) -> None:
    done = shell(f"{SCEANN} schema > /dev/full", run)
    assert done.returncode == 20, done.stderr
    assert b"The disk is full" in done.stderr
    assert b"Traceback" not in done.stderr


@pytest.mark.parametrize("encoding", ["latin-1", "ascii"])
@pytest.mark.parametrize("command", ["status r", "champion r", "plan run.yaml", "evolve --help"])
def test_a_terminal_of_few_characters_gets_those(run: Path, command: str, encoding: str) -> None:
    done = shell(f"{SCEANN} {command}", run, PYTHONIOENCODING=encoding, COLUMNS="100")
    assert b"Traceback" not in done.stderr
    assert b"UnicodeEncodeError" not in done.stderr
    done.stdout.decode(encoding)
    assert done.returncode in (0, 2), done.stderr


def test_characters_become_the_nearest_ones() -> None:
    code = (
        "from sceann_hil.commands.streams import prepare; prepare(); print('5 µm → 3 \u00d7 2 ≤ 7… ─│┼ ő 日 \\udcff')"
    )
    done = shell(f'{sys.executable} -c "{code}"', REPOSITORY, PYTHONIOENCODING="ascii")
    assert done.stdout == b"5 um -> 3 x 2 <= 7... -|+ o ? \xff\n", done.stderr


@pytest.mark.parametrize("patience_s", [0.4, 1.2])
def test_ctrl_c_while_a_run_starts_leaves_nothing_behind(run: Path, tmp_path: Path, patience_s: float) -> None:
    long = [
        "evolve",
        str(run / "run.yaml"),
        "--out",
        "new",
        "--record",
        "none",
        "--set",
        "algorithm.generations=100000",
    ]
    with terminal(long, tmp_path) as started:
        time.sleep(patience_s)
        started.interrupt()
        deadline = time.monotonic() + 60
        while started.wait_briefly() is None and time.monotonic() < deadline:
            # the first may have been taken as a wish for the end of the generation
            started.interrupt()
        code = started.wait()
        assert "Traceback" not in started.shown
        assert code in (130, 40, -signal.SIGINT), started.shown
        if "Getting" not in started.shown and "generation" not in started.shown:
            assert not (tmp_path / "new").exists(), started.shown


def test_ctrl_c_while_the_program_is_imported_ends_it_quietly() -> None:
    code = """
import os, signal, sys
import sceann_hil.start

class Impatient:
    def find_spec(self, name, path, target=None):
        if name == "sceann_hil.cli":
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Impatient())
sceann_hil.start.main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False, cwd=REPOSITORY)
    assert (done.returncode, done.stdout, done.stderr) == (130, b"", b"")
