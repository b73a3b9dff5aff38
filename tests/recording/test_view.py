"""What the viewer shows, looked at without a window. Needs a Vulkan driver (mesa-vulkan-drivers)."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from sceann_hil.errors import NotARun, RecordingIsDamaged, ViewerUnavailable
from sceann_hil.recording import RecordingPaths, view
from sceann_hil.recording.headless import explain_failure, headless_viewer

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
        deadline = 100
        while not (state := client.get_state()).views and deadline:
            deadline -= 1
        names = {v.name for v in state.views}
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
    assert "sceann record" in caught.value.hint


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
    with pytest.raises(ViewerUnavailable, match="graphics driver") as caught, headless_viewer():
        pass
    assert "mesa-vulkan-drivers" in caught.value.hint


def test_any_other_failure_keeps_the_first_line_of_what_the_viewer_said() -> None:
    assert "it broke" in explain_failure("\n  it broke\nbacktrace\n").message
