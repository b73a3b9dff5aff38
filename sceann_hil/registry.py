"""Robots, tasks and algorithms, found by entry point, so that any installed package can add one.

A package adds a robot in its ``pyproject.toml``::

    [project.entry-points."sceann_hil.robots"]
    hexapod = "my_package.hexapod:HexapodConfig"

where ``HexapodConfig`` is a `sceann_hil.plugins.RobotConfig` with ``type: Literal["hexapod"] = "hexapod"``.
Nothing is imported before it is asked for.
"""

from __future__ import annotations

from difflib import get_close_matches
from enum import StrEnum
from functools import cache
from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints
from typing import Literal, overload

from sceann_hil.errors import PluginError
from sceann_hil.plugins import AlgorithmConfig, PluginConfig, RobotConfig, TaskConfig


class Group(StrEnum):
    """What can be plugged in; the values are the entry-point groups."""

    ROBOTS = "sceann_hil.robots"
    TASKS = "sceann_hil.tasks"
    ALGORITHMS = "sceann_hil.algorithms"

    @property
    def singular(self) -> str:
        """For messages, and the key of the section that chooses one."""
        return self.name.lower().removesuffix("s")


_BASES: dict[Group, type[PluginConfig]] = {
    Group.ROBOTS: RobotConfig,
    Group.TASKS: TaskConfig,
    Group.ALGORITHMS: AlgorithmConfig,
}


@cache
def entry_points(group: str) -> EntryPoints:
    """The entry points of all installed packages: looked up once, because a study asks thousands of times."""
    return metadata.entry_points(group=group)


def available(group: Group) -> dict[str, EntryPoint]:
    """The installed plug-ins of a group by name, sorted; nothing is imported.

    Raises:
        PluginError: two packages claim the same name, or there is none at all.
    """
    found: dict[str, EntryPoint] = {}
    for entry in entry_points(group=group.value):
        other = found.setdefault(entry.name, entry)
        if other != entry:
            raise PluginError(
                f"{group.singular} {entry.name!r} is provided twice: by {package_of(other)} ({other.value}) "
                f"and by {package_of(entry)} ({entry.value}).",
                "Uninstall one of the two packages.",
            )
    if not found:
        raise PluginError(
            f"No {group.value.partition('.')[2]} are installed: the entry points of sceann-hil are missing.",
            "Install the package (again): pip install -e .",
        )
    return dict(sorted(found.items()))


@overload
def load(group: Literal[Group.ROBOTS], name: str) -> type[RobotConfig]: ...
@overload
def load(group: Literal[Group.TASKS], name: str) -> type[TaskConfig]: ...
@overload
def load(group: Literal[Group.ALGORITHMS], name: str) -> type[AlgorithmConfig]: ...
@overload
def load(group: Group, name: str) -> type[PluginConfig]: ...
def load(group: Group, name: str) -> type[PluginConfig]:
    """The configuration model of one plug-in.

    Raises:
        PluginError: there is no such plug-in, it cannot be imported, or it is not what it claims to be.
    """
    plugins = available(group)
    if name not in plugins:
        near = get_close_matches(name, plugins, n=1)
        raise PluginError(
            f"There is no {group.singular} {name!r}; installed are {', '.join(plugins)}.",
            f"Did you mean {near[0]}?" if near else "Install the package that provides it.",
        )
    entry = plugins[name]
    who = f"{group.singular} {name!r} of {package_of(entry)} ({entry.value})"
    try:
        model = entry.load()
    except Exception as error:
        raise PluginError(
            f"The {who} cannot be loaded: {type(error).__name__}: {error}",
            "Repair, update or uninstall this package.",
        ) from error
    base = _BASES[group]
    if not (isinstance(model, type) and issubclass(model, base)):
        raise PluginError(
            f"The {who} is not a subclass of {base.__module__}.{base.__name__}.",
            "Tell the package's authors.",
        )
    default = model.model_fields["type"].default
    if default != name:
        raise PluginError(
            f"The {who} must declare `type: Literal[{name!r}] = {name!r}`, but its type is {default!r}.",
            "Tell the package's authors.",
        )
    return model


def package_of(entry: EntryPoint) -> str:
    """Name and version of the package that brings an entry point."""
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown package"
