"""What the tests of studies share."""

from __future__ import annotations

import pytest
from small_study import SMALL

from sceann_hil.study import Study, parse_study


@pytest.fixture
def small() -> Study:
    return parse_study(SMALL, "small.yaml")
