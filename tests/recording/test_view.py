"""What the viewer shows, looked at without a window. Needs a Vulkan driver (mesa-vulkan-drivers)."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from sceann_hil.errors import NotARun, RecordingIsDamaged, ViewerUnavailable
from sceann_hil.recording import RecordingPaths, blueprints, rrd, view
from sceann_hil.recording.chunks import shared_chunks, trial_chunks
from sceann_hil.recording.headless import complaints, explain_failure, headless_viewer, wait_for_views
from sceann_hil.recording.source import RunSource

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def recorded(goal_reach: Path, pole_balancing: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("recorded")
    return {
        "goal": Path(shutil.copytree(goal_reach, folder / "goal")),
        "pole": Path(shutil.copytree(pole_balancing, folder / "pole")),
    }


@pytest.mark.parametrize("task", ["goal", "pole"])
@pytest.mark.parametrize(
    ("screen", "at"),
    [(view.Screen(trial=1), 1.0), (view.OVERVIEW, 1), (view.GALLERY, None)],
    ids=["trial", "overview", "gallery"],
)
def test_no_view_reports_an_error(
    recorded: dict[str, Path], task: str, screen: view.Screen, at: float | None, tmp_path: Path
) -> None:
    file = tmp_path / "picture.png"
    assert view.picture(recorded[task], screen, file, at) == {}
    assert file.read_bytes().startswith(PNG)
    assert file.stat().st_size > 20_000, "an empty screen"


def test_the_trial_screen_has_its_views_and_both_timelines(recorded: dict[str, Path]) -> None:
    with view.prepared(recorded["goal"], view.Screen(trial=1)) as source, headless_viewer(source) as client:
        wait_for_views(client)
        names = {shown.name for shown in client.get_state().views}
    assert {"Arena", "Phase", "Sensors", "Hidden neurons", "Motor outputs", "Trial"} <= names


def test_a_run_that_was_not_recorded_is_recorded_when_it_is_shown(run: Path) -> None:
    with view.prepared(run, view.OVERVIEW) as source:
        assert Path(source) == RecordingPaths(run).run
    assert RecordingPaths(run).recorded_generations() == [0, 1, 2]


def test_showing_one_trial_records_only_its_generation(run: Path) -> None:
    with view.prepared(run, view.Screen(trial=14)) as source:
        assert source.endswith("segment_id=goal-reach-5_g001_i00_t1")
    assert RecordingPaths(run).recorded_generations() == [1]


@pytest.mark.parametrize("screen", [view.GALLERY, view.Screen(trial=14), view.OVERVIEW], ids=str)
def test_a_damaged_recording_is_named_with_its_remedy(run: Path, screen: view.Screen) -> None:
    with view.prepared(run, view.GALLERY):
        pass
    path = RecordingPaths(run).run if screen.overview else RecordingPaths(run).generation(1)
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(RecordingIsDamaged) as caught, view.prepared(run, screen):
        pass
    assert str(path) in caught.value.message
    assert f"sceann record {run}" in caught.value.hint


def test_an_unknown_trial_is_refused(run: Path) -> None:
    with pytest.raises(NotARun, match="has no trial 99"), view.prepared(run, view.Screen(trial=99)):
        pass


def test_no_display_is_told_before_anything_is_recorded(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(ViewerUnavailable, match="no display") as caught:
        view.view(run)
    assert "--web" in caught.value.hint
    assert RecordingPaths(run).recorded_generations() == []


def test_a_missing_graphics_driver_is_told_with_the_package_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES"):
        monkeypatch.setenv(name, "/nonexistent")
    with pytest.raises(ViewerUnavailable, match="graphics driver") as caught, headless_viewer() as client:
        wait_for_views(client)
    assert "mesa-vulkan-drivers" in caught.value.hint


@pytest.mark.parametrize(
    "said",
    [
        "Error: winit EventLoopError: neither WAYLAND_DISPLAY nor WAYLAND_SOCKET nor DISPLAY is set.",
        "Error: winit EventLoopError: os error: Failed to open connection to X server",
    ],
)
def test_a_window_that_cannot_be_opened_is_a_missing_display(said: str) -> None:
    assert "display" in explain_failure(said).message


def test_any_other_failure_keeps_the_first_line_of_what_the_viewer_said() -> None:
    assert "it broke" in explain_failure("\n  it broke\nbacktrace\n").message


def test_a_robot_that_nothing_is_known_of_shows_its_signals_and_network(run: Path, tmp_path: Path) -> None:
    source = RunSource(run)
    plain = replace(source.run, drawing=None)
    trial = source.generation(0).trials[0]
    source.close()
    scenery, recording, screen = (tmp_path / name for name in ("scenery.rrd", "trial.rrd", "trial.rbl"))
    for path, chunks in (
        (scenery, shared_chunks(plain)),
        (recording, trial_chunks(plain, trial, full=True)),
    ):
        rrd.write_recording(path, chunks, application_id=plain.experiment, recording_id=path.stem)
    blueprints.trial_blueprint(plain).save(plain.experiment, str(screen))
    with headless_viewer("--asset", scenery, recording, screen) as client:
        wait_for_views(client)
        assert complaints(client) == {}
        names = {shown.name for shown in client.get_state().views}
    assert names == {"Sensors", "Hidden neurons", "Motor outputs", "Controller and its activity", "Trial"}
