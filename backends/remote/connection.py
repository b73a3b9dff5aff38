"""One robot at the end of a line: found, found again, checked against the configuration, given its network."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import can

from sceann_hil.link.descriptor import Capability, Descriptor
from sceann_hil.link.session import Refused, RobotLink, TwoRobots
from sceann_hil.link.upload import upload
from sceann_hil.link.vocabulary import Mode, Op, State, Status
from sceann_hil.robot import EmergencyStop, EndReason, LinkError, RobotFault, RobotSpec, Trials

OPENING_S = 0.2
"""Pause between two tries to open a port that is gone."""

SEEK_S = 1.0
"""How long one look for a lost robot takes."""
STATE_S = 0.5
"""How long to listen for a found robot's state; it tells it every 100 ms."""


@dataclass(frozen=True, slots=True)
class RemoteSettings:
    """How a robot is reached and used.

    Attributes:
        mode: where controller and body are during a trial.
        node: the robot's number on its bus.
        reconnect_s: how long to try to reach a robot that does not answer.
        bumper: what a hit bumper means for the task; None: the rig says it.
        rig_address: ``host:port`` of a machine that puts the robot back, if there is one.
        battery_range_v: empty and full, if the battery is measured.
    """

    mode: Mode
    node: int = 1
    reconnect_s: float = 10.0
    bumper: EndReason | None = EndReason.OUT_OF_BOUNDS
    rig_address: str | None = None
    battery_range_v: tuple[float, float] | None = None


class Connection:
    """The line to one robot; it is opened again whenever the robot was lost.

    Attributes:
        descriptor: what the robot said that it is; None before `open`.
        in_doubt: what the robot does and remembers is not known any more.

    Args:
        spec: what the robot should be.
        settings: see `RemoteSettings`.
        open_bus: opens the bus.
    """

    def __init__(self, spec: RobotSpec, settings: RemoteSettings, open_bus: Callable[[], can.BusABC]) -> None:
        self.descriptor: Descriptor | None = None
        self.in_doubt = False
        self._spec = spec
        self._settings = settings
        self._open_bus = open_bus
        self._link: RobotLink | None = None
        self._loaded: bytes | None = None

    @property
    def link(self) -> RobotLink | None:
        """The open link, if there is one."""
        return self._link

    @property
    def connected(self) -> RobotLink:
        """The open link.

        Raises:
            LinkError: there is none.
        """
        if self._link is None:
            raise LinkError(f"{self._spec.name} is not connected")
        return self._link

    def open(self) -> None:
        """Reach the robot, check that it is the right one, and put it to rest: somebody asked for it to work.

        Raises:
            LinkError: it cannot be reached, another host has it, or it is not what the configuration says.
            RobotFault: something holds it in SAFE or ESTOP.
        """
        self.reach()
        try:
            self._check_descriptor()
            try:
                self.rest()
            except Refused as refused:
                if refused.status is not Status.NO_SESSION:
                    raise
                # it lost power since it said hello
                self.reach()
                self._check_descriptor()
                self.rest()
        except BaseException:
            self.close()
            raise

    def reach(self) -> None:
        """Open the line and say hello, again and again for `RemoteSettings.reconnect_s`.

        Raises:
            LinkError: nobody answers, or somebody else than expected.
        """
        deadline = time.monotonic() + self._settings.reconnect_s
        self._loaded, self.in_doubt = None, False
        while True:
            self.close()
            try:
                self._link = RobotLink(self._open_bus(), self._settings.node)
            except (can.CanError, OSError) as error:
                if time.monotonic() >= deadline:
                    raise LinkError(f"{self._spec.name}: {error}") from error
                time.sleep(OPENING_S)
                continue
            try:
                self.descriptor = self._link.hello(max(1.5, deadline - time.monotonic()))
                return
            except TwoRobots:
                self.close()
                raise
            except LinkError:
                self.close()
                if time.monotonic() >= deadline:
                    raise
                time.sleep(OPENING_S)

    def seek(self) -> None:
        """Look once whether the robot is there again; never raises. Its network and state are in doubt then."""
        self._loaded, self.in_doubt = None, False
        self.close()
        try:
            self._link = RobotLink(self._open_bus(), self._settings.node)
            self.descriptor = self._link.hello(SEEK_S)
        except (LinkError, can.CanError, OSError):
            self.close()

    def _check_descriptor(self) -> None:
        robot, spec, mode = self.descriptor, self._spec, self._settings.mode
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

    def close(self) -> None:
        """Hang up; may be called twice."""
        if self._link is not None:
            self._link.close()
            self._link = None

    def load(self, trials: Trials) -> None:
        """Give the robot the one trial's network; reach it anew where that is needed.

        Raises:
            LinkError: it cannot be reached.
            RobotFault: it decodes genomes wrongly, or something holds it in SAFE.
            EmergencyStop: its stop is latched.
        """
        try:
            if self.in_doubt:
                # it may have restarted, and then remembers neither us nor its network
                self._loaded = None
                self.connected.hello(1.5)
                self.in_doubt = False
            self._load_now(trials)
        except Refused as refused:
            if refused.status is Status.NO_SESSION:
                self.reach()
            self._rest_unless_stopped()
            self._load_now(trials)
        except LinkError:
            self.reach()
            self._rest_unless_stopped()
            self._load_now(trials)

    def rest(self) -> None:
        """Out of ARMED, RUNNING or SAFE, so that a trial can be prepared.

        Raises:
            RobotFault: something holds the robot in SAFE or ESTOP.
        """
        self.connected.request(Op.STOP)
        try:
            self.connected.request(Op.CLEAR)
        except Refused as refused:
            if refused.status is Status.ALARM:
                raise RobotFault(
                    f"{self._spec.name} stays stopped: a stop button is held, or its board has a fault"
                ) from None
            raise

    def _rest_unless_stopped(self) -> None:
        """`rest` in the middle of a run: nobody asked for a latched stop to be cleared."""
        link, patience_s = self.connected, time.monotonic() + STATE_S
        while link.state is None and time.monotonic() < patience_s:
            link.receive(0.05)
        self._refuse_latched_stop()
        self.rest()

    def _refuse_latched_stop(self) -> None:
        if self.connected.state is State.ESTOP:
            raise EmergencyStop(f"{self._spec.name}: its emergency stop is latched")

    def _load_now(self, trials: Trials) -> None:
        self._refuse_latched_stop()
        if self.connected.state in (State.SAFE, State.ARMED, State.RUNNING):
            self.rest()
        weights = trials.weights[trials.genome_index[0]]
        record = weights.tobytes() + repr((trials.size, trials.dynamics)).encode()
        if self._settings.mode is not Mode.TETHERED and record != self._loaded:
            self._loaded = None
            upload(self.connected, weights, trials.size, trials.dynamics)
            self._loaded = record
