"""A robot in an arena: walls and target once for all trials; path, pose, sensor cones and phases of each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from sceann_hil.network.controller import SENSOR_MAX
from sceann_hil.recording import style
from sceann_hil.recording.columns import poses, scalars, several, static, step_times, timed, times_of
from sceann_hil.recording.trial import RecordedRun, RecordedTrial
from sceann_hil.robot import EndReason
from sceann_hil.robot.scenery import ArenaScenery

IN_SIGHT, BLIND, AT_TARGET = "target in sight", "blind", "at the target"
_TURN = np.linspace(0.0, 2.0 * np.pi, 13)
_RING = np.column_stack([np.cos(_TURN), np.sin(_TURN)]).astype(np.float32)
ROBOT = "/arena/robot"
"""Entity of the robot: its pose, and its distance to the target as a curve."""
DISTANCE_NAME = "distance to the target [m]"


def arena_scenery(scene: ArenaScenery) -> Iterator[Chunk]:
    """Everything that stands still, and the robot's shape."""
    yield from arena_ground(scene)
    r = scene.body_radius_m
    yield static("/arena/trail", rr.Points2D.from_fields(colors=style.colours(style.TRAIL), radii=r / 7, draw_order=12))
    yield static(
        "/arena/path", rr.LineStrips2D.from_fields(colors=style.colours(style.PATH), radii=r / 10, draw_order=1)
    )
    yield static("/arena/robot/body", rr.Points2D([[0, 0]], radii=r, colors=style.colours(style.BODY), draw_order=20))
    yield static(
        "/arena/robot/nose",
        rr.LineStrips2D([[[0.15 * r, 0], [r, 0]]], radii=0.14 * r, colors=style.colours(style.NOSE), draw_order=22),
    )
    yield static("/arena/robot/cones", _fans(scene))
    wheels = [[[-0.45 * r, side], [0.45 * r, side]] for side in (0.95 * r, -0.95 * r)]
    yield static(
        "/arena/robot/wheels",
        rr.LineStrips2D(wheels, radii=0.17 * r, colors=style.colours(style.WHEEL), draw_order=21),
    )
    states = [BLIND, IN_SIGHT, AT_TARGET]
    colours = style.colours(style.BLIND, style.PATH, style.TARGET)
    yield static("/phase", rr.StateConfiguration(values=states, labels=states, colors=colours))
    yield from _solid(scene)


def arena_ground(scene: ArenaScenery) -> Iterator[Chunk]:
    """Walls and target in two dimensions."""
    # 2D views have y pointing down: one mirror above the arena lets all data stay in true metres with y up
    yield static("/arena", rr.Transform3D(scale=[1, -1, 1]))
    width, height = scene.arena_m
    frame = [[0, 0], [width, 0], [width, height], [0, height], [0, 0]]
    thickness = max(scene.arena_m) / 150
    corners = np.array(frame) + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * thickness
    yield static(
        "/arena/walls",
        rr.LineStrips2D([corners], colors=style.colours(style.WALL), radii=thickness, draw_order=5),
    )
    yield static(
        "/arena/target",
        rr.Points2D(
            [scene.target_m], radii=scene.target_radius_m, colors=style.colours(style.TARGET_FILL), draw_order=-5
        ),
    )
    yield static(
        "/arena/target/rim",
        rr.Ellipses2D(
            centers=[scene.target_m],
            half_sizes=[[scene.target_radius_m] * 2],
            colors=style.colours(style.TARGET),
            line_radii=thickness / 2,
            draw_order=-4,
        ),
    )


