"""Strict YAML: the core schema of YAML 1.2, every value with its place."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sceann_hil.config.document import parse
from sceann_hil.errors import ConfigError


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("yes", "yes"),
        ("no", "no"),
        ("on", "on"),
        ("off", "off"),
        ("y", "y"),
        ("true", True),
        ("False", False),
        ("1e-3", 0.001),
        ("1E5", 100000.0),
        ("-1.5e+3", -1500.0),
        (".5", 0.5),
        ("5.", 5.0),
        ("010", 10),
        ("0o10", 8),
        ("0x1f", 31),
        ("+3", 3),
        ("1_000", "1_000"),
        ("1:30", "1:30"),
        ("2024-01-01", "2024-01-01"),
        ("~", None),
        ("null", None),
        ("", None),
        ("-", [None]),
        ("'3'", "3"),
        ('"true"', "true"),
        ("1.2.3", "1.2.3"),
        ("e5", "e5"),
        ("[1, [2.5, a]]", [1, [2.5, "a"]]),
        ("{}", {}),
    ],
)
def test_plain_scalars_are_read_as_yaml_1_2_reads_them(text: str, value: Any) -> None:
    read = parse(f"key: {text}" if text != "-" else "key:\n  -", "x").data["key"]
    assert read == value
    assert type(read) is type(value)


def test_infinity_is_read_as_a_number_for_the_validation_to_refuse() -> None:
    assert parse("[.inf, -.Inf]", "x").data == [float("inf"), float("-inf")]
    assert parse("[.nan]", "x").data[0] != 0


def test_keys_are_text_however_they_look() -> None:
    assert parse("{1: a, true: b, null: c}", "x").data == {"1": "a", "true": "b", "null": "c"}


def test_every_key_and_value_has_its_place() -> None:
    document = parse("a: 1\nb:\n  - x\n  - {c: 2}\n", "file.yaml")
    assert str(document.keys["b",]) == "file.yaml:2:1"
    assert str(document.values["a",]) == "file.yaml:1:4"
    assert str(document.values["b", 0]) == "file.yaml:3:5"
    assert str(document.keys["b", 1, "c"]) == "file.yaml:4:6"
    assert str(document.values["b", 1, "c"]) == "file.yaml:4:9"


def test_the_place_of_something_unwritten_is_the_section_around_it() -> None:
    document = parse("a: 1\nb:\n  c: 2\n", "file.yaml")
    assert str(document.place_of_value(("b", "d", "e"))) == "file.yaml:2:1"
    assert str(document.place_of_key(("z",))) == "file.yaml:1:1"


def test_only_comments_are_no_data() -> None:
    assert parse("# a\n\n# b\n", "x").data is None


@settings(deadline=None, max_examples=500)
@given(st.text(st.sampled_from("ab:-[]{},'\"#&*!|>%@`? \n\t01.~\x00\x85\ud800\U0001f916"), max_size=40))
def test_no_text_gets_anything_but_data_or_a_config_error(text: str) -> None:
    try:
        document = parse(text, "x")
    except ConfigError as error:
        assert str(error).startswith("x:")  # noqa: PT017 (most texts are refused, and some are not)
    else:
        assert document.data is None or document.values[()].line >= 1
