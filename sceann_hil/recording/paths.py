"""Where a run's recordings are. Everything in this folder is derived: it can be deleted and made again."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from sceann_hil.run.experiment import RECORDING_NAME

_GENERATION = re.compile(r"g(\d{3,})\.rrd")


@dataclass(frozen=True, slots=True)
class RecordingPaths:
    """Names of all files in a run's ``recording`` folder.

    Attributes:
        run_dir: the run.
    """

    run_dir: Path

    @property
    def folder(self) -> Path:
        """All recordings of the run."""
        return self.run_dir / RECORDING_NAME

    @property
    def run(self) -> Path:
        """The overview over the generations."""
        return self.folder / "run.rrd"

    @property
    def scenery(self) -> Path:
        """What stands still: shared by all trials."""
        return self.folder / "scenery.rrd"

    @property
    def trial_blueprint(self) -> Path:
        """The screen of one trial."""
        return self.folder / "trial.rbl"

    @property
    def table_blueprint(self) -> Path:
        """The gallery."""
        return self.folder / "table.rbl"

    @property
    def run_blueprint(self) -> Path:
        """The screen of the overview."""
        return self.folder / "run.rbl"

    @property
    def trials(self) -> Path:
        """One file per generation, one recording per trial in it."""
        return self.folder / "trials"

    def generation(self, number: int) -> Path:
        """All recorded trials of a generation."""
        return self.trials / f"g{number:03}.rrd"

    def overview(self, number: int) -> Path:
        """A generation's part of the overview."""
        return self.folder / "overview" / f"g{number:03}.rrd"

    @property
    def overview_start(self) -> Path:
        """The part of the overview that holds for all generations."""
        return self.folder / "overview" / "start.rrd"

    @property
    def form(self) -> Path:
        """Which form the files have; see `sceann_hil.recording.recorder`."""
        return self.folder / "form"

    @property
    def log(self) -> Path:
        """What the recorder had to say."""
        return self.folder / "recorder.log"

    @property
    def status(self) -> Path:
        """How far the recorder is, as JSON."""
        return self.folder / "status.json"

    def recorded_generations(self) -> list[int]:
        """Numbers of the generations that have a file of trials."""
        if not self.trials.is_dir():
            return []
        names = (_GENERATION.fullmatch(path.name) for path in self.trials.iterdir())
        return sorted(int(match[1]) for match in names if match)
