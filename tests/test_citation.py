"""CITATION.cff is readable and names the version that is installed."""

from __future__ import annotations

from pathlib import Path

import yaml

from sceann_hil.versions import PROGRAM, running_versions


def test_the_citation_names_this_version_and_the_paper() -> None:
    citation = yaml.safe_load((Path(__file__).parents[1] / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()
    assert citation["version"] == running_versions()[PROGRAM]
    assert citation["references"][0]["authors"][0]["family-names"] == "Katada"
