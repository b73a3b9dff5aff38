"""A robot that a person stands beside: simulated, but real in everything that operators can notice."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from sceann_hil.config import ExperimentConfig
from sceann_hil.robot import EndReason, Health, Results, Robot, RobotSpec, Trials
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.operators.script import Script, Step
from tests.runs import GOAL, config_of


class Beside(Robot):
    """Runs trials of a simulated body one at a time, as an attended robot that repeats nothing.

    Attributes:
        health_now: what `health` says.
        interrupts: what it was told during trials.
        starts: how many trials it started.

    Args:
        body: simulated.
        endless: a trial goes on until somebody interrupts it.
    """

    def __init__(
        self, body: Robot, *, endless: bool = False, on_trial: Callable[[int], object] = lambda _: None
    ) -> None:
        self._body = body
        self._endless = endless
        self._on_trial = on_trial
        self._stopped = threading.Event()
        self.health_now = Health()
        self.interrupts: list[EndReason] = []
        self.made_safe: list[str] = []
        self.starts = 0

    @property
    def spec(self) -> RobotSpec:
        return replace(self._body.spec, attended=True, batch_size=1, deterministic=False, noise_free=False)

    def run(self, trials: Trials) -> Results:
        self.starts += 1
        self._on_trial(self.starts)
        if self._endless:
            assert self._stopped.wait(20)
        results = self._body.run(trials)
        if self._stopped.is_set():
            self._stopped.clear()
            reason = self.interrupts[-1]
            return replace(results, end_reasons=np.array([reason], np.uint8))
        return results

    def interrupt(self, reason: EndReason) -> None:
        self.interrupts.append(reason)
        self._stopped.set()

    def make_safe(self, reason: str) -> bool:
        self.made_safe.append(reason)
        return True

    def health(self) -> Health:
        return self.health_now


def attended_run(
    directory: Path,
    script: list[str],
    *overrides: str,
    robot: Callable[[Robot], Robot] = Beside,
    text: str = GOAL,
    repeat: bool = False,
) -> tuple[Outcome, Experiment]:
    """A run with a scripted operator; the experiment is closed, its journal can still be read anew."""
    config: ExperimentConfig = config_of(text, "algorithm.population=2", "algorithm.generations=1", *overrides)
    beside = robot(config.robot.build())
    exists = directory.exists()
    with Experiment.open(directory) if exists else Experiment.create(config, directory) as experiment:
        desk = Desk(on_emergency=beside.make_safe)
        with beside, Script(desk, [Step.parse(line) for line in script], repeat=repeat):
            outcome = experiment.evolve(beside, desk=desk)
    return outcome, experiment
