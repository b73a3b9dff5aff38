"""The `sceann` command as a user meets it: answers, refusals and exit codes."""

from __future__ import annotations

import json
import os
import pty
import signal
import socket
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from sceann_hil.errors import ExitCode
from sceann_hil.run.experiment import Experiment
from sceann_hil.versions import VERSIONS_NAME
from tests.runs import GOAL, config_of, contents, evolve

CONFIGS = Path(__file__).parents[2] / "configs"
SCEANN = Path(sys.executable).parent / "sceann"


def sceann(*arguments: str | Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the installed command."""
    return subprocess.run(
        [SCEANN, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        env={**os.environ, "COLUMNS": "200", **environment},
    )


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("runs") / "goal"
    evolve(directory, GOAL)
    return directory


def test_quick_start_solves_its_task_and_every_trial_replays(tmp_path: Path) -> None:
    out = tmp_path / "first"
    done = sceann("evolve", CONFIGS / "quickstart.yaml", "--out", out, "--record", "none", "--json")
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["outcome"] == "finished"
    assert summary["champion"]["fitness"] == 3000.0
    replayed = sceann("replay", out, "--all", "--json")
    assert json.loads(replayed.stdout)["different"] == []
    assert replayed.returncode == 0


def test_status_tells_people_and_programs(run: Path) -> None:
    status = json.loads(sceann("status", run, "--json").stdout)
    assert (status["state"], status["generations_finished"], status["trials"]) == ("finished", 4, 72)
    assert status["champion"]["genome"] in sceann("status", run).stdout


def test_replay_shows_both_sides(run: Path) -> None:
    shown = sceann("replay", run, "5")
    assert shown.returncode == 0
    assert shown.stdout.count("same") >= 5


def test_a_falsified_journal_is_found_out(tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL)
    db = sqlite3.connect(tmp_path / "run" / "journal.sqlite")
    db.execute("UPDATE attempt SET steps = steps + 1 WHERE id = 5")
    db.commit()
    db.close()
    answer = sceann("replay", tmp_path / "run", "--all")
    assert answer.returncode == ExitCode.REPLAY_DIFFERS
    assert "1 of 72 replayed trials differ from the journal: 5." in answer.stderr


def test_tables_are_written_once(run: Path, tmp_path: Path) -> None:
    done = sceann("export-csv", run, "--out", tmp_path / "tables")
    assert done.returncode == 0
    assert len((tmp_path / "tables" / "trials.csv").read_text().splitlines()) == 73
    versions = json.loads((tmp_path / "tables" / VERSIONS_NAME).read_text())
    assert versions["computed_with"] == [versions["written_by"]]
    assert sceann("export-csv", run, "--out", tmp_path / "tables").returncode == ExitCode.RUN_EXISTS


def test_plan_counts_without_running(tmp_path: Path) -> None:
    plan = json.loads(sceann("plan", CONFIGS / "goal_reach.yaml", "--json").stdout)
    assert (plan["trials"], plan["longest_robot_s"], plan["genome_length"]) == (10_200, 10_200 * 40.0, 44)


def test_list_shows_what_is_installed() -> None:
    listed = json.loads(sceann("list", "--json").stdout)
    assert {"cartpole", "diffdrive"} <= set(listed["robots"])
    assert {"goal_reach", "pole_balancing"} <= set(listed["tasks"])
    assert {"sga", "oga"} <= set(listed["algorithms"])


@pytest.mark.parametrize(
    "command", ["evolve", "resume", "status", "replay", "plan", "list", "schema", "export-csv", "view", "record"]
)
def test_every_command_has_help_with_an_example(command: str) -> None:
    shown = sceann(command, "--help")
    assert shown.returncode == 0
    assert f"Example: sceann {command}" in shown.stdout


BAD = [
    pytest.param(["evolve", "nowhere.yaml"], ExitCode.CONFIG, "no such file", id="missing config"),
    pytest.param(["evolve", "empty.yaml"], ExitCode.CONFIG, "empty", id="empty config"),
    pytest.param(["evolve", "binary.yaml"], ExitCode.CONFIG, "text", id="binary config"),
    pytest.param(["evolve", "huge.yaml"], ExitCode.CONFIG, "large", id="huge config"),
    pytest.param(["evolve", "."], ExitCode.CONFIG, "directory", id="a folder as config"),
    pytest.param(["evolve", "big.yaml"], ExitCode.CONFIG, "at most 23 sources", id="24 sources"),
    pytest.param(["evolve", "good.yaml", "--out", "taken"], ExitCode.RUN_EXISTS, "nothing was overwritten", id="taken"),
    pytest.param(["status", "nowhere"], ExitCode.NOT_A_RUN, "does not exist", id="missing run"),
    pytest.param(["status", __file__], ExitCode.NOT_A_RUN, "is a file, not a folder", id="a file"),
    pytest.param(["champion", __file__], ExitCode.NOT_A_RUN, "is a file, not a folder", id="a file of no study"),
    pytest.param(["resume", "taken"], ExitCode.NOT_A_RUN, "has no journal", id="not a run"),
    pytest.param(["status", "damaged"], ExitCode.RUN_IS_DAMAGED, "cannot be read", id="damaged run"),
    pytest.param(["resume", "newer"], ExitCode.RUN_IS_NEWER, "newer version", id="newer run"),
    pytest.param(["replay", "good", "999"], ExitCode.NOT_A_RUN, "no trial 999", id="missing trial"),
    pytest.param(["replay", "good"], ExitCode.USAGE, "name one TRIAL", id="no trial named"),
    pytest.param(["evolve", "good.yaml", "--set", "algorithm.popul=3"], ExitCode.CONFIG, "did you mean", id="typo"),
    pytest.param(["evlve"], ExitCode.USAGE, "evolve", id="unknown command"),
]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bad")
    (folder / "good.yaml").write_text(GOAL)
    (folder / "empty.yaml").write_text("")
    (folder / "binary.yaml").write_bytes(os.urandom(5000) + b"\x00")
    (folder / "huge.yaml").write_text("# much\n" * 1_000_000)
    (folder / "big.yaml").write_text(
        GOAL.replace("n_sensors: 3", "n_sensors: 20").replace("n_hidden: 1", "n_hidden: 2")
    )
    (folder / "taken").mkdir()
    (folder / "taken" / "thesis.txt").write_text("mine")
    (folder / "damaged").mkdir()
    (folder / "damaged" / "journal.sqlite").write_bytes(os.urandom(9000))
    evolve(folder / "good", GOAL)
    evolve(folder / "newer", GOAL)
    db = sqlite3.connect(folder / "newer" / "journal.sqlite")
    db.execute("PRAGMA user_version = 2000")
    db.close()
    return folder


@pytest.mark.parametrize(("arguments", "code", "message"), BAD)
def test_bad_input_gets_one_message_and_its_own_exit_code(
    arguments: list[str], code: ExitCode, message: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(place)
    answer = sceann(*arguments)
    assert answer.returncode == code, answer.stderr
    assert message in answer.stderr
    assert "Traceback" not in answer.stderr
    assert len(answer.stderr.splitlines()) <= 25
    assert (place / "taken" / "thesis.txt").read_text() == "mine"


@pytest.mark.parametrize(
    ("overrides", "code"),
    [
        (
            ["robot={type: remote, port: nowhere, mode: hil, reconnect_s: 0.1, body: {type: cartpole}}"],
            ExitCode.LINK,
        ),
        (["operator.who=[web]", "operator.port=PORT"], ExitCode.PANEL),
    ],
    ids=["no robot", "port in use"],
)
def test_a_run_that_cannot_begin_leaves_no_folder_behind(overrides: list[str], code: ExitCode, tmp_path: Path) -> None:
    """Regression: once the cable was plugged in, the same command was refused because its folder existed."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        settings = [text.replace("PORT", str(taken.getsockname()[1])) for text in overrides]
        options = [part for text in settings for part in ("--set", text)]
        for _ in range(2):
            ended = sceann("evolve", CONFIGS / "quickstart.yaml", "--out", tmp_path / "run", *options)
            assert ended.returncode == code, ended.stderr
            assert "Nothing was begun; no run was kept." in ended.stderr
            assert not (tmp_path / "run").exists()


def test_a_locked_run_is_told_apart(tmp_path: Path) -> None:
    with Experiment.create(config_of(GOAL), tmp_path / "run"):
        answer = sceann("resume", tmp_path / "run")
        assert json.loads(sceann("status", tmp_path / "run", "--json").stdout)["state"] == "running"
    assert answer.returncode == ExitCode.RUN_IS_LOCKED
    assert f"process {os.getpid()}" in answer.stderr


def test_a_place_that_cannot_be_written_to(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    answer = sceann("evolve", CONFIGS / "quickstart.yaml", "--out", tmp_path / "file" / "run")
    assert answer.returncode == ExitCode.CANNOT_WRITE
    assert "Traceback" not in answer.stderr


def interrupted(presses: int, *arguments: str | Path) -> tuple[int, str]:
    """Run the command on a terminal and press Ctrl-C once it shows progress: exit code and what was seen."""
    screen, terminal = pty.openpty()
    process = subprocess.Popen(
        [SCEANN, *map(str, arguments)], stdin=terminal, stdout=terminal, stderr=terminal, start_new_session=True
    )
    os.close(terminal)
    seen, pressed = b"", 0
    try:
        while chunk := os.read(screen, 4096):
            seen += chunk
            if pressed < presses and (b"best" in seen if pressed == 0 else b"after this generation" in seen):
                process.send_signal(signal.SIGINT)
                pressed += 1
    except OSError:
        pass
    os.close(screen)
    return process.wait(60), seen.decode(errors="replace")


def test_ctrl_c_stops_after_the_generation_and_the_run_goes_on_where_it_was(tmp_path: Path) -> None:
    config = tmp_path / "long.yaml"
    config.write_text(GOAL.replace("generations: 3", "generations: 400"))
    code, seen = interrupted(1, "evolve", config, "--out", tmp_path / "run", "--record", "none")
    assert code == ExitCode.INTERRUPTED, seen
    status = json.loads(sceann("status", tmp_path / "run", "--json").stdout)
    assert status["state"] == "stopped"
    assert 0 < status["generations_finished"] < 401
    done = sceann("resume", tmp_path / "run", "--record", "none", "--json")
    assert json.loads(done.stdout)["outcome"] == "finished"
    evolve(tmp_path / "whole", GOAL, "algorithm.generations=400")
    assert contents(tmp_path / "run")["attempt"] == contents(tmp_path / "whole")["attempt"]


def test_ctrl_c_twice_stops_now_and_the_run_goes_on_where_it_was(tmp_path: Path) -> None:
    size = ("algorithm.population=3000", "algorithm.generations=12")
    config = tmp_path / "wide.yaml"
    config.write_text(GOAL)
    arguments = ["evolve", config, "--out", tmp_path / "run", "--set", size[0], "--set", size[1], "--record", "none"]
    code, seen = interrupted(2, *arguments)
    for _ in range(4):
        if code != ExitCode.INTERRUPTED:
            break
        # the generation ended between the two presses
        code, seen = interrupted(2, "resume", tmp_path / "run", "--record", "none")
    assert code == ExitCode.INTERRUPTED_NOW, seen
    done = sceann("resume", tmp_path / "run", "--record", "none", "--json")
    assert json.loads(done.stdout)["outcome"] == "finished"
    evolve(tmp_path / "whole", GOAL, *size)
    assert contents(tmp_path / "run")["attempt"] == contents(tmp_path / "whole")["attempt"]
