"""Mode TETHERED: the robot's sensors and motors, the controller here; every SENSE is answered by a DRIVE_IN."""

from __future__ import annotations

from sceann_hil.link.messages import pack_drive
from sceann_hil.link.session import RobotLink
from sceann_hil.link.trial import Follower, Order, TrialLost, Watch, begin, check, wait_for_end
from sceann_hil.link.vocabulary import Function, Mode, Op, Telemetry
from sceann_hil.network.controller import Controller
from sceann_hil.robot import TrialObserver


def run_tethered(
    link: RobotLink, order: Order, controller: Controller, watch: Watch | None, observer: TrialObserver | None
) -> Follower:
    """Run one trial to its end.

    A DRIVE_IN that comes too late is dropped by the robot, which holds its motors and stops after the third in a row; a
    SENSE that never comes means that the network missed a step, and the trial is void.

    Returns:
        What came; its `end` is set.

    Raises:
        LinkError: how it ended is not known, or the network missed a step.
    """
    follower = Follower(order, watch, observer)
    controller.reset()
    tick = 0
    with link.exclusive(order.trial_id), link.listening(follower.take):
        begin(link, order, Mode.TETHERED, Telemetry.NONE)
        follower.begun()
        while follower.end is None and not (follower.at_rest and tick > follower.newest):
            if tick > follower.newest:
                link.receive(0.02)
                check(link, follower)
                continue
            if not follower.has_sensors[tick]:
                raise TrialLost(f"the sensors of step {tick} were lost on the link")
            if follower.task_end is not None and follower.task_end[1] < tick:
                link.request(Op.STOP)
                break
            motors = controller.step(follower.sensors[tick])
            link.send(Function.DRIVE_IN, pack_drive(tick, link.session, motors.tolist()))
            tick += 1
        follower.end = wait_for_end(link, follower)
    return follower
