"""What the viewer's screens look like: one trial, the gallery of all trials, and the run over its generations."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import rerun.blueprint as rrb
import rerun.blueprint.table as rrt
from rerun import LineStrips2D, Points2D

from sceann_hil.recording import elites, network, overview, scene, solid, style
from sceann_hil.recording.chunks import PROPERTY
from sceann_hil.recording.columns import GENERATION, STEP, TRIAL_TIME
from sceann_hil.recording.trial import RecordedRun
from sceann_hil.robot.drawing import Distance, Drawing, Part

_DARK = list(style.BACKGROUND)
_LOG_COLUMNS = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
_PLAIN = [
    LineStrips2D.from_fields(colors=style.colours(style.WHEEL)),
    Points2D.from_fields(colors=style.resting_colour()),
]
"""Colours of sensor fields and nodes where a trial has none: their place is shared, their activity is the trial's."""

_UNIT = (-0.05, 1.05)


def trial_blueprint(run: RecordedRun) -> rrb.Blueprint:
    """The screen of one trial: what it did, what it sensed and said, and who it was."""
    neurons = [_curves("Hidden neurons", "/signals/hidden", _UNIT)] if run.size.n_hidden else []
    sensors = _curves("Sensors", "/signals/sensors", _UNIT, legend=run.size.n_sensors <= 5)
    signals = [sensors, *neurons, _curves("Motor outputs", "/signals/motors", _UNIT)]
    if run.accumulation is not None:
        signals += [
            _curves("Value of each step", "/signals/value", legend=False),
            _curves(
                f"Fitness so far ({run.accumulation.combine.replace('_', ' ')} of the values)",
                "/signals/worth",
                legend=False,
            ),
        ]
    about = rrb.TextDocumentView(origin="/info", name="Trial")
    right = rrb.Vertical(_network_view("Controller and its activity"), about, row_shares=[3, 1.5])
    if run.drawing is None:
        return _screen(rrb.Horizontal(rrb.Vertical(*signals), right, column_shares=[4, 3]), TRIAL_TIME, playing=1.0)
    drawing = run.drawing
    flat = _flat_view(drawing, _contents(drawing), drawing.title)
    picture: list[rrb.View | rrb.Container] = [
        rrb.Tabs(flat, _solid_view(drawing)) if drawing.from_above else flat,
    ]
    shares = [7.0]
    if drawing.phases is not None:
        picture.append(rrb.StateTimelineView(origin="/", contents=[scene.PHASE], name="Phase"))
        shares.append(1.1)
    curves = [
        _curves(_curve_title(part), scene.entity(drawing, part), legend=not isinstance(part.curves, Distance))
        for part in reversed(drawing.parts)
        if part.curves
    ]
    if drawing.from_above:
        signals += curves
    else:
        # a drawing from the side is low: there is room below it
        picture += curves
        shares += [3.5] * len(curves)
    left = rrb.Vertical(*picture, row_shares=shares)
    root = rrb.Horizontal(left, rrb.Vertical(*signals), right, column_shares=[4, 3, 3.4])
    return _screen(root, TRIAL_TIME, playing=1.0)


def table_blueprint(run: RecordedRun) -> rrt.TableBlueprint:
    """The gallery: every trial as a playing miniature, best first, to be sorted and filtered by its properties."""
    names = ("fitness", "outcome", "generation", "individual", "trial", "steps", "champion")
    columns = {name: rrt.Column(_property(name), name=name) for name in names}
    replay = rrt.Column("recording link", name="replay", column_type=rrt.PreviewCell(_miniature(run)))
    hidden = [rrt.Column(_property(name), visible=False) for name in ("run", "attempt", "platform", "number")]
    return rrt.TableBlueprint(
        table_layout=rrt.TableLayout(columns=[replay, *columns.values(), *hidden]),
        card_layout=rrt.CardLayout(
            title=_property("title"), fields=[replay, columns["fitness"], columns["outcome"], columns["steps"]]
        ),
        default_layout="cards",
        sort_by=rrt.SortBy(_property("fitness"), direction="Descending"),
        previews_config=rrt.PreviewsConfig(timeline=TRIAL_TIME, play_state="playing", playback_speed=2.0),
    )


def run_blueprint(run: RecordedRun) -> rrb.Blueprint:
    """The screen of a run over its generations."""
    top = run.best_fitness
    shown = (-0.03 * top, 1.03 * top) if isfinite(top) else None
    fitness = _curves("Fitness over generations", "/fitness", shown, legend=False)
    success = _curves("Trials that succeeded", "/success", (-0.03, 1.03), legend=False)
    events = rrb.TextLogView(origin="/log", name="Generations and events", columns=_LOG_COLUMNS)
    left = rrb.Vertical(fitness, success, events, row_shares=[3, 1.5, 1.8])
    right = rrb.Vertical(
        _network_view("Champion's network"),
        rrb.Spatial2DView(origin="/population/weights", name="Connections of everyone, best on top", background=_DARK),
        rrb.BarChartView(
            origin="/population/fitness", name="Fitness, sorted", plot_legend=rrb.PlotLegend(visible=False)
        ),
        rrb.TextDocumentView(origin="/config", name="Run"),
        row_shares=[3, 1.6, 1.2, 1.6],
    )
    everyone = _middle([view for view in (_everyone(run.drawing), _map_view() if run.has_map else None) if view])
    if everyone is None:
        return _screen(rrb.Horizontal(left, right), GENERATION)
    return _screen(rrb.Horizontal(left, everyone, right, column_shares=[3, 4, 3]), GENERATION)


