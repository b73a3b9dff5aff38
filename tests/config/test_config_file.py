"""What stands in the way of reading a file: one message each."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from sceann_hil.config import load_config
from sceann_hil.config.file import MAX_BYTES, read_text
from sceann_hil.errors import ConfigError


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def message(path: str | Path) -> str:
    with pytest.raises(ConfigError) as caught:
        load_config(path)
    return caught.value.message


def test_a_missing_file_is_named_with_the_nearest_one() -> None:
    Path("quickstart.yaml").write_text("seed: 1")
    assert message("quikstart.yaml") == "quikstart.yaml: no such file, did you mean quickstart.yaml?"
    assert message("nowhere/else.yaml") == "nowhere/else.yaml: no such file"


def test_a_directory_is_named_with_the_configurations_in_it() -> None:
    Path("configs").mkdir()
    Path("configs/a.yaml").write_text("seed: 1")
    assert message("configs") == "configs: expected a YAML file, got a directory (it holds a.yaml)"


def test_a_huge_file_is_refused_without_being_parsed() -> None:
    Path("huge.yaml").write_text("# comment\n" * (MAX_BYTES // 10 + 1))
    assert message("huge.yaml") == "huge.yaml: expected at most 1024 KiB of YAML, got a larger file"


def test_a_file_that_never_ends_is_refused() -> None:
    assert message("/dev/zero") == "/dev/zero: expected at most 1024 KiB of YAML, got a larger file"


def test_a_path_through_a_file_is_refused() -> None:
    Path("file").write_text("x")
    assert message("file/run.yaml") == "file/run.yaml: cannot be read: Not a directory"


def test_a_path_that_no_system_can_open_is_refused() -> None:
    assert message("a\0b") == "a\0b: cannot be read: embedded null byte"
    assert message("x" * 5000).endswith("cannot be read: File name too long")


def test_a_byte_order_mark_is_accepted() -> None:
    Path("bom.yaml").write_bytes(b"\xef\xbb\xbfseed: 1\n")
    assert read_text("bom.yaml") == "seed: 1\n"


def test_a_pipe_can_be_read() -> None:
    reader, writer = os.pipe()
    os.write(writer, b"seed: 1\n")
    os.close(writer)
    assert read_text(f"/dev/fd/{reader}") == "seed: 1\n"
    os.close(reader)
