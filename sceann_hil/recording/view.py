"""Showing a run: the gallery of all trials, one trial, or the overview; in a window, a browser, or a picture."""

from __future__ import annotations

import contextlib
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path

from sceann_hil.errors import NotARun, PackageMissing, RunIsLocked
from sceann_hil.guarded import guarded
from sceann_hil.journal import AttemptRow, JournalReader
from sceann_hil.recording.catalog import catalog
from sceann_hil.recording.display import require_display
from sceann_hil.recording.headless import (
    LOCAL,
    complaints,
    explain_failure,
    headless_viewer,
    wait_for_gallery,
    wait_for_views,
)
from sceann_hil.recording.paths import RecordingPaths
from sceann_hil.recording.process import Detail, RecorderStatus, wait_for_recorder
from sceann_hil.recording.recorder import Recorder, remedy
from sceann_hil.recording.rrd import VIEWER, check, quiet_environment
from sceann_hil.recording.source import RunSource, recorded_name
from sceann_hil.recording.trial import RecordedTrial, recording_id
from sceann_hil.recording.trial_files import write_trials

_MEMORY_LIMIT = "50%"


class Window(Enum):
    """Where the viewer appears."""

    NATIVE = auto()
    """A window of its own."""
    WEB = auto()
    """The default browser."""


@dataclass(frozen=True, slots=True)
class Screen:
    """What to show.

    Attributes:
        trial: this trial's number; None for all of them.
        overview: the run over its generations instead.
    """

    trial: int | None = None
    overview: bool = False


GALLERY = Screen()
OVERVIEW = Screen(overview=True)


def view(
    run_dir: Path,
    screen: Screen = GALLERY,
    window: Window = Window.NATIVE,
    report: Callable[[RecorderStatus], None] = lambda _: None,
) -> None:
    """Show a run and return when the viewer is closed. What has not been recorded is recorded first.

    Args:
        run_dir: the run.
        screen: what to show.
        window: where.
        report: told how far the recording is.

    Raises:
        NotARun: there is no such run or trial, or nothing is recorded.
        RecordingIsDamaged: a file is cut off or unreadable; it is named, with the remedy.
        ViewerUnavailable: the viewer does not start here, and why.
    """
    if window is Window.NATIVE:
        require_display()
    with prepared(run_dir, screen, report) as source:
        _run_viewer(source, window)


def picture(
    run_dir: Path, screen: Screen, file: Path, at: float | None = None, settle_s: float = 1.5
) -> dict[str, list[str]]:
    """Draw a screen into a PNG file; needs no display, but a Vulkan driver (Mesa's software driver will do).

    Args:
        run_dir: the run.
        screen: what to show.
        file: the picture.
        at: where the time cursor stands: a generation in the overview, seconds in a trial; None: as the viewer likes.
        settle_s: how long the viewer gets to draw, before and after the cursor is set.

    Returns:
        What views complained about, by their names: empty if all is well.

    Raises:
        NotARun, RecordingIsDamaged, ViewerUnavailable: as `view`.
    """
    with prepared(run_dir, screen) as source, headless_viewer(source) as client:
        if screen == GALLERY:
            wait_for_gallery(client)
        else:
            wait_for_views(client)
        time.sleep(settle_s)
        if at is not None and screen.overview:
            client.set_time("generation", sequence=int(at), play_state="paused")
        elif at is not None:
            client.set_time("trial_time", duration=at, play_state="paused")
        time.sleep(settle_s)
        file.write_bytes(client.take_screenshot())
        return complaints(client)


@contextlib.contextmanager
def prepared(run_dir: Path, screen: Screen, report: Callable[[RecorderStatus], None] = lambda _: None) -> Iterator[str]:
    """What a viewer must open to show a screen: a file, or an address that is served until the end of the block.

    Raises:
        NotARun, RecordingIsDamaged: as `view`.
    """
    paths = RecordingPaths(run_dir)
    try:
        source = RunSource(run_dir)
    except PackageMissing as missing:
        with _recorded_before(paths, screen, missing) as shown:
            yield shown
        return
    try:
        wanted = _wanted(source, screen, run_dir)
        run = source.run
    finally:
        source.close()
    _record_missing(paths, wanted.generations, report)
    if screen.overview:
        yield str(_sound(paths.run, run_dir))
        return
    files = _trial_files(paths, wanted.generations)
    # only whoever looks now sees an unfinished generation so: in a minute there is more of it
    with tempfile.TemporaryDirectory(prefix="sceann-") as now:
        if wanted.so_far:
            files.append(Path(now) / "so-far.rrd")
            write_trials(run, wanted.so_far, files[-1])
        with _served(paths, files, run.name, wanted.shown) as address:
            yield address


