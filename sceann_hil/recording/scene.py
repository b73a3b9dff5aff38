"""A robot's drawing in two dimensions: what stands still once for all trials; poses, path and sensors of each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.recording import style
from sceann_hil.recording.columns import poses, scalars, several, static, step_times, timed, times_of
from sceann_hil.recording.trial import RecordedRun, RecordedTrial
from sceann_hil.robot import EndReason
from sceann_hil.robot.drawing import Block, Disc, Distance, Drawing, Fan, Look, Part, Shades, Shape, Strip

SCENE = "/scene"
PATH, TRAIL, PHASE = f"{SCENE}/path", f"{SCENE}/trail", "/phase"
_TURN = np.linspace(0.0, 2.0 * np.pi, 13)
_RING = np.column_stack([np.cos(_TURN), np.sin(_TURN)]).astype(np.float32)
_MOVING_ORDER = 20
"""What moves is drawn above what stands still."""


def entity(drawing: Drawing, part: Part) -> str:
    """Where a part is: below the part that it is fixed to."""
    on = {other.name: other for other in drawing.parts}.get(part.on or "")
    return f"{entity(drawing, on) if on else SCENE}/{part.name}"


def still(drawing: Drawing) -> Iterator[Chunk]:
    """Everything that stands still, and the shapes of what moves."""
    yield from ground(drawing)
    thin = _size(drawing) / 250
    yield static(TRAIL, rr.Points2D.from_fields(colors=style.colours(style.TRAIL), radii=thin * 1.5, draw_order=12))
    yield static(PATH, rr.LineStrips2D.from_fields(colors=style.colours(style.PATH), radii=thin, draw_order=1))
    for part in drawing.parts:
        name = entity(drawing, part)
        for number, shape in enumerate(part.shapes):
            yield from _shape(f"{name}/shape{number}", shape, _MOVING_ORDER + number)
        if part.fans:
            yield static(f"{name}/fans", _fans(part.fans, thin))
    if drawing.phases is not None:
        states = [drawing.phases.blind, drawing.phases.sensing, drawing.phases.goal]
        colours = style.colours(style.BLIND, style.PATH, style.TARGET)
        yield static(PHASE, rr.StateConfiguration(values=states, labels=states, colors=colours))


def ground(drawing: Drawing) -> Iterator[Chunk]:
    """What stands still."""
    # 2D views have y pointing down: one mirror above the scene lets all data stay in true metres with y up
    yield static(SCENE, rr.Transform3D(scale=[1, -1, 1]))
    for number, shape in enumerate(drawing.fixed):
        yield from _shape(f"{SCENE}/fixed/shape{number}", shape, 0)


def moving(run: RecordedRun, drawing: Drawing, trial: RecordedTrial, *, full: bool) -> Iterator[Chunk]:
    """What moved in one trial; `full` lights the sensors' fields and adds trail and arrows."""
    state, n = trial.trace.state, trial.steps
    fields = {name: state[:, k] for k, name in enumerate(run.state_fields)}
    if not all(field in fields for part in drawing.parts for field in (part.x, part.y, part.turn) if field):
        yield from _at_its_start(run, drawing, trial, full=full)
        return
    now = step_times(n + 1, run.tick_s)
    for part in drawing.parts:
        name = entity(drawing, part)
        columns: list[rr.ComponentColumn] = list(_pose(part, fields, n + 1))
        if part.curves:
            # curves belong to the part itself: a chunk less in every recording
            columns = [*columns, *scalars(_curves(part, fields))]
        yield timed(name, now, columns)
        if full and part.fans:
            yield timed(f"{name}/fans", step_times(n, run.tick_s), _fan_colours(trial, len(part.fans)))
        if full and part.arrow is not None:
            motor = trial.trace.x[:, run.size.n_hidden + part.arrow.motor]
            lengths = (2.0 * motor / ONE - 1.0) * part.arrow.length_m
            look = style.colours(style.FORCE)
            still_arrow = rr.Arrows2D.from_fields(
                origins=[[0, 0]], radii=_size(drawing) / 125, colors=look, draw_order=_MOVING_ORDER + 9
            )
            yield static(f"{name}/arrow", still_arrow)
            arrows = rr.Arrows2D.columns(vectors=np.column_stack([lengths, np.zeros(n)]))
            yield timed(f"{name}/arrow", step_times(n, run.tick_s), arrows)
    path = path_of(drawing, fields)
    if path is not None:
        ring = path[0] + _size(drawing) / 60 * _RING
        yield static(PATH, rr.LineStrips2D.from_fields(strips=[path, ring]))
        if full:
            yield timed(TRAIL, now, rr.Points2D.columns(positions=path))
    if drawing.phases is not None:
        steps, names = phases(drawing, trial)
        yield timed(PHASE, times_of(steps, run.tick_s), rr.StateChange.columns(state=names))


