"""Plug-ins for the tests, installed as real packages in a folder where the registry looks, and only there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.metadata import EntryPoints, distributions
from pathlib import Path

import pytest

from sceann_hil import registry

Install = Callable[[str, Mapping[str, Mapping[str, str]]], None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Installs a package with these entry points: ``install("name", {group: {name: "module:Class"}})``."""
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(site)
    monkeypatch.syspath_prepend(Path(__file__).parent)

    def entry_points(group: str) -> EntryPoints:
        found = (entry for package in distributions(path=[str(site)]) for entry in package.entry_points)
        return EntryPoints(found).select(group=group)

    monkeypatch.setattr(registry, "entry_points", entry_points)

    def install(package: str, groups: Mapping[str, Mapping[str, str]]) -> None:
        info = site / f"{package}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        lines = []
        for group, entries in groups.items():
            lines += [f"[sceann_hil.{group}]", *(f"{name} = {value}" for name, value in entries.items())]
        (info / "entry_points.txt").write_text("\n".join(lines) + "\n")

    return install


@pytest.fixture
def bench(install: Install) -> None:
    """The plug-ins of bench_plugins.py, and no others."""
    install(
        "bench",
        {
            "robots": {"rover": "bench_plugins:RoverConfig", "stilt": "bench_plugins:StiltConfig"},
            "tasks": {"reach": "bench_plugins:ReachConfig", "stand": "bench_plugins:StandConfig"},
            "algorithms": {"climb": "bench_plugins:ClimbConfig"},
        },
    )
