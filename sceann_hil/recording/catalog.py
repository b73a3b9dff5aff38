"""A run's recordings as a catalog on this machine, which the viewer shows as a gallery."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import rerun as rr

from sceann_hil.recording.paths import RecordingPaths

_DATASET = "trials"


@dataclass(frozen=True, slots=True)
class Catalog:
    """A running server.

    Attributes:
        gallery_url: all recordings.
    """

    gallery_url: str

    def trial_url(self, recording_id: str) -> str:
        """One recording."""
        return f"{self.gallery_url}?segment_id={recording_id}"


@contextlib.contextmanager
def catalog(paths: RecordingPaths, files: Sequence[Path]) -> Iterator[Catalog]:
    """Serve recordings to viewers on this machine only, until the end of the block.

    Args:
        paths: of the run, whose scenery and screens are used.
        files: files of trials.
    """
    with rr.server.Server(host="127.0.0.1", datasets={_DATASET: list(files)}) as server:
        dataset = server.client().get_dataset(_DATASET)
        dataset.register_asset(paths.scenery.absolute().as_uri())
        dataset.register_blueprint(paths.trial_blueprint.absolute().as_uri())
        dataset.register_blueprint(paths.table_blueprint.absolute().as_uri(), segment_table=True)
        yield Catalog(f"{server.url()}/dataset/{dataset.id}")
