"""What was computed is kept whole, or made again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sceann_hil.config import ExperimentConfig
from sceann_hil.run.transfer import cache
from sceann_hil.run.transfer.preparation import Preparation


def test_every_damaged_byte_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "some.npz"
    cache.save(path, {"a": np.arange(5)})
    whole = path.read_bytes()
    for place in range(0, len(whole), 7):
        broken = bytearray(whole)
        broken[place] ^= 0x10
        path.write_bytes(broken)
        assert cache.load(path) is None
    for length in (0, 10, len(whole) - 1):
        path.write_bytes(whole[:length])
        assert cache.load(path) is None
    path.write_bytes(whole)
    known = cache.load(path)
    assert known is not None
    assert known["a"].tolist() == [0, 1, 2, 3, 4]


def test_the_longest_unused_goes_first(tmp_path: Path) -> None:
    import os

    for number in range(4):
        path = tmp_path / f"kind-{number}" / "part.npz"
        cache.save(path, {"a": np.zeros(1000)})
        os.utime(path, (number, number))
    cache.prune(tmp_path / "kind-0", 20_000)
    assert sorted(path.parent.name for path in tmp_path.glob("*/*")) == ["kind-0", "kind-3"]


def test_a_damaged_part_of_an_ensemble_is_made_again(small: ExperimentConfig, own_cache: Path) -> None:
    candidates = np.random.default_rng(0).integers(0, 2, (8, small.genome_length), np.uint8)
    told: list[int] = []

    def prepared() -> np.ndarray:
        return (
            Preparation(small, (), 0, 10, lambda _what, done, _total: told.append(done))
            .prepared(candidates)
            .ensemble.fitness
        )

    before = set(own_cache.glob("ensemble-*/*"))
    first = prepared()
    parts = sorted(set(own_cache.glob("ensemble-*/*")) - before)
    assert len(parts) == 2
    parts[1].write_bytes(parts[1].read_bytes()[:-3])
    assert (prepared() == first).all()
    assert cache.load(parts[1]) is not None


def test_a_full_disk_is_told_and_loses_nothing(small: ExperimentConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    from sceann_hil.errors import DiskFull, as_user_error

    def full(*_: object) -> int:
        raise OSError(28, "No space left on device", "part")

    monkeypatch.setattr(Path, "write_bytes", full)
    candidates = np.random.default_rng(1).integers(0, 2, (8, small.genome_length), np.uint8)
    with pytest.raises(OSError, match="No space left") as caught:
        Preparation(small, (), 0, 10).prepared(candidates)
    assert isinstance(as_user_error(caught.value), DiskFull)
