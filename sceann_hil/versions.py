"""What a result depends on besides its configuration: this program, what computes for it, and the processor."""

from __future__ import annotations

import json
import platform
from collections.abc import Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from sceann_hil.registry import Group, entry_points

PROGRAM = "sceann-hil"
_COMPUTING = (PROGRAM, "numpy", "numba", "llvmlite")
_NOT_COMPUTING = ("machine",)
VERSIONS_NAME = "sceann-versions.json"
BODIES = "simulated bodies"
"""Beside versions: a fingerprint of the bodies' code, where somebody notes one."""


@cache
def running_versions() -> dict[str, str]:
    """What this process runs on: versions of packages by their names (every plug-in's too), Python, processor, machine.

    The order is always the same, so that equal circumstances give equal texts.
    """
    plugins = {
        entry.dist.name: entry.dist.version for group in Group for entry in entry_points(group.value) if entry.dist
    }
    packages = {name: _version(name) for name in _COMPUTING}
    return {
        **packages,
        **{name: plugins[name] for name in sorted(plugins) if name not in packages},
        "python": platform.python_version(),
        "processor": _processor(),
        "machine": f"{platform.system()} {platform.machine()}",
    }


def maker() -> str:
    """This program with its version, for the metadata of what it writes."""
    return f"{PROGRAM} {running_versions()[PROGRAM]}"


def write_versions(folder: Path, made_with: Sequence[dict[str, str]]) -> Path:
    """What tables were computed with and are written by, in a file beside them: a comment in a CSV breaks its readers.

    Args:
        folder: of the tables.
        made_with: versions of every process that computed what is in them.

    Returns:
        The file.
    """
    path = folder / VERSIONS_NAME
    different = list({tuple(sorted(versions.items())): versions for versions in made_with}.values())
    path.write_text(
        json.dumps({"computed_with": different, "written_by": running_versions()}, indent=2) + "\n", encoding="utf-8"
    )
    return path


def version_differences(before: dict[str, str], now: dict[str, str]) -> list[str]:
    """What differs between two processes, one line each; what only one of them knows of is compared where it matters.

    Args:
        before: as `running_versions` told it then; older versions of this program noted less.
        now: as it tells it now.
    """
    lines = []
    for name in dict.fromkeys((*before, *now)):
        old, new = before.get(name), now.get(name)
        if old != new and (old is not None or _is_plugin(name)) and name not in _NOT_COMPUTING:
            lines.append(f"{name}: {old or 'not there'} before, {new or 'not there'} now")
    return lines


def _is_plugin(name: str) -> bool:
    return name not in (*_COMPUTING, "python", "processor", BODIES, *_NOT_COMPUTING)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _processor() -> str:
    """The processor's name: results are the same on all of them, and whoever doubts that can tell them apart."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in text.splitlines() if line.startswith(("model name", "Model"))]
    return names[0] if names else platform.processor() or platform.machine()
