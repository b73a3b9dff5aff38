"""What a link did: frames, losses, retries, and how long answers took."""

from __future__ import annotations

from dataclasses import dataclass, field

from sceann_hil.durations import Durations


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
    """

    sent: int = 0
    received: int = 0
    foreign: int = 0
    retries: int = 0
    lost_ticks: int = 0
    robot_receive_errors: int = 0
    round_trips: Durations = field(default_factory=Durations)
