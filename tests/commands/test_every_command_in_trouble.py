"""Every `sceann` command in read-only, homeless, closed, foreign, damaged surroundings: a message, no traceback.

A command that is added to the program has to be added to `CALLS`: a test says so.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import typer

from sceann_hil.cli import app
from sceann_hil.errors import ExitCode
from sceann_hil.journal import JOURNAL_NAME, RunLock
from sceann_hil.study import STUDY_NAME
from tests.commands.many_commands import REPOSITORY, Call, Ended, call_all
from tests.runs import evolve

POLE = """
task: {type: pole_balancing, max_steps: 50}
robot: {type: cartpole, n_sensors: 2}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga, population: 4, generations: 2}
"""
ROBOT = """
task: {type: pole_balancing, max_steps: 50}
robot:
  {type: remote, port: PORT, mode: onboard, n_sensors: 2, n_motors: 1, tick_s: 0.02, ends: [],
    start_fields: [x_m, velocity_m_s, angle_rad, angular_velocity_rad_s]}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga, population: 4, generations: 2}
"""
STUDY = f"""
name: small
runs: 2
base:
{"".join(f"  {line}{chr(10)}" for line in POLE.strip().splitlines())}
grid:
  algorithm.population: [4]
"""

CALLS = {
    "evolve": "evolve CONFIG --from RUN --out NEW --record none",
    "resume": "resume RUN --record none",
    "transfer": "transfer CONFIG --from RUN --trials 2 --evolve 0 --out NEW --record none",
    "plan": "plan CONFIG",
    "rehearse": "rehearse CONFIG --out NEW",
    "runs": "runs RUN",
    "status": "status RUN",
    "view": "view RUN --run --picture NEW.png",
    "champion": "champion RUN",
    "replay": "replay RUN --all",
    "record": "record RUN --record best",
    "check": "check RUN",
    "copy": "copy RUN --out NEW",
    "export-csv": "export-csv RUN --out NEW",
    "doctor": "doctor --robot ROBOT",
    "compare": "compare RUN --on CONFIG",
    "repeat": "repeat RUN -n 2",
    "drift": "drift RUN",
    "export": "export RUN -o NEW.h",
    "flash": "flash RUN --genome-only --port PORT",
    "verify": "verify RUN --port PORT",
    "set-node": "set-node 2 --port PORT",
    "study": "study STUDY --workers 1 --out STUDIES",
    "enumerate": "enumerate CONFIG --workers 1 --out NEW",
    "report": "report PLACE --out NEW",
    "list": "list",
    "schema": "schema",
    "virtual": "virtual posix CONFIG --port NEW --write NEW.yaml",
}
"""How each is called. RUN is the folder of a run, PLACE that of a study, NEW what is to be made."""
ON_A_RUN = {name: line for name, line in CALLS.items() if " RUN" in line and name != "runs"}
WITHOUT_END = {"virtual"}
"""These work until Ctrl-C."""
OF_STUDIES = {
    "study": CALLS["study"],
    "runs": "runs PLACE",
    "champion-study": "champion PLACE",
    "check-study": "check PLACE",
    "copy-study": "copy PLACE --out NEW",
    "export-csv-study": "export-csv PLACE --out NEW",
    "report": "report PLACE --out NEW",
}
ENDED_IN_GOOD_ORDER = {ExitCode.OK, ExitCode.INTERRUPTED, ExitCode.OPERATOR_FINISHED, ExitCode.BUDGET_SPENT}


class Surroundings:
    """A folder with a configuration, a finished run and a finished study."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.run = folder / "run"
        self.study = folder / "studies" / "small"

    def calls(self, lines: dict[str, str], new: Path | None = None, *, closed: bool = False) -> list[Call]:
        """Calls as they are typed in the folder."""
        new = new or self.folder
        return [
            Call(self._words(line, name, new), str(self.folder), closed, interrupt_after_s=4.0 * (name in WITHOUT_END))
            for name, line in lines.items()
        ]

    def _words(self, line: str, name: str, new: Path) -> list[str]:
        place = {
            "CONFIG": self.folder / "config.yaml",
            "ROBOT": self.folder / "robot.yaml",
            "STUDY": self.folder / "study.yaml",
            "STUDIES": self.folder / "studies",
            "PLACE": self.study,
            "RUN": self.run,
            "PORT": self.folder / "no-port",
        }
        made = str(new / f"new-{name}")
        return [str(place[word]) if word in place else word.replace("NEW", made) for word in line.split()]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Surroundings:
    folder = tmp_path_factory.mktemp("trouble")
    (folder / "config.yaml").write_text(POLE)
    (folder / "robot.yaml").write_text(ROBOT.replace("PORT", str(folder / "no-port")))
    (folder / "study.yaml").write_text(STUDY)
    evolve(folder / "run", POLE)
    subprocess.run(
        [sys.executable, "-m", "sceann_hil.cli", "study", "study.yaml", "--workers", "1", "--out", "studies"],
        cwd=folder,
        check=True,
        capture_output=True,
        env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
    )
    return Surroundings(folder)


