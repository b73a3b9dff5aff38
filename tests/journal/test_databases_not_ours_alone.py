"""Read-only places, other programs' locks, a folder that goes away, copies: each works, or says what is wrong."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from sceann_hil.errors import CannotWrite, DiskFull, OtherVersions, UserError, database_error
from sceann_hil.journal import JOURNAL_NAME, JournalReader, RunLock
from sceann_hil.journal.copying import copy_database, new_folder
from sceann_hil.journal.database import patiently
from sceann_hil.journal.lock import who_has_locked
from sceann_hil.journal.verify import examine
from sceann_hil.run.experiment import Experiment
from tests.runs import POLE, config_of, contents, evolve, resume

SMALL = (POLE, "algorithm.population=3", "algorithm.generations=2")
NO_LIMITS: dict[str, float | None] = dict.fromkeys(("robot_s", "wall_s", "trials", "battery_charges"))


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("alone") / "run"
    evolve(directory, *SMALL)
    return directory


@pytest.fixture
def run(finished: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "run"))


def as_nobody(read: Callable[[], object]) -> str:
    """What somebody tells who may write nothing there: permissions mean nothing to root, so it becomes another user."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            if os.geteuid() == 0:
                os.setgid(65534)
                os.setuid(65534)
            os.write(writing, repr(read()).encode())
        except BaseException as error:
            os.write(writing, repr(error).encode())
        finally:
            os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as told:
        answer = told.read()
    os.waitpid(pid, 0)
    return answer


def looked_at(directory: Path) -> object:
    reader = JournalReader(directory)
    return len(reader.generations(finished=True)), reader.count_attempts(), examine(directory).damage


@pytest.fixture
def readable_by_all(run: Path) -> Iterator[Path]:
    """The run in a read-only folder that everybody can reach."""
    place = Path("/tmp") / f"sceann-shared-{os.getpid()}-{time.monotonic_ns()}"
    shutil.copytree(run, place)
    for path in (*place.iterdir(), place):
        path.chmod(0o555 if path.is_dir() else 0o444)
    yield place
    place.chmod(0o755)
    shutil.rmtree(place)


def test_a_finished_run_in_a_read_only_folder_is_read(readable_by_all: Path) -> None:
    n_trials = JournalReader(readable_by_all).count_attempts()
    assert as_nobody(lambda: looked_at(readable_by_all)) == repr((3, n_trials, ()))


def test_a_killed_run_in_a_read_only_folder_is_read_with_its_log(run: Path, readable_by_all: Path) -> None:
    readable_by_all.chmod(0o755)
    db = sqlite3.connect(run / JOURNAL_NAME, isolation_level=None)
    db.execute("PRAGMA wal_autocheckpoint = 0")
    with Experiment.open(run) as experiment:
        experiment.journal.note("operator", "the newest words")
        for name in (JOURNAL_NAME, f"{JOURNAL_NAME}-wal", f"{JOURNAL_NAME}.seal"):
            (readable_by_all / name).unlink(missing_ok=True)
            shutil.copyfile(run / name, readable_by_all / name)
            (readable_by_all / name).chmod(0o444)
    db.close()
    readable_by_all.chmod(0o555)
    told = as_nobody(lambda: (examine(readable_by_all).damage, JournalReader(readable_by_all).events()[-1][3]))
    assert told == repr(((), "the newest words"))


