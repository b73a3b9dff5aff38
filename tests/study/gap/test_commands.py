"""plan, rehearse, compare, repeat and drift as a user meets them; reference runs on a robot that repeats nothing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from sceann_hil.cli import app
from sceann_hil.errors import ConfigError, NotARun
from sceann_hil.journal import AttemptKind, JournalReader
from sceann_hil.robot import Results, Trials
from sceann_hil.run.experiment import Experiment, Outcome
from tests.runs import GOAL, POLE, config_of, evolve
from tests.supervision.operators.fakes import Beside

REAL = "robot: {type: cartpole, n_sensors: 2, gap: {sensor_offset: 0.01, motor_gain: 0.9, latency_steps: 1}}"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("gap") / "run"
    evolve(directory, POLE, "algorithm.population=25", "algorithm.generations=8", "task.start_angle_deg=3")
    return directory


def said(*arguments: object) -> dict[str, object]:
    result = CliRunner().invoke(app, [str(argument) for argument in (*arguments, "--json")], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    document: dict[str, object] = json.loads(result.stdout[result.stdout.index("{") :])
    return document


def test_compare_finds_the_gap_and_leaves_pictures(run: Path, tmp_path: Path) -> None:
    (tmp_path / "real.yaml").write_text(REAL)
    document = said("compare", run, "--on", tmp_path / "real.yaml", "--top", 4, "--repeats", 2)
    estimate = document["estimate"]
    assert isinstance(estimate, dict)
    assert estimate["latency_steps"]["low"] <= 1 <= estimate["latency_steps"]["high"]
    assert estimate["motor_gain"][0]["low"] <= 0.9 <= estimate["motor_gain"][0]["high"]
    assert [one["value"] for one in estimate["sensor_offset"]] == pytest.approx([0.01, 0.01], abs=0.003)
    pasted = yaml.safe_load(str(document["gap_section"]))["gap"]
    assert config_of(POLE, f"robot.gap={pasted}").robot.model_dump()["gap"]["latency_steps"] == 1.0
    assert len(pasted["sensor_offset"]) == 2
    for name in ("gap.png", "trajectories.png", "compare.json"):
        assert (run / "reports" / "compare" / name).stat().st_size > 1000


def test_a_comparison_s_numbers_are_json_for_every_reader(run: Path, tmp_path: Path) -> None:
    """One repeat of two genomes has neither intervals nor a rank correlation."""
    (tmp_path / "real.yaml").write_text(REAL)
    said("compare", run, "--on", tmp_path / "real.yaml", "--top", 2, "--repeats", 1)
    text = (run / "reports" / "compare" / "compare.json").read_text()

    def refuse(name: str) -> None:
        raise AssertionError(name)

    document = json.loads(text, parse_constant=refuse)
    assert document["rank_correlation"] is None
    assert document["genomes"][0]["low"] is None
    assert document["estimate"]["motor_gain"] == [{"value": None, "low": None, "high": None}]
    assert document["gap_section"] == ""


def test_what_the_trials_do_not_tell_is_said_in_words(run: Path, tmp_path: Path) -> None:
    (tmp_path / "real.yaml").write_text(REAL)
    result = CliRunner().invoke(
        app, ["compare", str(run), "--on", str(tmp_path / "real.yaml"), "--top", "1", "--repeats", "1"]
    )
    assert result.exit_code == 0, result.output
    assert "not identifiable from" in result.output
    assert "These trials tell nothing of the robot's gap" in " ".join(result.output.split())


def test_compare_without_a_second_robot_says_what_is_missing(run: Path) -> None:
    with pytest.raises(ConfigError, match="needs a simulated robot and another one"):
        CliRunner().invoke(app, ["compare", str(run)], catch_exceptions=False)


def test_repeat_gives_the_spread_and_what_can_be_told_apart(run: Path, tmp_path: Path) -> None:
    (tmp_path / "real.yaml").write_text(REAL.replace("0.01", "{normal: [0, 0.01]}"))
    document = said("repeat", run, "-n", 12, "--on", tmp_path / "real.yaml")
    fitness = document["fitness"]
    assert isinstance(fitness, list)
    assert len(fitness) == 12
    assert document["deviation"] == pytest.approx(np.std(fitness, ddof=1))
    needed = document["repeats_to_tell"]
    assert isinstance(needed, dict)
    assert list(needed.values()) == sorted(needed.values(), reverse=True)


def test_plan_counts_prompts_and_time_of_an_attended_robot(tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text(GOAL)
    document = said("plan", tmp_path / "c.yaml", "--set", "budget.trials=10")
    assert (document["trials"], document["prompts"]) == (4 * 6 * 3, 0)
    assert document["fits"] == "not surely: trials may end first"


def test_rehearse_plays_every_prompt(tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text(GOAL)
    document = said("rehearse", tmp_path / "c.yaml", "--set", "algorithm.generations=1")
    assert (document["outcome"], document["trials"], document["prompts"]) == ("finished", 36, 72)


def test_rehearse_ends_with_its_budget(tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text(GOAL)
    document = said("rehearse", tmp_path / "c.yaml", "--set", "budget.trials=5")
    assert (document["outcome"], document["trials"]) == ("budget_spent", 5)


class _Wearing(Beside):
    """Its wheels slip more and more: every trial takes a little longer than the one before."""

    def run(self, trials: Trials) -> Results:
        results = super().run(trials)
        results.steps[:] = self.starts
        results.end_reasons[:] = 1
        return results


@pytest.mark.parametrize(("robot", "drifts"), [(_Wearing, True), (Beside, False)])
def test_reference_runs_see_a_robot_drift(robot: type[Beside], drifts: bool, tmp_path: Path) -> None:
    config = config_of(GOAL, "reference.every=5")
    with Experiment.create(config, tmp_path / "run") as experiment, robot(config.robot.build()) as beside:
        assert experiment.evolve(beside) is Outcome.FINISHED
        events = [kind for _, _, kind, _ in experiment.journal.reader.events()]
    rows = JournalReader(tmp_path / "run").attempts_of_kind(AttemptKind.REFERENCE)
    # the first generation has no best yet
    assert len(rows) >= 8
    assert len({row.genome for row in rows}) == 1
    assert ("drift" in events) is drifts
    document = said("drift", tmp_path / "run")
    assert (document["warning"] is not None) is drifts
    assert Path(str(document["chart"])).stat().st_size > 1000


def test_a_robot_that_repeats_its_trials_needs_no_reference(tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL, "reference.every=5")
    assert JournalReader(tmp_path / "run").attempts_of_kind(AttemptKind.REFERENCE) == []
    with pytest.raises(NotARun, match="no reference runs"):
        CliRunner().invoke(app, ["drift", str(tmp_path / "run")], catch_exceptions=False)


def test_a_comparison_of_trials_that_only_a_person_can_score_is_refused_before_anything_moves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    evolve(tmp_path / "run", GOAL, "algorithm.generations=1")
    scored = config_of(GOAL, "task.score_by_operator=true", "operator={who: [console], confirm: true}")
    monkeypatch.setattr("sceann_hil.commands.gap.journalled_config", lambda _: scored)
    (tmp_path / "real.yaml").write_text("robot: {type: diffdrive, n_sensors: 3, gap: {sensor_offset: 0.01}}")
    for command in (["compare", "--on", str(tmp_path / "real.yaml")], ["repeat"]):
        result = CliRunner().invoke(app, [command[0], str(tmp_path / "run"), *command[1:]])
        assert isinstance(result.exception, ConfigError)
        assert "a person says what each trial is worth" in str(result.exception)


def test_a_comparison_in_a_world_with_drawn_obstacles_draws_paths_and_estimates_no_gap(tmp_path: Path) -> None:
    world = "infrared: [{direction_deg: 0}, {direction_deg: 40}, {direction_deg: -40}], obstacles: "
    world += "[{drawn: {x_m: [0.2, 0.5], y_m: [0.2, 0.5]}, radius_m: 0.04}]"
    robot = f"robot={{type: diffdrive, world: {{{world}}}}}"
    evolve(tmp_path / "run", GOAL, "algorithm.generations=1", robot)
    text = f"robot: {{type: diffdrive, gap: {{motor_gain: 0.8}}, world: {{{world}}}}}"
    (tmp_path / "real.yaml").write_text(text)
    document = said("compare", tmp_path / "run", "--on", tmp_path / "real.yaml", "--top", 2, "--repeats", 1)
    assert document["estimate"] is None
    assert (tmp_path / "run" / "reports" / "compare" / "trajectories.png").stat().st_size > 10_000
