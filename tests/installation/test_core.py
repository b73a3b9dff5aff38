"""What a computer beside a robot needs, and nothing else: only the locked core packages can be imported."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from sceann_hil.errors import ExitCode

ROOT = Path(__file__).parents[2]
LOCK = (ROOT / "tools" / "requirements-core.lock").read_text(encoding="utf-8")
LOCKED = set(re.findall(r"^([a-z0-9.-]+)==", LOCK, re.MULTILINE))
SCEANN = Path(sys.executable).parent / "sceann"
LEFT_OUT = {"rerun", "matplotlib", "scipy", "pandas", "pyarrow", "distributed", "dask"}
EMULATED = ("sceann_hil.firmware.emulated", "backends.virtual")

_BLOCKER = """
import sys
from importlib.abc import MetaPathFinder

ALLOWED, REFUSED = {allowed!r}, {refused!r}

class Blocker(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.startswith("_sysconfigdata"):
            return
        if name.startswith(REFUSED) or name.partition(".")[0] not in ALLOWED:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Blocker())
"""


def _allowed() -> set[str]:
    """Top-level modules of Python itself, of this package and of the locked packages."""
    modules = {name for name, owners in metadata.packages_distributions().items() if _normal(owners) & LOCKED}
    finders = {name for name in sys.modules if name.startswith("__editable__")}
    own = {"sceann_hil", "backends", "sitecustomize", "usercustomize", "_sitebuiltins", "__main__", "__mp_main__"}
    return modules | finders | own | set(sys.stdlib_module_names)


def _normal(names: list[str]) -> set[str]:
    return {re.sub(r"[-_.]+", "-", name).lower() for name in names}


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment variables of a process that has the core packages only."""
    folder = tmp_path_factory.mktemp("blocker")
    text = _BLOCKER.format(allowed=_allowed(), refused=EMULATED)
    (folder / "sitecustomize.py").write_text(text, encoding="utf-8")
    return {**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "200"}


def _sceann(core: dict[str, str], *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [SCEANN, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        env=core,
    )


@pytest.fixture(scope="module")
def run(core: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Evolved with the core packages only."""
    out = tmp_path_factory.mktemp("core") / "run"
    setting = "algorithm.generations=3"
    config = ROOT / "configs" / "quickstart.yaml"
    done = _sceann(core, "evolve", config, "--out", out, "--set", setting, "--record", "none")
    assert done.returncode == 0, done.stderr
    return out


def test_the_blocker_blocks(core: dict[str, str]) -> None:
    for module in sorted(LEFT_OUT | set(EMULATED)):
        done = subprocess.run([sys.executable, "-c", f"import {module}"], env=core, capture_output=True, check=False)
        assert done.returncode == 1, module


@pytest.mark.parametrize(
    "arguments",
    [
        ("status", "{run}"),
        ("replay", "{run}", "--all"),
        ("export", "{run}"),
        ("export-csv", "{run}", "--out", "{run}/tables"),
        ("champion", "{run}"),
        ("resume", "{run}", "--record", "none"),
        ("plan", "{configs}/goal_reach.yaml"),
        ("rehearse", "{configs}/quickstart.yaml", "--set", "algorithm.generations=1"),
        (
            *("transfer", "{configs}/quickstart.yaml", "--out", "{run}/../transfer", "--record", "none"),
            *("--from", "{run}", "--trials", "2", "--rounds", "1", "--set", "uncertainty.robots=20"),
            *("--set", "algorithm.candidates=10"),
        ),
        ("list",),
        ("schema",),
        ("flash", "--help"),
        ("doctor", "--help"),
        ("--help",),
    ],
    ids=lambda arguments: arguments[0],
)
def test_what_a_robots_host_does_needs_no_more(core: dict[str, str], run: Path, arguments: tuple[str, ...]) -> None:
    done = _sceann(core, *(argument.format(run=run, configs=ROOT / "configs") for argument in arguments))
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("arguments", "package"),
    [
        (("view", "{run}"), "rerun-sdk"),
        (("record", "{run}"), "rerun-sdk"),
        (("report", "{run}"), "matplotlib"),
        (("drift", "{run}"), "scipy"),
        (("study", "{configs}/paper/fig6.yaml", "--cluster", "tcp://127.0.0.1:9"), "distributed"),
    ],
    ids=["view", "record", "report", "drift", "study --cluster"],
)
def test_a_command_whose_package_is_missing_names_it(
    core: dict[str, str], run: Path, arguments: tuple[str, ...], package: str
) -> None:
    done = _sceann(core, *(argument.format(run=run, configs=ROOT / "configs") for argument in arguments))
    assert done.returncode == ExitCode.PACKAGE_MISSING, done.stderr
    assert package in done.stderr
    assert "Traceback" not in done.stderr


def test_a_run_that_cannot_be_recorded_here_is_complete_and_says_how_to_record_it(
    core: dict[str, str], tmp_path: Path
) -> None:
    config = ROOT / "configs" / "quickstart.yaml"
    done = _sceann(core, "evolve", config, "--out", tmp_path / "run", "--set", "algorithm.generations=1")
    assert done.returncode == 0
    assert "rerun-sdk" in done.stderr
    assert f"sceann record {tmp_path / 'run'}" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_locked_core_takes_at_most_350_megabytes() -> None:
    size = 0
    for name in LOCKED - {"colorama"}:  # for Windows only
        files = [Path(str(file.locate())) for file in metadata.distribution(name).files or []]
        size += sum(path.stat().st_size for path in files if path.is_file())
    assert 100e6 < size <= 350e6


def test_the_core_is_the_whole_minus_looking_and_statistics() -> None:
    whole = set(re.findall(r"^([a-z0-9.-]+)==", (ROOT / "tools" / "requirements.lock").read_text(), re.MULTILINE))
    assert whole > LOCKED
    assert not LOCKED & {"rerun-sdk", "matplotlib", "scipy", "pandas", "pyarrow", "distributed", "dask"}
