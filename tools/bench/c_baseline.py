"""Pole balancing in hand-tuned C (``pole.c``), where a C compiler is installed."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.controller import sigmoid_table

_FREE = ["-ffast-math"]
_EXACT = ["-DEXACT", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]
"""The last two change no result: they let the compiler keep loops without branches."""


class Balanced(NamedTuple):
    """What became of n trials: the last two are zeros where nothing is computed exactly.

    Attributes:
        steps: int32, shape ``(n,)``.
        hashes: CRC-16 of all neuron states, uint16, shape ``(n,)``.
        final_states: float32, shape ``(n, 4)``.
    """

    steps: NDArray[np.int32]
    hashes: NDArray[np.uint16]
    final_states: NDArray[np.float32]


Balance = Callable[[NDArray[np.int8], float, int], Balanced]


@cache
def compiled_balance(*, exact: bool) -> Balance | None:
    """The function, compiled for this machine; None without a compiler. Arguments as in `numpy_baseline.balance`.

    Args:
        exact: the same bits as the lane engine, with its hash; otherwise with fast-math and without a hash.
    """
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    folder = Path(tempfile.mkdtemp(prefix="sceann-bench-"))
    source, library = Path(__file__).with_name("pole.c"), folder / "pole.so"
    flags = ["-std=c11", "-O3", "-march=native", "-shared", "-fPIC", *(_EXACT if exact else _FREE)]
    subprocess.run([compiler, *flags, str(source), "-o", str(library), "-lm"], check=True)
    function = ctypes.CDLL(str(library)).balance
    nodes = sigmoid_table().astype(np.int32)
    table = np.ascontiguousarray((nodes[:129] << 8) | (nodes[1:] - nodes[:129]))

    def balance(weights: NDArray[np.int8], start_rad: float, max_steps: int) -> Balanced:
        weights = np.ascontiguousarray(weights)
        n = len(weights)
        balanced = Balanced(np.zeros(n, np.int32), np.zeros(n, np.uint16), np.zeros((n, 4), np.float32))
        function(
            weights.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_int64(n),
            ctypes.c_float(start_rad),
            ctypes.c_int32(max_steps),
            table.ctypes.data_as(ctypes.c_void_p),
            *(array.ctypes.data_as(ctypes.c_void_p) for array in balanced),
        )
        return balanced

    return balance
