"""A small transfer, and a cache of its own for every test session."""

from __future__ import annotations

from pathlib import Path

import pytest

from sceann_hil.config import ExperimentConfig, parse_config

SMALL = """
task: {type: goal_reach, headings_deg: [0, 90, 180], max_steps: 60}
robot: {type: diffdrive, n_sensors: 3, gap: {motor_gain: [0.7, 1.0], latency_steps: 1}}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: transfer, trials: 6, rounds: 2, evolve: 2, candidates: 60}
uncertainty: {robots: 20}
"""


@pytest.fixture(autouse=True, scope="session")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What is prepared is kept for this session only."""
    from sceann_hil.run.transfer import cache

    folder = tmp_path_factory.mktemp("transfer-cache")
    patch = pytest.MonkeyPatch()
    patch.setattr(cache, "cache_folder", lambda kind, digest: folder / f"{kind}-{digest}")
    return folder


@pytest.fixture
def small() -> ExperimentConfig:
    return parse_config(SMALL, "small")
