"""Trials on a robot at the end of a line: reconnecting, loading, running, checking, settling."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import can
import numpy as np
from numpy.typing import NDArray

from backends.remote import rig
from backends.remote.connection import Connection, RemoteSettings
from backends.remote.doctor import examine
from backends.remote.verdict import end_reason, ended, first_difference, result
from backends.simulation.body import SimulatedBody
from backends.simulation.stepwise import StepwiseBody
from sceann_hil.link.descriptor import Descriptor
from sceann_hil.link.hil import run_hil_trial
from sceann_hil.link.messages import LinkEnd
from sceann_hil.link.onboard import run_onboard
from sceann_hil.link.session import Refused, RobotLink
from sceann_hil.link.statistics import lateness_s
from sceann_hil.link.tethered import run_tethered
from sceann_hil.link.trial import Follower, Order, TrialLost, Watch
from sceann_hil.link.vocabulary import EventCode, Mode, Op, State, Status
from sceann_hil.network.controller import Controller
from sceann_hil.network.recompute import recompute
from sceann_hil.robot import (
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
from sceann_hil.robot.diagnosis import Finding, Mover
from sceann_hil.robot.drawing import Drawing
from sceann_hil.robot.durations import Durations

SILENT_BODY = 1
"""Fault of a virtual board whose simulated body did not answer (``firmware/boards/posix/board.h``)."""
PROBES = 20
"""Requests that say how good a line is while no trial runs."""
LEAST_MESSAGES = 20
"""Of a trial, before they say how good its line is."""


class RemoteRobot(Robot):
    """One robot on any python-can bus; one trial at a time.

    Args:
        spec: what it should be; held against the robot's descriptor at `connect`.
        settings: see `RemoteSettings`.
        open_bus: opens the bus; called again after the link was lost.
        body: whose body the host simulates in mode HIL.
        watch: which task ends the sensors tell, in the other modes.
        drawing: what the robot and its arena look like, in the other modes.
    """

    def __init__(
        self,
        spec: RobotSpec,
        settings: RemoteSettings,
        open_bus: Callable[[], can.BusABC],
        body: SimulatedBody | None = None,
        watch: Watch | None = None,
        drawing: Drawing | None = None,
    ) -> None:
        if (body is None) == (settings.mode is Mode.HIL):
            raise ValueError(f"body: expected a simulated body in mode HIL and in no other, got {settings.mode.name}")
        self._spec = replace(spec, batch_size=1, deterministic=False)
        self._settings = settings
        self._connection = Connection(self._spec, settings, open_bus)
        self._body = StepwiseBody(body) if body is not None else None
        self._watch = watch
        self._drawing = drawing if self._body is None else self._body.robot.drawing
        self._observer: TrialObserver | None = None
        self._complaint = ""
        self._interrupted: EndReason | None = None
        self._link_quality: float | None = None
        self._counted_before: tuple[int, int] | None = None

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    @property
    def drawing(self) -> Drawing | None:
        return self._drawing

    @property
    def link(self) -> RobotLink:
        """The connected link.

        Raises:
            LinkError: there is none.
        """
        return self._connection.connected

    @property
    def identity(self) -> str | None:
        """The board's own number."""
        known = self._connection.descriptor
        return None if known is None else f"{known.unique_id:014x}"

    @property
    def descriptor(self) -> Descriptor | None:
        """What the robot said that it is; None before `connect`."""
        return self._connection.descriptor

    # -- connection -------------------------------------------------------------------------------------------------

    def connect(self) -> None:
        """Reach the robot, check that it is the right one, and leave SAFE or ESTOP: somebody asked for it to work.

        Raises:
            LinkError: it cannot be reached, another host has it, or it is not what the configuration says.
        """
        if self._body is not None:
            self._body.robot.connect()
            self._body.prepare()
        self._connection.open()
        self._link_quality = _quality((0, 0), _counted(self.link))

    def disconnect(self) -> None:
        self.make_safe("disconnect")
        self._connection.close()

    def make_safe(self, reason: str) -> bool:
        """Stop whatever runs. Without an answer the robot stops by itself 300 ms after our last heartbeat."""
        link = self._connection.link
        return link is not None and link.make_safe()

    @property
    def timing(self) -> dict[str, Durations]:
        link = self._connection.link
        if link is None:
            return {}
        told = {
            "round trip of the link": link.statistics.round_trips,
            "lateness of a control step": link.statistics.lateness,
        }
        return {name: durations for name, durations in told.items() if len(durations)}

    def body_fingerprint(self) -> str | None:
        return None if self._body is None else self._body.robot.body_fingerprint()

    def interrupt(self, reason: EndReason) -> None:
        """One frame, sent past whoever holds the link: STOP, or the latched stop of all robots."""
        # also while the line is being opened again: the trial must not begin then
        self._interrupted = reason
        link = self._connection.link
        if link is None:
            return
        if reason is EndReason.EMERGENCY_STOP:
            link.emergency_stop()
        else:
            link.stop_now()

    def health(self) -> Health:
        link = self._connection.link
        if link is None:
            return Health(ok=False, messages=(*self._complaints(), "not connected"))
        volts = link.battery_mv / 1000.0
        limits = self._settings.battery_range_v
        fraction = None
        if limits is not None and link.battery_mv:
            fraction = min(1.0, max(0.0, (volts - limits[0]) / (limits[1] - limits[0])))
        told = (f"battery {volts:.2f} V",) if link.battery_mv else ()
        ok = link.state not in (State.SAFE, State.ESTOP)
        return Health(ok, fraction, (*self._complaints(), *told), link_quality=self._quality_now())

    def _quality_now(self) -> float | None:
        """Of the trial that runs, once it has had enough messages to say; else as it was before it."""
        link, before = self._connection.link, self._counted_before
        if link is None or before is None or _counted(link)[0] - before[0] < LEAST_MESSAGES:
            return self._link_quality
        return _quality(before, _counted(link))

    def probe(self) -> None:
        """Try the line with requests that move nothing; look for the robot anew if it does not answer."""
        link = self._connection.link
        try:
            if link is None:
                raise LinkError("not connected")
            before = _counted(link)
            for _ in range(PROBES):
                link.request(Op.STOP, tries=2)
            self._link_quality = _quality(before, _counted(link))
        except LinkError:
            self._link_quality = 0.0
            self._connection.seek()

    def _board_fault(self) -> tuple[str, ...]:
        """What the board itself said last, if it was a fault."""
        events = self.link.events
        faults = [event.argument for event in events if event.code == EventCode.FAULT]
        if not faults or not events or events[-1].code not in (EventCode.FAULT, EventCode.STATE_CHANGE):
            return ()
        if self.descriptor is not None and self.descriptor.name.startswith("virtual") and faults[-1] == SILENT_BODY:
            return ("its simulated body did not answer in time: this computer was too slow",)
        return (f"board fault {faults[-1]}",)

    def _complaints(self) -> tuple[str, ...]:
        return (self._complaint,) if self._complaint else ()

    def observe(self, observer: TrialObserver | None) -> None:
        self._observer = observer

    def diagnose(self, mover: Mover | None = None) -> Iterator[Finding]:
        """Ports, handshake, latency, losses, the robot's own watchdog, sensors, and with leave the motors."""
        yield from examine(self, self._settings.mode, mover)

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
        size.check_fits(spec.n_sensors, spec.n_motors, spec.name)
        self._complaint = ""
        self._make_ready(trials)
        if self._interrupted is not None:
            return self._called_off()
        if self._observer is not None:
            self._observer.begin(int(trials.ids[0]))
        self._counted_before = _counted(self.link)
        try:
            return self._attempt(trials)
        except LinkError as error:
            self._complaint = str(error)
            self._connection.in_doubt = True
            self.make_safe(str(error))
            return Results.void(1, EndReason.LINK_LOST, len(spec.state_fields), str(error))
        except BaseException:
            self.make_safe("the host gives up")
            raise
        finally:
            self._link_quality, self._counted_before = self._quality_now(), None
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
        if self._connection.link is not None:
            self._connection.link.stop_wanted = False

    def _make_ready(self, trials: Trials) -> None:
        """Network loaded, robot at its start; nothing has moved yet, so all of it may simply be tried again."""
        self._connection.load(trials)
        if self._settings.rig_address is not None:
            # only now: a robot that could not be reached may still have been driving
            start = dict(zip(self._spec.start_fields, trials.starts[0].tolist(), strict=True))
            rig.place(self._settings.rig_address, start)

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
                follower, states = run_hil_trial(self.link, order, self._body, self._observer)
        except Refused as refused:
            if refused.status is Status.ALARM:
                told = ", ".join((*self._board_fault(), *self.health().messages))
                raise RobotFault(f"{self._spec.name} does not arm: bumper, battery or stop button ({told})") from None
            raise
        for late_s in lateness_s(follower.heard_s).tolist():
            self.link.statistics.lateness.add(late_s)
        return self._judge(trials, follower, states)

    def _bumper(self) -> EndReason:
        if self._settings.bumper is not None or self._settings.rig_address is None:
            return self._settings.bumper or EndReason.OUT_OF_BOUNDS
        return rig.why_ended(self._settings.rig_address)

    def _judge(self, trials: Trials, follower: Follower, states: NDArray[np.float32]) -> Results:
        reason = end_reason(follower, self._bumper)
        _, ticks = ended(follower)
        if reason is EndReason.OPERATOR and self._interrupted is not None:
            # the robot knows only that it was stopped; who stopped it knows why
            reason = self._interrupted
        if reason.is_void:
            self._complaint = ": ".join((f"the robot ended the trial: {reason}", *self._board_fault()))
            return Results.void(1, reason, len(self._spec.state_fields), self._complaint)
        steps = ticks if follower.task_end is None else follower.task_end[1] + 1
        contradiction = follower.contradiction or _ends_impossibly(follower, ticks, steps)
        if contradiction:
            raise TrialLost(f"what came on the link cannot all be true: {contradiction}")
        missing = follower.missing(ticks)
        if missing:
            self.link.statistics.lost_ticks += missing
            raise TrialLost(f"the sensors of {missing} of {ticks} steps were lost on the link")
        if self._body is not None and ticks >= len(states):
            raise TrialLost("the robot's last answer was lost on the link, so the body never made that step")
        sensors = follower.sensors[:ticks]
        neurons = recompute(trials.weights[trials.genome_index[0]], trials.size, trials.dynamics, sensors)
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
        """Ask the robot how a trial went whose host died: never started, ended, or half.

        A trial that never started is run now, or is void if a person has to be asked first. One that ended is taken if
        its result is known for sure: in mode HIL if the robot's steps and state hash are those of the simulation,
        otherwise if its steps ran out and no sensor could have ended the task before. Anything else is void.
        """
        try:
            last = self.link.last()
        except LinkError:
            self._connection.reach()
            last = self.link.last()
        void = Results.void(1, EndReason.LINK_LOST, len(self._spec.state_fields))
        if last.trial_id != robot_trial_id(trials):
            # whoever said "ready" before the crash may not be there, nor the robot at its start
            return void if self._spec.attended else self.run(trials)
        if self._body is not None:
            expected = self._body.robot.trace(trials)
            same = (last.ticks, last.state_hash) == (int(expected.steps[0]), int(expected.hashes[0]))
            return expected if same and last.reason in (LinkEnd.MAX_TICKS, LinkEnd.STOPPED) else void
        if last.reason is LinkEnd.MAX_TICKS and last.ticks == trials.max_steps and self._watch is None:
            return Results(
                end_reasons=np.array([EndReason.TIME_UP], np.uint8),
                steps=np.array([last.ticks], np.int32),
                hashes=np.array([last.state_hash], np.uint16),
                final_states=np.zeros((1, 0), np.float32),
                durations_s=np.array([last.ticks * self._spec.tick_s]),
            )
        return void


def _ends_impossibly(follower: Follower, ticks: int, steps: int) -> str:
    """What is wrong with the robot's word about the end of a trial; empty if nothing is."""
    most = follower.order.max_ticks
    ran_out = follower.end is not None and follower.end.reason is LinkEnd.MAX_TICKS
    if ticks > most or (ran_out and ticks != most):
        return f"the robot ended after {ticks} of {most} steps"
    return f"the task ended in step {steps - 1}, and the robot did {ticks} steps" if steps > ticks else ""


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
