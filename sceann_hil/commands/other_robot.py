"""Another robot for a configuration, from a YAML file that may hold no more than its `robot` section."""

from __future__ import annotations

import json
from pathlib import Path

import yaml

from sceann_hil.config import ExperimentConfig, dump_config, parse_config
from sceann_hil.config.file import read_text
from sceann_hil.errors import ConfigError


def with_robot_of(config: ExperimentConfig, path: Path) -> ExperimentConfig:
    """`config` on the robot that a file describes.

    Raises:
        ConfigError: the file cannot be read or has no robot, or the robot does not suit the rest.
    """
    text = read_text(path)
    try:
        data = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigError(f"{path}: {error}", "Nothing was started.") from error
    robot = data.get("robot") if isinstance(data, dict) else None
    if not isinstance(robot, dict):
        raise ConfigError(f"{path}: expected a section robot, found none.", "Nothing was started.")
    return parse_config(dump_config(config), str(path), [f"robot={json.dumps(robot)}"])
