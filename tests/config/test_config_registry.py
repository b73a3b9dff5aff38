"""Plug-ins by entry point: lazy, and with the package's name in every complaint."""

from __future__ import annotations

import sys
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from sceann_hil.errors import ExitCode, PluginError
from sceann_hil.registry import Group, available, load, package_of

Install = Callable[[str, Mapping[str, Mapping[str, str]]], None]


@pytest.mark.usefixtures("bench")
def test_plugins_are_listed_by_name() -> None:
    assert list(available(Group.ROBOTS)) == ["rover", "stilt"]
    assert list(available(Group.TASKS)) == ["reach", "stand"]
    assert package_of(available(Group.ROBOTS)["rover"]) == "bench 1.0"


def test_listing_imports_nothing(install: Install) -> None:
    install("absent", {"robots": {"ghost": "a_module_that_does_not_exist:Ghost"}})
    assert list(available(Group.ROBOTS)) == ["ghost"]


@pytest.mark.usefixtures("bench")
def test_a_plugin_is_loaded_by_name() -> None:
    model = load(Group.ROBOTS, "rover")
    assert model.__name__ == "RoverConfig"
    assert "bench_plugins" in sys.modules


def complaint(group: Group, name: str) -> str:
    with pytest.raises(PluginError) as caught:
        load(group, name)
    assert caught.value.exit_code is ExitCode.PLUGIN
    assert caught.value.hint
    return caught.value.message


def test_two_packages_with_one_name_are_both_named(install: Install) -> None:
    install("one", {"tasks": {"reach": "one:Reach"}})
    install("other", {"tasks": {"reach": "other:Reach"}})
    assert complaint(Group.TASKS, "reach") == (
        "task 'reach' is provided twice: by one 1.0 (one:Reach) and by other 1.0 (other:Reach)."
    )


@pytest.mark.usefixtures("bench")
def test_an_unknown_name_is_answered_with_the_installed_ones() -> None:
    assert complaint(Group.TASKS, "reech") == "There is no task 'reech'; installed are reach, stand."
    with pytest.raises(PluginError, match=r"Did you mean reach\?"):
        load(Group.TASKS, "reech")


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("import a_module_that_does_not_exist", "cannot be loaded: ModuleNotFoundError: No module named"),
        ("1 / 0", "cannot be loaded: ZeroDivisionError: division by zero"),
        ("Hexapod = (", "cannot be loaded: SyntaxError: "),
        ("", "cannot be loaded: AttributeError: module"),
        ("Hexapod = int", "is not a subclass of sceann_hil.plugins.RobotConfig."),
        ("Hexapod = 3", "is not a subclass of sceann_hil.plugins.RobotConfig."),
        (
            "from bench_plugins import RoverConfig as Hexapod",
            "must declare `type: Literal['hexapod'] = 'hexapod'`, but its type is 'rover'.",
        ),
    ],
)
def test_a_broken_plugin_is_reported_with_its_package(
    install: Install, tmp_path: Path, source: str, reason: str
) -> None:
    module = f"hexapod_{zlib.crc32(source.encode())}"
    install("six-legs", {"robots": {"hexapod": f"{module}:Hexapod"}})
    (tmp_path / "site" / f"{module}.py").write_text(source)
    message = complaint(Group.ROBOTS, "hexapod")
    assert message.startswith(f"The robot 'hexapod' of six-legs 1.0 ({module}:Hexapod) {reason}")


@pytest.mark.usefixtures("install")
def test_an_installation_without_plugins_says_how_to_repair_it() -> None:
    with pytest.raises(PluginError, match="No algorithms are installed"):
        available(Group.ALGORITHMS)
