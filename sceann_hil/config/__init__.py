"""The configuration of an experiment: strict YAML in, a frozen model out.

* `load_config` reads a file (and ``--set`` overrides), `parse_config` a text: `load`, on top of `file`,
  `document`, `overrides` (where things stand) and `explain`, `problems` (what to say of them).
* `ExperimentConfig` and `ControllerConfig` are the models: `model`. The sections `robot`, `task` and
  `algorithm` are plug-ins: `sceann_hil.plugins`, `sceann_hil.registry`.
* `dump_config` writes the canonical text, `config_difference` compares two: `text`.
* `json_schema` and `schema_text` are for editors: `schema`.
"""

from sceann_hil.config.load import load_config, parse_config
from sceann_hil.config.model import ControllerConfig, ExperimentConfig
from sceann_hil.config.schema import json_schema, schema_text
from sceann_hil.config.text import Difference, config_difference, dump_config

__all__ = [
    "ControllerConfig",
    "Difference",
    "ExperimentConfig",
    "config_difference",
    "dump_config",
    "json_schema",
    "load_config",
    "parse_config",
    "schema_text",
]