def _at_its_start(run: RecordedRun, drawing: Drawing, trial: RecordedTrial, *, full: bool) -> Iterator[Chunk]:
    """The robot where it was put: nobody knows where it went, as with most real ones."""
    fields = {name: np.array([value], np.float32) for name, value in zip(run.start_fields, trial.start, strict=False)}
    if not all(field in fields for part in drawing.parts for field in (part.x, part.y, part.turn) if field):
        return
    for part in drawing.parts:
        name = entity(drawing, part)
        yield timed(name, step_times(1, run.tick_s), _pose(part, fields, 1))
        if full and part.fans:
            yield timed(f"{name}/fans", step_times(trial.steps, run.tick_s), _fan_colours(trial, len(part.fans)))


def curve_names(part: Part) -> tuple[str, ...]:
    """Names of the curves beside the picture."""
    if isinstance(part.curves, Distance):
        return (part.curves.name,)
    return tuple(curve.name for curve in part.curves)


def path_of(drawing: Drawing, fields: dict[str, NDArray[np.float32]]) -> NDArray[np.float32] | None:
    """Where the first part was, shape ``(n + 1, 2)``; None unless it moves in two directions."""
    if not drawing.parts or drawing.parts[0].x is None or drawing.parts[0].y is None:
        return None
    return np.column_stack([fields[drawing.parts[0].x], fields[drawing.parts[0].y]])


def phases(drawing: Drawing, trial: RecordedTrial) -> tuple[NDArray[np.int64], list[str]]:
    """At which steps the sensors began or ceased to read anything, or the goal was reached, and what from then on."""
    words = drawing.phases
    if words is None:
        return np.zeros(0, np.int64), []
    sees = np.asarray(trial.trace.sensors.any(axis=1))
    steps = np.flatnonzero(np.diff(sees, prepend=~sees[:1]))
    names = [words.sensing if sees[k] else words.blind for k in steps]
    if trial.end_reason is EndReason.GOAL:
        steps, names = np.append(steps, trial.steps), [*names, words.goal]
    return steps.astype(np.int64), names


def _pose(part: Part, fields: dict[str, NDArray[np.float32]], rows: int) -> rr.ComponentColumnList:
    zero = np.zeros(rows, np.float32)
    place = None
    if part.x is not None or part.y is not None:
        x = fields[part.x] if part.x is not None else zero
        place = np.column_stack([x, fields[part.y] if part.y is not None else zero, zero])
    turn = None
    if part.turn is not None:
        turn = -fields[part.turn] if part.clockwise else fields[part.turn]
    return poses(place, turn)


def _curves(part: Part, fields: dict[str, NDArray[np.float32]]) -> NDArray[np.float64]:
    if isinstance(part.curves, Distance):
        zero = np.zeros(1, np.float32)
        x = fields[part.x] if part.x is not None else zero
        y = fields[part.y] if part.y is not None else zero
        away = np.hypot(x.astype(np.float64) - part.curves.to_m[0], y.astype(np.float64) - part.curves.to_m[1])
        return np.asarray(away[:, None])
    return np.column_stack([fields[curve.field].astype(np.float64) * curve.factor for curve in part.curves])


