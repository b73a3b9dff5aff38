"""The C sources themselves: generated code, static analysis, published sizes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from sceann_hil.firmware.build import FIRMWARE, find_tool
from sceann_hil.link import numbers

ROOT = FIRMWARE.parent
CORE = sorted(path for path in (FIRMWARE / "src").glob("*.c") if path.name != "sceann_link.c")
HOST = [*CORE, *sorted((FIRMWARE / "boards" / "posix").glob("*.c"))]


def tool(name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "tools" / name), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)


def test_link_messages_are_what_the_dbc_gives() -> None:
    done = tool("generate_link", "--check")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ("firmware/README.md", f"stop when the host is silent for {1000 * numbers.HOST_DEADLINE_S:g} ms"),
        ("firmware/README.md", f"after {1000 * numbers.WATCHDOG_S:g} ms when the program hangs"),
        ("firmware/README.md", f"battery stays low for {1000 * numbers.BATTERY_LOW_S:g} ms"),
        ("firmware/README.md", f"run {numbers.AUTORUN_S:g} s after it is switched on"),
        ("firmware/README.md", f"| {numbers.STORE_BYTES} bytes that survive power loss"),
        ("docs/hardware.md", f"stops by itself {1000 * numbers.HOST_DEADLINE_S:g} ms after the last heartbeat"),
        ("docs/operating.md", f"our firmware stops {1000 * numbers.HOST_DEADLINE_S:g} ms after the last heartbeat"),
        ("docs/link.md", f"no heartbeat from the host for {1000 * numbers.HOST_DEADLINE_S:g} ms"),
        ("docs/link.md", f"after {1000 * numbers.WATCHDOG_S:g} ms, which makes the motors safe"),
        ("docs/link.md", f"means low for {1000 * numbers.BATTERY_LOW_S:g} ms"),
        ("docs/link.md", f"{numbers.AUTORUN_S:g} s after boot with no HELLO"),
        ("docs/link.md", f"the line held low for {1000 * numbers.BREAK_S:g} ms"),
        ("docs/link.md", f"# The robot link, version {numbers.LINK_VERSION}"),
    ],
)
def test_documents_say_the_numbers_in_words_too(document: str, words: str) -> None:
    assert words in " ".join((ROOT / document).read_text().split())


def test_no_published_size_grew_by_more_than_five_percent() -> None:
    done = tool("firmware_sizes", "--check")
    assert done.returncode == 0, done.stdout


def test_cppcheck_finds_nothing() -> None:
    command = [find_tool("cppcheck", "cppcheck"), "--std=c99", "--enable=warning,performance,portability,style"]
    command += ["--inline-suppr", "--error-exitcode=1", "--quiet", "--suppress=missingIncludeSystem"]
    command += ["--suppress=unusedStructMember", "--suppress=variableScope", f"-I{FIRMWARE / 'src'}"]
    done = subprocess.run([*command, *map(str, HOST)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("source", HOST, ids=lambda path: path.stem)
def test_clang_tidy_finds_nothing(source: Path) -> None:
    checks = "-*,bugprone-*,clang-analyzer-*,performance-*,portability-*,cert-*"
    checks += ",-bugprone-easily-swappable-parameters,-bugprone-reserved-identifier"
    checks += ",-cert-err33-c,-cert-dcl37-c,-cert-dcl51-cpp"
    # what C's integer promotions make of every small type; -Wconversion is on in every build
    checks += ",-bugprone-narrowing-conversions,-bugprone-too-small-loop-variable"
    checks += ",-bugprone-implicit-widening-of-multiplication-result"
    checks += ",-clang-analyzer-security.insecureAPI.DeprecatedOrUnsafeBufferHandling"
    command = [
        find_tool("clang-tidy", "clang-tidy"),
        f"--checks={checks}",
        "--warnings-as-errors=*",
        "--quiet",
        str(source),
    ]
    command += ["--", "-std=c99", f"-I{FIRMWARE / 'src'}", f"-I{FIRMWARE / 'boards' / 'posix'}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("source", CORE, ids=lambda path: path.stem)
def test_the_core_has_no_heap_no_float_and_no_test_switches(source: Path) -> None:
    text = source.read_text()
    for word in ("malloc", "free(", "float", "double", "printf", "#ifdef TEST"):
        assert word not in text
