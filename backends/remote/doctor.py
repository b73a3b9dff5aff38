"""``sceann doctor`` for a robot on a line: one check after the other, each with advice."""

from __future__ import annotations

import secrets
import time
from collections.abc import Iterator
from functools import partial
from typing import Protocol

import numpy as np

from sceann_hil.link.descriptor import Capability, Descriptor
from sceann_hil.link.messages import LinkEnd, arm_arguments, pack_drive, start_arguments, unpack_sensors
from sceann_hil.link.numbers import HOST_DEADLINE_S
from sceann_hil.link.ports import serial_ports
from sceann_hil.link.session import NoAnswer, Refused, RobotLink, TwoRobots
from sceann_hil.link.statistics import LinkStatistics
from sceann_hil.link.trial import Order, begin
from sceann_hil.link.upload import upload
from sceann_hil.link.vocabulary import Function, Mode, Op, State, Status, Telemetry
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import ONE, SENSOR_MAX, Dynamics
from sceann_hil.robot import Health, LinkError, RobotError
from sceann_hil.robot.diagnosis import Finding, Mover, Verdict
from sceann_hil.robot.durations import Durations

PROBES = 200
_HOPELESS = 10
"""Requests without any answer after which probing the line further tells nothing more."""
SLOW_S = 0.008
LATEST_S = HOST_DEADLINE_S + 0.05
MOTOR_S = 0.5
_MOTOR_PART = 0.3
"""How far from rest a motor is driven in the check."""


class Examined(Protocol):
    """A robot on a line, as far as the doctor is concerned."""

    @property
    def descriptor(self) -> Descriptor | None:
        """What it says that it is; None before `connect`."""

    @property
    def link(self) -> RobotLink:
        """The open link."""

    def connect(self) -> None:
        """Reach it and check that it is the right one."""

    def disconnect(self) -> None:
        """Stop it and hang up."""

    def health(self) -> Health:
        """What it complains of."""


def examine(robot: Examined, mode: Mode, mover: Mover | None) -> Iterator[Finding]:
    """All checks, until one fails that makes the others pointless."""
    yield _ports()
    try:
        robot.connect()
    except TwoRobots as error:
        yield Finding("handshake", Verdict.BAD, str(error), "Switch all but one of them off and run the doctor again.")
        return
    except RobotError as error:
        yield Finding("handshake", Verdict.BAD, str(error), "Check power, cable, port, baud rate and node number.")
        return
    try:
        descriptor, link = robot.descriptor, robot.link
        if descriptor is None:
            return
        yield _handshake(descriptor)
        yield from _line_quality(link)
        yield _watchdog(link, descriptor)
        yield from _sensors(link, descriptor)
        if Capability.BODY not in descriptor.capabilities:
            return
        if mover is not None:
            yield mover("motors", partial(_motors, link, descriptor))
        else:
            yield Finding(
                "motors", Verdict.NOT_DONE, "the robot was not moved", "Lift its wheels and add --move to try them."
            )
    except Refused as refused:
        yield _refusal(refused, robot)
    except LinkError as error:
        yield Finding("link", Verdict.BAD, str(error), "Check the cable; run the doctor again.")
    finally:
        robot.disconnect()


def _refusal(refused: Refused, robot: Examined) -> Finding:
    if refused.status is not Status.ALARM:
        return Finding("link", Verdict.BAD, str(refused), "Run the doctor again with the robot switched off and on.")
    told = ", ".join(robot.health().messages)
    return Finding(
        "alarms",
        Verdict.BAD,
        f"the robot does not arm: bumper, battery or stop button{f' ({told})' if told else ''}",
        "Put it back where nothing touches its bumper, release the stop button, look at the battery. A virtual "
        "robot that has fallen over or arrived is put back by its next trial, or by switching it off and on.",
    )


def _ports() -> Finding:
    ports = sorted(serial_ports(include_links=True), key=lambda port: port.device)
    stable = [port for port in ports if "/by-id/" in port.device or "/by-path/" in port.device]
    lines = [f"{port.device}  {port.description}" for port in (stable or ports)]
    if not lines:
        return Finding("serial ports", Verdict.GOOD, "none found on this machine (a socket or a CAN bus needs none)")
    advice = "" if stable else "These names may change when another device is plugged in."
    return Finding("serial ports", Verdict.GOOD, "\n".join(lines), advice)