@pytest.fixture
def copied(whole: Surroundings, tmp_path: Path) -> Surroundings:
    return Surroundings(Path(shutil.copytree(whole.folder, tmp_path / "trouble")))


def bare(**more: str) -> dict[str, str]:
    """An environment without a home, and without a folder that a cache could be kept in."""
    return {"PATH": os.environ["PATH"], "SCEANN_CACHE_DIR": "/proc/nowhere", **more}


def usual(**more: str) -> dict[str, str]:
    return {**os.environ, **more}


def check(ended: list[Ended], allowed: set[ExitCode] | None = None) -> None:
    """Every command said what is wrong, once, and left with a known code."""
    found = []
    for one in ended:
        told = f"sceann {' '.join(one.words)}: code {one.code}\n{one.output[-500:]}\n{one.errors[-1500:]}"
        known = one.code in {int(code) for code in ExitCode} - {ExitCode.BUG, ExitCode.USAGE}
        messages = one.errors.count("Error:") + one.errors.count("Stopped, as asked. ")
        expected = 0 if one.code in ENDED_IN_GOOD_ORDER else 1
        if not known or "Traceback" in one.errors + one.output or (messages != expected and one.code not in UNTOLD):
            found.append(told)
        elif allowed is not None and one.code not in allowed:
            found.append(f"expected {sorted(allowed)}: {told}")
    assert not found, "\n\n".join([f"{len(found)} of {len(ended)} commands:", *found])


UNTOLD = {ExitCode.REPLAY_DIFFERS, ExitCode.VERIFY_DIFFERS, ExitCode.RUN_IS_DAMAGED}
"""Codes of commands whose answer is what they print."""


def test_every_command_is_tried_here() -> None:
    group = typer.main.get_command(app)
    context = typer.Context(group)
    assert set(group.list_commands(context)) == set(CALLS)  # type: ignore[attr-defined]


def read_only(*writable: Path) -> list[str]:
    """A program that starts another one where nothing can be written, for root too."""
    mounts = "".join(f"mount --bind {place} {place} && " for place in writable)
    script = f'{mounts} mount -o remount,bind,ro / && exec "$@"'
    wrapped = ["unshare", "--map-root-user", "--mount", "sh", "-c", script, "sh"]
    return wrapped if subprocess.run([*wrapped, "true"], check=False).returncode == 0 else []


def test_in_a_read_only_place_without_a_home_and_without_a_cache(whole: Surroundings) -> None:
    # without the right to mount, the new things go where nobody can make a folder
    wrapped, new = read_only(), Path("/proc/nowhere")
    ended = call_all(whole.calls(CALLS, None if wrapped else new), bare(TMPDIR="/dev/shm"), wrapped)
    check(ended)


def test_where_not_even_temporary_files_can_be_made(whole: Surroundings) -> None:
    wrapped, new = read_only(), Path("/proc/nowhere")
    environment = bare() if wrapped else bare(TMPDIR=str(new))
    check(call_all(whole.calls(CALLS, None if wrapped else new), environment, wrapped))


def test_with_closed_input_and_output(copied: Surroundings) -> None:
    check(call_all(copied.calls(CALLS, closed=True), usual()))


