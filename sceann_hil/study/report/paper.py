"""The numbers that the paper prints."""

from __future__ import annotations

from sceann_hil.network.coding import Coding
from sceann_hil.study.report.cells import Key

RUNS = 50
"""Independent runs of every condition (Section III.B)."""

_TABLES = {
    ("sga", 2): (0, 0, 34, 26, 20),
    ("sga", 4): (0, 0, 12, 4, 0),
    ("oga", 2): (0, 0, 44, 36, 26),
    ("oga", 4): (0, 0, 26, 8, 6),
}
SUCCESS_PERCENT = {
    Key(Coding.SCEANN3, algorithm, n_sensors, n_hidden): percent
    for (algorithm, n_sensors), row in _TABLES.items()
    for n_hidden, percent in enumerate(row, start=1)
}
"""Tables I (SGA) and II (OGA): success rate of SCEANN3 on pole balancing."""


def successes(key: Key) -> int:
    """Runs out of `RUNS` that succeeded."""
    return SUCCESS_PERCENT[key] * RUNS // 100
