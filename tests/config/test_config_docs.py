"""docs/configuration.md names the keys that there are, and its example plug-in is one."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from sceann_hil.config import ControllerConfig, ExperimentConfig
from sceann_hil.plugins import RobotConfig, Section
from sceann_hil.robot import Robot, RobotSpec

TEXT = (Path(__file__).parent.parent.parent / "docs" / "configuration.md").read_text(encoding="utf-8")


def documented(head: str) -> dict[str, str]:
    table = TEXT.partition(f"| {head} |")[2].partition("\n\n")[0]
    return dict(re.findall(r"^\| `(\w+)` \| (?:default )?`?(\S+?)`? \|", table, re.MULTILINE))


def test_the_tables_name_every_key_and_its_default() -> None:
    for head, model in (("key", ExperimentConfig), ("key of `controller`", ControllerConfig)):
        expected = {
            name: "required" if field.is_required() else _default(field.default)
            for name, field in model.model_fields.items()
        }
        assert documented(head) == expected


def _default(value: object) -> str:
    """A section or a name that may be missing has no default to print."""
    return "optional" if value is None or isinstance(value, Section) else str(value)


def test_the_example_plugin_works_as_it_is_printed() -> None:
    source = TEXT.partition("```python\n")[2].partition("```")[0]
    names: dict[str, Any] = {
        "Annotated": Annotated,
        "Field": Field,
        "Literal": Literal,
        "Robot": Robot,
        "RobotConfig": RobotConfig,
        "RobotSpec": RobotSpec,
        "__name__": "hexapod",
    }
    exec(compile(source, "docs", "exec", dont_inherit=True), names)
    spec = names["HexapodConfig"](port="/dev/null").spec
    assert (spec.n_sensors, spec.n_motors, spec.tick_s) == (4, 3, 0.05)
