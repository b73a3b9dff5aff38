"""Every file in bad/ is refused with the message beside it: one screen, no traceback."""

from __future__ import annotations

from pathlib import Path

import pytest

from sceann_hil.config import load_config
from sceann_hil.errors import ConfigError, ExitCode

BAD = Path(__file__).parent / "bad"
FILES = sorted(path.name for path in BAD.glob("*.yaml"))


@pytest.mark.usefixtures("bench")
@pytest.mark.parametrize("file", FILES)
def test_bad_file_is_refused_with_the_expected_message(file: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(BAD)
    with pytest.raises(ConfigError) as caught:
        load_config(file)
    expected = Path(file).with_suffix(".expected").read_text(encoding="utf-8")
    assert caught.value.message + "\n" == expected
    assert caught.value.exit_code is ExitCode.CONFIG
    assert caught.value.hint
    lines = caught.value.message.splitlines()
    assert len(lines) <= 12
    assert max(map(len, lines)) <= 300


def test_every_expected_message_belongs_to_a_file() -> None:
    assert {path.stem for path in BAD.glob("*.expected")} == {Path(file).stem for file in FILES}
