"""Mode ONBOARD: the robot's own sensors, motors and controller; the host watches and ends the task."""

from __future__ import annotations

from sceann_hil.link.session import RobotLink
from sceann_hil.link.trial import Follower, Order, Watch, begin, check, wait_for_end
from sceann_hil.link.vocabulary import Mode, Op, Telemetry
from sceann_hil.robot import TrialObserver


def run_onboard(link: RobotLink, order: Order, watch: Watch | None, observer: TrialObserver | None) -> Follower:
    """Run one trial to its end.

    Returns:
        What came; its `end` is set.

    Raises:
        LinkError: how it ended is not known.
    """
    follower = Follower(order, watch, observer)
    with link.exclusive(order.trial_id), link.listening(follower.take):
        begin(link, order, Mode.ONBOARD, Telemetry.SENSE | Telemetry.DRIVE)
        follower.begun()
        while follower.end is None and not follower.at_rest:
            link.receive(0.02)
            check(link, follower)
            if follower.task_end is not None:
                link.request(Op.STOP)
                break
        follower.end = wait_for_end(link, follower)
    return follower
