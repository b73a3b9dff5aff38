"""What a robot is asked to do, and what it tells of it, as structures of arrays."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import NetworkSize, Weights
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot.end_reasons import EndReason, TrialVoid

if TYPE_CHECKING:
    from sceann_hil.robot.accumulation import Accumulation

MOST_STEPS = 2**30
"""Longest trial."""

_COUNTS = np.zeros(256, np.bool_)
_COUNTS[[reason for reason in EndReason if not reason.is_void]] = True


@dataclass(frozen=True, slots=True)
class Trials:
    """Trials to run, as a structure of arrays (n trials, g genomes).

    Compiled code trusts these arrays, so they are checked when they are made, and are contiguous.

    Attributes:
        size: the network's size, the same for all.
        dynamics: the neuron's reading, the same for all.
        weights: connection matrices, int8, shape ``(g, n_neurons, n_sources)``.
        genome_index: which of them each trial uses, int32, shape ``(n,)``.
        starts: start values in the order of `RobotSpec.start_fields`, float64, shape ``(n, n_start)``.
        keys: 64-bit noise keys from the seed tree, uint64, shape ``(n,)``.
        max_steps: a trial that reaches this many steps ends with `EndReason.TIME_UP`.
        ids: numbers that name the trials in the journal, int64, shape ``(n,)``.
        run_id: a number that tells this run from others, so that a robot's memory of another run's trial is not
            taken for one of this run's.
        accumulation: what the task adds up over a trial's steps, if it does.

    Raises:
        ValueError: an array has another shape, type or range.
    """

    size: NetworkSize
    dynamics: Dynamics
    weights: Weights
    genome_index: NDArray[np.int32]
    starts: NDArray[np.float64]
    keys: NDArray[np.uint64]
    max_steps: int
    ids: NDArray[np.int64]
    run_id: int = 0
    accumulation: Accumulation | None = None

    def __post_init__(self) -> None:
        size, (n,) = self.size, np.shape(self.genome_index) if np.ndim(self.genome_index) == 1 else (-1,)
        weights = _array("weights", self.weights, np.int8, (-1, size.n_neurons, size.n_sources), (-1, 1))
        checked = {
            "weights": weights,
            "genome_index": _array("genome_index", self.genome_index, np.int32, (n,), (0, len(weights) - 1)),
            "starts": _array("starts", self.starts, np.float64, (n, -1)),
            "keys": _array("keys", self.keys, np.uint64, (n,), (0, 2**64 - 1)),
            "ids": _array("ids", self.ids, np.int64, (n,), (-(2**63), 2**63 - 1)),
        }
        for name, array in checked.items():
            object.__setattr__(self, name, array)
        if not 1 <= self.max_steps <= MOST_STEPS:
            raise ValueError(f"max_steps: expected 1..{MOST_STEPS}, got {self.max_steps}")

    @classmethod
    def none(cls, size: NetworkSize, n_start: int) -> Self:
        """No trials at all, of the right types."""
        return cls(
            size=size,
            dynamics=Dynamics(),
            weights=np.zeros((0, size.n_neurons, size.n_sources), np.int8),
            genome_index=np.zeros(0, np.int32),
            starts=np.zeros((0, n_start)),
            keys=np.zeros(0, np.uint64),
            max_steps=1,
            ids=np.zeros(0, np.int64),
        )

    def __len__(self) -> int:
        return len(self.genome_index)

    def take(self, which: slice | NDArray[np.intp]) -> Trials:
        """Some of the trials, in the order asked for."""
        # a copy is not checked again: whoever runs trials one by one would check all weights for each of them
        part = copy.copy(self)
        for name in ("genome_index", "starts", "keys", "ids"):
            object.__setattr__(part, name, getattr(self, name)[which])
        return part

    def completed(self, results: Results) -> Results:
        """What a robot told, with the totals of its steps where the task adds something up.

        Raises:
            PluginError: the task's value of a step is no number.
        """
        return results if self.accumulation is None else self.accumulation.complete(self, results)

    def batches(self, batch_size: int | None) -> Iterator[Trials]:
        """The trials in consecutive batches that a robot can take."""
        step = batch_size or max(len(self), 1)
        for first in range(0, len(self), step):
            yield self.take(slice(first, first + step))


@dataclass(frozen=True, slots=True)
class Trace:
    """Everything about one trial, step by step (n steps).

    Attributes:
        state: body state before each step and after the last, float32, shape ``(n + 1, n_state)``; no columns
            where the robot cannot know it.
        sensors: wire values 0..1023 that the controller saw, uint16, shape ``(n, n_sensors)``.
        u: neuron states after each step, int16 Q10, shape ``(n, n_neurons)``.
        x: neuron outputs after each step, int16 Q10, shape ``(n, n_neurons)``; the motors are the last columns.
    """

    state: NDArray[np.float32]
    sensors: NDArray[np.uint16]
    u: NDArray[np.int16]
    x: NDArray[np.int16]


@dataclass(frozen=True, slots=True)
class Results:
    """What happened in n trials, in the order they were given.

    Attributes:
        end_reasons: values of `EndReason`, uint8, shape ``(n,)``.
        steps: control steps done, int32, shape ``(n,)``.
        hashes: CRC-16 of all neuron states (`sceann_hil.network.controller.state_hash`), uint16, shape ``(n,)``.
        final_states: body state after the last step, float32, shape ``(n, n_state)``.
        durations_s: robot time of each trial (steps times tick in simulation), float64, shape ``(n,)``.
        traces: one trace per trial, where the robot delivers them.
        why_void: for people: what went wrong, where trials are void.
        values: what the task added up over each trial's steps, float64, shape ``(n,)``; None if nobody did.
    """

    end_reasons: NDArray[np.uint8]
    steps: NDArray[np.int32]
    hashes: NDArray[np.uint16]
    final_states: NDArray[np.float32]
    durations_s: NDArray[np.float64]
    traces: Sequence[Trace] | None = None
    why_void: str = ""
    values: NDArray[np.float64] | None = None

    @classmethod
    def void(cls, n: int, reason: EndReason, n_state: int, why: str = "") -> Self:
        """Results of n trials that measured nothing, and why."""
        return cls(
            end_reasons=np.full(n, reason, np.uint8),
            steps=np.zeros(n, np.int32),
            hashes=np.zeros(n, np.uint16),
            final_states=np.zeros((n, n_state), np.float32),
            durations_s=np.zeros(n, np.float64),
            why_void=why,
        )

    @property
    def counts(self) -> NDArray[np.bool_]:
        """Which trials measured something, shape ``(n,)``; a void or unknown end is never a number."""
        return np.asarray(_COUNTS[self.end_reasons])

    def must_count(self) -> None:
        """Refuse to make numbers of trials that measured nothing.

        Raises:
            TrialVoid: at least one trial is void, or ended for a reason that does not exist.
        """
        for place in np.flatnonzero(~self.counts)[:1].tolist():
            reason = int(self.end_reasons[place])
            known = reason in EndReason.__members__.values()
            what = str(EndReason(reason)) if known else f"the unknown reason {reason}"
            raise TrialVoid(f"trial {place} of {len(self)} ended with {what}, which is no result")

    def __len__(self) -> int:
        return len(self.end_reasons)


def _array(
    name: str, values: NDArray[Any], dtype: type, shape: tuple[int, ...], limits: tuple[int, int] | None = None
) -> NDArray[Any]:
    """Values as a contiguous array of this type; -1 in `shape` is any length.

    Raises:
        ValueError: they are not of this shape, of another kind, outside `limits` or not finite.
    """
    array = np.asarray(values)
    wanted = tuple("any" if length < 0 else length for length in shape)
    if array.ndim != len(shape) or any(length not in (-1, got) for length, got in zip(shape, array.shape, strict=True)):
        raise ValueError(f"{name}: expected shape ({', '.join(map(str, wanted))}), got {array.shape}")
    if array.dtype.kind not in ("iu" if limits else "iuf"):
        raise ValueError(f"{name}: expected {np.dtype(dtype)}, got {array.dtype}")
    if array.size and limits is not None:
        low, high = int(array.min()), int(array.max())
        if low < limits[0] or high > limits[1]:
            raise ValueError(f"{name}: expected {limits[0]}..{limits[1]}, got {low}..{high}")
    if limits is None and not np.isfinite(array).all():
        raise ValueError(f"{name}: expected finite values, got {array[~np.isfinite(array)][0]}")
    return np.ascontiguousarray(array, dtype)
