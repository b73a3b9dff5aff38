"""Everything about one trial as rerun chunks, and what all trials of a run share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from sceann_hil.network.controller import ONE, sensors_to_q10
from sceann_hil.recording import network, scene, solid, style
from sceann_hil.recording.columns import scalars, static, step_times, timed
from sceann_hil.recording.trial import RecordedRun, RecordedTrial

PROPERTY = "trial"
"""Name of the property whose components are what a gallery can be sorted by."""


def trial_chunks(run: RecordedRun, trial: RecordedTrial, *, full: bool) -> Iterator[Chunk]:
    """One trial, for a file or a live viewer.

    Args:
        run: what the trials share.
        trial: with its trace.
        full: also what costs most: sensor cones, trail, and the network's activity.
    """
    yield Chunk.from_property(PROPERTY, rr.AnyValues(drop_untyped_nones=True, **properties(run, trial)))
    yield static("/info", rr.TextDocument(_description(run, trial), media_type="text/markdown"))
    if run.drawing is not None:
        yield from scene.moving(run, run.drawing, trial, full=full)
    yield from _signals(run, trial)
    yield static("/network/connections", network.connections(trial.weights, run.size, run.sensors_from_left))
    if full:
        yield timed("/network/nodes", step_times(trial.steps, run.tick_s), network.activity(run, trial))


def properties(run: RecordedRun, trial: RecordedTrial) -> dict[str, Any]:
    """What a trial can be sorted and filtered by; a void attempt has no fitness."""
    values: dict[str, Any] = {
        "title": trial.title,
        "run": run.name,
        "number": trial.id,
        "generation": trial.generation,
        "individual": trial.individual,
        "trial": trial.trial,
        "attempt": trial.attempt,
        "outcome": trial.end_reason.name.lower(),
        "steps": trial.steps,
        "champion": trial.champion,
        "platform": run.robot,
    }
    if trial.fitness is not None:
        values["fitness"] = float(trial.fitness)
    return values


def shared_chunks(run: RecordedRun) -> Iterator[Chunk]:
    """What all trials share: surroundings, shapes, names and colours of curves."""
    curves: list[tuple[str, tuple[str, ...], NDArray[np.uint32]]] = [
        ("/signals/sensors", run.sensor_names, style.signal_colours(run.size.n_sensors)),
        ("/signals/hidden", run.hidden_names, style.signal_colours(run.size.n_hidden + 3)[3:]),
        ("/signals/motors", run.motor_names, style.motor_colours(run.size.n_motors)),
    ]
    if run.accumulation is not None:
        colours = style.signal_colours(2)
        curves.append(("/signals/value", ("value of the step",), colours[:1]))
        curves.append(("/signals/worth", ("fitness so far",), colours[1:]))
    if run.drawing is not None:
        yield from scene.still(run.drawing)
        yield from solid.solid(run.drawing)
        for part in run.drawing.parts:
            names = scene.curve_names(part)
            curves.append((scene.entity(run.drawing, part), names, style.part_colours(len(names))))
    for path, names, colours in curves:
        if names:
            yield static(path, rr.SeriesLines(colors=colours, names=list(names), widths=1.5))
    yield from network.network_scenery(run)


def _signals(run: RecordedRun, trial: RecordedTrial) -> Iterator[Chunk]:
    """Sensors as the network sees them and neuron outputs, 0..1 in exact multiples of 1/1024."""
    trace, n_hidden = trial.trace, run.size.n_hidden
    now = step_times(trial.steps, run.tick_s)
    yield timed("/signals/sensors", now, scalars(sensors_to_q10(trace.sensors) / ONE))
    if n_hidden:
        yield timed("/signals/hidden", now, scalars(trace.x[:, :n_hidden] / ONE))
    yield timed("/signals/motors", now, scalars(trace.x[:, n_hidden:] / ONE))
    if run.accumulation is not None:
        values = run.accumulation.of_steps(trace, run.size.n_motors)
        yield timed("/signals/value", now, scalars(values[:, None]))
        yield timed("/signals/worth", now, scalars(run.accumulation.so_far(values)[:, None]))


def _description(run: RecordedRun, trial: RecordedTrial) -> str:
    void = "none (void)"
    left = {
        "run": run.name,
        "generation": trial.generation,
        "individual": trial.individual,
        "trial": trial.trial,
        "robot": run.robot,
    }
    right = {
        "fitness": void if trial.fitness is None else f"{trial.fitness:.4g}",
        "outcome": trial.end_reason.name.lower().replace("_", " "),
        "steps": f"{trial.steps} of {run.max_steps}",
        "duration": f"{trial.steps * run.tick_s:.4g} s",
        "best of its generation": "yes" if trial.champion else "no",
    }
    return two_columns(f"Trial {trial.id}", left, right)


def two_columns(title: str, left: Mapping[str, object], right: Mapping[str, object]) -> str:
    """A Markdown table with two key-value pairs per line; `left` has at least as many as `right`."""
    pairs = [f"{key} | **{value}**" for key, value in left.items()]
    others = [f"{key} | **{value}**" for key, value in right.items()]
    others += [" | "] * (len(pairs) - len(others))
    rows = "\n".join(f"| {a} | {b} |" for a, b in zip(pairs, others, strict=True))
    return f"**{title}**\n\n| | | | |\n|---|---|---|---|\n{rows}"
