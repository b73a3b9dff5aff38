"""The run's record of truth: one SQLite database that survives ``kill -9`` at any moment.

`schema` says what is in it, `Journal` writes it, `JournalReader` reads it (also while a run writes), `RunLock` keeps a
second writer away.
"""

from sceann_hil.journal.again import sound_trials, trial_arrays
from sceann_hil.journal.entries import AttemptKind, Circumstances, FirstGeneration, Slots
from sceann_hil.journal.lock import LOCK_NAME, RunLock
from sceann_hil.journal.reader import JournalReader
from sceann_hil.journal.rows import (
    AttemptRow,
    GenerationRow,
    IndividualRow,
    MeasurementRow,
    RunRow,
    SessionRow,
    SpentRow,
)
from sceann_hil.journal.schema import JOURNAL_NAME, SCHEMA_VERSION
from sceann_hil.journal.writer import Journal

__all__ = [
    "JOURNAL_NAME",
    "LOCK_NAME",
    "SCHEMA_VERSION",
    "AttemptKind",
    "AttemptRow",
    "Circumstances",
    "FirstGeneration",
    "GenerationRow",
    "IndividualRow",
    "Journal",
    "JournalReader",
    "MeasurementRow",
    "RunLock",
    "RunRow",
    "SessionRow",
    "Slots",
    "SpentRow",
    "sound_trials",
    "trial_arrays",
]
