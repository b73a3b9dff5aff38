"""What the numbers of a study or a landscape depend on besides its configuration: versions, and simulated bodies."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable

from sceann_hil.config import ExperimentConfig
from sceann_hil.plugins import RobotConfig
from sceann_hil.versions import BODIES, running_versions


def circumstances(configs: Iterable[ExperimentConfig]) -> dict[str, str]:
    """`running_versions`, with one fingerprint of all bodies that these experiments simulate."""
    robots: dict[str, RobotConfig] = {config.robot.model_dump_json(): config.robot for config in configs}
    fingerprints = {robot.build().body_fingerprint() or "" for robot in robots.values()}
    digest = hashlib.sha256("".join(sorted(fingerprints)).encode()).hexdigest()[:16]
    return {**running_versions(), BODIES: digest}
