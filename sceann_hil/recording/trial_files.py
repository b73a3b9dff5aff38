"""Trials of a generation as one file, with a recording for each of them."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from sceann_hil.recording import chunks, rrd
from sceann_hil.recording.trial import RecordedRun, RecordedTrial, recording_id


def write_trials(run: RecordedRun, trials: Sequence[RecordedTrial], path: Path) -> int:
    """Write trials, at least one, into a file.

    Args:
        run: that they belong to.
        trials: in the order that they get in the file.
        path: the file; what is needed meanwhile is beside it.

    Returns:
        How many they are.

    Raises:
        DiskFull, OSError: it cannot be written.
    """
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".parts-") as folder:
        rrd.join([_write_trial(run, trial, Path(folder)) for trial in trials], path)
    return len(trials)


def _write_trial(run: RecordedRun, trial: RecordedTrial, folder: Path) -> Path:
    path = folder / f"{trial.id}.rrd"
    rrd.write_recording(
        path,
        chunks.trial_chunks(run, trial, full=trial.champion),
        application_id=run.experiment,
        recording_id=recording_id(run.name, trial.generation, trial.individual, trial.trial, trial.attempt),
    )
    return path
