"""The algorithms under test: the defaults, and the operon-GA with every other value of every option."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

import pytest

from sceann_hil.evolution import GenerationalConfig, OGAConfig, OGAOptions, SGAConfig
from sceann_hil.evolution.oga_options import InitialOperons

GENOME_LENGTH = 24


def _variants() -> dict[str, GenerationalConfig]:
    variants: dict[str, GenerationalConfig] = {"sga": SGAConfig(), "oga": OGAConfig()}
    for name, field in OGAOptions.model_fields.items():
        if isinstance(field.default, StrEnum):
            for value in list(type(field.default))[1:]:
                settings: dict[str, Any] = {name: value}
                if value is InitialOperons.PER_PARAMETER:
                    settings["parameter_loci"] = 6
                variants[f"oga-{name}-{value}"] = OGAConfig(**settings)
    for cap in (1, 3, 32):
        variants[f"oga-cap-{cap}"] = OGAConfig(cap=cap)
    return variants


_VARIANTS = _variants()


@pytest.fixture(params=list(_VARIANTS), scope="session")
def config(request: pytest.FixtureRequest) -> GenerationalConfig:
    """Settings of one algorithm; the test runs once for each."""
    return _VARIANTS[request.param]


@pytest.fixture(scope="session")
def genome_length() -> int:
    """Bits per genome, a multiple of the variants' parameter_loci."""
    return GENOME_LENGTH
