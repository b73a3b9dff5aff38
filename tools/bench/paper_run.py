"""A whole run of the paper (goal reach, 25 x 8 trials x 51 generations): time, memory, and the price of recording."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from figures import Figure, median_s

CONFIG = Path(__file__).parents[2] / "configs" / "goal_reach.yaml"
SCEANN = Path(sys.executable).with_name("sceann")


def run() -> list[Figure]:
    """The command as a user runs it; machine code comes from the cache of an earlier run."""
    with tempfile.TemporaryDirectory(prefix="sceann-bench-") as folder:
        numbered = iter(range(1000))

        def evolve(record: str) -> dict[str, float]:
            out = Path(folder) / f"run{next(numbered)}"
            started = time.perf_counter()
            command = [SCEANN, "evolve", CONFIG, "--out", out, "--record", record, "--json"]
            done = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True)
            whole_s = time.perf_counter() - started
            size = sum(path.stat().st_size for path in (out / "recording").rglob("*") if path.is_file())
            return {**json.loads(done.stdout), "whole_s": whole_s, "recording_mb": size / 1e6}

        plain_s = median_s(lambda: evolve("none"), 3)
        cpu_s = _usage(Path(folder) / "usage", "none")[0]
        plain = min((evolve("none") for _ in range(3)), key=lambda run: run["evolved_s"])
        recorded = min((evolve("all") for _ in range(2)), key=lambda run: run["evolved_s"])
        slower = recorded["evolved_s"] / plain["evolved_s"] - 1
        memory_mb = _usage(Path(folder) / "memory", "none")[1]
    return [
        Figure("evolution alone", f"{plain['evolved_s']:.2f} s", "<= 0.25 s", plain["evolved_s"] <= 0.25),
        Figure(
            "the whole command, without recording",
            f"{plain_s:.2f} s, {cpu_s:.2f} s of CPU",
            "<= 0.9 s of CPU",
            cpu_s <= 0.9,
        ),
        Figure("with every trial recorded", f"{recorded['whole_s']:.1f} s", "<= 10 s", recorded["whole_s"] <= 10),
        Figure(
            "recordings of 10,200 trials",
            f"{recorded['recording_mb']:.0f} MB",
            "<= 200 MB",
            recorded["recording_mb"] <= 200,
        ),
        Figure("evolution slowed by recording", f"{slower:+.0%}", "<= 10 %", slower <= 0.1),
        Figure("resident memory without recording", f"{memory_mb:.0f} MB", "< 400 MB", memory_mb < 400),
    ]


def _usage(out: Path, record: str) -> tuple[float, float]:
    """Processor time and largest resident memory of the command, s and MB."""
    command = [SCEANN, "evolve", CONFIG, "--out", out, "--record", record]
    process = subprocess.Popen([str(part) for part in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{command} ended with status {status}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024
