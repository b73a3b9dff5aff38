"""Pole balancing in hand-tuned C (``pole.c``), where a C compiler is installed."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.controller import sigmoid_table

Balance = Callable[[NDArray[np.int8], float, int], NDArray[np.int32]]


@cache
def compiled_balance() -> Balance | None:
    """The function, compiled for this machine; None without a compiler. Arguments as in `numpy_baseline.balance`."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    folder = Path(tempfile.mkdtemp(prefix="sceann-bench-"))
    source, library = Path(__file__).with_name("pole.c"), folder / "pole.so"
    flags = ["-std=c11", "-O3", "-march=native", "-ffast-math", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, str(source), "-o", str(library), "-lm"], check=True)
    function = ctypes.CDLL(str(library)).balance
    nodes = sigmoid_table().astype(np.int32)
    table = np.ascontiguousarray((nodes[:129] << 8) | (nodes[1:] - nodes[:129]))

    def balance(weights: NDArray[np.int8], start_rad: float, max_steps: int) -> NDArray[np.int32]:
        weights = np.ascontiguousarray(weights)
        steps = np.zeros(len(weights), np.int32)
        function(
            weights.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_int64(len(weights)),
            ctypes.c_float(start_rad),
            ctypes.c_int32(max_steps),
            table.ctypes.data_as(ctypes.c_void_p),
            steps.ctypes.data_as(ctypes.c_void_p),
        )
        return steps

    return balance
