"""What a trial was worth as evidence: the robot's word against what the host computes from the same sensors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sceann_hil.link.messages import LinkEnd
from sceann_hil.link.trial import Follower, TrialLost
from sceann_hil.network.recompute import Neurons
from sceann_hil.robot import EndReason, Results, Trace

_VOID = {
    LinkEnd.LINK_LOST: EndReason.LINK_LOST,
    LinkEnd.BATTERY: EndReason.BATTERY,
    LinkEnd.FAULT: EndReason.FAULT,
    LinkEnd.EMERGENCY_STOP: EndReason.EMERGENCY_STOP,
    LinkEnd.OVERRUN: EndReason.OVERRUN,
    LinkEnd.STOPPED: EndReason.OPERATOR,
    LinkEnd.UNFINISHED: EndReason.LINK_LOST,
}
"""Ends that say nothing about the controller; ``docs/end-reasons.md`` is this table for people."""


def end_reason(follower: Follower, bumper: Callable[[], EndReason]) -> EndReason:
    """Why the trial ended, for the journal.

    Args:
        follower: of a trial whose `end` is known.
        bumper: asked what a hit bumper means for the task.
    """
    if follower.task_end is not None:
        return follower.task_end[0]
    link_end = ended(follower)[0]
    if link_end is LinkEnd.MAX_TICKS:
        return EndReason.TIME_UP
    if link_end is LinkEnd.BUMPER:
        return bumper()
    return _VOID[link_end]


def ended(follower: Follower) -> tuple[LinkEnd, int]:
    """The robot's reason and number of ticks.

    Raises:
        TrialLost: not known.
    """
    if follower.end is None:
        raise TrialLost("the robot never said how the trial ended")
    return follower.end.reason, follower.end.ticks


def first_difference(follower: Follower, neurons: Neurons, state_hash: int) -> int | None:
    """The first step in which the robot computed something else than the host; None if nowhere.

    Args:
        follower: of a trial with complete sensors.
        neurons: the host's, of every tick that the robot did.
        state_hash: the robot's, of the whole trial.
    """
    n = len(neurons.hashes)
    if n == 0:
        return None
    told = follower.hash_bytes[:n] >= 0
    n_motors = follower.order.n_motors
    differs = told & (follower.hash_bytes[:n] != (neurons.hashes & 255))
    differs |= told & (follower.motors[:n] != neurons.x[:, -n_motors:]).any(axis=1)
    if differs.any():
        return int(np.argmax(differs))
    return n - 1 if int(neurons.hashes[-1]) != state_hash else None


def result(
    reason: EndReason,
    steps: int,
    tick_s: float,
    neurons: Neurons,
    sensors: NDArray[np.uint16],
    states: NDArray[np.float32],
) -> Results:
    """One trial's results.

    Args:
        reason: why it ended.
        steps: control steps that count.
        tick_s: control period.
        neurons: of at least `steps` steps.
        sensors: wire values of at least `steps` steps.
        states: body states, shape ``(at least steps + 1, n_state)``; no columns where they are not known.
    """
    trace = Trace(states[: steps + 1], sensors[:steps], neurons.u[:steps], neurons.x[:steps])
    return Results(
        end_reasons=np.array([reason], np.uint8),
        steps=np.array([steps], np.int32),
        hashes=np.array([neurons.hashes[steps - 1] if steps else 0xFFFF], np.uint16),
        final_states=np.array(states[steps : steps + 1], np.float32),
        durations_s=np.array([steps * tick_s], np.float64),
        traces=[trace],
    )