def _handshake(robot: Descriptor) -> Finding:
    major, minor, patch = robot.firmware
    can = ", ".join(str(c.name).lower() for c in Capability if c in robot.capabilities)
    return Finding(
        "handshake",
        Verdict.GOOD,
        f"{robot.name}, node {robot.node}, id {robot.unique_id:014x}, firmware {major}.{minor}.{patch}\n"
        f"link version {robot.link_version}, arithmetic {robot.arithmetic_id:08x}\n"
        f"{robot.n_sensors} sensors, {robot.n_motors} motors; networks of up to {robot.max_sources} sources\n"
        f"control step {robot.tick_min_s * 1e3:g}..{robot.tick_max_s * 1e3:g} ms; {can}",
    )


def _line_quality(link: RobotLink) -> Iterator[Finding]:
    before = link.statistics
    link.statistics = probe = LinkStatistics(robot_receive_errors=before.robot_receive_errors)
    link.receive(0.25)
    errors = probe.robot_receive_errors
    unanswered = 0
    for _ in range(PROBES):
        try:
            link.request(Op.STOP)
        except NoAnswer:
            unanswered += 1
            if unanswered == _HOPELESS:
                raise
    link.receive(0.25)
    trips, lost = probe.round_trips, probe.retries
    errors = probe.robot_receive_errors - errors
    slow = trips.quantile_s(0.5) > SLOW_S
    yield Finding(
        "round trip",
        Verdict.BAD if slow else Verdict.GOOD,
        f"p50 {trips.quantile_s(0.5) * 1e3:.2f} ms, p99 {trips.quantile_s(0.99) * 1e3:.2f} ms, "
        f"longest {trips.largest_s * 1e3:.2f} ms\n{histogram(trips)}",
        "A USB adapter's latency timer of 16 ms does this: set it to 1 ms, or use a faster baud rate." if slow else "",
    )
    yield Finding(
        "frame loss",
        Verdict.BAD if lost or errors else Verdict.GOOD,
        f"{lost} of {PROBES} requests had to be repeated, {unanswered} were never answered, "
        f"{errors} broken frames at the robot",
        "Shorten or shield the cable, or lower the baud rate." if lost or errors else "",
    )
    link.statistics = before


def histogram(durations: Durations, width: int = 40) -> str:
    """Bars, one line per bucket that holds anything."""
    edges, counts = durations.edges_s(), durations.counts
    held = np.flatnonzero(counts)
    if not len(held):
        return ""
    return "\n".join(
        f"{edges[k] * 1e3:9.3f} ms  {'#' * max(1, round(width * counts[k] / counts.max()))} {counts[k]}" for k in held
    )


def _trial_id() -> int:
    return secrets.randbelow(0xFFFF) + 1


def _watchdog(link: RobotLink, robot: Descriptor) -> Finding:
    """Falls silent in a running trial and sees the robot stop by itself."""
    name = "watchdog self-test"
    if Capability.HIL in robot.capabilities:
        size = NetworkSize(1, 0, 1)
        upload(link, np.zeros((1, 2), np.int8), size, Dynamics())
        begin(link, Order(_trial_id(), 1000, 0.02, 1, 1), Mode.HIL, Telemetry.NONE)
    else:
        link.request(Op.ARM)
    link.last_end = None
    with link.silent():
        silent_s = time.monotonic()
        while link.state not in (State.SAFE, State.ESTOP):
            link.receive(0.005)
            if time.monotonic() - silent_s > 1.0:
                break
        took_s = time.monotonic() - silent_s
    end = link.last_end
    link.request(Op.STOP)
    link.request(Op.CLEAR)
    stopped = took_s <= LATEST_S and (end is None or end.reason is LinkEnd.LINK_LOST)
    return Finding(
        name,
        Verdict.GOOD if stopped else Verdict.BAD,
        f"heartbeat stopped; the robot was safe after {took_s * 1e3:.0f} ms (deadline {HOST_DEADLINE_S * 1e3:.0f} ms)",
        "" if stopped else "Do not run this robot: its firmware does not stop when the host dies.",
    )


