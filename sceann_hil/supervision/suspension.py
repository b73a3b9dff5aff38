"""All suspenders of a run at work: they are looked at between trials and during them, and waited for.

A suspender that could never see its value, or never let go again, would be a trap: `check` refuses it before anything
moves.
"""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sceann_hil.errors import ConfigError
from sceann_hil.robot import Health, Robot
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.suspenders import Quantity, Suspender

LOOK_S = 0.5
"""How often a suspended run looks whether it may go on."""
WATCH_S = 0.2
"""How often suspenders are looked at during a trial."""
FIRST_VALUE_S = 2.0
"""How long a robot may take after it was connected to tell a value for the first time."""


class Suspension:
    """Reasons to pause that begin and end by themselves.

    Args:
        suspenders: as configured.
        robot: connected.
        desk: where the operators are.
        folder: the run's, whose disk may fill up.
    """

    def __init__(self, suspenders: tuple[Suspender, ...], robot: Robot, desk: Desk, folder: Path) -> None:
        self._suspenders = suspenders
        self._robot = robot
        self._desk = desk
        self._folder = folder

    def check(self) -> None:
        """Refuse a suspender whose value nobody measures; nothing has moved yet.

        Raises:
            ConfigError: which, and what to do.
        """
        deadline = time.monotonic() + FIRST_VALUE_S
        while unseen := [s.quantity for s in self._suspenders if self._value(s.quantity, self._robot.health()) is None]:
            if time.monotonic() >= deadline:
                raise ConfigError(*_never_seen(unseen[0], self._robot.spec.name))
            time.sleep(0.05)

    @property
    def reasons(self) -> tuple[Suspender, ...]:
        """Look now; those that pause the run."""
        health = self._robot.health() if self._suspenders else Health()
        now_s = time.monotonic()
        return tuple(s for s in self._suspenders if s.look(self._value(s.quantity, health), now_s))

    def wait(self, tell: Callable[[str, str], object]) -> None:
        """Return when no suspender has a reason.

        Args:
            tell: told what began or ended (suspended, unsuspended) and why, and with an empty first word at every
                look in between, what suspends now.

        Raises:
            Stopped, EmergencyStop: as in `Desk.between`.
        """
        told: set[Quantity] = set()
        while suspending := self.reasons:
            why = ", ".join(suspender.reason for suspender in suspending)
            quantities = {suspender.quantity for suspender in suspending}
            tell("suspended" if quantities != told else "", why)
            told = quantities
            self._desk.suspend(", ".join(sorted(quantity.value for quantity in quantities)), LOOK_S)
            if quantities & {Quantity.LINK_QUALITY, Quantity.BATTERY, Quantity.TEMPERATURE}:
                # no trial runs now, so nobody else would notice that the robot is back, or its line good again
                self._robot.probe()
        if told:
            tell("unsuspended", "all values are good again")
            self._desk.unsuspend()

    @contextmanager
    def watched(self) -> Iterator[list[Suspender]]:
        """Look at suspenders that may stop a trial, while one runs; whoever did is in the list."""
        stopped_by: list[Suspender] = []
        watching = [suspender for suspender in self._suspenders if suspender.watches_trials]
        if not watching:
            yield stopped_by
            return
        over = threading.Event()

        def watch() -> None:
            while not over.wait(WATCH_S):
                health = self._robot.health()
                for suspender in watching:
                    value = self._value(suspender.quantity, health)
                    if suspender.voids(value):
                        suspender.look(value, time.monotonic())
                        stopped_by.append(suspender)
                        self._robot.interrupt(suspender.quantity.void_reason)
                        return

        watcher = threading.Thread(target=watch, name="suspenders", daemon=True)
        watcher.start()
        try:
            yield stopped_by
        finally:
            over.set()
            watcher.join()

    def _value(self, quantity: Quantity, health: Health) -> float | None:
        if quantity is Quantity.BATTERY:
            return health.battery_fraction
        if quantity is Quantity.TEMPERATURE:
            return health.temperature_c
        if quantity is Quantity.LINK_QUALITY:
            return health.link_quality
        if quantity is Quantity.DISK:
            try:
                return shutil.disk_usage(self._folder).free / 1e6
            except OSError:
                # whoever writes there next finds out and tells
                return None
        return self._desk.absent_s if self._desk.asks else None


def _never_seen(quantity: Quantity, robot: str) -> tuple[str, str]:
    """Message and hint."""
    key = f"suspenders.{quantity.value}"
    leave_out = f"Leave {key} out."
    if quantity is Quantity.ABSENCE:
        return f"{key}: expected an operator, got none: nobody's absence can be noticed.", f"{leave_out} Or name one."
    if quantity is Quantity.BATTERY:
        how = "A robot on a line needs battery_range_v, and firmware that measures it."
        return f"{key}: {robot} does not measure its battery, so this would never pause the run.", f"{leave_out} {how}"
    what = {Quantity.TEMPERATURE: "its temperature", Quantity.LINK_QUALITY: "the quality of a link"}
    told = what.get(quantity, quantity.value)
    return f"{key}: {robot} does not measure {told}, so this would never pause the run.", leave_out
