"""Recordings of a run for the rerun viewer, made from its journal; the only package that imports rerun.

`RecorderProcess` records beside an experiment. `Recorder` (in `recorder`) makes what is missing, `view` shows it.
Importing this package imports neither rerun nor a robot.
"""

from sceann_hil.recording.paths import RecordingPaths
from sceann_hil.recording.process import Detail, RecorderProcess, RecorderStatus, State

__all__ = ["Detail", "RecorderProcess", "RecorderStatus", "RecordingPaths", "State"]
