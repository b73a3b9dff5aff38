"""Every benchmark can be started: what it uses of the program is still there."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

BENCH = Path(__file__).parents[2] / "tools" / "bench"
STARTED = """
import importlib, inspect, runpy, sys
bench = runpy.run_path(sys.argv[1], run_name="bench")
for name in bench["NAMES"]:
    run = importlib.import_module(name).run
    inspect.signature(run).bind()
    print(name)
"""


def test_every_benchmark_is_ready_to_run() -> None:
    done = subprocess.run(
        [sys.executable, "-c", STARTED, BENCH / "__main__.py"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert {"simulation", "study", "link", "recording", "saving"} <= set(done.stdout.split())
