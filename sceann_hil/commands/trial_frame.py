"""A moment of a trial in characters: the robot in its surroundings, and beside it what its network says."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

import numpy as np
from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.recording.trial import RecordedRun, RecordedTrial
from sceann_hil.robot.drawing import Look
from sceann_hil.robot.raster import Cell, Raster
from sceann_hil.timespans import duration_text

_SIDE, _WIDEST, _NARROWEST = 37, 44, 12
"""Columns beside the picture, and the most and fewest of it."""
_BELOW = 6
"""Lines that are left for a progress bar and what stands below it."""
_STYLES = {
    Look.TARGET: "green",
    Look.LAMP: "bright_yellow",
    Look.LIMIT: "red",
    Look.BODY: "bright_yellow",
    Look.NOSE: "bright_red",
    Look.WHEEL: "yellow",
    Look.CART: "bright_blue",
    Look.TIP: "bright_red",
}
_PATH_STYLE = "cyan"


def frame(run: RecordedRun, trial: RecordedTrial, step: int, console: Console, hint: Text) -> RenderableType:
    """What a terminal shows of a trial after so many steps.

    Args:
        run: that it belongs to.
        trial: the best individual's.
        step: 0 to the trial's steps.
        console: where it is drawn; its size and its characters matter.
        hint: which keys mean something.
    """
    columns, rows = console.size
    room = max(3, rows - _BELOW)
    utf8 = console.encoding.lower().replace("-", "") == "utf8"
    side = Text("\n").join(list(_words(run, trial, step, hint, "█" if utf8 else "#"))[:room])
    side.no_wrap, side.overflow = True, "ellipsis"
    scene = _scene(run, trial, step, min(_WIDEST, columns - _SIDE), room, braille=utf8)
    drawn = Table.grid(padding=(0, 1))
    drawn.add_row(*([scene] if scene is not None else []), side)
    return drawn


def _words(run: RecordedRun, trial: RecordedTrial, step: int, hint: Text, block: str) -> Iterator[Text]:
    yield Text(f"best of generation {trial.generation}", "bold")
    yield Text(f"individual {trial.individual}, trial {trial.trial} (#{trial.id})")
    took = duration_text(trial.steps * run.tick_s)
    if step < trial.steps:
        yield Text(f"{step * run.tick_s:.1f} s of {took}")
    else:
        worth = "" if trial.fitness is None else f", fitness {trial.fitness:.4g}"
        yield Text(f"{trial.end_reason} after {took}{worth}", "bold green")
    yield hint
    yield Text("")
    shown = min(step, trial.steps - 1)
    if shown < 0:
        return
    sensors = (trial.trace.sensors[shown] / SENSOR_MAX).tolist()
    outputs = (trial.trace.x[shown] / ONE).tolist()
    rows = [(run.sensor_names[k], sensors[k]) for k in run.sensors_from_left]
    rows += zip((*run.hidden_names, *run.motor_names), outputs, strict=True)
    for name, value in rows:
        bar = block * round(10 * min(1.0, max(0.0, value)))
        yield Text.assemble(f"{name[:12]:>12} ", (f"{bar:<10}", "cyan"), f" {value:4.2f}")


def _scene(run: RecordedRun, trial: RecordedTrial, step: int, columns: int, rows: int, *, braille: bool) -> Text | None:
    """The robot after so many steps, and its path until then; None where nobody knows where it was."""
    names, state = run.state_fields, trial.trace.state.astype(np.float64)
    if run.drawing is None or columns < _NARROWEST or state.shape[1] != len(names) or not len(state):
        return None
    raster = Raster(run.drawing, columns, rows)
    first = run.drawing.parts[0] if run.drawing.parts else None
    if first is not None and first.x in names and first.y in names:
        raster.path(state[: step + 1][:, [names.index(first.x), names.index(first.y)]])
    raster.parts(dict(zip(names, state[min(step, len(state) - 1)].tolist(), strict=True)))
    text = Text(no_wrap=True)
    for line in raster.lines(braille=braille):
        for style, cells in groupby(line, _style):
            text.append("".join(cell.text for cell in cells), style)
        text.append("\n")
    text.rstrip()
    return text


def _style(cell: Cell) -> str:
    if cell.text == " ":
        return ""
    return _PATH_STYLE if cell.look is None else _STYLES.get(cell.look, "")
