"""The commands around studies, as a user types them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from sceann_hil.errors import ExitCode
from sceann_hil.versions import VERSIONS_NAME

SMALL = """\
name: small
runs: 6
base:
  task: {type: pole_balancing, max_steps: 50}
  robot: {type: cartpole}
  controller: {coding: sceann3, n_hidden: 1}
  algorithm: {type: sga, population: 6, generations: 3}
grid:
  robot.n_sensors: [2, 4]
"""


def sceann(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "sceann_hil.cli", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False, timeout=120)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("commands")
    (path / "small.yaml").write_text(SMALL, encoding="utf-8")
    done = sceann("study", "small.yaml", "--workers", 1, cwd=path)
    assert done.returncode == 0, done.stderr
    return path


def test_progress_is_told_per_condition_with_an_eta(folder: Path) -> None:
    told = sceann("study", "small.yaml", "--workers", 1, "--out", "again", cwd=folder).stderr
    assert "2 conditions, 0 of them done; 12 runs to do" in told
    assert "[1/2] n_sensors=2: best " in told
    assert "; ETA " in told


def test_a_finished_study_is_not_computed_again(folder: Path) -> None:
    assert "2 conditions, 2 of them done; 0 runs to do" in sceann("study", "small.yaml", cwd=folder).stderr


def test_a_changed_study_is_refused_with_its_own_exit_code(folder: Path) -> None:
    changed = sceann("study", "small.yaml", "--set", "base.task.max_steps=60", cwd=folder)
    assert changed.returncode == ExitCode.STUDY_CHANGED
    assert "base.task.max_steps: 50 -> 60" in changed.stderr
    assert "Traceback" not in changed.stderr


def test_a_contradictory_axis_is_refused_before_anything_runs(folder: Path) -> None:
    (folder / "bad.yaml").write_text(SMALL.replace("[2, 4]", "[2, 3]"), encoding="utf-8")
    refused = sceann("study", "bad.yaml", "--out", "never", cwd=folder)
    assert refused.returncode == ExitCode.CONFIG
    assert "on the axis robot.n_sensors" in refused.stderr
    assert not (folder / "never").exists()


def test_a_folder_of_studies_is_run_as_a_whole(folder: Path) -> None:
    many = folder / "many"
    many.mkdir()
    for name in ("one", "two"):
        (many / f"{name}.yaml").write_text(SMALL.replace("small", name).replace("runs: 6", "runs: 1"), encoding="utf-8")
    assert sceann("study", "many", "--workers", 1, "--out", "both", cwd=folder).returncode == 0
    assert sorted(path.parent.name for path in (folder / "both").glob("*/study.sqlite")) == ["one", "two"]


def test_cluster_and_workers_exclude_each_other(folder: Path) -> None:
    refused = sceann("study", "small.yaml", "--cluster", "tcp://127.0.0.1:9", "--workers", 2, cwd=folder)
    assert refused.returncode == ExitCode.USAGE


def test_enumerate_prints_what_it_found(folder: Path) -> None:
    done = sceann("enumerate", "small.yaml", "--json", cwd=folder)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert {label: entry["length"] for label, entry in found.items()} == {"n_sensors=2": 8, "n_sensors=4": 12}
    assert len(list((folder / "studies" / "small" / "landscapes").glob("*/fitness.npy"))) == 2


def test_enumerate_refuses_a_genome_that_is_too_long(folder: Path) -> None:
    refused = sceann("enumerate", "small.yaml", "--set", "base.controller.n_hidden=6", cwd=folder)
    assert refused.returncode == ExitCode.CONFIG
    assert "expected at most 26" in refused.stderr


def test_the_champion_of_a_study_is_the_fittest(folder: Path) -> None:
    done = sceann("champion", "studies/small", "--condition", 1, "--json", "--top", 3, cwd=folder)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["from"] == "Condition 1: n_sensors=4"
    fitness = [one["fitness"] for one in told["champions"]]
    assert fitness == sorted(fitness, reverse=True)


def test_the_robust_champion_is_the_one_with_the_best_score(folder: Path) -> None:
    everyone = sceann("champion", "studies/small", "--robust", "--json", "--top", 99, cwd=folder)
    assert everyone.returncode == 0, everyone.stderr
    scores = [one["robust_score"] for one in json.loads(everyone.stdout)["champions"]]
    assert scores == sorted(scores, reverse=True)
    best = json.loads(everyone.stdout)["champions"][0]
    assert set(best["success"]) == {"sensor noise", "sensor offset", "motor gain error", "latency", "initial angle"}
    shown = sceann("champion", "studies/small", "--robust", "--top", 1, cwd=folder).stdout
    assert best["genome"] in shown
    assert best["robust_fitness"]["low"] <= best["robust_score"] <= best["robust_fitness"]["high"]


def test_the_robust_champion_can_be_chosen_by_success(folder: Path) -> None:
    told = json.loads(sceann("champion", "studies/small", "--robust", "--by", "success", "--json", cwd=folder).stdout)
    assert [one["robust_score"] for one in told["champions"]] == [one["robust_success"] for one in told["champions"]]


def test_the_champion_of_a_run_comes_from_its_journal(folder: Path) -> None:
    run = "task: {type: pole_balancing, max_steps: 50}\nrobot: {type: cartpole}\n"
    run += "controller: {coding: sceann3, n_hidden: 1}\nalgorithm: {type: oga, population: 5, generations: 2}\n"
    (folder / "run.yaml").write_text(run, encoding="utf-8")
    assert sceann("evolve", "run.yaml", "--out", "run", cwd=folder).returncode == 0
    told = json.loads(sceann("champion", "run", "--robust", "--json", cwd=folder).stdout)
    assert told["champions"][0]["origin"].startswith("generation ")
    assert len({one["genome"] for one in told["champions"]}) == len(told["champions"])


def test_a_condition_that_is_not_there_is_refused(folder: Path) -> None:
    refused = sceann("champion", "studies/small", "--condition", 7, cwd=folder)
    assert refused.returncode == ExitCode.NOT_A_RUN
    assert "numbered from 0 to 1" in refused.stderr


def test_report_names_its_files(folder: Path) -> None:
    done = sceann("report", "studies", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["studies/report/report.md", "studies/report/report.html"]
    text = (folder / "studies" / "report" / "report.md").read_text(encoding="utf-8")
    assert text.startswith("# small\n\nStudy `small`: 2 conditions, 6 runs each")


def test_report_refuses_a_folder_without_studies(folder: Path) -> None:
    assert sceann("report", "many", cwd=folder).returncode == ExitCode.NOT_A_RUN


def test_ctrl_c_stops_with_its_own_exit_code_and_the_study_goes_on(folder: Path) -> None:
    command = [sys.executable, "-m", "sceann_hil.cli", "study", "small.yaml", "--runs", "4000", "--workers", "1"]
    process = subprocess.Popen([*command, "--out", "interrupted"], cwd=folder, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    try:
        for line in process.stderr:
            if "runs to do" in line:
                process.send_signal(signal.SIGINT)
                break
        told = process.stderr.read()
        assert process.wait(60) == ExitCode.INTERRUPTED_NOW
    finally:
        process.kill()
        process.wait()
        process.stderr.close()
    assert "Stopped, as asked." in told
    assert "Traceback" not in told


def test_a_study_is_exported_as_tables(folder: Path) -> None:
    done = sceann("export-csv", "studies/small", "--out", "tables", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert [Path(line).name for line in done.stdout.split()] == [
        *("conditions.csv", "runs.csv", "best.csv"),
        VERSIONS_NAME,
    ]
    large = sceann("export-csv", "studies/small", "--out", "tables", "--format", "parquet", cwd=folder)
    assert large.returncode == 0, large.stderr
    assert (folder / "tables" / "runs.parquet").stat().st_size > 500
    assert sceann("export-csv", "studies/small", "--format", "xlsx", cwd=folder).returncode == 2
