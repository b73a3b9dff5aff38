"""What a command imports: the help and a look at a run need neither physics nor pictures."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import import_module
from importlib.metadata import version
from inspect import getdoc
from pathlib import Path

import pytest
import typer

from sceann_hil.commands import COMMANDS
from sceann_hil.errors import ExitCode
from tests.runs import GOAL, evolve

HEAVY = {"numba", "scipy", "matplotlib", "rerun", "pandas", "can", "cantools", "serial", "distributed"}
PHYSICS = {"backends.diffdrive", "backends.simulation", "sceann_hil.study", "sceann_hil.firmware.emulated"}

_RUN_AND_TELL = """
import json, sys
sys.argv = ["sceann", *sys.argv[1:]]
from sceann_hil.cli import main
try:
    main()
except SystemExit as end:
    code = end.code or 0
print(json.dumps([code, sorted(sys.modules)]), file=sys.stderr)
"""


def imported_by(*arguments: str | Path) -> tuple[int, set[str]]:
    """The exit code of a command and the modules that it left imported."""
    done = subprocess.run(
        [sys.executable, "-c", _RUN_AND_TELL, *map(str, arguments)], capture_output=True, text=True, check=True
    )
    code, modules = json.loads(done.stderr.splitlines()[-1])
    return code, set(modules)


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_the_help_and_the_version_load_nothing_heavy(option: str) -> None:
    code, modules = imported_by(option)
    assert code == 0
    assert not modules & (HEAVY | PHYSICS | {"numpy", "pydantic"})


def test_a_look_at_a_run_loads_neither_its_robot_nor_numba(tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL)
    code, modules = imported_by("status", tmp_path / "run")
    assert code == 0
    assert not modules & (HEAVY | PHYSICS)


def test_the_package_itself_loads_nothing_heavy() -> None:
    code = "import sys, sceann_hil; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not set(done.stdout.split()) & (HEAVY | PHYSICS | {"numpy", "pydantic"})


def test_the_version_is_the_installed_one() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "sceann_hil.cli", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"sceann-hil {version('sceann-hil')}\n"


def test_the_table_of_commands_is_what_the_modules_register() -> None:
    registered: dict[str, tuple[str, str]] = {}
    for module in sorted({entry.module for entry in COMMANDS.values()}):
        app = typer.Typer()
        import_module(f"sceann_hil.commands.{module}").register(app)
        for command in app.registered_commands:
            assert command.callback is not None
            name = command.name or command.callback.__name__.replace("_", "-")
            summary = (getdoc(command.callback) or "").partition("\n\n")[0].replace("\n", " ")
            registered[name] = (module, summary)
    assert registered == {name: (entry.module, entry.summary) for name, entry in COMMANDS.items()}


def _with_command_package(folder: Path, source: str) -> None:
    """An importable distribution that adds commands."""
    (folder / "extra_commands.py").write_text(source, encoding="utf-8")
    info = folder / "extra_commands-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: extra-commands\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text("[sceann_hil.commands]\nwalk = extra_commands:register\n")


def _with_path(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    code = f"import sys; sys.path.insert(0, {str(folder)!r}); from sceann_hil.cli import main; main()"
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False)


def test_a_package_can_add_commands(tmp_path: Path) -> None:
    _with_command_package(
        tmp_path,
        "def register(app):\n"
        "    @app.command()\n"
        "    def walk(steps: int = 3) -> None:\n"
        '        """Walk some steps."""\n'
        "        print('walked', steps)\n",
    )
    assert "Walk some steps." in _with_path(tmp_path, "--help").stdout
    assert _with_path(tmp_path, "walk", "--steps", "5").stdout == "walked 5\n"


def test_a_broken_package_of_commands_is_named_and_breaks_nothing_else(tmp_path: Path) -> None:
    _with_command_package(tmp_path, "import a_module_that_nobody_has\n")
    shown = _with_path(tmp_path, "--help")
    assert shown.returncode == 0
    assert "evolve" in shown.stdout
    assert "extra-commands 1.2" in shown.stderr
    refused = _with_path(tmp_path, "walk")
    assert refused.returncode == ExitCode.PLUGIN
    assert "extra-commands 1.2" in refused.stderr
    assert "Traceback" not in refused.stderr
