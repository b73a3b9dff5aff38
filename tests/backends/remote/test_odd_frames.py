"""Whatever arrives on a line is at worst a void attempt: odd frames that pass the check, in every phase of a trial.

More than the tests' share: ``python -m tests.backends.remote.test_odd_frames 1000000``.
"""

from __future__ import annotations

import secrets
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from backends.cartpole import CartPole
from backends.remote import RemoteConfig, RemoteRobot
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.config import parse_config
from sceann_hil.robot import EndReason, Results, RobotError
from tests.backends.remote.trials import hil_robot, pole_run, pole_trials, virtual_config
from tests.link.odd_frames import OddFrames

MODES = ("hil", "onboard", "tethered")
PHASES = ("connect", "run", "settle", "probe", "make_safe")
STEPS = 12


class Fuzz:
    """One robot at a time on a bus with odd frames, which are let in during one phase.

    Attributes:
        ends: how calls ended.
        injected: odd frames, by the function that they claim.

    Args:
        mode: of the robot.
        seed: of the frames.
        at_once: how many come before every true frame; each session draws one of these.
    """

    def __init__(self, mode: str, seed: int, at_once: tuple[float, ...] = (0.02, 1.0, 30.0)) -> None:
        self._at_once = at_once
        self.ends: Counter[str] = Counter()
        self.injected: Counter[int] = Counter()
        self._mode = mode
        self._rng = np.random.default_rng(seed)
        self._trials = pole_trials(200, STEPS, seed=seed)
        with CartPole() as simulated:
            self._expected = simulated.run(self._trials)
        self._number = secrets.randbelow(1 << 16)

    def run(self, frames: int) -> None:
        """Until so many odd frames came."""
        with _virtual(self._mode) as (virtual, config):
            while self.injected.total() < frames:
                for phase in PHASES:
                    self._session(config, phase)
                    virtual.power_cycle()

    def _session(self, config: RemoteConfig, phase: str) -> None:
        robot = config.build()
        buses: list[OddFrames] = []
        odd = [0.0]

        def open_bus() -> OddFrames:
            buses.append(OddFrames(config.open_bus(), self._rng, odd))
            return buses[-1]

        robot._connection._open_bus = open_bus
        much = float(self._rng.choice(self._at_once))

        def asked(name: str, call: Callable[[], Results | None]) -> None:
            odd[0] = much if name == phase else 0.0
            try:
                results = call()
                if results is not None:
                    self._judge(name, results)
            except RobotError as error:
                self.ends[f"{name} {type(error).__name__}"] += 1
            finally:
                odd[0] = 0.0

        asked("connect", robot.connect)
        for _ in range(3):
            self._number += 1
            trial = self._trials.take(slice(self._number % 200, self._number % 200 + 1))
            trial = replace(trial, ids=np.array([self._number]))
            asked("run", lambda trial=trial: robot.run(trial))  # type: ignore[misc]
            asked("settle", lambda trial=trial: robot.settle(trial))  # type: ignore[misc]
            asked("probe", robot.probe)
            asked("make_safe", lambda: self._made_safe(robot))
        robot.disconnect()
        for bus in buses:
            self.injected += bus.injected

    def _made_safe(self, robot: RemoteRobot) -> None:
        assert robot.make_safe("a test") in (True, False)
        assert robot.health() is not None

    def _judge(self, name: str, results: Results) -> None:
        self.ends[f"{name} {EndReason(int(results.end_reasons[0]))}"] += 1
        if self._mode == "hil" and results.counts[0]:
            i = self._number % 200
            assert results.steps[0] == self._expected.steps[i]
            assert results.hashes[0] == self._expected.hashes[i]
            assert results.end_reasons[0] == self._expected.end_reasons[i]


@contextmanager
def _virtual(mode: str) -> Iterator[tuple[VirtualPosix, RemoteConfig]]:
    with VirtualPosix(None if mode == "hil" else VirtualBody(CartPole())) as virtual:
        if mode == "hil":
            config = parse_config(pole_run(hil_robot(virtual.port, reconnect_s=0.5)), "test").robot
            assert isinstance(config, RemoteConfig)
        else:
            config = virtual_config(virtual, mode, reconnect_s=0.5)
        yield virtual, config


@pytest.mark.parametrize("mode", MODES)
def test_odd_frames_are_at_worst_a_void_attempt(mode: str) -> None:
    """Regression: an unknown status, a motor value beyond its range or a chunk too many was a traceback."""
    fuzz = Fuzz(mode, seed=secrets.randbits(32))
    fuzz.run(3000)
    assert any(end.startswith("run") for end in fuzz.ends), fuzz.ends


if __name__ == "__main__":
    for seed, mode in enumerate(MODES):
        fuzz = Fuzz(mode, seed, (0.02, 1.0, 30.0, 1000.0))
        fuzz.run(int(sys.argv[1]) // len(MODES))
        print(mode, fuzz.injected.total(), dict(fuzz.ends))
