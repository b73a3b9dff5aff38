"""A cart with a pole: the track once for all trials; cart, pole and force of each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from sceann_hil.network.controller import ONE
from sceann_hil.recording import style
from sceann_hil.recording.columns import poses, scalars, static, step_times, timed
from sceann_hil.recording.trial import RecordedRun, RecordedTrial
from sceann_hil.robot.scenery import CartPoleScenery

CART, POLE = "/scene/cart", "/scene/cart/pole"
"""Entities of cart and pole: where they are, and that as curves."""
CART_NAMES = ("x [m]", "speed [m/s]")
POLE_NAMES = ("angle [deg]", "rate [10 deg/s]")
FORCE_NAME = "force [N]"
_RAIL_Y = -0.11


def cartpole_scenery(scene: CartPoleScenery) -> Iterator[Chunk]:
    """Track, limits, and the shapes of cart and pole."""
    end, length = scene.track_m, scene.pole_m
    yield static("/scene", rr.Transform3D(scale=[1, -1, 1]))
    rail = [[[-end, _RAIL_Y], [end, _RAIL_Y]], *([[s * end, _RAIL_Y - 0.1], [s * end, 0.15]] for s in (-1, 1))]
    yield static("/scene/track", rr.LineStrips2D(rail, colors=style.colours(style.WALL), radii=0.012))
    marks = np.arange(np.ceil(-end / 0.5), np.floor(end / 0.5) + 1) * 0.5
    yield static(
        "/scene/track/marks",
        rr.LineStrips2D(
            [np.array([[x, _RAIL_Y], [x, _RAIL_Y - 0.05]]) for x in marks],
            colors=style.colours(style.MARK),
            radii=0.005,
        ),
    )
    tilt = scene.largest_angle_rad * np.array([-1.0, 1.0])
    limits = [1.15 * length * np.array([[0.0, 0.0], [np.sin(a), np.cos(a)]]) for a in tilt]
    yield static(
        "/scene/cart/limits", rr.LineStrips2D(limits, colors=style.colours(style.LIMIT), radii=0.006, draw_order=1)
    )
    yield static(
        "/scene/cart/body",
        rr.LineStrips2D([[[-0.16, 0], [0.16, 0]]], colors=style.colours(style.PATH), radii=0.075, draw_order=3),
    )
    yield static(
        "/scene/cart/wheels",
        rr.Points2D([[-0.12, -0.07], [0.12, -0.07]], radii=0.035, colors=style.colours(style.MARK), draw_order=4),
    )
    yield static(
        "/scene/cart/pole/rod",
        rr.LineStrips2D([np.array([[0, 0], [0, length]])], colors=style.colours(style.BODY), radii=0.022, draw_order=5),
    )
    yield static(
        "/scene/cart/pole/ends",
        rr.Points2D(
            np.array([[0, length], [0, 0]]),
            radii=[0.045, 0.03],
            colors=style.colours(style.FORCE, style.WALL),
            draw_order=6,
        ),
    )


def cartpole_trial(run: RecordedRun, scene: CartPoleScenery, trial: RecordedTrial, *, full: bool) -> Iterator[Chunk]:
    """What moved in one trial; `full` adds the force as an arrow."""
    if not trial.knows_state:
        return
    state, n = trial.trace.state, trial.steps
    x, speed, angle, rate = state.T
    now = step_times(n + 1, run.tick_s)
    zero = np.zeros_like(x)
    place = poses(np.column_stack([x, zero, zero]))
    yield timed(CART, now, [*place, *scalars(np.column_stack([x, speed]))])
    # a positive angle leans to the right, a positive turn goes to the left
    lean = poses(None, -angle)
    yield timed(POLE, now, [*lean, *scalars(np.rad2deg(np.column_stack([angle, rate / 10]).astype(np.float64)))])
    if full:
        force = (2.0 * trial.trace.x[:, -1] / ONE - 1.0) * scene.largest_force_n
        arrows = np.column_stack([force * (0.6 / scene.largest_force_n), np.zeros(n)])
        yield static(
            "/scene/cart/force",
            rr.Arrows2D.from_fields(origins=[[0, 0]], radii=0.02, colors=style.colours(style.FORCE), draw_order=9),
        )
        yield timed("/scene/cart/force", step_times(n, run.tick_s), rr.Arrows2D.columns(vectors=arrows))
