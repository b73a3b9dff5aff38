"""`evolve --watch`: the best of every generation again, in a terminal and for the viewer, and pauses to explain."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from rich.console import Console

from sceann_hil.commands.evolve import evolve as evolve_command
from sceann_hil.commands.watching import Watch
from sceann_hil.errors import ExitCode, ViewerUnavailable
from sceann_hil.journal import JournalReader
from sceann_hil.recording.source import RunSource
from sceann_hil.run.experiment import Progress
from sceann_hil.supervision.operators.hits import Hit
from sceann_hil.supervision.stopping import StopRequest, nobody
from tests.runs import GOAL, POLE, evolve
from tests.terminal import terminal

LAST = 3


class Keys:
    """Keys that are hit one by one, and then no more."""

    def __init__(self, *keys: str) -> None:
        self.left = list(keys)

    def read(self, timeout_s: float) -> Hit | None:
        if not self.left:
            raise EOFError
        return Hit(self.left.pop(0))

    def drop(self) -> None:
        """There is nothing to drop."""

    def close(self) -> None:
        """There is nothing to close."""


class Viewer:
    """Counts what it is told."""

    def __init__(self) -> None:
        self.told: list[tuple[str, int]] = []

    def begin(self, trial_id: int) -> None:
        self.told.append(("begin", trial_id))

    def step(self, step: int, sensors: NDArray[np.uint16], state: NDArray[np.float32]) -> None:
        assert sensors.size == 3
        assert state.size == 3
        self.told.append(("step", step))

    def end(self) -> None:
        self.told.append(("end", 0))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("runs") / "goal"
    evolve(directory, GOAL)
    return directory


@pytest.fixture
def source(run: Path) -> Iterator[RunSource]:
    source = RunSource(run)
    yield source
    source.close()


def progress(run: Path, number: int) -> Progress:
    reader = JournalReader(run)
    champion = max(reader.individuals(number), key=lambda row: row.fitness or 0.0)
    found = Progress(reader.generations(finished=True)[number], LAST, 18, champion)
    reader.close()
    return found


def drawn(watch: Watch, columns: int = 80) -> str:
    console = Console(width=columns, height=24, record=True, file=io.StringIO())
    console.print(watch.picture())
    return console.export_text()


def test_the_best_of_a_generation_is_shown_as_it_was(run: Path, source: RunSource) -> None:
    watch = Watch(source, Console(width=80, height=24), None, nobody, 0.01)
    for number in range(LAST + 1):
        watch.show(progress(run, number))
        trials = source.trials_of_best(number)
        shown = trials[number % len(trials)]
        text = drawn(watch)
        assert f"best of generation {number}" in text
        assert f"trial {shown.trial} (#{shown.id})" in text
        assert f"fitness {shown.fitness:.4g}" in text
        assert "left" in text
        assert "⡇" in text
        assert max(map(len, text.splitlines())) <= 80


def test_a_terminal_without_braille_and_a_narrow_one_get_what_they_can_show(run: Path, source: RunSource) -> None:
    with Path("/dev/null").open("w", encoding="ascii") as nowhere:
        watch = Watch(source, Console(width=80, height=24, file=nowhere), None, nobody, 0.01)
        watch.show(progress(run, 0))
        assert drawn(watch).replace("°", "").isascii()
        narrow = Watch(source, Console(width=40, height=10, file=nowhere), None, nobody, 0.01)
        narrow.show(progress(run, 0))
        assert "best of generation 0" in drawn(narrow, 40)


def test_the_viewer_is_told_every_step_however_short_it_is_shown(run: Path, source: RunSource) -> None:
    viewer = Viewer()
    shown = source.trials_of_best(1)[1]
    Watch(source, Console(width=80, height=24), None, nobody, 0.01, viewer).show(progress(run, 1))
    assert viewer.told == [("begin", shown.id), *(("step", k) for k in range(shown.steps)), ("end", 0)]


def test_a_pause_lasts_until_somebody_goes_on(run: Path, source: RunSource) -> None:
    keys = Keys("p", "s", "x", "y", "c", "z")
    Watch(source, Console(width=80, height=24), keys, nobody, 60.0).show(progress(run, 0))
    assert keys.left == ["z"]


def test_step_by_step_every_generation_waits(run: Path, source: RunSource) -> None:
    keys = Keys("p", "s", "s", "s", "s", "s", "c", "z")
    watch = Watch(source, Console(width=80, height=24), keys, nobody, 60.0)
    watch.show(progress(run, 0))
    assert len(keys.left) == 5
    watch.show(progress(run, 1))
    assert len(keys.left) == 3
    watch.show(progress(run, 2))
    assert keys.left == ["z"]


def test_whoever_finishes_or_stops_is_not_held_up(run: Path, source: RunSource) -> None:
    watch = Watch(source, Console(width=80, height=24), Keys("p", "f"), nobody, 60.0)
    watch.show(progress(run, 0))
    assert watch.request() is StopRequest.AFTER_GENERATION
    stopped = Watch(source, Console(width=80, height=24), Keys("p"), lambda: StopRequest.NOW, 60.0)
    stopped.show(progress(run, 0))
    assert stopped.request() is StopRequest.NOW


def test_without_anybody_at_the_keys_a_pause_ends(run: Path, source: RunSource) -> None:
    Watch(source, Console(width=80, height=24), Keys("p", "s"), nobody, 60.0).show(progress(run, 0))


def test_it_is_watched_and_paused_in_a_terminal(tmp_path: Path) -> None:
    (tmp_path / "pole.yaml").write_text(POLE)
    arguments = ["evolve", "pole.yaml", "--out", "run", "--record", "none", "--watch", "--watch-s", "0.2"]
    with terminal(arguments, tmp_path) as shown:
        shown.type("p")
        assert shown.until("PAUSED")
        shown.type("s")
        assert shown.until("best of generation 1")
        assert shown.until("PAUSED", after=shown.shown.index("best of generation 1"))
        shown.type("f")
        assert shown.wait() == ExitCode.INTERRUPTED
    assert "Stopped after generation 1, as you asked." in shown.shown


def test_where_there_is_no_terminal_nothing_is_begun(tmp_path: Path) -> None:
    (tmp_path / "pole.yaml").write_text(POLE)
    with pytest.raises(ViewerUnavailable, match="--watch: expected a terminal"):
        evolve_command(tmp_path / "pole.yaml", out=tmp_path / "run", watch=True)
    assert not (tmp_path / "run").exists()
