"""Paths in hints, so that a hint can be pasted into a shell."""

from __future__ import annotations

import shlex
from pathlib import Path


def pasteable(path: Path | str) -> str:
    """A path as a shell takes it for one argument that is no option."""
    text = str(path)
    return shlex.quote(f"./{text}" if text.startswith("-") else text)
