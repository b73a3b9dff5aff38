"""The run over its generations: fitness, success, everyone's paths, the champion's network, the population."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import rerun as rr
import yaml
from numpy.typing import NDArray
from rerun.chunk import Chunk

from sceann_hil.evolution.algorithm import Archive
from sceann_hil.recording import elites, network, scene, style
from sceann_hil.recording.columns import at_generation, once, static
from sceann_hil.recording.source import RecordedGeneration
from sceann_hil.recording.trial import RecordedRun, RecordedTrial
from sceann_hil.robot.drawing import Drawing, Swing

_STRIDE = 3
"""Of this many points of a path one is drawn."""
_SWING_WIDTH, _SWING_HEIGHT = 10.0, 10.0
"""Size of the picture of all swings, in the units of its view."""
SWING_BOUNDS = ((-1.0, 10.4), (-5.6, 5.6))
"""What a view of it should show: x range, y range (y points down)."""


def overview_start(run: RecordedRun, config: str, seed: int, archive: Archive | None = None) -> Iterator[Chunk]:
    """What holds for all generations: styles, surroundings, the run's configuration."""
    yield static("/config", rr.TextDocument(_config_table(run, config, seed), media_type="text/markdown"))
    yield static(
        "/fitness/curve",
        rr.SeriesLines(colors=style.colours(style.BEST, style.MEAN), names=["best", "mean"], widths=2.0),
    )
    yield static(
        "/fitness/everyone",
        rr.SeriesPoints(colors=style.colours(style.EVERYONE), markers="circle", marker_sizes=1.5, names=["everyone"]),
    )
    yield static(
        "/success", rr.SeriesLines(colors=style.colours(style.SUCCESS), names=["part of all trials"], widths=2.0)
    )
    if run.drawing is not None and run.drawing.swing is not None:
        yield from _swing_frame(run, run.drawing.swing)
    elif run.drawing is not None:
        yield from scene.ground(run.drawing)
    yield from network.network_scenery(run)
    if archive is not None:
        yield from elites.map_scenery(archive)


def overview_generation(run: RecordedRun, generation: RecordedGeneration) -> Iterator[Chunk]:
    """One generation's part."""
    row, fitness = generation.row, generation.fitness
    when = at_generation(row.number)
    order = np.argsort(-fitness, kind="stable")
    yield once("/fitness/curve", when, rr.Scalars([fitness.max(), fitness.mean()]))
    yield once("/fitness/everyone", when, rr.Scalars(fitness))
    yield once("/success", when, rr.Scalars([row.success_rate or 0.0]))
    best, mean = f"{fitness.max():.4g} (individual {generation.champion})", f"{fitness.mean():.4g}"
    text = f"generation {row.number}: best {best}, mean {mean}"
    yield once("/log", when, rr.TextLog(text, level="INFO"))
    for number, (kind, message) in enumerate(generation.notes):
        yield once(f"/log/note{number}", when, rr.TextLog(f"{kind}: {message}", level="WARN"))
    yield from _paths(run, generation)
    weights = generation.weights[generation.champion]
    yield once("/network/connections", when, network.connections(weights, run.size, run.sensors_from_left))
    picture = style.weight_image(generation.weights.reshape(len(fitness), -1)[order])
    yield once("/population/weights", when, rr.Image(picture))
    yield once("/population/fitness", when, rr.BarChart(fitness[order], color=style.TRAIL))
    if generation.archive is not None:
        yield from elites.map_of(generation.archive, row.number)


def _paths(run: RecordedRun, generation: RecordedGeneration) -> Iterator[Chunk]:
    """Everyone's trials from red (worst) to blue (best), the champion's on top."""
    drawing = run.drawing
    if drawing is None or not (drawing.swing is not None or has_paths(drawing)):
        return
    moving = (drawing.parts[0].x, drawing.parts[0].y) if drawing.swing is None else (drawing.swing.field,)
    if not set(moving) <= set(run.state_fields):
        # of most real robots nobody knows where they went
        return
    left, right, bottom, top = drawing.bounds_m
    name, thin = scene.SCENE, max(right - left, top - bottom) / 800
    if drawing.swing is not None:
        name, thin = "/swings", 0.012
    ranks = np.argsort(np.argsort(generation.fitness, kind="stable"), kind="stable")
    shades = style.rank_colours(len(ranks))
    everyone = sorted(generation.trials, key=lambda trial: int(ranks[trial.individual]))
    best = [trial for trial in generation.trials if trial.champion]
    when = at_generation(generation.row.number)
    if everyone:
        colours = shades[[ranks[trial.individual] for trial in everyone]]
        strips = [_path(run, drawing, trial) for trial in everyone]
        yield once(f"{name}/paths", when, rr.LineStrips2D(strips, colors=colours, radii=thin, draw_order=1))
    if best:
        strips, colour = [_path(run, drawing, trial) for trial in best], style.colours(style.CHAMPION)
        yield once(f"{name}/champion", when, rr.LineStrips2D(strips, colors=colour, radii=2.5 * thin, draw_order=3))


def has_paths(drawing: Drawing) -> bool:
    """Whether its first part moves in two directions."""
    return bool(drawing.parts) and drawing.parts[0].x is not None and drawing.parts[0].y is not None


def _path(run: RecordedRun, drawing: Drawing, trial: RecordedTrial) -> NDArray[np.float32]:
    fields = {name: trial.trace.state[:, k] for k, name in enumerate(run.state_fields)}
    points: NDArray[np.float32] | None
    if drawing.swing is not None:
        values = fields[drawing.swing.field]
        time = np.arange(len(values)) * (_SWING_WIDTH / run.max_steps)
        height = np.clip(values / drawing.swing.limit, -1.05, 1.05) * (_SWING_HEIGHT / 2)
        points = np.column_stack([time, -height])
    else:
        points = scene.path_of(drawing, fields)
    if points is None:
        return np.zeros((1, 2), np.float32)
    return np.concatenate([points[:-1:_STRIDE], points[-1:]]).astype(np.float32)


def _swing_frame(run: RecordedRun, swing: Swing) -> Iterator[Chunk]:
    half = _SWING_HEIGHT / 2
    lines = [[[0.0, y], [_SWING_WIDTH, y]] for y in (-half, 0.0, half)] + [[[0.0, -half], [0.0, half]]]
    yield static("/swings/frame", rr.LineStrips2D(lines, colors=style.colours(style.WHEEL), radii=0.01))
    places = [[-0.5, -half], [-0.5, 0.0], [-0.5, half], [_SWING_WIDTH, half + 0.25]]
    labels = [f"+{swing.limit_text}", "0", f"-{swing.limit_text}", f"{run.max_steps * run.tick_s:.4g} s"]
    yield static(
        "/swings/frame/labels",
        rr.Points2D(places, radii=0.001, labels=labels, show_labels=True, colors=style.colours(style.LABEL)),
    )


def _config_table(run: RecordedRun, config: str, seed: int) -> str:
    """The configuration's sections as a Markdown table."""
    data = yaml.safe_load(config)
    rows = [("run", f"**{run.name}**"), ("seed", f"**{seed}**")]
    for key, value in data.items() if isinstance(data, dict) else ():
        if isinstance(value, dict):
            inside = ", ".join(f"{k} **{v}**" for k, v in value.items() if not isinstance(v, dict | list))
            rows.append((str(key), inside))
    return "| | |\n|---|---|\n" + "\n".join(f"| {key} | {value} |" for key, value in rows)
