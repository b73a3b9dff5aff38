#!/usr/bin/env python
"""Thousands of hardware-in-the-loop trials while everything goes wrong, then proof that nothing was lost or doubled.

    .venv/bin/python tools/torture.py [--trials 2000] [--seed 1] [--keep DIR]

The robot is the firmware on the posix board, with a store, at the end of a cable. The host is a process that evolves
through that cable. This program is the fate of both: at random moments it kills the host (kill -9), takes the robot's
power, pulls the cable, or lets frames get lost, doubled, spoilt and swapped. A host that ended is started again with
what a user would say: resume. In the end the journal must be whole, hold exactly one counted result for every
(individual, trial), and equal, result by result, the same run in simulation.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sqlite3
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from backends.virtual.cable import Cable, LineFaults
from sceann_hil.config import parse_config
from sceann_hil.errors import NotARun, as_user_error
from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.run.experiment import Experiment, Outcome

POPULATION = 20
PEACE_S = (0.05, 0.8)
"""Time between two blows."""
STUCK_S = 60.0
BAD_LINE = LineFaults(lost=0.01, doubled=0.02, spoilt=0.01, swapped=0.01)
PAUSED = 3
CONFIG = """
task: {{type: pole_balancing, max_steps: 40}}
robot: {robot}
controller: {{coding: sceann3, n_hidden: 3}}
algorithm: {{type: sga, population: {population}, generations: {generations}}}
"""
SIMULATED = "{type: cartpole}"
COUNTED = (
    "SELECT generation, individual, trial, end_reason, steps, state_hash, fitness FROM attempt "
    "WHERE fitness IS NOT NULL ORDER BY generation, individual, trial"
)


def evolve(directory: Path, text: str) -> Outcome:
    """Start the run, or go on with it."""
    config = parse_config(text, "torture")
    try:
        experiment = Experiment.open(directory)
    except NotARun:
        experiment = Experiment.create(config, directory)
    with experiment, config.robot.build() as robot:
        return experiment.evolve(robot)


def start_host(directory: Path, text: str) -> int:
    """A process that evolves; its exit status is 0 when the run is finished, `PAUSED` when it may be resumed."""
    pid = os.fork()
    if pid:
        return pid
    # a host that kept this program's ends of the cable would never see it pulled
    os.closerange(3, 1024)
    status = 1
    try:
        evolve(directory, text)
        status = 0
    except Exception as error:
        told = as_user_error(error)
        if told is None:
            raise
        print(f"    paused: {told.message}", flush=True)
        status = PAUSED
    finally:
        os._exit(status)


class Fate:
    """Decides what goes wrong next.

    Attributes:
        blows: how often each thing happened.
    """

    def __init__(self, board: PosixBoard, cable: Cable, seed: int) -> None:
        self.blows: Counter[str] = Counter()
        self._board, self._cable = board, cable
        self._random = random.Random(seed)

    def pause_s(self) -> float:
        """Peace until the next blow."""
        return self._random.uniform(*PEACE_S)

    def strike(self, host: int) -> None:
        """One thing goes wrong, and comes right again, but for a killed host."""
        blow = self._random.choice(["host killed", "power lost", "cable pulled", "bad line", "host stopped"])
        self.blows[blow] += 1
        if blow == "host killed":
            os.kill(host, signal.SIGKILL)
        elif blow == "power lost":
            self._board.power_off()
            time.sleep(self._random.uniform(0.0, 0.3))
            self._board.power_on()
        elif blow == "cable pulled":
            self._cable.pull()
            time.sleep(self._random.uniform(0.0, 0.6))
            self._cable.plug()
        elif blow == "bad line":
            self._cable.faults = BAD_LINE
            time.sleep(self._random.uniform(0.2, 1.0))
            self._cable.faults = LineFaults()
        else:
            os.kill(host, signal.SIGSTOP)
            time.sleep(self._random.uniform(0.1, 0.8))
            os.kill(host, signal.SIGCONT)


def under_blows(directory: Path, text: str, fate: Fate) -> int:
    """Evolve to the end, whatever happens; how many hosts it took."""
    hosts, host = 1, start_host(directory, text)
    next_blow_s = time.monotonic() + fate.pause_s()
    grown_s, size = time.monotonic(), 0
    while True:
        done, status = os.waitpid(host, os.WNOHANG)
        if done:
            if not os.WIFSIGNALED(status) and os.WEXITSTATUS(status) == 0:
                return hosts
            if not os.WIFSIGNALED(status) and os.WEXITSTATUS(status) != PAUSED:
                raise SystemExit(f"the host ended with status {os.WEXITSTATUS(status)}: a bug")
            hosts, host = hosts + 1, start_host(directory, text)
        if time.monotonic() >= next_blow_s:
            fate.strike(host)
            next_blow_s = time.monotonic() + fate.pause_s()
        now_size = sum(path.stat().st_size for path in directory.glob("journal*"))
        if now_size != size:
            grown_s, size = time.monotonic(), now_size
        if time.monotonic() - grown_s > STUCK_S:
            os.kill(host, signal.SIGKILL)
            raise SystemExit(f"nothing was journalled for {STUCK_S:g} s: the host hangs")
        time.sleep(0.01)


def counted(directory: Path) -> list[tuple[object, ...]]:
    """The counted results of a run whose file is whole.

    Raises:
        SystemExit: it is not, or a void attempt has a fitness.
    """
    db = sqlite3.connect(directory / JOURNAL_NAME)
    (integrity,) = db.execute("PRAGMA integrity_check").fetchone()
    if integrity != "ok":
        raise SystemExit(f"the journal is damaged: {integrity}")
    void = "('link_lost', 'battery', 'operator', 'fault', 'emergency_stop', 'overrun')"
    if db.execute(f"SELECT 1 FROM attempt WHERE end_reason IN {void} AND fitness IS NOT NULL").fetchall():
        raise SystemExit("a void attempt has a fitness")
    rows = db.execute(COUNTED).fetchall()
    attempts, voids = db.execute(
        f"SELECT count(*), sum(end_reason IN {void}) FROM attempt WHERE end_reason IS NOT NULL"
    ).fetchone()
    print(f"  {directory.name}: {attempts} attempts, {voids or 0} void, {len(rows)} counted")
    return rows


def main() -> int:
    """Run it; 0 if nothing was lost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=2000, help="counted trials (default 2000)")
    parser.add_argument("--seed", type=int, default=1, help="of fate (default 1)")
    parser.add_argument("--keep", type=Path, help="folder for the journals; a temporary one otherwise")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        size = {"population": POPULATION, "generations": max(0, -(-arguments.trials // POPULATION) - 1)}
        evolve(folder / "simulated", CONFIG.format(robot=SIMULATED, **size))
        started_s = time.monotonic()
        with PosixBoard(store=folder / "eeprom") as board:
            if board.line is None:
                raise SystemExit("the board has no line")
            cable = Cable(board.line.socket, folder / "port", arguments.seed)
            fate = Fate(board, cable, arguments.seed)
            robot = f"{{type: remote, port: {folder / 'port'}, mode: hil, body: {SIMULATED}, reconnect_s: 5.0}}"
            hosts = under_blows(folder / "tortured", CONFIG.format(robot=robot, **size), fate)
            cable.close()
        blows = ", ".join(f"{what} {n}" for what, n in sorted(fate.blows.items()))
        print(f"  {time.monotonic() - started_s:.0f} s, {hosts} hosts; {blows or 'no blow'}")
        expected, got = counted(folder / "simulated"), counted(folder / "tortured")
    if got != expected:
        first = next(
            (pair for pair in zip(expected, got, strict=False) if pair[0] != pair[1]), (len(expected), len(got))
        )
        print(f"BROKEN: expected {first[0]}, got {first[1]}")
        return 1
    print(f"INTACT: {len(got)} trials, every one counted once, all as in simulation")
    return 0


if __name__ == "__main__":
    sys.exit(main())