def _trial_files(paths: RecordingPaths, generations: set[int] | None) -> list[Path]:
    numbers = paths.recorded_generations() if generations is None else sorted(generations)
    files = [_sound(paths.generation(number), paths.run_dir) for number in numbers]
    for shared in (paths.scenery, paths.trial_blueprint, paths.table_blueprint):
        _present(shared)
    return files


@contextlib.contextmanager
def _served(paths: RecordingPaths, files: Sequence[Path], name: str, row: AttemptRow | None) -> Iterator[str]:
    """The address of one trial, or of all of them."""
    with catalog(paths, files) as served:
        if row is None:
            yield served.gallery_url
        else:
            yield served.trial_url(recording_id(name, row.own_generation, row.individual, row.trial, row.attempt))


@contextlib.contextmanager
def _recorded_before(paths: RecordingPaths, screen: Screen, missing: PackageMissing) -> Iterator[str]:
    """What was recorded while everything that the run needs was installed."""
    reader = JournalReader(paths.run_dir)
    try:
        row = reader.attempt(screen.trial) if screen.trial is not None else None
        name = recorded_name(reader.run())
    finally:
        reader.close()
    generations = None if row is None else {row.own_generation}
    wanted = [paths.run] if screen.overview else [paths.generation(number) for number in generations or ()]
    if not all(file.exists() for file in wanted) or not (screen.overview or paths.recorded_generations()):
        raise missing
    if screen.overview:
        yield str(_sound(paths.run, paths.run_dir))
        return
    with _served(paths, _trial_files(paths, generations), name, row) as address:
        yield address


@dataclass(frozen=True, slots=True)
class _Wanted:
    """What a screen needs.

    Attributes:
        shown: the trial that it shows; None for all of them.
        generations: whose files it needs; None for all that are finished.
        so_far: trials of the generation that is not finished.
    """

    shown: AttemptRow | None
    generations: set[int] | None
    so_far: Sequence[RecordedTrial]


def _wanted(source: RunSource, screen: Screen, run_dir: Path) -> _Wanted:
    finished = source.finished()
    if screen.trial is not None:
        shown = source.attempt(screen.trial)
        if shown.fitness is not None and shown.generation in finished:
            return _Wanted(shown, {shown.own_generation}, ())
        so_far = source.trials_so_far()
        if shown.id not in {trial.id for trial in so_far}:
            raise NotARun(
                f"Trial {shown.id} cannot be shown: it does not count, or only its result is known.",
                "Choose another trial.",
            )
        return _Wanted(shown, set(), so_far)
    if screen.overview:
        if not finished:
            raise NotARun(
                f"{run_dir} has no finished generation yet.",
                "Wait for the first one, or leave --run out to see trials.",
            )
        return _Wanted(None, None, ())
    so_far = source.trials_so_far()
    if not finished and not so_far:
        raise NotARun(f"{run_dir} has no trial yet that can be shown.", "Wait for the first one.")
    return _Wanted(None, None, so_far)


def _record_missing(
    paths: RecordingPaths, generations: set[int] | None, report: Callable[[RecorderStatus], None]
) -> None:
    """Missing files are made; damaged ones are not touched, because a user should know of them."""
    before = RecorderStatus.read(paths.status)
    detail = before.detail if before and generations is None else Detail.ALL

    def enough() -> bool:
        return generations is not None and all(paths.generation(number).exists() for number in generations)

    # of a run that still goes on, what there is by now is shown
    if not wait_for_recorder(paths.run_dir, report, enough):
        return
    try:
        recorder = Recorder(paths.run_dir, detail, report, replace_damaged=False)
    except RunIsLocked:
        return  # another one has just begun
    try:
        recorder.record(only=generations)
    finally:
        recorder.close()


def _present(path: Path) -> Path:
    if not path.exists():
        raise NotARun(f"{path} is not recorded yet.", "A recorder is at work on this run: try again in a moment.")
    return path


def _sound(path: Path, run_dir: Path) -> Path:
    check(_present(path), remedy(run_dir))
    return path


def _run_viewer(source: str, window: Window) -> None:
    environment = quiet_environment()
    if window is Window.WEB:
        # it opens the browser and prints its address, for those whose browser is elsewhere
        environment["RUST_LOG"] += ",re_sdk::web_viewer=info"
        where = ["--web-viewer", "--web-viewer-port", "0"]
    else:
        where = ["--memory-limit", _MEMORY_LIMIT]
    with tempfile.TemporaryFile() as said:
        command = [str(VIEWER), "--hide-welcome-screen", *LOCAL, "--port", "auto", *where, source]
        errors = None if window is Window.WEB else said
        with guarded(command, errors, environment) as process:
            try:
                code = process.wait()
            except KeyboardInterrupt:
                return
        if code > 0:
            said.seek(0)
            raise explain_failure(said.read().decode(errors="replace"))
