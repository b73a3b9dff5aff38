"""`sceann export`, `flash` and `verify` as a user meets them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sceann_hil.errors import ExitCode
from sceann_hil.firmware.emulated.posix import PosixBoard
from tests.commands.test_cli import sceann
from tests.runs import GOAL, evolve


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("runs") / "goal"
    evolve(directory, GOAL)
    return directory


def test_export_writes_a_header_that_says_how_to_make_it_again(run: Path, tmp_path: Path) -> None:
    header = tmp_path / "walker.h"
    assert sceann("export", run, "--name", "walker", "-o", header).returncode == 0
    text = header.read_text()
    assert sceann("export", run, "--name", "walker").stdout == text
    command = next(line for line in text.splitlines() if "made by" in line).split("made by")[1].split()
    assert command[:2] == ["sceann", "export"]
    assert sceann("export", run, *command[3:]).stdout == text
    assert str(tmp_path) not in text


def test_export_replaces_its_own_header_and_nothing_else(run: Path, tmp_path: Path) -> None:
    header, other = tmp_path / "a.h", tmp_path / "thesis.txt"
    other.write_text("years of work")
    for _ in range(2):
        assert sceann("export", run, "-o", header).returncode == 0
    assert sceann("export", run, "-o", other).returncode == ExitCode.RUN_EXISTS
    assert other.read_text() == "years of work"
    assert sorted(tmp_path.iterdir()) == [header, other]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("export", "--name", "int"), ExitCode.FIRMWARE_BUILD, "C identifier"),
        (("export", "--genome", "worst"), ExitCode.NOT_A_RUN, "expected best, GENERATION:INDIVIDUAL"),
        (("export", "--genome", "99999"), ExitCode.NOT_A_RUN, "99999"),
        (("flash", "--board", "toaster"), ExitCode.TOOL_MISSING, "expected one of posix, uno"),
        (("flash", "--board", "posix"), ExitCode.TOOL_MISSING, "nothing to flash"),
        (("flash", "--board", "uno", "--genome-only", "--port", "/dev/none"), ExitCode.FLASH, "no such port"),
        (("flash", "--board", "uno", "--dry-run", "--build-only"), ExitCode.USAGE, "give one of"),
        (("flash", "--board", "uno", "--can", "--dry-run"), ExitCode.FIRMWARE_BUILD, "has no CAN driver"),
        (("verify", "--board", "toaster"), ExitCode.TOOL_MISSING, "toaster"),
    ],
)
def test_bad_input_gets_one_message_and_its_exit_code(
    run: Path, arguments: tuple[str, ...], code: ExitCode, words: str
) -> None:
    done = sceann(arguments[0], run, *arguments[1:])
    assert done.returncode == code, done.stderr
    assert words in done.stderr
    assert "Traceback" not in done.stderr


def test_a_missing_compiler_names_its_package(run: Path, tmp_path: Path) -> None:
    done = sceann("flash", run, "--board", "uno", "--build-only", PATH=str(tmp_path), XDG_CACHE_HOME=str(tmp_path))
    assert done.returncode == ExitCode.TOOL_MISSING
    assert "apt-get install gcc-avr" in done.stderr


def test_a_dry_run_says_what_would_be_done(run: Path) -> None:
    done = sceann("flash", run, "--board", "uno", "--dry-run", "--port", "/dev/ttyACM0")
    assert done.returncode == 0, done.stderr
    assert "avrdude -c arduino -p m328p -P /dev/ttyACM0 -b 115200 -D -U flash:w:" in done.stdout
    slow = sceann("flash", run, "--board", "uno", "--dry-run", "--upload-baud", "57600", "--autorun", "50")
    assert " -b 57600 -D" in slow.stdout
    assert "run without a host every 50 ms" in slow.stdout


def test_a_board_whose_link_is_on_can_is_another_image(run: Path) -> None:
    serial, can = (sceann("flash", run, "--board", "stm32f405", "--dry-run", *more) for more in ((), ("--can",)))
    assert can.returncode == 0, can.stderr
    assert "over CAN, when a run on it begins" in can.stdout
    assert can.stdout.splitlines()[0] != serial.stdout.splitlines()[0]


def test_a_genome_goes_into_a_running_robot(run: Path, tmp_path: Path) -> None:
    with PosixBoard(terminal=True, store=tmp_path / "store", name="twin") as board:
        done = sceann("flash", run, "--board", "posix", "--genome-only", "--port", board.port or "")
        assert done.returncode == 0, done.stderr
        assert "now on the robot: twin" in done.stdout
        assert "kept over power loss" in done.stdout
        again = sceann("verify", run, "--board", "posix", "--port", board.port or "", "--sequences", "20", "--json")
    answer = json.loads(again.stdout)
    assert (answer["equal"], answer["recorded_sequences"]) == (True, 3)


def test_a_new_board_is_proved_and_loaded_without_naming_it(run: Path, tmp_path: Path) -> None:
    """What firmware/README.md tells whoever writes a port: no --board is needed."""
    with PosixBoard(
        n_sensors=3, n_motors=2, terminal=True, store=tmp_path / "store", name="brand new", node=7
    ) as board:
        at = ("--port", board.port or "", "--node", "7")
        loaded = sceann("flash", run, "--genome-only", *at, "--autorun", "50")
        assert loaded.returncode == 0, loaded.stderr
        assert "brand new" in loaded.stdout
        assert "run 3 s after it is switched on" in loaded.stdout
        by_button = sceann("flash", run, "--genome-only", *at, "--autorun", "50", "--on-button")
        assert "run when its start button is pressed" in by_button.stdout
        proved = sceann("verify", run, *at, "--sequences", "5")
        assert proved.returncode == 0, proved.stderr
        assert "every state is equal" in proved.stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--autorun", "50"), "5 sensors and 2 motors"),
        (("--autorun", "0.01"), "--autorun: expected"),
    ],
)
def test_a_robot_that_cannot_run_it_alone_is_told_before_anything_is_sent(
    run: Path, tmp_path: Path, options: tuple[str, ...], words: str
) -> None:
    n_sensors = 5 if "5 sensors" in words else 3
    with PosixBoard(n_sensors=n_sensors, n_motors=2, terminal=True, store=tmp_path / "store") as board:
        done = sceann("flash", run, "--genome-only", "--port", board.port or "", *options)
    assert done.returncode == ExitCode.FLASH
    assert words in done.stderr
    assert not (tmp_path / "store").exists() or b"\x51" not in (tmp_path / "store").read_bytes()[:300]


def test_verify_on_an_emulated_uno(run: Path) -> None:
    done = sceann("verify", run, "--board", "uno", "--sequences", "10")
    assert done.returncode == 0, done.stderr
    assert "every state is equal" in done.stdout
