"""Whatever enters compiled code is checked where `Trials` are made."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import Trials

SIZE = NetworkSize(2, 1, 1)


def _trials() -> Trials:
    return Trials(
        size=SIZE,
        dynamics=Dynamics(),
        weights=np.zeros((3, SIZE.n_neurons, SIZE.n_sources), np.int8),
        genome_index=np.array([0, 2], np.int32),
        starts=np.zeros((2, 4)),
        keys=np.zeros(2, np.uint64),
        max_steps=10,
        ids=np.arange(2),
    )


BAD: list[tuple[str, Any, str]] = [
    ("weights", np.zeros((3, 2, 3), np.int8), r"weights: expected shape \(any, 2, 4\), got \(3, 2, 3\)"),
    ("weights", np.zeros((2, 4), np.int8), r"weights: expected shape \(any, 2, 4\), got \(2, 4\)"),
    ("weights", np.full((3, 2, 4), 2, np.int8), r"weights: expected -1..1, got 2..2"),
    ("weights", np.zeros((3, 2, 4)), r"weights: expected int8, got float64"),
    ("genome_index", np.array([0, 3]), r"genome_index: expected 0..2, got 0..3"),
    ("genome_index", np.array([-1, 0]), r"genome_index: expected 0..2, got -1..0"),
    ("genome_index", np.array([[0, 1]]), r"genome_index: expected shape"),
    ("genome_index", np.array([0.0, 1.0]), r"genome_index: expected int32, got float64"),
    ("starts", np.zeros((3, 4)), r"starts: expected shape \(2, any\), got \(3, 4\)"),
    ("starts", np.zeros(4), r"starts: expected shape \(2, any\), got \(4,\)"),
    ("starts", np.array([[0.0, np.nan], [0.0, 0.0]]), r"starts: expected finite values, got nan"),
    ("starts", np.array([["a", "b"], ["c", "d"]]), r"starts: expected float64, got <U1"),
    ("keys", np.zeros(1, np.uint64), r"keys: expected shape \(2\), got \(1,\)"),
    ("keys", np.array([-1, 0]), r"keys: expected 0..18446744073709551615, got -1..0"),
    ("ids", np.zeros(3, np.int64), r"ids: expected shape \(2\), got \(3,\)"),
    ("max_steps", 0, r"max_steps: expected 1..\d+, got 0"),
    ("max_steps", 2**31, r"max_steps: expected 1..\d+, got 2147483648"),
]


@pytest.mark.parametrize(("name", "value", "message"), BAD)
def test_what_does_not_fit_is_refused_with_what_was_expected_and_got(name: str, value: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(_trials(), **{name: value})


def test_arrays_are_made_contiguous_and_of_the_right_type() -> None:
    wide = np.zeros((3, SIZE.n_neurons, 2 * SIZE.n_sources), np.int64)
    trials = replace(_trials(), weights=wide[:, :, ::2], genome_index=np.array([2, 0]), keys=np.array([1, 2]))
    assert trials.weights.flags.c_contiguous
    types = [array.dtype for array in (trials.weights, trials.genome_index, trials.starts, trials.keys, trials.ids)]
    assert types == [np.int8, np.int32, np.float64, np.uint64, np.int64]