def _read_sensors(link: RobotLink, ticks: int) -> list[tuple[int, ...]]:
    """Sensors of a tethered trial that drives nothing: until the first DRIVE_IN the safe output stays."""
    rows: list[tuple[int, ...]] = []
    for _ in range(ticks):
        order = Order(_trial_id(), 1, 0.02, 1, 1)
        link.request(Op.ARM, arm_arguments(order.tick_s))
        arguments = start_arguments(order.trial_id, 1, Mode.TETHERED, Telemetry.NONE)
        heard: list[tuple[int, ...]] = []
        pages: dict[int, tuple[int, ...]] = {}

        def listen(incoming: tuple[int, bytes], pages: dict[int, tuple[int, ...]] = pages) -> None:
            if incoming[0] in (Function.SENSE, Function.SENSE_PAGE2):
                pages[incoming[0]] = unpack_sensors(incoming[1])[1]

        link.last_end = None
        with link.exclusive(order.trial_id), link.listening(listen):
            link.request(Op.START, arguments)
            until = time.monotonic() + 0.5
            while link.last_end is None and time.monotonic() < until:
                link.receive(0.02)
        heard = [pages[page] for page in (Function.SENSE, Function.SENSE_PAGE2) if page in pages]
        if heard:
            rows.append(tuple(value for page in heard for value in page))
    return rows


def _sensors(link: RobotLink, robot: Descriptor) -> Iterator[Finding]:
    if Capability.BODY not in robot.capabilities:
        yield Finding("sensors", Verdict.NOT_DONE, "the board has no body: it serves mode hil only")
        return
    rows = _read_sensors(link, 10)
    if not rows:
        yield Finding("sensors", Verdict.BAD, "no sensor message came", "Run the doctor again.")
        return
    values = np.array(rows)[:, : robot.n_sensors]
    stuck = [k for k in range(robot.n_sensors) if (values[:, k] == 0).all() or (values[:, k] == SENSOR_MAX).all()]
    told = "\n".join(
        f"sensor {k}: {values[:, k].mean():6.1f} of {SENSOR_MAX}, from {values[:, k].min()} to {values[:, k].max()}"
        for k in range(robot.n_sensors)
    )
    advice = f"At the end of the scale: {', '.join(map(str, stuck))}. See that something is in front, and the wiring."
    yield Finding("sensors", Verdict.GOOD, told, advice if stuck else "")


def _motors(link: RobotLink, robot: Descriptor) -> Finding:
    """Drives each motor a little, then falls silent while driving."""
    trial_id = _trial_id()
    period_s, safe_s = 0.05, 0.0
    tick = [-1]

    def listen(incoming: tuple[int, bytes]) -> None:
        if incoming[0] == Function.SENSE:
            tick[0] += 1

    link.last_end = None
    with link.exclusive(trial_id), link.listening(listen):
        begin(link, Order(trial_id, 2000, period_s, 1, 1), Mode.TETHERED, Telemetry.NONE)
        started_s, answered = time.monotonic(), -1
        stopped = silent = False
        for motor in range(robot.n_motors + 1):
            if stopped:
                break
            # the last round drives the last motor on and sends no heartbeats
            silent = motor == robot.n_motors
            driven = min(motor, robot.n_motors - 1)
            values = [round(_MOTOR_PART * ONE) if m == driven else 0 for m in range(robot.n_motors)]
            until_s = started_s + (motor + 1) * MOTOR_S
            silent_s = time.monotonic()
            with link.silent() if silent else link.exclusive():
                while time.monotonic() < until_s + (1.0 if silent else 0.0):
                    link.receive(0.01)
                    if tick[0] > answered:
                        answered = tick[0]
                        link.send(Function.DRIVE_IN, pack_drive(answered, link.session, values))
                    stopped = link.last_end is not None or link.state is State.SAFE
                    if stopped:
                        safe_s = time.monotonic() - silent_s
                        break
    end = link.last_end
    link.request(Op.STOP)
    link.request(Op.CLEAR)
    if stopped and not (silent and (end is None or end.reason is LinkEnd.LINK_LOST)):
        why = "END was lost" if end is None else end.reason.name.lower().replace("_", " ")
        return Finding(
            "motors",
            Verdict.BAD,
            f"the robot stopped by itself before silence could stop it ({why})",
            "Release bumper and stop button, look at the battery, and run the doctor again.",
        )
    good = 0.0 < safe_s <= LATEST_S
    return Finding(
        "motors",
        Verdict.GOOD if good else Verdict.BAD,
        f"each of {robot.n_motors} was driven for {MOTOR_S:g} s at {_MOTOR_PART:.0%}; "
        f"silent while driving: safe after {safe_s * 1e3:.0f} ms",
        "Did each turn, one after the other, forwards? If not: wiring, driver, battery."
        if good
        else "Do not run this robot: its motors did not stop when the host fell silent.",
    )
