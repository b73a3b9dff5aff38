"""Trials that tell of one robot tell nothing of another: a swapped robot is noticed."""

from __future__ import annotations

import os
import pty
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.run.experiment import Experiment, Outcome, StopRequest
from sceann_hil.run.rehearsal import StandIn
from sceann_hil.run.transfer.again import read_transfer
from sceann_hil.supervision.operators import Desk, Phase, console
from sceann_hil.supervision.operators.console import Console
from sceann_hil.supervision.operators.terminal_keys import TerminalKeys


class Named(StandIn):
    """A robot that knows who it is."""

    name = "a"

    @property
    def identity(self) -> str:
        return self.name


def session(config: ExperimentConfig, directory: Path, who: str, desk: Desk | None = None) -> Outcome:
    robot = Named(config.robot.build(), attended=desk is not None, deterministic=True)
    robot.name = who
    done = 0

    def count(_: object) -> None:
        nonlocal done
        done += 1

    def stop() -> StopRequest:
        return StopRequest.AFTER_GENERATION if done >= 2 else StopRequest.NONE

    with (
        Experiment.open(directory) if directory.exists() else Experiment.create(config, directory) as experiment,
        robot,
    ):
        return experiment.evolve(robot, count, stop, desk or Desk(asks=False))


def test_another_robot_is_refused_and_the_first_one_goes_on(small: ExperimentConfig, tmp_path: Path) -> None:
    assert session(small, tmp_path / "run", "a") is Outcome.STOPPED_AFTER_GENERATION
    with pytest.raises(ConfigError, match=r"another robot \(id b\) than the one that did this run's trials \(id a\)"):
        session(small, tmp_path / "run", "b")
    assert session(small, tmp_path / "run", "a") is Outcome.STOPPED_AFTER_GENERATION


@contextmanager
def person(keys: dict[Phase, str]) -> Iterator[tuple[Desk, list[str]]]:
    """Somebody at a console who answers every question with the same key."""
    desk, shown, over = Desk(), [], threading.Event()
    terminal, line = pty.openpty()

    def answer() -> None:
        while not over.wait(0.1):
            # what is typed before the question is shown does not count, so it is typed again
            if (phase := desk.view().phase) in keys:
                os.write(terminal, keys[phase].encode())

    hand = threading.Thread(target=answer, daemon=True)
    with Console(desk, TerminalKeys(line), shown.append):
        hand.start()
        yield desk, shown
        over.set()
        hand.join()
    os.close(line)
    os.close(terminal)


def test_a_person_at_the_console_is_asked_whether_another_robot_may_go_on(
    small: ExperimentConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(console, "QUIET_S", 0.0)
    session(small, tmp_path / "run", "a")
    with person({Phase.BEFORE: "q"}) as (desk, shown):
        assert session(small, tmp_path / "run", "b", desk) is Outcome.FINISHED_BY_OPERATOR
    assert "another robot (id b)" in "".join(shown)
    assert read_transfer(tmp_path / "run")[0].observed.value.size == 2
    with person({Phase.BEFORE: "r", Phase.AFTER: "a"}) as (desk, shown):
        assert session(small, tmp_path / "run", "b", desk) is Outcome.STOPPED_AFTER_GENERATION
    assert "another robot (id b)" in "".join(shown)
    assert read_transfer(tmp_path / "run")[0].observed.value.size == 4
    # it is known now, and nobody is asked again
    assert session(small, tmp_path / "run", "b") is Outcome.STOPPED_AFTER_GENERATION
