"""The page of handled troubles names tests that are there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

TESTS = Path(__file__).parents[1]
PAGE = (TESTS.parent / "docs" / "reliability.md").read_text(encoding="utf-8")


def rows() -> list[list[str]]:
    """The cells of every table's rows."""
    lines = [line for line in PAGE.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [row for row in cells if row[0] != "trouble" and not set(row[0]) <= set("-")]


def test_every_row_names_a_test_that_is_there() -> None:
    missing = []
    for row in rows():
        assert len(row) == 3, row
        named = re.fullmatch(r"`([\w/]+\.py)::(\w+)`", row[2])
        assert named, row
        path, name = TESTS / named[1], named[2]
        tree = ast.parse(path.read_text(encoding="utf-8")) if path.is_file() else ast.Module([], [])
        if name not in {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}:
            missing.append(row[2])
    assert not missing


def test_every_row_says_what_happens_once() -> None:
    troubles = [row[0] for row in rows()]
    assert len(troubles) > 50
    assert len(set(troubles)) == len(troubles)
    assert all(row[1] for row in rows())
