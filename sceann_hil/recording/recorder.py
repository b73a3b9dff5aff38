"""Making recordings from a run's journal: beside the evolution, after it, or again after something was lost.

Files are whole or absent, so a recorder can be killed at any moment and started again: it makes what is missing.
"""

from __future__ import annotations

import shutil
import time
from collections import deque
from collections.abc import Callable, Collection
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from sceann_hil.errors import CannotWrite, RecordingIsDamaged
from sceann_hil.journal import RunLock
from sceann_hil.recording import blueprints, chunks, overview, rrd
from sceann_hil.recording.paths import RecordingPaths
from sceann_hil.recording.process import Detail, RecorderStatus, State
from sceann_hil.recording.source import RecordedGeneration, RunSource
from sceann_hil.recording.trial_files import write_trials

FORM = 2
"""What files of trials and scenery agree on, such as the lines of a network: trials of another form are drawn again."""
_LOOK_AGAIN_S = 0.2
_WRITERS = 2


def remedy(run_dir: Path) -> str:
    """What a user should do about a damaged recording."""
    return f"`sceann record {run_dir}` makes it again from the journal."


def _nobody(status: RecorderStatus) -> None:
    pass


def _must_be_writable(run_dir: Path) -> None:
    try:
        str(run_dir).encode()
    except UnicodeEncodeError:
        raise CannotWrite(
            f"{run_dir}: rerun writes no recordings into a folder whose name is not UTF-8.",
            "Rename the folder, or call the command from within it (`sceann record .`).",
        ) from None


