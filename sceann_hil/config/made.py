"""`sceann_hil.config(...)`: a configuration in one call, from a file, a text, a mapping or sections."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sceann_hil.config.data import config_from
from sceann_hil.config.load import load_config, parse_config
from sceann_hil.config.model import ExperimentConfig
from sceann_hil.registry import Group

_PLUGGED = {group.singular for group in Group}


def made(source: Mapping[str, Any] | Path | str | None, sections: Mapping[str, Any]) -> ExperimentConfig:
    """A checked configuration.

    Args:
        source: a YAML file, YAML text (it has line breaks), a mapping, or None.
        sections: sections and keys that replace those of the source. A task, robot or algorithm may be given as a word,
            its type.

    Raises:
        ConfigError: what is wrong.
        PluginError: a package that brings a robot, task or algorithm is broken.
    """
    whole = {
        name: {"type": value} if name in _PLUGGED and isinstance(value, str) else value
        for name, value in sections.items()
    }
    if source is None:
        return config_from(whole, "config")
    if isinstance(source, Mapping):
        return config_from(source, "config", whole)
    is_text = isinstance(source, str) and "\n" in source
    config = parse_config(str(source), "config") if is_text else load_config(source)
    return config.with_changes(whole) if whole else config
