"""What a command costs before it does anything: CPU time of whole processes, beside that of an empty one."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from figures import Figure

CONFIG = Path(__file__).parents[2] / "configs" / "quickstart.yaml"
SCEANN = str(Path(sys.executable).with_name("sceann"))
REPEATS = 7


def run() -> list[Figure]:
    """Median over several processes each; the figures are CPU time, so other processes hardly disturb them."""
    with tempfile.TemporaryDirectory(prefix="sceann-bench-") as folder:
        out = str(Path(folder) / "run")
        evolve = [SCEANN, "evolve", str(CONFIG), "--out", out, "--set", "algorithm.generations=5", "--record", "none"]
        subprocess.run(evolve, check=True, capture_output=True)
        empty_s = _cpu_s([sys.executable, "-c", "pass"])
        return [
            Figure("an empty Python process", f"{empty_s:.2f} s of CPU"),
            _figure("sceann --help", [SCEANN, "--help"], empty_s, 0.25),
            _figure("sceann --version", [SCEANN, "--version"], empty_s, 0.15),
            _figure("sceann status of a small run", [SCEANN, "status", out], empty_s, 0.4),
            _figure("import sceann_hil", [sys.executable, "-c", "import sceann_hil"], empty_s, 0.3),
        ]


def _figure(name: str, command: list[str], empty_s: float, promised_s: float) -> Figure:
    cpu_s = _cpu_s(command)
    measured = f"{cpu_s:.2f} s of CPU, {cpu_s / empty_s:.1f} x an empty process"
    return Figure(name, measured, f"<= {promised_s:g} s", cpu_s <= promised_s)


def _cpu_s(command: list[str]) -> float:
    return statistics.median(_once_s(command) for _ in range(REPEATS))


def _once_s(command: list[str]) -> float:
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{command} ended with status {status}")
    return usage.ru_utime + usage.ru_stime