class Recorder:
    """Records one run.

    Args:
        run_dir: the run.
        detail: which trials.
        report: told how far it is.
        replace_damaged: make a damaged file again; otherwise refuse it.

    Raises:
        NotARun, RunIsNewer, RunIsDamaged: see `RunSource`.
        RunIsLocked: another recorder is at work on this run.
        CannotWrite: rerun cannot write to files of this name.
    """

    def __init__(
        self,
        run_dir: Path,
        detail: Detail,
        report: Callable[[RecorderStatus], None] = _nobody,
        *,
        replace_damaged: bool = True,
    ) -> None:
        _must_be_writable(run_dir)
        self._paths = RecordingPaths(run_dir)
        self._detail = detail
        self._report = report
        self._replace_damaged = replace_damaged
        self._trials = 0
        self._partly = False
        self._done: set[int] = set()
        self._source = RunSource(run_dir)
        self._run = self._source.run
        self._paths.folder.mkdir(exist_ok=True)
        try:
            self._lock = RunLock(self._paths.folder)
        except BaseException:
            self._source.close()
            raise

    def close(self) -> None:
        """Let another recorder work. May be called twice."""
        self._lock.release()
        self._source.close()

    def record(self, more: Callable[[], bool] = lambda: False, only: Collection[int] | None = None) -> None:
        """Make what is missing.

        Args:
            more: as long as it says that more generations may come, they are waited for.
            only: nothing but these generations, and no overview.

        Raises:
            RecordingIsDamaged: a file is damaged and is not to be replaced.
            ReplayDiffers: running a trial again did not give the journalled bits.
            DiskFull, OSError: files cannot be written.
        """
        self._partly = only is not None
        self._prepare()
        while True:
            expecting = more()  # asked first: a generation that is finished after this is seen in the next round
            todo = [g for g in self._source.finished() if g not in self._done and (only is None or g in only)]
            self._record_generations(todo)
            if todo and only is None and not self._has_whole_overview():
                self._join_overview()
            if not expecting and not todo:
                break
            if not todo:
                time.sleep(_LOOK_AGAIN_S)
        self._tell(State.FINISHED)

    def _tell(self, state: State) -> None:
        known = len(self._source.finished())
        status = RecorderStatus(state, self._detail, len(self._done), known, self._trials)
        if not self._partly:
            status.write(self._paths.status)
        self._report(status)

    def _prepare(self) -> None:
        """Screens and scenery, and nothing left of a recorder that was killed."""
        paths, run = self._paths, self._run
        rrd.remove_leftovers(paths.folder)
        self._forget_other_forms()
        with rrd.replacing(paths.scenery) as part:
            rrd.write_recording(part, chunks.shared_chunks(run), application_id=run.experiment, recording_id="scenery")
        with rrd.replacing(paths.overview_start) as part:
            start = overview.overview_start(run, self._source.config, self._source.seed, self._source.empty_archive)
            rrd.write_recording(part, start, application_id=self._overview_application, recording_id=run.name)
        with rrd.replacing(paths.trial_blueprint) as part:
            blueprints.trial_blueprint(run).save(run.experiment, str(part))
        with rrd.replacing(paths.table_blueprint) as part:
            blueprints.table_blueprint(run).save(run.experiment, part)
        with rrd.replacing(paths.run_blueprint) as part:
            blueprints.run_blueprint(run).save(self._overview_application, str(part))

    def _forget_other_forms(self) -> None:
        """Recordings of another version of this program would be shown with a scenery that is not theirs."""
        paths = self._paths
        if paths.trials.exists() and (not paths.form.exists() or paths.form.read_text(encoding="ascii") != f"{FORM}\n"):
            for folder in (paths.trials, paths.overview_start.parent):
                shutil.rmtree(folder, ignore_errors=True)
            paths.run.unlink(missing_ok=True)
        paths.form.write_text(f"{FORM}\n", encoding="ascii")

    @property
    def _overview_application(self) -> str:
        return f"{self._run.experiment}-run"

    def _record_generations(self, numbers: list[int]) -> None:
        # rerun works outside Python's lock, so a second thread writes one generation while the next is drawn
        with ThreadPoolExecutor(_WRITERS) as writers:
            writing: deque[tuple[int, Future[int]]] = deque()
            for number in numbers:
                if self._is_recorded(number):
                    self._done.add(number)
                    self._tell(State.RECORDING)
                    continue
                writing.append((number, writers.submit(self._write, self._source.generation(number))))
                if len(writing) > _WRITERS:
                    self._finish(*writing.popleft())
            for number, written in writing:
                self._finish(number, written)

    def _finish(self, number: int, written: Future[int]) -> None:
        self._trials += written.result()
        self._done.add(number)
        self._tell(State.RECORDING)

    def _is_recorded(self, number: int) -> bool:
        return self._is_whole(self._paths.generation(number), self._source.expected_trials(number)) and self._is_whole(
            self._paths.overview(number), 1
        )

    def _write(self, generation: RecordedGeneration) -> int:
        trials = self._write_trials(generation)
        with rrd.replacing(self._paths.overview(generation.row.number)) as part:
            rrd.write_recording(
                part,
                overview.overview_generation(self._run, generation),
                application_id=self._overview_application,
                recording_id=self._run.name,
            )
        return trials

    def _is_whole(self, path: Path, expected: int) -> bool:
        if not path.exists():
            return False
        try:
            found = rrd.check(path, remedy(self._paths.run_dir))
        except RecordingIsDamaged:
            if not self._replace_damaged:
                raise
            return False
        return found >= (expected if self._detail is Detail.ALL else 1)

    def _write_trials(self, generation: RecordedGeneration) -> int:
        wanted = [trial for trial in generation.trials if trial.champion or self._detail is Detail.ALL]
        if not wanted:
            return 0
        path = self._paths.generation(generation.row.number)
        path.parent.mkdir(exist_ok=True)
        return write_trials(self._run, wanted, path)

    def _has_whole_overview(self) -> bool:
        newest = max(self._paths.overview(number).stat().st_mtime_ns for number in self._done)
        run = self._paths.run
        return self._is_whole(run, 1) and run.stat().st_mtime_ns >= newest

    def _join_overview(self) -> None:
        paths = self._paths
        parts = [paths.overview(number) for number in sorted(self._done)]
        rrd.merge([paths.run_blueprint, paths.overview_start, *parts], paths.run)
