"""What is in the files is what happened, bit for bit."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import Chunk, RrdReader

from sceann_hil.journal import JournalReader
from sceann_hil.network.controller import ONE
from sceann_hil.recording import Detail, RecordingPaths
from sceann_hil.recording.recorder import Recorder
from sceann_hil.recording.scene import phases
from sceann_hil.recording.source import RunSource
from sceann_hil.recording.trial import RecordedTrial, recording_id
from sceann_hil.robot import EndReason

Recording = dict[str, list[Chunk]]


def record(run_dir: Path, detail: Detail = Detail.ALL) -> RecordingPaths:
    recorder = Recorder(run_dir, detail)
    try:
        recorder.record()
    finally:
        recorder.close()
    return RecordingPaths(run_dir)


def recordings(path: Path) -> dict[str, Recording]:
    """All recordings of a file by id, their chunks by entity."""
    reader = RrdReader(path)
    found: dict[str, Recording] = {}
    for entry in reader.recordings():
        chunks: Recording = found.setdefault(entry.recording_id, {})
        for chunk in reader.stream(store=entry).to_chunks():
            chunks.setdefault(chunk.entity_path, []).append(chunk)
    return found


def column(chunk: Chunk, name: str) -> Any:
    return chunk.to_record_batch().column(name)


def scalars(recording: Recording, entity: str) -> np.ndarray:
    (chunk,) = recording[entity]
    return np.stack(column(chunk, "Scalars:scalars").to_numpy(zero_copy_only=False))


def properties(recording: Recording) -> dict[str, Any]:
    (chunk,) = recording["/__properties/trial"]
    batch = chunk.to_record_batch()
    return {field.name: batch.column(field.name)[0].as_py()[0] for field in batch.schema if "RowId" not in field.name}


def recorded(run_dir: Path, folder: Path) -> Iterator[tuple[RunSource, RecordingPaths]]:
    """A copy of a run with recordings."""
    copy = Path(shutil.copytree(run_dir, folder / "run"))
    source = RunSource(copy)
    yield source, record(copy)
    source.close()


@pytest.fixture(scope="module")
def goal(goal_reach: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[RunSource, RecordingPaths]]:
    yield from recorded(goal_reach, tmp_path_factory.mktemp("goal"))


@pytest.fixture(scope="module")
def pole(pole_balancing: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[RunSource, RecordingPaths]]:
    yield from recorded(pole_balancing, tmp_path_factory.mktemp("pole"))


def pairs(source: RunSource, paths: RecordingPaths) -> Iterator[tuple[RecordedTrial, Recording]]:
    """Every trial and its recording."""
    for number in source.finished():
        found = recordings(paths.generation(number))
        trials = source.generation(number).trials
        assert len(found) == len(trials)
        for trial in trials:
            name = recording_id(source.run.name, number, trial.individual, trial.trial, trial.attempt)
            yield trial, found[name]


@pytest.mark.parametrize("task", ["goal", "pole"])
def test_sensors_and_outputs_are_the_wire_values_and_q10_states(task: str, request: pytest.FixtureRequest) -> None:
    source, paths = request.getfixturevalue(task)
    n_hidden = source.run.size.n_hidden
    for trial, recording in pairs(source, paths):
        q10 = scalars(recording, "/signals/sensors") * ONE
        assert np.array_equal(q10 - (q10 > 511), trial.trace.sensors)
        assert np.array_equal(scalars(recording, "/signals/hidden") * ONE, trial.trace.x[:, :n_hidden])
        assert np.array_equal(scalars(recording, "/signals/motors") * ONE, trial.trace.x[:, n_hidden:])


def test_poses_are_the_states_of_the_body(goal: tuple[RunSource, RecordingPaths]) -> None:
    source, paths = goal
    for trial, recording in pairs(source, paths):
        (chunk,) = recording["/scene/robot"]
        at = np.stack([row[0] for row in column(chunk, "Transform3D:translation").to_pylist()]).astype(np.float32)
        turn = [row[0]["angle"] for row in column(chunk, "Transform3D:rotation_axis_angle").to_pylist()]
        assert np.array_equal(at[:, :2], trial.trace.state[:, :2])
        assert np.array_equal(np.array(turn, np.float32), trial.trace.state[:, 2])


def test_cart_and_pole_are_the_states_of_the_body(pole: tuple[RunSource, RecordingPaths]) -> None:
    source, paths = pole
    for trial, recording in pairs(source, paths):
        assert np.array_equal(scalars(recording, "/scene/cart"), trial.trace.state[:, :2])
        (chunk,) = recording["/scene/cart/pole"]
        turn = [row[0]["angle"] for row in column(chunk, "Transform3D:rotation_axis_angle").to_pylist()]
        assert np.array_equal(-np.array(turn, np.float32), trial.trace.state[:, 2])


@pytest.mark.parametrize("task", ["goal", "pole"])
def test_both_timelines_count_ticks_from_the_start(task: str, request: pytest.FixtureRequest) -> None:
    source, paths = request.getfixturevalue(task)
    for trial, recording in pairs(source, paths):
        (chunk,) = recording["/signals/motors"]
        steps = column(chunk, "step").to_numpy()
        nanoseconds = column(chunk, "trial_time").to_numpy(zero_copy_only=False).astype(np.int64)
        assert np.array_equal(steps, np.arange(trial.steps))
        assert np.array_equal(nanoseconds, np.rint(steps * source.run.tick_s * 1e9).astype(np.int64))


@pytest.mark.parametrize("task", ["goal", "pole"])
def test_properties_say_what_the_journal_says(task: str, request: pytest.FixtureRequest) -> None:
    source, paths = request.getfixturevalue(task)
    journal = JournalReader(paths.run_dir)
    for trial, recording in pairs(source, paths):
        row = journal.attempt(trial.id)
        best = int(journal.fitness(row.generation).argmax())
        assert row.end_reason is not None
        assert properties(recording) == {
            "title": trial.title,
            "run": source.run.name,
            "number": row.id,
            "generation": row.generation,
            "individual": row.individual,
            "trial": row.trial,
            "attempt": row.attempt,
            "fitness": row.fitness,
            "outcome": row.end_reason.name.lower(),
            "steps": row.steps,
            "champion": row.individual == best,
            "platform": source.run.robot,
        }
    journal.close()


def test_a_champion_has_full_detail_and_others_do_not(goal: tuple[RunSource, RecordingPaths]) -> None:
    source, paths = goal
    for trial, recording in pairs(source, paths):
        full = {"/scene/robot/fans", "/scene/trail", "/network/nodes"}
        assert full & set(recording) == (full if trial.champion else set())


def test_phases_follow_the_sensors_and_end_at_the_target(goal: tuple[RunSource, RecordingPaths]) -> None:
    source, paths = goal
    reached = 0
    for trial, recording in pairs(source, paths):
        (chunk,) = recording["/phase"]
        names = [row[0] for row in column(chunk, "StateChange:state").to_pylist()]
        steps, expected = phases(source.run.drawing, trial)
        assert names == expected
        assert np.array_equal(column(chunk, "step").to_numpy(), steps)
        assert steps[0] == 0
        assert (names[-1] == "at the target") == (trial.end_reason is EndReason.GOAL)
        reached += trial.end_reason is EndReason.GOAL
    assert reached, "the fixture should have a trial that reaches the target"


def test_the_overview_holds_every_generation(goal: tuple[RunSource, RecordingPaths]) -> None:
    source, paths = goal
    (recording,) = recordings(paths.run).values()
    for entity, of in (("/fitness/everyone", lambda g: g.fitness), ("/success", lambda g: [g.row.success_rate])):
        found: dict[int, np.ndarray] = {}
        for chunk in recording[entity]:
            if chunk.is_static:
                continue
            rows = column(chunk, "Scalars:scalars").to_numpy(zero_copy_only=False)
            found |= dict(zip(column(chunk, "generation").to_pylist(), rows, strict=True))
        assert sorted(found) == source.finished()
        for number, values in found.items():
            assert np.array_equal(values, of(source.generation(number)))
