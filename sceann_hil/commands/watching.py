"""``--watch``: the best of every generation, shown again between the generations, while evolution waits for it.

In the terminal it is drawn in characters; with ``--live`` the viewer shows it too. Whoever explains can pause with a
key.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console, RenderableType
from rich.text import Text

from sceann_hil.commands.trial_frame import frame
from sceann_hil.errors import ViewerUnavailable
from sceann_hil.recording.source import RunSource
from sceann_hil.recording.trial import RecordedTrial
from sceann_hil.robot import TrialObserver
from sceann_hil.run.experiment import Progress
from sceann_hil.supervision.operators.hits import KeySource
from sceann_hil.supervision.operators.keys import open_keys
from sceann_hil.supervision.stopping import StopRequest

FRAME_S = 0.05
HOLD_S = 0.6
"""The end of a trial stays at least so long."""
_PAUSE, _GO_ON, _NEXT, _FINISH = "p", "c", "s", "f"
_HINT = Text(f"[{_PAUSE}] pause  [{_NEXT}] skip  [{_FINISH}] finish", "dim")
_SOON = Text(f"will pause; [{_GO_ON}] go on  [{_NEXT}] skip", "yellow")
_PAUSED = Text(f"PAUSED [{_GO_ON}] go on [{_NEXT}] step [{_FINISH}] finish", "bold yellow")

Watching = Annotated[
    bool,
    typer.Option("--watch", help="Show the best of every generation again, in the terminal; p pauses, c goes on."),
]
WatchSeconds = Annotated[
    float,
    typer.Option("--watch-s", min=0.1, metavar="SECONDS", help="With --watch: how long a trial is shown at most."),
]
WATCH_S = 3.0


class Watch:
    """Shows trials again; a picture of the newest one is always there to be drawn.

    Args:
        source: the run.
        console: where it is drawn; only its size and its characters matter here.
        keys: where keys come from; None where they belong to somebody else.
        stop: what the command line wants; whoever wants to stop ends a replay and a pause.
        each_s: how long a trial is shown at most. A shorter one is shown as long as it took.
        viewer: told the steps while they are shown.
    """

    def __init__(
        self,
        source: RunSource,
        console: Console,
        keys: KeySource | None,
        stop: Callable[[], StopRequest],
        each_s: float,
        viewer: TrialObserver | None = None,
    ) -> None:
        self._source = source
        self._console = console
        self._keys = keys
        self._stop = stop
        self._each_s = each_s
        self._viewer = viewer
        self._picture: RenderableType = Text("")
        self._pausing = self._finishing = False

    def picture(self) -> RenderableType:
        """What there is to see now."""
        return self._picture

    def request(self) -> StopRequest:
        """What is wanted here, or at the command line."""
        wanted = self._stop()
        return StopRequest.AFTER_GENERATION if self._finishing and wanted is StopRequest.NONE else wanted

    def after(self, report: Callable[[Progress], None]) -> Callable[[Progress], None]:
        """Another display's function for `Experiment.evolve` to report to, and then `show`."""

        def both(progress: Progress) -> None:
            report(progress)
            self.show(progress)

        return both

    def show(self, progress: Progress) -> None:
        """Show the best of a generation that has just finished, and wait if somebody wants to explain."""
        trials = self._source.trials_of_best(progress.generation.number)
        if not trials:
            return
        # over the generations every start has its turn
        trial = trials[progress.generation.number % len(trials)]
        self._replay(trial)
        self._draw(trial, trial.steps, paused=self._pausing)
        while self._pausing and not self._leaving and self._key() != _NEXT:
            pass
        self._draw(trial, trial.steps)

    @property
    def _leaving(self) -> bool:
        return self.request() is not StopRequest.NONE

    def _replay(self, trial: RecordedTrial) -> None:
        if self._viewer is not None:
            self._viewer.begin(trial.id)
        takes_s = min(trial.steps * self._source.run.tick_s, self._each_s)
        began_s, told, key = time.monotonic(), 0, ""
        while key != _NEXT and not self._leaving:
            passed_s = time.monotonic() - began_s
            now = trial.steps if passed_s >= takes_s else int(passed_s / takes_s * trial.steps)
            self._draw(trial, now)
            told = self._tell(trial, told, now)
            if passed_s >= takes_s + HOLD_S:
                break
            key = self._key()
        if self._viewer is not None:
            self._tell(trial, told, trial.steps)
            self._viewer.end()

    def _tell(self, trial: RecordedTrial, first: int, last: int) -> int:
        """Pass steps on to the viewer; with which it has to go on."""
        if self._viewer is not None:
            for step in range(first, last):
                self._viewer.step(step, trial.trace.sensors[step], trial.trace.state[step])
        return last

    def _key(self) -> str:
        """Obey the key that is hit during a frame, and say which it was."""
        if self._keys is None:
            time.sleep(FRAME_S)
            return ""
        try:
            hit = self._keys.read(FRAME_S)
        except EOFError:
            # nobody can end a pause any more
            self._keys, self._pausing = None, False
            return ""
        key = hit.key if hit is not None else ""
        if key in (_PAUSE, _GO_ON):
            self._pausing = key == _PAUSE
        self._finishing = self._finishing or key == _FINISH
        return key

    def _draw(self, trial: RecordedTrial, step: int, *, paused: bool = False) -> None:
        hint = Text("") if self._keys is None else _PAUSED if paused else _SOON if self._pausing else _HINT
        self._picture = frame(self._source.run, trial, step, self._console, hint)


def must_be_a_terminal(console: Console) -> None:
    """Refuse to draw where nobody could see it.

    Raises:
        ViewerUnavailable: standard error is no terminal.
    """
    if not console.is_terminal:
        raise ViewerUnavailable(
            "--watch: expected a terminal to draw in, got a file or a pipe.",
            "Leave --watch out; `sceann view RUN --run` shows every generation afterwards.",
        )


@contextmanager
def watched(
    directory: Path,
    console: Console,
    stop: Callable[[], StopRequest],
    each_s: float | None,
    *,
    own_keys: bool,
    viewer: TrialObserver | None = None,
) -> Iterator[Watch | None]:
    """A run's `Watch`, for as long as the block lasts.

    Args:
        directory: of the run; its journal exists.
        console, stop, viewer: as for `Watch`.
        each_s: as for `Watch`; None if nobody wants to watch.
        own_keys: nobody else reads the keys.
    """
    if each_s is None:
        yield None
        return
    with ExitStack() as opened:
        source = RunSource(directory)
        opened.callback(source.close)
        keys = open_keys() if own_keys else None
        if keys is not None:
            opened.callback(keys.close)
        yield Watch(source, console, keys, stop, each_s, viewer)
