"""Packages with plug-ins, installed for one test beside those that are there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from sceann_hil import registry


@contextmanager
def installed(folder: Path, packages: Mapping[str, str], monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The packages are there for as long as the block lasts.

    Args:
        folder: where they are written.
        packages: the text of ``entry_points.txt`` by the package's name; its modules can be imported already.
        monkeypatch: of the test.
    """
    for name, entries in packages.items():
        info = folder / f"{name}-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(entries)
    monkeypatch.syspath_prepend(folder)
    registry.entry_points.cache_clear()
    try:
        yield
    finally:
        registry.entry_points.cache_clear()
