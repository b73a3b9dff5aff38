"""What the three control modes share: the order, what the robot sent about it, and its start and end."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.link.line import Incoming
from sceann_hil.link.messages import (
    End,
    Event,
    Heartbeat,
    LinkEnd,
    arm_arguments,
    start_arguments,
    unpack_drive,
    unpack_sensors,
    unpack_states,
)
from sceann_hil.link.numbers import SENSORS_PER_PAGE
from sceann_hil.link.session import Refused, RobotLink
from sceann_hil.link.vocabulary import EventCode, Function, Mode, Op, State, Status, Telemetry
from sceann_hil.robot import UNKNOWN_STATE, EndReason, LinkError, TrialObserver

SILENCE_S = 1.0
"""A robot that was not heard for so long during a trial is lost; by then it has stopped by itself."""


NO_STATE = -0x8000
"""No neuron state: they lie within -8192..8192."""


ALARM_S = 0.5
"""How long a bumper or button may take to be released before the robot counts as stopped by it."""


class TrialLost(LinkError):
    """What became of the trial cannot be known; the attempt is void."""


@dataclass(frozen=True, slots=True)
class Order:
    """One trial as the link sees it.

    Attributes:
        trial_id: 1..65535, another one for every attempt.
        max_ticks: the robot ends the trial after so many ticks, host or no host.
        tick_s: control period.
        n_sensors: of the network.
        n_motors: of the network.
        n_neurons: of the network, if the robot is to send its states.
    """

    trial_id: int
    max_ticks: int
    tick_s: float
    n_sensors: int
    n_motors: int
    n_neurons: int = 0


Watch = Callable[[NDArray[np.uint16]], EndReason | None]
"""Whether a task has ended, from one tick's wire values (for robots whose sensors tell it)."""


