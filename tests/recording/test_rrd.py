"""Files are whole or absent, and a damaged one is told apart."""

from __future__ import annotations

from pathlib import Path

import pytest
import rerun as rr

from sceann_hil.errors import DiskFull, ExitCode, RecordingIsDamaged
from sceann_hil.recording import rrd
from sceann_hil.recording.columns import static

REMEDY = "do this"


def write(path: Path, name: str) -> Path:
    text = static("/text", rr.TextDocument(name * 1000))
    rrd.write_recording(path, [text], application_id="test", recording_id=name)
    return path


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    parts = [write(tmp_path / f"{name}.rrd", name) for name in "abc"]
    rrd.join(parts, tmp_path / "joined.rrd")
    return tmp_path / "joined.rrd"


def test_a_joined_file_has_all_recordings(sound: Path) -> None:
    assert rrd.check(sound, REMEDY) == 3


def test_merged_parts_of_one_recording_are_one_recording(tmp_path: Path) -> None:
    parts = [write(tmp_path / f"{i}.rrd", "same") for i in range(3)]
    rrd.merge(parts, tmp_path / "merged.rrd")
    assert rrd.check(tmp_path / "merged.rrd", REMEDY) == 1


@pytest.mark.parametrize("keep", [5, 12, 100, 0.5, 0.99, -1])
def test_a_file_that_is_cut_off_says_so(sound: Path, keep: float) -> None:
    data = sound.read_bytes()
    sound.write_bytes(data[: int(keep * len(data)) if isinstance(keep, float) else keep])
    with pytest.raises(RecordingIsDamaged, match="cut off") as caught:
        rrd.check(sound, REMEDY)
    assert caught.value.exit_code is ExitCode.RECORDING_IS_DAMAGED
    assert str(sound) in caught.value.message
    assert caught.value.hint == REMEDY


def test_an_empty_file_says_so(sound: Path) -> None:
    sound.write_bytes(b"")
    with pytest.raises(RecordingIsDamaged, match="is empty"):
        rrd.check(sound, REMEDY)


def test_another_kind_of_file_says_so(sound: Path) -> None:
    sound.write_bytes(b"SQLite format 3\0" * 100)
    with pytest.raises(RecordingIsDamaged, match="is not a recording"):
        rrd.check(sound, REMEDY)


def test_a_changed_byte_in_the_index_is_found(sound: Path) -> None:
    data = bytearray(sound.read_bytes())
    data[-1500] ^= 0xFF
    sound.write_bytes(data)
    with pytest.raises(RecordingIsDamaged, match="checksum"):
        rrd.check(sound, REMEDY)


def test_a_failure_leaves_the_old_file_and_no_part(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")

    def fail() -> None:
        with rrd.replacing(path) as part:
            part.write_text("half")
            raise KeyError("interrupted")

    with pytest.raises(KeyError):
        fail()
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
    assert path.read_text() == "old"


def test_a_join_of_something_missing_fails_and_leaves_nothing(tmp_path: Path) -> None:
    part = write(tmp_path / "a.rrd", "a")
    with pytest.raises(OSError, match="rerun rrd route failed"):
        rrd.join([part, tmp_path / "absent.rrd"], tmp_path / "joined.rrd")
    assert [p.name for p in tmp_path.iterdir()] == ["a.rrd"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a device that is always full")
def test_a_full_disk_is_called_a_full_disk() -> None:
    with pytest.raises(DiskFull):
        write(Path("/dev/full"), "a")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has a device that is always full")
def test_a_full_disk_is_noticed_also_at_the_end_of_a_join(tmp_path: Path) -> None:
    part = write(tmp_path / "a.rrd", "a")
    with pytest.raises(DiskFull):
        rrd._rrd("route", [part], Path("/dev/full"))


def test_programs_of_rerun_send_no_statistics_and_leave_the_settings_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = write(tmp_path / "a.rrd", "a")
    home = tmp_path / "home"
    home.mkdir()
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME"):
        monkeypatch.setenv(name, str(home))
    rrd.join([part], tmp_path / "joined.rrd")
    assert not list(home.iterdir())


def test_every_flipped_byte_is_noticed(sound: Path) -> None:
    whole = sound.read_bytes()
    for place in range(0, len(whole), max(1, len(whole) // 60)):
        changed = bytearray(whole)
        changed[place] ^= 0x10
        sound.write_bytes(changed)
        with pytest.raises(RecordingIsDamaged):
            rrd.check(sound, REMEDY)