def _solid(scene: ArenaScenery) -> Iterator[Chunk]:
    """The same in three dimensions, in subtrees of its own: a view shows either 2D or 3D primitives."""
    (width, height), r = scene.arena_m, scene.body_radius_m
    wall, tall = max(scene.arena_m) / 75, 1.4 * r
    yield static(
        "/arena/solid/walls",
        rr.Boxes3D(
            centers=[
                [width / 2, -wall / 2, tall / 2],
                [width / 2, height + wall / 2, tall / 2],
                [-wall / 2, height / 2, tall / 2],
                [width + wall / 2, height / 2, tall / 2],
            ],
            half_sizes=[[width / 2 + wall, wall / 2, tall / 2]] * 2 + [[wall / 2, height / 2, tall / 2]] * 2,
            colors=style.colours(style.SOLID_WALL),
            fill_mode="solid",
        ),
    )
    yield static(
        "/arena/solid/floor",
        rr.Boxes3D(
            centers=[[width / 2, height / 2, -0.003]],
            half_sizes=[[width / 2, height / 2, 0.002]],
            colors=style.colours(style.FLOOR),
            fill_mode="solid",
        ),
    )
    yield static(
        "/arena/solid/target",
        rr.Cylinders3D(
            centers=[[*scene.target_m, 0.002]],
            lengths=[0.004],
            radii=[scene.target_radius_m],
            colors=style.colours(style.TARGET),
            fill_mode="solid",
        ),
    )
    yield static(
        "/arena/robot/solid/body",
        rr.Cylinders3D(
            centers=[[0, 0, r / 2]], lengths=[r], radii=[r], colors=style.colours(style.BODY), fill_mode="solid"
        ),
    )
    yield static(
        "/arena/robot/solid/nose",
        rr.Boxes3D(
            centers=[[0.6 * r, 0, 1.05 * r]],
            half_sizes=[[0.4 * r, 0.12 * r, 0.08 * r]],
            colors=style.colours(style.NOSE),
            fill_mode="solid",
        ),
    )


def arena_trial(run: RecordedRun, scene: ArenaScenery, trial: RecordedTrial, *, full: bool) -> Iterator[Chunk]:
    """What moved in one trial; `full` lights the sensors' cones and adds the trail."""
    steps, names = phases(trial)
    yield timed("/phase", times_of(steps, run.tick_s), rr.StateChange.columns(state=names))
    if full:
        yield timed("/arena/robot/cones", step_times(trial.steps, run.tick_s), _fan_colours(run, trial))
    if not trial.knows_state:
        yield from _start_only(trial)
        return
    state, n = trial.trace.state, trial.steps
    xy = state[:, :2]
    now = step_times(n + 1, run.tick_s)
    ring = xy[0] + 0.4 * scene.body_radius_m * _RING
    yield static("/arena/path", rr.LineStrips2D.from_fields(strips=[xy, ring]))
    away = np.hypot(*(xy.astype(np.float64) - scene.target_m).T)
    # the distance is a curve of the robot itself: a chunk less in every recording
    pose = poses(np.column_stack([xy, np.zeros(n + 1, np.float32)]), state[:, 2])
    yield timed(ROBOT, now, [*pose, *scalars(away[:, None])])
    if full:
        yield timed("/arena/trail", now, rr.Points2D.columns(positions=xy))


def _start_only(trial: RecordedTrial) -> Iterator[Chunk]:
    """The robot where it was put, all the trial long: nobody knows where it went."""
    if len(trial.start) >= 3:
        x, y, heading = (np.array([value], np.float32) for value in trial.start[:3])
        pose = poses(np.column_stack([x, y, np.zeros(1, np.float32)]), heading)
        yield timed(ROBOT, step_times(1, 1.0), pose)


def phases(trial: RecordedTrial) -> tuple[NDArray[np.int64], list[str]]:
    """The steps at which the robot found or lost sight of the target, or reached it, and what it did from then on."""
    sees = np.asarray(trial.trace.sensors.any(axis=1))
    steps = np.flatnonzero(np.diff(sees, prepend=~sees[:1]))
    names = [IN_SIGHT if sees[k] else BLIND for k in steps]
    if trial.end_reason is EndReason.GOAL:
        steps, names = np.append(steps, trial.steps), [*names, AT_TARGET]
    return steps.astype(np.int64), names


def _fans(scene: ArenaScenery) -> rr.LineStrips2D:
    """One fan per sensor."""
    reach = 0.3 * max(scene.arena_m)
    part = np.linspace(-1.0, 1.0, 9) * scene.sensor_half_width_rad
    fans = []
    for direction in scene.sensor_directions_rad:
        rim = reach * np.column_stack([np.cos(direction + part), np.sin(direction + part)])
        fans.append(np.concatenate([[[0.0, 0.0]], rim, [[0.0, 0.0]]]))
    return rr.LineStrips2D.from_fields(strips=fans, radii=scene.body_radius_m / 20, draw_order=15)


def _fan_colours(run: RecordedRun, trial: RecordedTrial) -> rr.ComponentColumnList:
    signal = trial.trace.sensors / SENSOR_MAX
    # a distant target gives a tenth of full scale: the square root makes it visible, and seeing nothing stays dark
    shown = np.where(signal > 0, 0.35 + 0.65 * np.sqrt(signal), 0.0)
    colours = rr.LineStrips2D.columns(colors=style.activation_colours(shown).reshape(-1))
    return several(colours, trial.steps, run.size.n_sensors)