def _size(drawing: Drawing) -> float:
    left, right, bottom, top = drawing.bounds_m
    return max(right - left, top - bottom)


_ORDER = {Look.LINE: -8, Look.TARGET: -5, Look.LAMP: 4, Look.WALL: 5, Look.OBSTACLE: 3}


def _shape(name: str, shape: Shape, order: int) -> Iterator[Chunk]:
    if isinstance(shape, Shades):
        rows = np.array(shape.rows, np.float32)[::-1]
        scale = [shape.size_m[0] / rows.shape[1], -shape.size_m[1] / rows.shape[0], 1.0]
        yield static(name, rr.Transform3D(translation=[0.0, shape.size_m[1], 0.0], scale=scale))
        yield static(f"{name}/image", rr.Image(style.shade_image(rows), draw_order=-9))
        return
    colour = style.look_colour(shape.look)
    order += _ORDER.get(shape.look, 0) if order == 0 else 0
    if isinstance(shape, Disc):
        yield static(name, rr.Points2D([shape.at_m], radii=shape.radius_m, colors=colour, draw_order=order))
        if shape.look is Look.TARGET:
            rim = rr.Ellipses2D(
                centers=[shape.at_m],
                half_sizes=[[shape.radius_m] * 2],
                colors=style.colours(style.TARGET),
                line_radii=shape.radius_m / 25,
                draw_order=order + 1,
            )
            yield static(f"{name}/rim", rim)
        return
    strips = filling(shape) if isinstance(shape, Block) else (shape,)
    points, width_m = [strip.points_m for strip in strips], strips[0].width_m
    yield static(name, rr.LineStrips2D(points, radii=width_m / 2, colors=colour, draw_order=order))


_LINES = 12
"""Lines that fill a rectangle: the ends of a line are round, so that one thick line would not have corners."""


def filling(block: Block) -> tuple[Strip, ...]:
    """A rectangle as lines side by side along its longer axis."""
    width, height = block.size_m
    along, across = max(width, height), min(width, height)
    turn = np.exp(1j * (block.angle_rad + (0.0 if width >= height else np.pi / 2)))
    thick = across / _LINES
    half = (along - thick) / 2
    strips = []
    for place in (np.arange(_LINES) - (_LINES - 1) / 2) * thick:
        ends = (complex(*block.at_m) + turn * complex(side * half, place) for side in (-1.0, 1.0))
        strips.append(Strip(tuple((end.real, end.imag) for end in ends), 1.2 * thick, block.look))
    return tuple(strips)


def _fans(fans: tuple[Fan, ...], thin: float) -> rr.LineStrips2D:
    strips = []
    for fan in fans:
        part = np.linspace(-1.0, 1.0, 9 if fan.half_width_rad > 0.0 else 1) * fan.half_width_rad
        rim = np.column_stack([np.cos(fan.direction_rad + part), np.sin(fan.direction_rad + part)]) * fan.reach_m
        origin = np.array([fan.at_m])
        strips.append(np.concatenate([origin, origin + rim, origin]))
    return rr.LineStrips2D.from_fields(strips=strips, radii=thin * 0.6, draw_order=15)


def _fan_colours(trial: RecordedTrial, n_fans: int) -> rr.ComponentColumnList:
    signal = trial.trace.sensors[:, :n_fans] / SENSOR_MAX
    # a distant target gives a tenth of full scale: the square root makes it visible, and seeing nothing stays dark
    shown = np.where(signal > 0, 0.35 + 0.65 * np.sqrt(signal), 0.0)
    colours = rr.LineStrips2D.columns(colors=style.activation_colours(shown).reshape(-1))
    return several(colours, trial.steps, n_fans)
