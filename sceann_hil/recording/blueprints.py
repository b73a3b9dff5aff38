"""What the viewer's screens look like: one trial, the gallery of all trials, and the run over its generations."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import rerun.blueprint as rrb
import rerun.blueprint.table as rrt
from rerun import LineStrips2D, Points2D

from sceann_hil.recording import arena, cartpole, network, overview, style
from sceann_hil.recording.chunks import PROPERTY
from sceann_hil.recording.columns import GENERATION, STEP, TRIAL_TIME
from sceann_hil.recording.trial import RecordedRun
from sceann_hil.robot.scenery import ArenaScenery, CartPoleScenery

_DARK = list(style.BACKGROUND)
_LOG_COLUMNS = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
_FLAT = ["/arena/**", "- /arena/solid/**", "- /arena/robot/solid/**"]
_PLAIN = [
    LineStrips2D.from_fields(colors=style.colours(style.WHEEL)),
    Points2D.from_fields(colors=style.resting_colour()),
]
"""Colours of cones and nodes where a trial has none: their place is in the scenery, their activity in the trial."""

_UNIT = (-0.05, 1.05)


def trial_blueprint(run: RecordedRun) -> rrb.Blueprint:
    """The screen of one trial: what it did, what it sensed and said, and who it was."""
    neurons = [_curves("Hidden neurons", "/signals/hidden", _UNIT)] if run.size.n_hidden else []
    sensors = _curves("Sensors", "/signals/sensors", _UNIT, legend=run.size.n_sensors <= 5)
    signals = [sensors, *neurons, _curves("Motor outputs", "/signals/motors", _UNIT)]
    about = rrb.TextDocumentView(origin="/info", name="Trial")
    right = rrb.Vertical(_network_view("Controller and its activity"), about, row_shares=[3, 1.5])
    match run.scenery:
        case ArenaScenery() as scene:
            picture = rrb.Vertical(
                rrb.Tabs(_arena_view(scene, _FLAT), _solid_view(scene)),
                rrb.StateTimelineView(origin="/", contents=["/phase"], name="Phase"),
                row_shares=[7, 1.1],
            )
            signals.append(_curves("Distance to the target", arena.ROBOT, legend=False))
        case CartPoleScenery() as scene:
            body = [_curves("Pole", cartpole.POLE), _curves("Cart", cartpole.CART)]
            picture = rrb.Vertical(_cartpole_view(scene), *body, row_shares=[2, 1, 1])
        case None:
            return _screen(rrb.Horizontal(rrb.Vertical(*signals), right, column_shares=[4, 3]), TRIAL_TIME, playing=1.0)
    root = rrb.Horizontal(picture, rrb.Vertical(*signals), right, column_shares=[4, 3, 3.4])
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
    match run.scenery:
        case ArenaScenery() as scene:
            everyone = _arena_view(scene, ["/arena/**"], "All trials of this generation (best individual bright)")
            root = rrb.Horizontal(left, everyone, right, column_shares=[3, 4, 3])
        case CartPoleScenery():
            (x_range, y_range) = overview.SWING_BOUNDS
            angles = rrb.Spatial2DView(
                origin="/",
                contents="/swings/**",
                name="Pole angle over time, all trials (best bright)",
                background=_DARK,
                visual_bounds=rrb.VisualBounds2D(x_range=x_range, y_range=y_range),
            )
            root = rrb.Horizontal(left, angles, right, column_shares=[3, 4, 3])
        case None:
            root = rrb.Horizontal(left, right)
    return _screen(root, GENERATION)


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


def _arena_bounds(scene: ArenaScenery) -> rrb.VisualBounds2D:
    width, height = scene.arena_m
    margin = max(width, height) / 40
    # views are y-down, so the mirrored arena lies above the x axis
    return rrb.VisualBounds2D(x_range=[-margin, width + margin], y_range=[-height - margin, margin])


def _arena_view(scene: ArenaScenery, contents: Sequence[str], name: str = "Arena") -> rrb.Spatial2DView:
    trail = [
        rrb.VisibleTimeRange(
            timeline, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
        )
        for timeline in (TRIAL_TIME, STEP)
    ]
    return rrb.Spatial2DView(
        origin="/",
        contents=list(contents),
        name=name,
        background=_DARK,
        visual_bounds=_arena_bounds(scene),
        overrides={"/arena/trail": rrb.VisibleTimeRanges(trail)},
        defaults=_PLAIN,
    )


def _solid_view(scene: ArenaScenery) -> rrb.Spatial3DView:
    width, height = scene.arena_m
    return rrb.Spatial3DView(
        origin="/arena",
        contents=["/arena/solid/**", "/arena/robot", "/arena/robot/solid/**"],
        name="3D",
        background=_DARK,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            position=[0.3 * width, -0.5 * height, 0.95 * max(width, height)],
            look_target=[width / 2, 0.45 * height, 0],
            eye_up=[0, 0, 1],
        ),
    )


def _cartpole_view(scene: CartPoleScenery) -> rrb.Spatial2DView:
    half = scene.track_m + 0.2
    return rrb.Spatial2DView(
        origin="/",
        contents="/scene/**",
        name="Cart and pole",
        background=_DARK,
        visual_bounds=rrb.VisualBounds2D(x_range=[-half, half], y_range=[-1.35 * scene.pole_m, 0.35 * scene.pole_m]),
    )


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
    match run.scenery:
        case ArenaScenery() as scene:
            return _arena_view(scene, [*_FLAT, "- /arena/trail", "- /arena/robot/cones"])
        case CartPoleScenery() as scene:
            return _cartpole_view(scene)
        case None:
            return _curves("Motor outputs", "/signals/motors", _UNIT, legend=False)
