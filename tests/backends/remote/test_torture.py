"""The short form of ``tools/torture.py``."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]


def test_no_trial_is_lost_or_counted_twice_whatever_happens() -> None:
    done = subprocess.run(
        [sys.executable, "tools/torture.py", "--trials", "120", "--seed", "5"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "INTACT: 120 trials" in done.stdout
    assert "no blow" not in done.stdout
