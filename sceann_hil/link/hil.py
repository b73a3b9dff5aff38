"""Mode HIL: the body here, the controller on the robot; the host's sensors are the tick."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sceann_hil.link.messages import pack_sensors, unpack_drive
from sceann_hil.link.numbers import SENSORS_PER_PAGE
from sceann_hil.link.session import RobotLink
from sceann_hil.link.trial import Follower, Order, TrialLost, begin, check, wait_for_end
from sceann_hil.link.vocabulary import Function, Mode, Op, Telemetry
from sceann_hil.robot import EndReason, TrialObserver

ANSWER_S = 0.1
"""How long to wait for a DRIVE before the same sensors are sent again."""


class Body(Protocol):
    """A simulated body that stands at the start of a trial."""

    @property
    def state(self) -> NDArray[np.float32]:
        """Body state, shape ``(n_state,)``."""

    def sense(self) -> NDArray[np.uint16]:
        """Wire values, shape ``(n_sensors,)``."""

    def move(self, motors: tuple[int, ...], /) -> EndReason | None:
        """One tick with these motors (Q10); why the trial ended, or None."""


def run_hil_trial(
    link: RobotLink,
    order: Order,
    body: Body,
    observer: TrialObserver | None = None,
    telemetry: Telemetry = Telemetry.NONE,
) -> tuple[Follower, NDArray[np.float32]]:
    """Run one trial to its end.

    Returns:
        What came, with `end` and (unless the steps ran out) `task_end` set; and the body's state before each step that
        it made and after the last, float32, shape ``(steps + 1, n_state)``.

    Raises:
        LinkError: how it ended is not known.
    """
    follower = Follower(order)
    states = np.zeros((order.max_ticks + 1, len(body.state)), np.float32)
    with link.exclusive(order.trial_id), link.listening(follower.take):
        begin(link, order, Mode.HIL, telemetry)
        follower.begun()
        states[0] = body.state
        tick = moved = 0
        for tick in range(order.max_ticks):
            sensors = body.sense()
            follower.sensors[tick] = sensors
            follower.has_sensors[tick] = True
            if observer is not None:
                observer.step(tick, sensors, states[tick])
            motors = _step(link, follower, tick, sensors.tolist())
            if motors is None:
                break
            reason = body.move(motors)
            moved = tick + 1
            states[moved] = body.state
            if reason is not None:
                follower.task_end = (reason, tick)
                break
            if link.stop_wanted:
                link.stop_now()
                break
        if follower.task_end is not None and tick + 1 < order.max_ticks:
            link.request(Op.STOP)
        follower.end = wait_for_end(link, follower)
    return follower, states[: moved + 1]


def _step(link: RobotLink, follower: Follower, tick: int, sensors: list[int]) -> tuple[int, ...] | None:
    """One lock-step; None if the robot ended the trial instead of answering."""
    page = pack_sensors(sensors[:SENSORS_PER_PAGE], tick)
    second = pack_sensors(sensors[SENSORS_PER_PAGE:], tick) if len(sensors) > SENSORS_PER_PAGE else None
    first_sent_s = link.now_s()
    while True:
        sent_s = link.now_s()
        link.send(Function.SENSE_IN, page)
        if second is not None:
            link.send(Function.SENSE_IN_PAGE2, second)
        while (left_s := sent_s + ANSWER_S - link.now_s()) > 0:
            incoming = link.receive(left_s)
            if incoming is None:
                break
            if incoming.function == Function.DRIVE and len(incoming.data) == 8:
                bits, _, motors = unpack_drive(incoming.data, follower.order.n_motors)
                if bits == tick & 255:
                    link.statistics.round_trips.add(link.now_s() - first_sent_s)
                    return motors
            elif follower.end is not None and follower.end.ticks <= tick:
                return None
        if follower.at_rest and follower.end is None and tick + 1 < follower.order.max_ticks:
            # the robot ended the trial and its END was lost
            return None
        check(link, follower)
        if link.now_s() - first_sent_s > 20 * ANSWER_S:
            raise TrialLost(f"step {tick}: the robot is there but does not answer")
        link.statistics.retries += 1