def test_a_lock_of_another_program_is_waited_for_with_a_word(tmp_path: Path) -> None:
    path = tmp_path / "some.sqlite"
    sqlite3.connect(path).execute("CREATE TABLE t (x)").connection.close()
    hold = (
        "import sqlite3, sys; db = sqlite3.connect(sys.argv[1]); db.execute('BEGIN EXCLUSIVE'); print('held'); input()"
    )
    other = subprocess.Popen(
        [sys.executable, "-u", "-c", hold, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert other.stdout is not None
    other.stdout.readline()
    assert who_has_locked(path).startswith(f"process {other.pid} (")
    told: list[str] = []

    def write() -> None:
        db = sqlite3.connect(path, timeout=0)
        try:
            with db:
                db.execute("INSERT INTO t VALUES (1)")
        finally:
            db.close()

    def tell(text: str) -> None:
        told.append(text)
        if len(told) == 1:
            assert other.stdin is not None
            other.stdin.close()  # it lets go once we have complained
            other.wait()

    patiently(write, path, tell)
    assert f"locked by process {other.pid}" in told[0]
    assert "free again" in told[1]
    other.stdout.close()


def test_a_run_goes_on_after_another_program_had_its_journal(run: Path) -> None:
    with Experiment.open(run) as experiment:
        other = sqlite3.connect(run / JOURNAL_NAME, isolation_level=None, check_same_thread=False)
        other.execute("BEGIN IMMEDIATE")
        threading.Timer(1.0, lambda: other.execute("ROLLBACK")).start()
        experiment.journal.note("operator", "waited")
        assert experiment.journal.reader.events()[-1][3] == "waited"
        other.close()


def test_a_folder_that_is_renamed_while_the_run_goes_on_is_an_error(run: Path) -> None:
    experiment = Experiment.open(run)
    experiment.journal.note("operator", "here")
    run.rename(run.with_name("elsewhere"))
    with pytest.raises(CannotWrite, match="removed or renamed"):
        experiment.journal.note("operator", "there")
    experiment.close()
    assert not run.exists()
    run.with_name("elsewhere").rename(run)
    assert examine(run).damage == ()


def test_a_folder_that_is_removed_while_the_run_goes_on_is_an_error(run: Path) -> None:
    experiment = Experiment.open(run)
    shutil.rmtree(run)
    with pytest.raises(CannotWrite, match="removed or renamed"):
        experiment.journal.note("operator", "there")
    experiment.close()
    assert not run.exists()


def test_a_copy_is_sound_and_goes_on_while_the_run_does(run: Path, finished: Path, tmp_path: Path) -> None:
    with Experiment.open(run) as experiment:
        experiment.journal.note("operator", "before the copy")
        reader = JournalReader(run)
        copy_database(reader.database, run / JOURNAL_NAME, new_folder(tmp_path / "copy") / JOURNAL_NAME)
        reader.close()
        experiment.journal.note("operator", "after it")
    verdict = examine(tmp_path / "copy")
    assert (verdict.damage, verdict.untouched) == ((), True)
    assert JournalReader(tmp_path / "copy").events()[-1][3] == "before the copy"
    resume(tmp_path / "copy")
    assert contents(tmp_path / "copy") == contents(finished)


def test_a_copy_of_the_database_without_its_log_is_noticed(run: Path, tmp_path: Path) -> None:
    with Experiment.open(run) as experiment:
        experiment.journal.note("operator", "in the log only")
        (tmp_path / "bad").mkdir()
        shutil.copy(run / JOURNAL_NAME, tmp_path / "bad" / JOURNAL_NAME)
        shutil.copy(run / f"{JOURNAL_NAME}.seal", tmp_path / "bad" / f"{JOURNAL_NAME}.seal")
    assert "transactions are missing" in examine(tmp_path / "bad").damage[0]


def test_other_versions_are_refused_unless_they_are_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = config_of(*SMALL)
    with Experiment.create(config, tmp_path / "run") as experiment:
        experiment.journal.begin_session("cartpole", "none", NO_LIMITS, {"sceann-hil": "0.1", "numba": "1"}, "body a")
    with pytest.raises(OtherVersions, match=r"sceann-hil: 0.1 before, .* now"):
        resume(tmp_path / "run")
    with Experiment.open(tmp_path / "run", accept_other_versions=True) as experiment, config.robot.build() as robot:
        experiment.evolve(robot)
        journal = experiment.journal
        kinds = [kind for _, _, kind, _ in journal.reader.events()]
        assert "versions" in kinds
        assert {row.session for g in (0, 1, 2) for row in journal.reader.attempts(g)} == {2}
    resume(tmp_path / "run")


def test_another_body_is_refused_as_well(tmp_path: Path) -> None:
    with Experiment.create(config_of(*SMALL), tmp_path / "run") as experiment:
        journal = experiment.journal
        journal.begin_session("cartpole", "none", {}, body="a")
        journal.begin_session("another robot", "none", {}, body="b")
        journal.begin_session("another robot", "none", {}, body="b")
        with pytest.raises(OtherVersions, match="simulated body: its code was b before, is c now"):
            journal.begin_session("another robot", "none", {}, body="c")


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        (sqlite3.SQLITE_FULL, DiskFull),
        (sqlite3.SQLITE_IOERR_WRITE, DiskFull),
        (sqlite3.SQLITE_READONLY_DBMOVED, CannotWrite),
        (sqlite3.SQLITE_CANTOPEN_ISDIR, UserError),
        (sqlite3.SQLITE_CORRUPT_VTAB, UserError),
    ],
)
def test_every_error_of_sqlite_is_one_of_ours(code: int, kind: type[UserError]) -> None:
    error = sqlite3.OperationalError("it said so")
    error.sqlite_errorcode = code
    told = database_error(error, Path("run/journal.sqlite"))
    assert isinstance(told, kind)
    assert "run/journal.sqlite" in told.message


def test_a_look_at_a_run_turns_no_writer_away(tmp_path: Path) -> None:
    stop = threading.Event()

    def look() -> None:
        while not stop.is_set():
            RunLock.is_held(tmp_path)

    RunLock(tmp_path).release()
    looking = threading.Thread(target=look)
    looking.start()
    try:
        for _ in range(50):
            RunLock(tmp_path).release()
    finally:
        stop.set()
        looking.join()


def test_a_file_system_without_locks_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_locks(*_: object) -> None:
        raise OSError(37, "No locks available")

    monkeypatch.setattr("fcntl.flock", no_locks)
    with pytest.raises(CannotWrite, match="has no locks"):
        RunLock(tmp_path)
