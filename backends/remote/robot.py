"""Trials on a robot at the end of a line: reconnecting, loading, running, checking, settling."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import can
import numpy as np
from numpy.typing import NDArray

from backends.link.lockstep import run_lockstep
from backends.link.messages import LinkEnd
from backends.link.onboard import run_onboard
from backends.link.session import Refused, RobotLink
from backends.link.tethered import run_tethered
from backends.link.trial import Follower, Order, TrialLost, Watch
from backends.link.upload import upload
from backends.remote import rig
from backends.remote.doctor import examine
from backends.remote.verdict import end_reason, ended, first_difference, result
from backends.simulation.engine import SimulatedRobot
from backends.simulation.recompute import recompute
from backends.simulation.stepwise import StepwiseBody
from sceann_hil.controller import Controller
from sceann_hil.diagnosis import Finding
from sceann_hil.durations import Durations
from sceann_hil.firmware.descriptor import Capability, Descriptor
from sceann_hil.firmware.vocabulary import Mode, Op, State, Status
from sceann_hil.robot import (
    EmergencyStop,
    EndReason,
    Health,
    LinkError,
    Results,
    Robot,
    RobotFault,
    RobotSpec,
    TrialObserver,
    Trials,
)
from sceann_hil.scenery import Scenery

OPENING_S = 0.2
"""Pause between two tries to open a port that is gone."""


@dataclass(frozen=True, slots=True)
class RemoteSettings:
    """How a robot is reached and used.

    Attributes:
        mode: where controller and body are during a trial.
        node: the robot's number on its bus.
        reconnect_s: how long to try to reach a robot that does not answer.
        bumper: what a hit bumper means for the task.
        rig_address: ``host:port`` of a machine that puts the robot back, if there is one.
        battery_range_v: empty and full, if the battery is measured.
    """

    mode: Mode
    node: int = 1
    reconnect_s: float = 10.0
    bumper: EndReason = EndReason.OUT_OF_BOUNDS
    rig_address: str | None = None
    battery_range_v: tuple[float, float] | None = None


class RemoteRobot(Robot):
    """One robot on any python-can bus; one trial at a time.

    Args:
        spec: what it should be; held against the robot's descriptor at `connect`.
        settings: see `RemoteSettings`.
        open_bus: opens the bus; called again after the link was lost.
        body: whose body the host simulates in mode HIL.
        watch: which task ends the sensors tell, in the other modes.
    """

    def __init__(
        self,
        spec: RobotSpec,
        settings: RemoteSettings,
        open_bus: Callable[[], can.BusABC],
        body: SimulatedRobot | None = None,
        watch: Watch | None = None,
    ) -> None:
        if (body is None) == (settings.mode is Mode.HIL):
            raise ValueError(f"body: expected a simulated body in mode HIL and in no other, got {settings.mode.name}")
        self._spec = replace(spec, batch_size=1, repeatable=False)
        self._settings = settings
        self._open_bus = open_bus
        self._body = StepwiseBody(body) if body is not None else None
        self._watch = watch
        self._link: RobotLink | None = None
        self._observer: TrialObserver | None = None
        self._descriptor: Descriptor | None = None
        self._loaded: bytes | None = None
        self._in_doubt = False
        self._complaint = ""
        self._interrupted: EndReason | None = None
        self._link_quality: float | None = None

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    @property
    def scenery(self) -> Scenery | None:
        return self._body.robot.scenery if self._body is not None else None

    @property
    def link(self) -> RobotLink:
        """The connected link.

        Raises:
            LinkError: there is none.
        """
        if self._link is None:
            raise LinkError(f"{self._spec.name} is not connected")
        return self._link

    @property
    def descriptor(self) -> Descriptor | None:
        """What the robot said that it is; None before `connect`."""
        return self._descriptor

    # -- connection -------------------------------------------------------------------------------------------------

    def connect(self) -> None:
        """Reach the robot, check that it is the right one, and leave SAFE or ESTOP: somebody asked for it to work.

        Raises:
            LinkError: it cannot be reached, another host has it, or it is not what the configuration says.
        """
        if self._body is not None:
            self._body.robot.connect()
            self._body.prepare()
        self._reach()
        try:
            self._check_descriptor()
            try:
                self._rest()
            except Refused as refused:
                if refused.status is not Status.NO_SESSION:
                    raise
                # it lost power since it said hello
                self._reach()
                self._check_descriptor()
                self._rest()
        except BaseException:
            self._hang_up()
            raise

    def _reach(self) -> None:
        deadline = time.monotonic() + self._settings.reconnect_s
        self._loaded, self._in_doubt = None, False
        while True:
            self._hang_up()
            try:
                self._link = RobotLink(self._open_bus(), self._settings.node)
            except (can.CanError, OSError) as error:
                if time.monotonic() >= deadline:
                    raise LinkError(f"{self._spec.name}: {error}") from error
                time.sleep(OPENING_S)
                continue
            try:
                self._descriptor = self._link.hello(max(1.5, deadline - time.monotonic()))
                return
            except LinkError:
                self._hang_up()
                if time.monotonic() >= deadline:
                    raise
                time.sleep(OPENING_S)

    def _check_descriptor(self) -> None:
        robot, spec, mode = self._descriptor, self._spec, self._settings.mode
        if robot is None:
            raise LinkError(f"{spec.name} is not connected")
        wanted = Capability.HIL if mode is Mode.HIL else Capability.BODY
        if wanted not in robot.capabilities:
            what = "hardware-in-the-loop trials" if mode is Mode.HIL else "sensors and motors of its own"
            raise LinkError(f"{robot.name}: the configuration's mode is {mode.name.lower()}, but it has no {what}")
        if mode is Mode.HIL:
            if spec.n_sensors > robot.max_sensors or spec.n_motors > robot.max_motors:
                raise LinkError(
                    f"{robot.name}: expected a board for {spec.n_sensors} sensors and {spec.n_motors} motors, "
                    f"this one takes at most {robot.max_sensors} and {robot.max_motors}"
                )
            return
        if (robot.n_sensors, robot.n_motors) != (spec.n_sensors, spec.n_motors):
            raise LinkError(
                f"{robot.name}: expected {spec.n_sensors} sensors and {spec.n_motors} motors (the configuration's "
                f"robot.n_sensors and robot.n_motors), the robot has {robot.n_sensors} and {robot.n_motors}"
            )
        if not robot.tick_min_s <= spec.tick_s <= robot.tick_max_s:
            raise LinkError(
                f"{robot.name}: robot.tick_s: expected {robot.tick_min_s:g}..{robot.tick_max_s:g} s, "
                f"got {spec.tick_s:g}"
            )

    def _hang_up(self) -> None:
        if self._link is not None:
            self._link.close()
            self._link = None

    def disconnect(self) -> None:
        self.make_safe("disconnect")
        self._hang_up()

    def make_safe(self, reason: str) -> bool:
        """Stop whatever runs. Without an answer the robot stops by itself 300 ms after our last heartbeat."""
        return self._link is not None and self._link.make_safe()

    @property
    def timing(self) -> dict[str, Durations]:
        return {"round trip of the link": self._link.statistics.round_trips} if self._link is not None else {}

    def interrupt(self, reason: EndReason) -> None:
        """One frame, sent past whoever holds the link: STOP, or the latched stop of all robots."""
        link = self._link
        if link is None:
            return
        self._interrupted = reason
        if reason is EndReason.EMERGENCY_STOP:
            link.emergency_stop()
        else:
            link.stop_now()

    def health(self) -> Health:
        link = self._link
        if link is None:
            return Health(ok=False, messages=(*self._complaints(), "not connected"))
        volts = link.battery_mv / 1000.0
        limits = self._settings.battery_range_v
        fraction = None
        if limits is not None and link.battery_mv:
            fraction = min(1.0, max(0.0, (volts - limits[0]) / (limits[1] - limits[0])))
        told = (f"battery {volts:.2f} V",) if link.battery_mv else ()
        ok = link.state not in (State.SAFE, State.ESTOP)
        return Health(ok, fraction, (*self._complaints(), *told), link_quality=self._link_quality)

    def _complaints(self) -> tuple[str, ...]:
        return (self._complaint,) if self._complaint else ()

    def observe(self, observer: TrialObserver | None) -> None:
        self._observer = observer

    def diagnose(self, *, may_move: bool) -> Iterator[Finding]:
        """Ports, handshake, latency, losses, the robot's own watchdog, sensors, and with leave the motors."""
        yield from examine(self, self._settings.mode, may_move=may_move)

    # -- trials -----------------------------------------------------------------------------------------------------

    def run(self, trials: Trials) -> Results:
        """Run one trial. A trial that the link or the robot spoilt is void; its traces are what came of it.

        Raises:
            ValueError: more than one trial, or a network that does not fit.
            LinkError: the robot cannot be reached within the reconnection time.
            RobotFault: it will not arm, or decodes genomes wrongly.
            EmergencyStop: its stop is latched.
        """
        size, spec = trials.size, self._spec
        if len(trials) != 1:
            raise ValueError(f"trials: expected 1 at a time, got {len(trials)}")
        if (size.n_sensors, size.n_motors) != (spec.n_sensors, spec.n_motors):
            raise ValueError(
                f"network: expected {spec.n_sensors} sensors and {spec.n_motors} motors for {spec.name}, "
                f"got {size.n_sensors} and {size.n_motors}"
            )
        self._complaint = ""
        self._make_ready(trials)
        if self._observer is not None:
            self._observer.begin(int(trials.ids[0]))
        if self._interrupted is not None:
            return self._called_off()
        before = _counted(self.link)
        try:
            results = self._attempt(trials)
            self._link_quality = _quality(before, _counted(self.link))
            return results
        except LinkError as error:
            self._complaint = str(error)
            self._in_doubt = True
            self.make_safe(str(error))
            return Results.void(1, EndReason.LINK_LOST, len(spec.state_fields))
        except BaseException:
            self.make_safe("the host gives up")
            raise
        finally:
            if self._observer is not None:
                self._observer.end()
            self._clear_interrupt()

    def _called_off(self) -> Results:
        """Somebody stopped the trial before it began."""
        reason = self._interrupted if self._interrupted is not None else EndReason.OPERATOR
        self._clear_interrupt()
        void = reason if reason.is_void else EndReason.OPERATOR
        return Results.void(1, void, len(self._spec.state_fields))

    def _clear_interrupt(self) -> None:
        self._interrupted = None
        if self._link is not None:
            self._link.stop_wanted = False

    def _make_ready(self, trials: Trials) -> None:
        """Network loaded, robot at its start; nothing has moved yet, so all of it may simply be tried again."""
        self._load_or_reach(trials)
        if self._settings.rig_address is not None:
            # only now: a robot that could not be reached may still have been driving
            start = dict(zip(self._spec.start_fields, trials.starts[0].tolist(), strict=True))
            rig.place(self._settings.rig_address, start)

    def _load_or_reach(self, trials: Trials) -> None:
        try:
            if self._in_doubt:
                # it may have restarted, and then remembers neither us nor its network
                self._loaded = None
                self.link.hello(1.5)
                self._in_doubt = False
            self._load(trials)
        except Refused as refused:
            if refused.status is not Status.NO_SESSION:
                self._rest()
            else:
                self._reach()
            self._load(trials)
        except LinkError:
            self._reach()
            self._rest()
            self._load(trials)

    def _rest(self) -> None:
        """Out of ARMED, RUNNING or SAFE, so that a trial can be prepared.

        Raises:
            RobotFault: something holds the robot in SAFE or ESTOP.
        """
        self.link.request(Op.STOP)
        try:
            self.link.request(Op.CLEAR)
        except Refused as refused:
            if refused.status is Status.ALARM:
                raise RobotFault(
                    f"{self._spec.name} stays stopped: a stop button is held, or its board has a fault"
                ) from None
            raise

    def _load(self, trials: Trials) -> None:
        if self.link.state is State.ESTOP:
            raise EmergencyStop(f"{self._spec.name}: its emergency stop is latched")
        if self.link.state in (State.SAFE, State.ARMED, State.RUNNING):
            self._rest()
        weights = trials.weights[trials.genome_index[0]]
        record = weights.tobytes() + repr((trials.size, trials.dynamics)).encode()
        if self._settings.mode is not Mode.TETHERED and record != self._loaded:
            self._loaded = None
            upload(self.link, weights, trials.size, trials.dynamics)
            self._loaded = record

    def _attempt(self, trials: Trials) -> Results:
        weights = trials.weights[trials.genome_index[0]]
        order = Order(
            trial_id=robot_trial_id(trials),
            max_ticks=trials.max_steps,
            tick_s=self._spec.tick_s,
            n_sensors=trials.size.n_sensors,
            n_motors=trials.size.n_motors,
        )
        states = np.zeros((trials.max_steps + 1, 0), np.float32)
        try:
            if self._settings.mode is Mode.ONBOARD:
                follower = run_onboard(self.link, order, self._watch, self._observer)
            elif self._settings.mode is Mode.TETHERED:
                controller = Controller(weights, trials.size, trials.dynamics)
                follower = run_tethered(self.link, order, controller, self._watch, self._observer)
            elif self._body is not None:
                self._body.reset(trials.starts[0], trials.keys[0])
                follower, states = run_lockstep(self.link, order, self._body, self._observer)
        except Refused as refused:
            if refused.status is Status.ALARM:
                told = ", ".join(self.health().messages)
                raise RobotFault(f"{self._spec.name} does not arm: bumper, battery or stop button ({told})") from None
            raise
        return self._judge(trials, follower, states)

    def _judge(self, trials: Trials, follower: Follower, states: NDArray[np.float32]) -> Results:
        reason = end_reason(follower, self._settings.bumper)
        _, ticks = ended(follower)
        if reason is EndReason.OPERATOR and self._interrupted is not None:
            # the robot knows only that it was stopped; who stopped it knows why
            reason = self._interrupted
        if reason.is_void:
            self._complaint = f"the robot ended the trial: {reason}"
            return Results.void(1, reason, len(self._spec.state_fields))
        missing = follower.missing(ticks)
        if missing:
            self.link.statistics.lost_ticks += missing
            raise TrialLost(f"the sensors of {missing} of {ticks} steps were lost on the link")
        sensors = follower.sensors[:ticks]
        neurons = recompute(trials.weights[trials.genome_index[0]], trials.size, trials.dynamics, sensors)
        steps = ticks if follower.task_end is None else follower.task_end[1] + 1
        if self._settings.mode is not Mode.TETHERED and follower.end is not None:
            step = first_difference(follower, neurons, follower.end.state_hash)
            if step is not None:
                self._complaint = (
                    f"robot and host computed different neurons from the same sensors, first in step {step} of trial "
                    f"{trials.ids[0]}: faulty hardware, or firmware that is not what its version says"
                )
                reason = EndReason.FAULT
        return result(reason, steps, self._spec.tick_s, neurons, sensors, states)

    # -- exactly once -----------------------------------------------------------------------------------------------

    def settle(self, trials: Trials) -> Results:
        """Ask the robot what became of a trial whose host died: never started, ended, or half.

        A trial that never started is run now. One that ended is taken if its result is known for sure: in mode HIL if
        the robot's steps and state hash are those of the simulation, otherwise if its steps ran out and no sensor
        could have ended the task before. Anything else is void.
        """
        try:
            last = self.link.last()
        except LinkError:
            self._reach()
            last = self.link.last()
        if last.trial_id != robot_trial_id(trials):
            return self.run(trials)
        void = Results.void(1, EndReason.LINK_LOST, len(self._spec.state_fields))
        if self._body is not None:
            expected = self._body.robot.trace(trials)
            same = (last.ticks, last.state_hash) == (int(expected.steps[0]), int(expected.hashes[0]))
            return expected if same and last.reason in (LinkEnd.MAX_TICKS, LinkEnd.STOPPED) else void
        if last.reason is LinkEnd.MAX_TICKS and self._watch is None:
            return Results(
                end_reasons=np.array([EndReason.TIME_UP], np.uint8),
                steps=np.array([last.ticks], np.int32),
                hashes=np.array([last.state_hash], np.uint16),
                final_states=np.zeros((1, 0), np.float32),
                durations_s=np.array([last.ticks * self._spec.tick_s]),
            )
        return void


def _counted(link: RobotLink) -> tuple[int, int]:
    """Messages, and messages that had to be sent again or never came."""
    statistics = link.statistics
    return statistics.sent + statistics.received, statistics.retries + statistics.lost_ticks


def _quality(before: tuple[int, int], after: tuple[int, int]) -> float:
    messages, failures = after[0] - before[0], after[1] - before[1]
    return 1.0 - min(1.0, failures / max(messages, 1))


def robot_trial_id(trials: Trials) -> int:
    """The number 1..65535 by which the robot knows the one trial: consecutive in a run, apart between runs."""
    return 1 + (trials.run_id + int(trials.ids[0])) % 65535