@pytest.fixture(scope="module")
def latin_1(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of a latin-1 system, or of an ASCII one where no such locale can be made."""
    place = tmp_path_factory.mktemp("locale") / "en_US.ISO-8859-1"
    with_tool = shutil.which("localedef") is not None
    if with_tool:
        subprocess.run(
            ["localedef", "-c", "-i", "en_US", "-f", "ISO-8859-1", str(place)], check=False, capture_output=True
        )
    made = {"LOCPATH": str(place.parent), "LC_ALL": place.name} if place.exists() else {"LC_ALL": "C"}
    environment = {"PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "LANG": "", **made}
    encoding = subprocess.run(
        [sys.executable, "-c", "import locale; print(locale.getpreferredencoding())"],
        env=usual(**environment),
        capture_output=True,
        text=True,
        check=True,
    )
    assert encoding.stdout.strip().upper() in ("ISO-8859-1", "ANSI_X3.4-1968"), encoding.stdout
    return environment


def test_under_a_latin_1_locale(copied: Surroundings, latin_1: dict[str, str]) -> None:
    check(call_all(copied.calls(CALLS), usual(**latin_1)))


def flip_bytes(path: Path) -> None:
    data = bytearray(path.read_bytes())
    for place in range(5000, len(data), 97):
        data[place] ^= 0xFF
    path.write_bytes(data)


def replace_by_somebody_else_s(path: Path) -> None:
    path.unlink()
    with sqlite3.connect(path) as db:
        db.execute("CREATE TABLE recipe (name TEXT)")
    db.close()


def make_newer(path: Path) -> None:
    with sqlite3.connect(path) as db:
        db.execute("PRAGMA user_version = 99")
    db.close()


KINDS: dict[str, tuple[Callable[[Path], object], set[ExitCode]]] = {
    "damaged": (flip_bytes, {ExitCode.RUN_IS_DAMAGED}),
    "overwritten": (lambda path: path.write_bytes(b"no database at all" * 1000), {ExitCode.RUN_IS_DAMAGED}),
    "empty": (lambda path: path.write_bytes(b""), {ExitCode.RUN_IS_DAMAGED, ExitCode.NOT_A_RUN}),
    "foreign": (replace_by_somebody_else_s, {ExitCode.NOT_A_RUN}),
    "newer": (make_newer, {ExitCode.RUN_IS_NEWER}),
    "missing": (Path.unlink, {ExitCode.NOT_A_RUN}),
}


@pytest.fixture(scope="module")
def ended_on(whole: Surroundings, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Ended]]:
    """What became of the commands that read a run or a study, by the kind of database; all from one process."""
    calls = {}
    for kind, (spoil, _) in KINDS.items():
        spoilt = Surroundings(Path(shutil.copytree(whole.folder, tmp_path_factory.mktemp(kind) / "trouble")))
        for path in (spoilt.run / JOURNAL_NAME, spoilt.study / STUDY_NAME):
            spoil(path)
        calls[kind] = [*spoilt.calls(ON_A_RUN), *spoilt.calls(OF_STUDIES), *spoilt.calls({"runs": CALLS["runs"]})]
    ended = iter(call_all([call for of_kind in calls.values() for call in of_kind], usual()))
    return {kind: [next(ended) for _ in of_kind] for kind, of_kind in calls.items()}


@pytest.mark.parametrize("kind", KINDS)
def test_on_a_database_that_is(kind: str, ended_on: dict[str, list[Ended]]) -> None:
    ended = ended_on[kind]
    check(ended[: len(ON_A_RUN)], KINDS[kind][1])
    check(ended[len(ON_A_RUN) :])


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Another program has a database for itself, and will not let go."""
    hold = (
        "import sqlite3, sys; db = sqlite3.connect(sys.argv[1]); db.execute('PRAGMA locking_mode = EXCLUSIVE'); "
        "db.execute('BEGIN EXCLUSIVE'); print('held', flush=True); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", hold, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert other.stdin is not None
    assert other.stdout is not None
    try:
        assert other.stdout.readline() == "held\n"
        yield
    finally:
        other.stdin.close()
        other.wait(20)
        other.stdout.close()


def test_on_a_database_that_another_program_has_locked(copied: Surroundings) -> None:
    calls = [*copied.calls(ON_A_RUN), *copied.calls(OF_STUDIES)]
    waiting = [Call(call.words, call.folder, interrupt_after_s=6.0) for call in calls]
    with locked(copied.run / JOURNAL_NAME), locked(copied.study / STUDY_NAME):
        ended = call_all(waiting, usual(), at_once=len(calls))
    check(ended)
    for one in ended[: len(ON_A_RUN)]:
        assert f"{JOURNAL_NAME} is locked by process" in one.errors, one
        assert one.code == ExitCode.INTERRUPTED_NOW, one


def test_on_a_run_and_a_study_that_another_sceann_works_on(copied: Surroundings) -> None:
    writing, reading = {"resume"}, {"status", "check", "champion", "copy", "export-csv", "replay", "record"}
    of_run = {name: line for name, line in CALLS.items() if name in writing | reading}
    with RunLock(copied.run), RunLock(copied.study):
        ended = call_all([*copied.calls(of_run), *copied.calls({"study": CALLS["study"]})], usual())
    check(ended)
    codes = {one.words[0]: one.code for one in ended}
    assert codes == dict.fromkeys(reading, 0) | dict.fromkeys(("resume", "study"), ExitCode.RUN_IS_LOCKED)
