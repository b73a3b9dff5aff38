"""docs/python.md: its code runs, in its order, and names everything that is public."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import sceann_hil as sh

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def test_the_code_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in BLOCKS:
        exec(compile(block, "docs/python.md", "exec"), names)
    assert (tmp_path / "walker.h").read_text().count("walker_") > 5
    run = names["run"]
    assert isinstance(run, sh.Run)
    assert run.finished


def test_the_loop_of_ones_own_has_at_most_fifteen_lines() -> None:
    (loop,) = [block for block in BLOCKS if "algorithm.tell" in block]
    assert len([line for line in loop.splitlines() if line.strip()]) <= 15


def test_the_page_names_every_public_name() -> None:
    table = PAGE.partition("## All names")[2]
    documented = set(re.findall(r"`(\w+)(?:\([^`]*\))?`", re.sub(r"\| [^|]* \|$", "", table, flags=re.MULTILINE)))
    assert documented == set(sh.__all__)