def _middle(views: list[rrb.View]) -> rrb.View | rrb.Container | None:
    if len(views) < 2:
        return views[0] if views else None
    return rrb.Vertical(*views)


def _map_view() -> rrb.View:
    x_range, y_range = elites.BOUNDS
    return rrb.Spatial2DView(
        origin=elites.ELITES,
        name="Map of different controllers",
        background=_DARK,
        visual_bounds=rrb.VisualBounds2D(x_range=x_range, y_range=y_range),
    )


def _everyone(drawing: Drawing | None) -> rrb.View | None:
    """All trials of a generation in one picture, if this robot can be drawn like that."""
    if drawing is None:
        return None
    if drawing.swing is not None:
        (x_range, y_range) = overview.SWING_BOUNDS
        return rrb.Spatial2DView(
            origin="/",
            contents="/swings/**",
            name=f"{drawing.swing.title}, all trials (best bright)",
            background=_DARK,
            visual_bounds=rrb.VisualBounds2D(x_range=x_range, y_range=y_range),
        )
    if not overview.has_paths(drawing):
        return None
    return _flat_view(drawing, [f"{scene.SCENE}/**"], "All trials of this generation (best individual bright)")


def _screen(root: rrb.Container, timeline: str, *, playing: float | None = None) -> rrb.Blueprint:
    return rrb.Blueprint(
        root,
        rrb.TimePanel(state="collapsed", timeline=timeline, playback_speed=playing),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _property(name: str) -> str:
    return f"property:{PROPERTY}:{name}"


def _curves(
    name: str, origin: str, limits: tuple[float, float] | None = None, *, legend: bool = True
) -> rrb.TimeSeriesView:
    axis = rrb.ScalarAxis(range=limits, zoom_lock=True) if limits else None
    return rrb.TimeSeriesView(
        origin=origin,
        contents=f"{origin}/**" if origin == "/fitness" else origin,
        name=name,
        axis_y=axis,
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=legend),
    )


def _contents(drawing: Drawing) -> list[str]:
    """What a flat view shows: everything but the solid things."""
    solids = [f"- {scene.entity(drawing, part)}/solid/**" for part in drawing.parts]
    return [f"{scene.SCENE}/**", f"- {solid.SOLID}/**", *solids]


def _flat_view(drawing: Drawing, contents: Sequence[str], name: str) -> rrb.Spatial2DView:
    trail = [
        rrb.VisibleTimeRange(
            timeline, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
        )
        for timeline in (TRIAL_TIME, STEP)
    ]
    left, right, bottom, top = drawing.bounds_m
    return rrb.Spatial2DView(
        origin="/",
        contents=list(contents),
        name=name,
        background=_DARK,
        # views are y-down, so the mirrored scene lies above the x axis
        visual_bounds=rrb.VisualBounds2D(x_range=[left, right], y_range=[-top, -bottom]),
        overrides={scene.TRAIL: rrb.VisibleTimeRanges(trail)},
        defaults=_PLAIN,
    )


def _solid_view(drawing: Drawing) -> rrb.Spatial3DView:
    left, right, bottom, top = drawing.bounds_m
    width, height = right - left, top - bottom
    moving = [name for part in drawing.parts for name in _solid_part(drawing, part)]
    return rrb.Spatial3DView(
        origin=scene.SCENE,
        contents=[f"{solid.SOLID}/**", *moving],
        name="3D",
        background=_DARK,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            position=[left + 0.3 * width, bottom - 0.5 * height, 0.95 * max(width, height)],
            look_target=[left + width / 2, bottom + 0.45 * height, 0],
            eye_up=[0, 0, 1],
        ),
    )


def _solid_part(drawing: Drawing, part: Part) -> tuple[str, str]:
    name = scene.entity(drawing, part)
    return name, f"{name}/solid/**"


def _curve_title(part: Part) -> str:
    name = part.curves.name.partition(" [")[0] if isinstance(part.curves, Distance) else part.name
    return name.capitalize()


def _network_view(name: str) -> rrb.Spatial2DView:
    x_range, y_range = network.BOUNDS
    return rrb.Spatial2DView(
        origin="/network",
        name=name,
        background=_DARK,
        visual_bounds=rrb.VisualBounds2D(x_range=x_range, y_range=y_range),
        defaults=_PLAIN,
    )


def _miniature(run: RecordedRun) -> rrb.View:
    if run.drawing is None:
        return _curves("Motor outputs", "/signals/motors", _UNIT, legend=False)
    fans = [f"- {scene.entity(run.drawing, part)}/fans" for part in run.drawing.parts if part.fans]
    return _flat_view(run.drawing, [*_contents(run.drawing), f"- {scene.TRAIL}", *fans], run.drawing.title)
