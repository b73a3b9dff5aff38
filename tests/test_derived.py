"""Files that can be made again: damage is noticed, and a computer that keeps nothing still works."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sceann_hil import derived
from sceann_hil.network.code_cache import CodeCache
from sceann_hil.network.compiled import compiled


def test_what_is_written_whole_is_read_and_damage_is_thrown_away(tmp_path: Path) -> None:
    path = tmp_path / "file"
    assert derived.read(path) is None
    derived.write(path, b"content")
    assert derived.read(path) == b"content"
    whole = path.read_bytes()
    for damaged in (b"", whole[:10], whole[:-1], whole + b"\0", b"\0" * 80, bytes([whole[0] ^ 1]) + whole[1:]):
        path.write_bytes(damaged)
        assert derived.read(path) is None
        assert not path.exists()
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_was_altered_after_it_was_sealed_is_thrown_away(tmp_path: Path) -> None:
    program = tmp_path / "program.elf"
    assert not derived.is_sealed(program)
    program.write_bytes(b"code")
    derived.seal(program)
    assert derived.is_sealed(program)
    for damage in (b"", b"cod", b"cOde"):
        program.write_bytes(damage)
        assert not derived.is_sealed(program)
        assert not program.exists()
        program.write_bytes(b"code")


def _twice(x: float) -> float:
    return x + x


@pytest.mark.parametrize("damage", [b"", b"cut off", b"\0" * 5000, None])
def test_damaged_machine_code_is_made_again(
    damage: bytes | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(derived.VARIABLE, str(tmp_path))
    assert compiled(_twice)(np.float64(2.0)) == 4.0
    (file,) = (tmp_path / "code").iterdir()
    whole = file.read_bytes()
    if damage is None:
        # whole, but nothing that the compiler understands
        derived.write(file, b"\x80\x04\x95nonsense")
    else:
        file.write_bytes(damage)
    again = compiled(_twice)
    assert again(np.float64(2.0)) == 4.0
    assert len(file.read_bytes()) == len(whole)
    assert _cache(again).load_overload(again.signatures[0], again.targetctx) is not None  # type: ignore[attr-defined]


def _cache(function: object) -> CodeCache:
    cache = function._cache  # type: ignore[attr-defined]
    assert isinstance(cache, CodeCache)
    return cache


SMALL = """
import sys
import numpy as np
from sceann_hil.network.compiled import compiled

@compiled
def mean(values):
    return np.mean(values)

print(mean(np.arange(4.0)), "numba.np.arraymath" in sys.modules)
"""


def test_machine_code_is_loaded_without_what_compiled_it(tmp_path: Path) -> None:
    (tmp_path / "small.py").write_text(SMALL)
    environment = {
        **os.environ,
        derived.VARIABLE: str(tmp_path / "cache"),
        "PYTHONPATH": str(Path(__file__).parents[1]),
    }
    told = [
        subprocess.run(
            [sys.executable, "-B", "-c", "import small"],
            cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=True,
        ).stdout.split()
        for _ in range(2)
    ]  # fmt: skip
    assert told == [["1.5", "True"], ["1.5", "False"]]


PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from sceann_hil.network.recompute import recompute
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics
size = NetworkSize(1, 0, 1)
for _ in range(2):
    print(len(recompute(np.ones((1, 2), np.int8), size, Dynamics(), np.zeros((3, 1), np.uint16)).hashes))
"""


def _run(folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    kept = {
        name: value for name, value in os.environ.items() if name not in ("HOME", "XDG_CACHE_HOME", derived.VARIABLE)
    }
    command = [sys.executable, "-B", "-c", PROGRAM, str(Path(__file__).parents[1])]
    return subprocess.run(
        command, cwd=folder, env={**kept, **environment}, capture_output=True, text=True, timeout=120, check=False
    )


@pytest.mark.parametrize("what", ["a file in its way", "a read-only system folder"])
def test_without_a_cache_there_is_one_warning_and_nothing_left_behind(what: str, tmp_path: Path) -> None:
    home, temporary = tmp_path / "home", tmp_path / "tmp"
    home.mkdir()
    temporary.mkdir()
    environment = {"HOME": str(home), "TMPDIR": str(temporary)}
    if what == "a file in its way":
        (home / ".cache").write_text("not a folder")
    else:
        environment["XDG_CACHE_HOME"] = "/proc/1"
    before = sorted(tmp_path.rglob("*"))
    done = _run(tmp_path, **environment)
    assert (done.returncode, done.stdout) == (0, "3\n3\n"), done.stderr
    assert done.stderr.count("\n") == 1
    assert "no cache can be kept" in done.stderr
    assert sorted(tmp_path.rglob("*")) == before


def _no_such_user(_: str) -> Path:
    raise KeyError("getpwuid(): uid not found: 4711")


@pytest.mark.parametrize("without_home", [_no_such_user, lambda _: Path("~/.cache/sceann-hil")])
def test_a_user_without_a_home_gets_a_temporary_folder(
    without_home: Callable[[str], Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(derived.VARIABLE, raising=False)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(derived.platformdirs, "user_cache_path", without_home)
    derived._root.cache_clear()
    derived._warn.cache_clear()
    try:
        folder = derived.folder("code")
        assert folder.parent.parent == tmp_path
        # what is started from here shares it, and need not say so again
        assert os.environ[derived.VARIABLE] == str(folder.parent)
        assert derived.folder("code") == folder
        assert capsys.readouterr().err.count("this user has no home") == 1
    finally:
        derived._root.cache_clear()


def test_the_cache_s_folder_can_be_named_and_is_private(tmp_path: Path) -> None:
    done = _run(tmp_path, HOME=str(tmp_path / "home"), **{derived.VARIABLE: str(tmp_path / "mine")})
    assert (done.returncode, done.stderr) == (0, "")
    (file,) = (tmp_path / "mine" / "code").iterdir()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert not (tmp_path / "home").exists()