class Follower:
    """Keeps what a robot sends about one trial, tick by tick.

    Attributes:
        sensors: wire values, uint16, shape ``(max_ticks, n_sensors)``.
        has_sensors: which ticks' sensors came, shape ``(max_ticks,)``.
        heard_s: when the robot's sensors of each tick came, monotonic, shape ``(max_ticks,)``; NaN where they did not.
        hash_bytes: low byte of the state hash after each tick, -1 where DRIVE did not come.
        motors: Q10, shape ``(max_ticks, n_motors)``, valid where `hash_bytes` is.
        neurons: states u, int16 Q10, shape ``(max_ticks, n_neurons)``; `NO_STATE` where they did not come.
        newest: the newest tick whose sensors are known; -1 before the first.
        end: what the robot said last.
        task_end: why the task ended, and in which tick, where `watch` says so.
        contradiction: what cannot all be true of what came; empty if there is nothing.

    Args:
        order: the trial.
        watch: asked for every tick in order.
        observer: told of every tick.
    """

    def __init__(self, order: Order, watch: Watch | None = None, observer: TrialObserver | None = None) -> None:
        self.order = order
        self.sensors = np.zeros((order.max_ticks, order.n_sensors), np.uint16)
        self.has_sensors = np.zeros(order.max_ticks, np.bool_)
        self.heard_s = np.full(order.max_ticks, np.nan)
        self.hash_bytes = np.full(order.max_ticks, -1, np.int16)
        self.motors = np.zeros((order.max_ticks, order.n_motors), np.int16)
        self.neurons = np.full((order.max_ticks, order.n_neurons), NO_STATE, np.int16)
        self.newest = -1
        self.end: End | None = None
        self.task_end: tuple[EndReason, int] | None = None
        self.restarted = False
        self.contradiction = ""
        self._watch = watch
        self._observer = observer
        self._rest_heartbeats = 0
        self._newest_drive = -1
        self._first_page: tuple[int, tuple[int, ...]] | None = None

    def take(self, incoming: Incoming) -> None:
        """A message from the robot."""
        function, data = incoming
        if function == Function.SENSE and len(data) == 8:
            tick = self._tick(data[7] >> 4, 16, self.newest)
            values = unpack_sensors(data)[1]
            if self.order.n_sensors <= SENSORS_PER_PAGE:
                self._sensed(tick, values)
            else:
                self._first_page = (tick, values)
        elif function == Function.SENSE_PAGE2 and len(data) == 8:
            tick = self._tick(data[7] >> 4, 16, self.newest)
            if self._first_page is not None and self._first_page[0] == tick:
                self._sensed(tick, self._first_page[1] + unpack_sensors(data)[1])
        elif function == Function.DRIVE and len(data) == 8:
            bits, hash_byte, motors = unpack_drive(data, self.order.n_motors)
            tick = self._tick(bits, 256, self._newest_drive)
            if 0 <= tick < self.order.max_ticks:
                if self.hash_bytes[tick] >= 0 and (hash_byte, *motors) != (self.hash_bytes[tick], *self.motors[tick]):
                    self.contradiction = f"step {tick} was answered in two different ways"
                self.hash_bytes[tick], self.motors[tick] = hash_byte, motors
                self._newest_drive = max(self._newest_drive, tick)
        elif function == Function.NEURON_STATES and len(data) == 8 and self.order.n_neurons:
            first, bits, states = unpack_states(data)
            tick = self._tick(bits, 256, self._newest_drive)
            if 0 <= tick < self.order.max_ticks:
                told = self.neurons[tick, first : first + 3]
                told[:] = states[: len(told)]
        elif function == Function.END and len(data) == 7:
            end = End.unpack(data)
            if end.trial_id == self.order.trial_id and end.reason is not LinkEnd.UNFINISHED:
                if self.end is not None and end != self.end:
                    self.contradiction = "the trial ended in two different ways"
                self.end = end
        elif function == Function.EVENT and len(data) == 8:
            event = Event.unpack(data)
            self.restarted |= event.code == EventCode.BOOT
        elif function == Function.HEARTBEAT and len(data) == 8:
            running = Heartbeat.unpack(data).state == State.RUNNING
            self._rest_heartbeats = 0 if running else self._rest_heartbeats + 1

    def begun(self) -> None:
        """The robot took the START: what its heartbeats said until now is not about this trial."""
        self._rest_heartbeats = 0

    @property
    def at_rest(self) -> bool:
        """The robot says twice in a row that it runs no trial (once may be from before the start)."""
        return self._rest_heartbeats >= 2

    @staticmethod
    def _tick(bits: int, modulus: int, newest: int) -> int:
        """The tick nearest to the one expected next that has these low bits."""
        ahead = (bits - (newest + 1)) % modulus
        return newest + 1 + ahead - (modulus if ahead >= modulus // 2 else 0)

    def _sensed(self, tick: int, values: tuple[int, ...]) -> None:
        if not 0 <= tick < self.order.max_ticks:
            return
        if self.has_sensors[tick]:
            if values[: self.order.n_sensors] != tuple(self.sensors[tick].tolist()):
                self.contradiction = f"two different sensor readings came for step {tick}"
            return
        self.sensors[tick] = values[: self.order.n_sensors]
        self.has_sensors[tick] = True
        self.heard_s[tick] = time.monotonic()
        self.newest = max(self.newest, tick)
        if self._observer is not None:
            self._observer.step(tick, self.sensors[tick], UNKNOWN_STATE)
        if self._watch is not None and self.task_end is None:
            reason = self._watch(self.sensors[tick])
            if reason is not None:
                self.task_end = (reason, tick)

    def missing(self, ticks: int) -> int:
        """How many of the first `ticks` ticks have no sensors."""
        return ticks - int(np.count_nonzero(self.has_sensors[:ticks]))


def begin(link: RobotLink, order: Order, mode: Mode, telemetry: Telemetry) -> None:
    """Arm and start.

    Raises:
        TrialLost: the robot remembers another trial of this number.
        Refused, NoAnswer, LinkDown: see `RobotLink.request`.
    """
    _arm(link, order.tick_s)
    try:
        link.request(Op.START, start_arguments(order.trial_id, order.max_ticks, mode, telemetry))
    except Refused as refused:
        if refused.status is not Status.ALREADY_RUN:
            raise
        if not refused.repeated:
            raise TrialLost(f"the robot already ran a trial {order.trial_id}") from None


def _arm(link: RobotLink, tick_s: float) -> None:
    """ARM, with patience for a switch that was released a moment ago."""
    deadline = link.now_s() + ALARM_S
    while True:
        try:
            link.request(Op.ARM, arm_arguments(tick_s))
            return
        except Refused as refused:
            if refused.status is not Status.ALARM or link.now_s() >= deadline:
                raise
        link.receive(0.02)


def wait_for_end(link: RobotLink, follower: Follower) -> End:
    """The robot's word about a trial that is over, or must be soon.

    Raises:
        TrialLost: it has none.
        Refused, NoAnswer, LinkDown: see `RobotLink.request`.
    """
    while follower.end is None:
        check(link, follower)
        if follower.at_rest:
            last = link.last()
            if last.trial_id != follower.order.trial_id or last.reason is LinkEnd.UNFINISHED:
                raise TrialLost("the robot does not remember the trial")
            return last
        link.receive(0.02)
    return follower.end


def check(link: RobotLink, follower: Follower) -> None:
    """Look whether the robot is still there and still the same.

    Raises:
        TrialLost: it restarted, or is silent.
    """
    if link.stop_wanted and follower.end is None:
        link.stop_now()
    if follower.restarted:
        raise TrialLost("the robot restarted during the trial")
    if link.silence_s > SILENCE_S:
        raise TrialLost(f"the robot was silent for {SILENCE_S:g} s during the trial")
