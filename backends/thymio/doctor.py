"""``sceann doctor`` for a Thymio: one check after the other, each with advice."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from backends.thymio.connection import Connection
from sceann_hil.firmware.aesl.node import AsebaNode, NoNode
from sceann_hil.firmware.aesl.program import HEAD, SILENCE_S, End, tethered_code
from sceann_hil.link.ports import describe_ports
from sceann_hil.link.statistics import lateness_s
from sceann_hil.network.controller import SENSOR_MAX
from sceann_hil.robot import RobotError
from sceann_hil.robot.diagnosis import Finding, Mover, Verdict

_ASKED = 30
_TICKS = 30
_NUMBER = 1
_MOVE = 150
"""Motor target of the check."""
_MOVE_S = 0.6
_SLOW_S = 0.06


def examine(connection: Connection, mover: Mover | None) -> Iterator[Finding]:
    """All checks, until one fails that makes the others pointless."""
    yield Finding("serial ports", Verdict.GOOD, describe_ports())
    try:
        connection.open()
    except NoNode as error:
        yield Finding("robot", Verdict.BAD, str(error), "Switch the robot on, and bring it near the dongle.")
        return
    except RobotError as error:
        yield Finding("robot", Verdict.BAD, str(error), "Check cable, dongle, port and host, and close other programs.")
        return
    try:
        with connection.listening() as node:
            target = node.target
            yield Finding(
                "robot",
                Verdict.GOOD,
                f"{target.name}, firmware {node.firmware()}, {target.bytecode_words} words of byte code, "
                f"{target.variable_words} of variables",
            )
            yield _answers(node)
            life = connection.life
            connection.load("tethered", lambda target: tethered_code(life, target))
            yield from _ticks(node, connection)
            yield _silence(node)
            if mover is not None:
                yield mover("motors", lambda: _motors(node))
            else:
                advice = "Lift its wheels and add --move to try them."
                yield Finding("motors", Verdict.NOT_DONE, "the robot was not moved", advice)
    except RobotError as error:
        yield Finding("line", Verdict.BAD, str(error), "Run the doctor again, nearer to the dongle or by cable.")
    finally:
        connection.stop()
        connection.close()


def _answers(node: AsebaNode) -> Finding:
    for _ in range(_ASKED):
        node.read(node.target.address("prox.horizontal"), 7)
    answered = node.answered
    slow = answered.quantile_s(0.5) > _SLOW_S
    return Finding(
        "answers",
        Verdict.BAD if slow else Verdict.GOOD,
        f"to a question: p50 {1e3 * answered.quantile_s(0.5):.1f} ms, longest {1e3 * answered.largest_s:.1f} ms",
        "Bring the robot nearer, or use the cable." if slow else "",
    )


def _ticks(node: AsebaNode, connection: Connection) -> Iterator[Finding]:
    """A trial in which the motors stand still: does the robot keep its beat, what does it see?"""
    tick_s, rows, heard_s = connection.life.tick_s, [], []
    node.forget_events()
    node.tell("sceann.start", _NUMBER, _TICKS)
    until_s = time.monotonic() + 2.0 * _TICKS * tick_s + 1.0
    while time.monotonic() < until_s:
        event = node.heard(0.1)
        node.tell("sceann.beat", _NUMBER)
        if event is not None and event[0] == "sceann.done":
            break
        if event is not None and event[0] == "sceann.tick":
            rows.append(event[1][HEAD:])
            heard_s.append(time.monotonic())
    whole = len(rows) == _TICKS
    late_s = lateness_s(np.array(heard_s))
    told = f"{len(rows)} of {_TICKS} steps of {1e3 * tick_s:g} ms were heard"
    if len(late_s):
        told += f", the latest {1e3 * late_s.max():.1f} ms late"
    yield Finding("beat", Verdict.GOOD if whole else Verdict.BAD, told, "" if whole else "Use a longer tick_s.")
    if rows:
        values = np.array(rows)
        text = "\n".join(
            f"sensor {k}: {values[:, k].mean():6.1f} of {SENSOR_MAX}, from {values[:, k].min()} to {values[:, k].max()}"
            for k in range(values.shape[1])
        )
        yield Finding("sensors", Verdict.GOOD, text, "Hold a hand before one after the other: does the right one rise?")


def _silence(node: AsebaNode) -> Finding:
    node.forget_events()
    node.tell("sceann.start", _NUMBER, 0xFFFF)
    silent_s, end = time.monotonic(), None
    while end is None and time.monotonic() - silent_s < 3.0:
        event = node.heard(0.1)
        if event is not None and event[0] == "sceann.done":
            end = event[1][1]
    took_s = time.monotonic() - silent_s
    good = end == End.SILENCE
    return Finding(
        "silence",
        Verdict.GOOD if good else Verdict.BAD,
        f"without messages the robot ended its trial after {took_s:.2f} s (expected about {SILENCE_S:g} s)",
        "" if good else "Do not run this robot: it does not stop when this computer falls silent.",
    )


def _motors(node: AsebaNode) -> Finding:
    target, told, good = node.target, [], True
    for side in ("left", "right"):
        node.write(target.address(f"motor.{side}.target"), [_MOVE])
        time.sleep(_MOVE_S)
        speed = node.read(target.address(f"motor.{side}.speed"), 1)[0]
        node.stop_motors()
        good &= abs(speed) > _MOVE // 3
        told.append(f"{side}: told {_MOVE}, turned at {speed}")
    time.sleep(0.2)
    return Finding(
        "motors",
        Verdict.GOOD if good else Verdict.BAD,
        "; ".join(told),
        "Did the right wheel turn, and forwards?" if good else "Is the battery empty, or a wheel blocked?",
    )
