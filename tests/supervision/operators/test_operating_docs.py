"""The configuration snippets of docs/operating.md are valid, and its table of keys is the console's."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import yaml

from sceann_hil.supervision.operators.keymap import KEYS
from tests.runs import GOAL, config_of

DOCUMENT = (Path(__file__).parents[3] / "docs" / "operating.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"```yaml\n(.*?)```", DOCUMENT, re.DOTALL)


@pytest.mark.parametrize("snippet", SNIPPETS, ids=lambda text: text.partition(":")[0])
def test_every_snippet_is_a_valid_section(snippet: str) -> None:
    sections = yaml.safe_load(snippet)
    config_of(GOAL, *(f"{name}={json.dumps(section)}" for name, section in sections.items()))


def test_every_key_is_documented() -> None:
    table = DOCUMENT[DOCUMENT.index("| when |") : DOCUMENT.index("The same words and keys")]
    assert {key for key in KEYS if key != " "} == set(re.findall(r"`([a-z!])`", table))
    assert "| space " in table
