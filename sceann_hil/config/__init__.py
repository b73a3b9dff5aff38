"""The configuration of an experiment: strict YAML in, a frozen model out.

* `load_config` reads a file (and ``--set`` overrides), `parse_config` a text: `load`, on top of `file`,
  `document`, `overrides` (where things stand) and `explain`, `problems` (what to say of them).
* `ExperimentConfig` and `ControllerConfig` are the models: `model`. The sections `robot`, `task` and
  `algorithm` are plug-ins: `sceann_hil.plugins`, `sceann_hil.registry`.
* `config_from` takes a mapping instead of a file, `ExperimentConfig.with_changes` changes some keys, `with_robot_of`
  puts an experiment on another file's robot: `data`.
* `dump_config` writes the canonical text, `config_difference` compares two: `text`.
* `journalled_config` is what a run was made with; `noted_config` too, whatever is installed here: `journalled`.
* `outline_of` says what a configuration names, without its plug-ins: `outline`.
* `json_schema` and `schema_text` are for editors: `schema`.

The names are imported when they are used: whoever only looks into a run needs none of the models. The module itself
can be called: `sceann_hil.config(...)` makes a configuration (see `made`).
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from sceann_hil.lazily import lazily

if TYPE_CHECKING:
    from sceann_hil.config.data import config_from, with_robot_of
    from sceann_hil.config.journalled import config_as_made, journalled_config, noted_config, require_installed
    from sceann_hil.config.load import load_config, parse_config
    from sceann_hil.config.model import ControllerConfig, ExperimentConfig
    from sceann_hil.config.outline import Outline, outline_of
    from sceann_hil.config.schema import json_schema, schema_text
    from sceann_hil.config.text import Difference, config_difference, dump_config

__all__ = [
    "ControllerConfig",
    "Difference",
    "ExperimentConfig",
    "Outline",
    "config_as_made",
    "config_difference",
    "config_from",
    "dump_config",
    "journalled_config",
    "json_schema",
    "load_config",
    "noted_config",
    "outline_of",
    "parse_config",
    "require_installed",
    "schema_text",
    "with_robot_of",
]

__getattr__ = lazily(
    __name__,
    {
        "data": ("config_from", "with_robot_of"),
        "journalled": ("config_as_made", "journalled_config", "noted_config", "require_installed"),
        "load": ("load_config", "parse_config"),
        "model": ("ControllerConfig", "ExperimentConfig"),
        "outline": ("Outline", "outline_of"),
        "schema": ("json_schema", "schema_text"),
        "text": ("Difference", "config_difference", "dump_config"),
    },
)


class _Callable(ModuleType):
    """This module, which shares its name with the public function."""

    def __call__(self, source: Mapping[str, Any] | Path | str | None = None, /, **sections: Any) -> ExperimentConfig:
        from sceann_hil.config.made import made

        return made(source, sections)


sys.modules[__name__].__class__ = _Callable
