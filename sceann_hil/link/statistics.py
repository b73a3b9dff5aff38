"""What a link did: frames, losses, retries, and how long answers took."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sceann_hil.robot.durations import Durations


@dataclass(slots=True)
class LinkStatistics:
    """Counters of one link since it was opened.

    Attributes:
        sent: frames to the robot.
        received: frames from it.
        foreign: frames with our robot's identifier that are none of this link's.
        retries: requests and lock-steps that were sent again because no answer came.
        lost_ticks: control steps whose telemetry did not arrive whole.
        robot_receive_errors: broken frames that the robot counted (stays at 255).
        round_trips: of requests and lock-steps, from sending to the answer.
        lateness: of control steps that the robot's clock paces, as their sensors are heard here (see `lateness_s`).
    """

    sent: int = 0
    received: int = 0
    foreign: int = 0
    retries: int = 0
    lost_ticks: int = 0
    robot_receive_errors: int = 0
    round_trips: Durations = field(default_factory=Durations)
    lateness: Durations = field(default_factory=Durations)


def lateness_s(heard_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """How late each step of a trial was heard, against an even beat that no step is ahead of.

    Period and phase of the beat are fitted: the robot paces its steps by its own clock, and a resonator is easily half
    a percent off.

    Args:
        heard_s: when each step was heard, shape ``(n_steps,)``; NaN where it was not.

    Returns:
        Seconds, for the steps that were heard; empty for fewer than three.
    """
    steps = np.flatnonzero(~np.isnan(heard_s))
    if len(steps) < 3:
        return np.zeros(0)
    times_s = heard_s[steps] - heard_s[steps[0]]
    late_s = times_s - np.polyval(np.polyfit(steps, times_s, 1), steps)
    return np.asarray(late_s - late_s.min(), np.float64)
