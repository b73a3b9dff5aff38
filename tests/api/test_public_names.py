"""The public names: there, lazily, and typed."""

from __future__ import annotations

import subprocess
import sys
from importlib.resources import files

import pytest

import sceann_hil as sh


def test_every_public_name_can_be_had() -> None:
    for name in sh.__all__:
        assert getattr(sh, name) is not None
        assert name in dir(sh)


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="evolv"):
        sh.evolv  # type: ignore[attr-defined]  # noqa: B018


def test_config_is_a_function_and_a_room_whichever_was_imported_first() -> None:
    for first in ("import sceann_hil.config", "import sceann_hil"):
        code = f"{first}\nimport sceann_hil as sh\nprint(callable(sh.config), sh.config.load_config.__name__)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout == "True load_config\n"


def test_the_package_is_typed() -> None:
    assert files("sceann_hil").joinpath("py.typed").is_file()
