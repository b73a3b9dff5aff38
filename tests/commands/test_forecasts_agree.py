"""What `plan` and `rehearse` say of the same configuration."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sceann_hil.cli import app
from tests.runs import POLE

REAL = """
task: {type: pole_balancing, max_steps: 20}
robot: {type: remote, port: nowhere, n_sensors: 2, n_motors: 1, tick_s: 0.02, bumper: fell,
  start_fields: [x_m, velocity_m_s, angle_rad, angular_velocity_rad_s]}
controller: {coding: sceann3, n_hidden: 3}
algorithm: {type: sga, population: 3, generations: 1}
operator: {who: [WHO]}
"""


@pytest.mark.parametrize(("who", "prompts"), [("none", 0), ("console", 12)])
def test_a_rehearsal_asks_as_often_as_the_plan_says(who: str, prompts: int, tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text(REAL.replace("WHO", who))
    for command in ("plan", "rehearse"):
        result = CliRunner().invoke(app, [command, str(tmp_path / "c.yaml"), "--json"], catch_exceptions=False)
        assert json.loads(result.stdout)["prompts"] == prompts, command


def test_nobody_is_told_to_wait_a_day_for_a_simulation(tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text(POLE)
    assert "wall time at most" not in CliRunner().invoke(app, ["plan", str(tmp_path / "c.yaml")]).stdout
    (tmp_path / "c.yaml").write_text(REAL.replace("WHO", "console"))
    assert "wall time at most" in CliRunner().invoke(app, ["plan", str(tmp_path / "c.yaml")]).stdout
