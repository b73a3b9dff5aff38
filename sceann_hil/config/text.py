"""A configuration as canonical YAML, and what differs between two."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import yaml

from sceann_hil.config.document import FLOAT_PATTERN, FLOAT_TAG, INT_PATTERN, INT_TAG, NUMBER_STARTS
from sceann_hil.config.model import ExperimentConfig
from sceann_hil.config.problems import Path, dotted


def dump_config(config: ExperimentConfig) -> str:
    """YAML with every default spelled out, in a fixed order; `parse_config` gives an equal configuration.

    This is the text that the journal keeps: equal configurations give equal bytes.
    """
    return yaml.dump(
        config.model_dump(mode="json"),
        Dumper=_Dumper,
        sort_keys=False,
        default_flow_style=False,
        width=2**30,
    )


@dataclass(frozen=True, slots=True)
class Difference:
    """One key with two values; None where one configuration does not have it.

    Attributes:
        key: the dotted key.
        before: its value in the first configuration.
        after: its value in the second one.
    """

    key: str
    before: Any
    after: Any

    def __str__(self) -> str:
        return f"{self.key}: {_written(self.before)} -> {_written(self.after)}"


def config_difference(before: ExperimentConfig, after: ExperimentConfig) -> list[Difference]:
    """The keys whose values differ, in the order of the file; empty for equal configurations."""
    return data_difference(before.model_dump(mode="json"), after.model_dump(mode="json"))


def data_difference(before: Any, after: Any) -> list[Difference]:
    """The same for plain data."""
    one, other = dict(_leaves(before, ())), dict(_leaves(after, ()))
    return [
        Difference(dotted(path), one.get(path), other.get(path))
        for path in {**one, **other}
        if one.get(path) != other.get(path)
    ]


def _leaves(value: Any, path: Path) -> Iterator[tuple[Path, Any]]:
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            yield from _leaves(inner, (*path, key))
    else:
        yield path, value


def _written(value: Any) -> str:
    """A value as one line of YAML."""
    text: str = yaml.dump(value, Dumper=_Dumper, default_flow_style=True, width=2**30)
    return text.removesuffix("\n").removesuffix("\n...")


class _Dumper(yaml.SafeDumper):
    """Quotes whatever would not be text in YAML 1.1 or in YAML 1.2; lists stay on one line."""

    def ignore_aliases(self, _data: Any) -> bool:
        return True


def _list_node(dumper: _Dumper, values: list[Any]) -> yaml.Node:
    return dumper.represent_sequence("tag:yaml.org,2002:seq", values, flow_style=True)


_Dumper.add_representer(list, _list_node)
_Dumper.add_implicit_resolver(INT_TAG, INT_PATTERN, NUMBER_STARTS)
_Dumper.add_implicit_resolver(FLOAT_TAG, FLOAT_PATTERN, NUMBER_STARTS)
