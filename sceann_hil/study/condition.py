"""One condition of a study: an experiment that is run many times, and the seeds of its runs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig, dump_config
from sceann_hil.seeds import Purpose, keys

Setting = tuple[str, Any]
"""An axis's dotted key and the value that a condition has on it."""


@dataclass(frozen=True)
class Condition:
    """One cell of a study's grid.

    Attributes:
        number: its place in the grid, from 0; the last axis varies fastest.
        settings: where on each axis it is, in the order of the axes.
        config: the experiment, without name and with seed 0: each run has a seed of its own.
    """

    number: int
    settings: tuple[Setting, ...]
    config: ExperimentConfig

    @cached_property
    def identity(self) -> int:
        """64 bits that depend on what the experiment does, and on nothing else.

        Only values that are not the defaults count: an option that is added later, with a default that changes
        nothing, changes no seed of an older study.
        """
        essence = self.config.model_dump(mode="json", exclude={"name", "seed"}, exclude_defaults=True)
        for section in ("task", "robot", "algorithm"):
            essence[section] = {"type": getattr(self.config, section).type, **essence.get(section, {})}
        return int.from_bytes(hashlib.sha256(json.dumps(essence, sort_keys=True).encode()).digest()[:8], "big")

    @cached_property
    def text(self) -> str:
        """The experiment as canonical YAML."""
        return dump_config(self.config)

    @property
    def label(self) -> str:
        """For people: the settings, with the last word of each key."""
        return ", ".join(setting_text(key, value) for key, value in self.settings) or "the one condition"

    def seeds(self, study_seed: int, runs: Sequence[int] | range) -> NDArray[np.uint64]:
        """Root seeds of some runs, below 2**63, shape ``(len(runs),)``.

        They depend on the study's seed, this condition and the runs' numbers only: neither on the grid around the
        condition nor on who computes what in which order.
        """
        return keys(study_seed, Purpose.RUN, np.uint64(self.identity), np.asarray(runs)) >> np.uint64(1)

    def experiment(self, study_seed: int, run: int) -> ExperimentConfig:
        """One run of this condition as an experiment of its own, which gives the same numbers."""
        return self.config.model_copy(update={"seed": int(self.seeds(study_seed, [run])[0])})


def setting_text(key: str, value: Any) -> str:
    """One setting for people, such as ``n_hidden=3`` or ``oga scope=per_locus``."""
    if isinstance(value, dict):
        rest = [f"{name}={inner}" for name, inner in value.items() if name != "type"]
        return " ".join([str(value.get("type", key)), *rest])
    return f"{key.rpartition('.')[2]}={value}" if key.rpartition(".")[2] != "type" else str(value)
