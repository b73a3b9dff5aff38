"""The house: which room may use which, no circles, no giants, and the viewer's library behind one door."""

from __future__ import annotations

import ast
import statistics
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = (
    *(
        "timespans",
        "lazily",
        "pasting",
        "errors",
        "places",
        "seeds",
        "derived",
        "guarded",
        "plugins",
        "registry",
        "versions",
        "plugin_faults",
    ),
    *("network", "robot", "tasks", "evolution", "journal", "link", "supervision", "config"),
    *("run", "firmware", "recording", "study", "commands", "api", "cli", "start"),
)
"""Folders and modules of `sceann_hil`, bottom up: each uses only those before it."""
OUTSIDE = ("", "testing")
"""The public face, which imports lazily whatever it names, and the kits for plug-ins' tests: nothing uses them."""
WITHIN_A_METHOD = {
    # `config.with_changes` reads a changed configuration with the very model that it is a method of
    ("sceann_hil.config.model", "sceann_hil.config.data"),
    # a plug-in's section builds the algorithm that it configures
    ("sceann_hil.run.transfer.settings", "sceann_hil.run.transfer.algorithm"),
    ("sceann_hil.run.transfer.settings", "sceann_hil.run.transfer.preparation"),
}
"""Imports inside a method that close a circle on purpose."""
LONGEST = 400
MEDIAN = 150


@dataclass(frozen=True)
class Import:
    """One module needs another one, wherever in its text it says so."""

    by: str
    of: str
    for_types_only: bool


@cache
def modules() -> dict[str, Path]:
    """All modules of the product by their names."""
    found = {}
    for top in ("sceann_hil", "backends"):
        for path in (ROOT / top).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def imports() -> tuple[Import, ...]:
    """Everything that a module of ours imports, of ours or of others."""
    return tuple(
        Import(name, needed, for_types)
        for name, path in modules().items()
        for needed, for_types in _imported(ast.parse(path.read_text(encoding="utf-8")).body, for_types=False)
    )


def _imported(nodes: Iterable[ast.AST], *, for_types: bool) -> Iterator[tuple[str, bool]]:
    for node in nodes:
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            yield from _imported(node.body, for_types=True)
        elif isinstance(node, ast.Import):
            yield from ((alias.name, for_types) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            whole = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from ((name if name in modules() else str(node.module), for_types) for name in whole)
        else:
            yield from _imported(ast.iter_child_nodes(node), for_types=for_types)


def _room(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


def test_every_room_has_its_place() -> None:
    rooms = {_room(name) for name in modules() if name.startswith("sceann_hil")}
    assert rooms == {*ROOMS, *OUTSIDE}


def test_nothing_imports_upwards() -> None:
    upwards = [
        f"{one.by} -> {one.of}"
        for one in imports()
        if one.by.startswith("sceann_hil")
        and one.of.startswith("sceann_hil")
        and not one.for_types_only
        and _room(one.by) in ROOMS
        and (_room(one.of) not in ROOMS or ROOMS.index(_room(one.by)) < ROOMS.index(_room(one.of)))
    ]
    assert upwards == []


def test_the_core_knows_no_robot() -> None:
    assert [f"{one.by} -> {one.of}" for one in imports() if _is_core(one.by) and one.of.startswith("backends")] == []


def _is_core(module: str) -> bool:
    return module.startswith("sceann_hil")


def test_no_modules_import_each_other_in_a_circle() -> None:
    uses: dict[str, set[str]] = {name: set() for name in modules()}
    for one in imports():
        if (
            one.of in modules()
            and one.of != one.by
            and not one.for_types_only
            and (one.by, one.of) not in WITHIN_A_METHOD
        ):
            uses[one.by].add(one.of)
    # whoever uses nobody is in no circle, and neither is who then uses nobody else
    while ends := [name for name, used in uses.items() if not used & uses.keys()]:
        for name in ends:
            del uses[name]
    while ends := [name for name in uses if not any(name in used for used in uses.values())]:
        for name in ends:
            del uses[name]
    assert sorted(uses) == []


def test_the_viewer_s_library_is_imported_in_one_room() -> None:
    rooms = {_room(one.by) for one in imports() if one.of.split(".")[0] == "rerun"}
    assert rooms == {"recording"}


@pytest.mark.parametrize("name", modules())
def test_a_module_is_one_idea(name: str) -> None:
    assert len(modules()[name].read_text(encoding="utf-8").splitlines()) <= LONGEST


def test_most_modules_are_short() -> None:
    assert statistics.median(len(path.read_text(encoding="utf-8").splitlines()) for path in modules().values()) < MEDIAN


def test_test_modules_have_names_of_their_own() -> None:
    # pytest imports them by these names, and with two of the same none of the whole suite is run
    names = Counter(path.name for path in Path(__file__).parent.rglob("test_*.py"))
    assert [name for name, times in names.items() if times > 1] == []
