"""A Thymio that runs its controllers itself: loaded, started, listened to, and held against the reference."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from backends.thymio.connection import Connection, Done
from backends.thymio.reached import ReachedThymio
from backends.thymio.tethered import QUIET_S
from sceann_hil.firmware.aesl.compiler import Code
from sceann_hil.firmware.aesl.program import HEAD, End, network_code
from sceann_hil.link.statistics import lateness_s
from sceann_hil.link.trial import TrialLost
from sceann_hil.network.controller import SENSOR_MAX
from sceann_hil.network.recompute import recompute
from sceann_hil.robot import (
    UNKNOWN_STATE,
    EndReason,
    LinkError,
    Results,
    RobotFault,
    RobotSpec,
    Trace,
    TrialObserver,
    Trials,
)
from sceann_hil.robot.drawing import Drawing
from sceann_hil.robot.durations import Durations
from sceann_hil.robot.sensor_ends import SensorWatch

BEAT_S = 0.1
"""How often the robot is told that somebody is here."""
_LISTEN_S = 0.02
MOST_STEPS = 65_535


class OnboardThymio(ReachedThymio):
    """One trial at a time; every step's sensors come as an event, with the hash of all states so far.

    Args:
        spec: what it is.
        connection: the way to it.
        ends: what its sensors say of the task.
        drawing: what it and its arena look like.
    """

    def __init__(
        self, spec: RobotSpec, connection: Connection, ends: SensorWatch | None, drawing: Drawing | None
    ) -> None:
        super().__init__(spec, connection, ends, drawing)
        self._observer: TrialObserver | None = None
        self._interrupted: EndReason | None = None
        self._lateness = Durations()

    def make_safe(self, reason: str) -> bool:
        return self._connection.stop()

    def interrupt(self, reason: EndReason) -> None:
        # also while the robot is being found again: the trial must not begin then
        self._interrupted = reason
        self.make_safe(str(reason))

    @property
    def timing(self) -> dict[str, Durations]:
        return {"lateness of a control step": self._lateness} if len(self._lateness) else {}

    def observe(self, observer: TrialObserver | None) -> None:
        self._observer = observer

    # -- trials -----------------------------------------------------------------------------------------------------

    def run(self, trials: Trials) -> Results:
        """Run one trial. A trial that the line or the robot spoilt is void.

        Raises:
            ValueError: more than one trial, a network that does not fit, or too many steps.
            LinkError: the robot cannot be reached within the time for it.
            RobotFault: it does not take its program.
        """
        spec = self._spec
        trials.size.check_fits(spec.n_sensors, spec.n_motors, spec.name)
        if len(trials) != 1:
            raise ValueError(f"trials: expected 1 at a time, got {len(trials)}")
        if trials.max_steps > MOST_STEPS:
            raise ValueError(f"task.max_steps: expected at most {MOST_STEPS} on board, got {trials.max_steps}")
        self._complaint = ""
        self._connection.reach()
        try:
            self._make_ready(trials)
            if self._interrupted is not None:
                called_off = self._interrupted if self._interrupted.is_void else EndReason.OPERATOR
                return Results.void(1, called_off, len(spec.state_fields))
            return self._attempt(trials)
        except LinkError as error:
            self._complaint = str(error)
            self.make_safe(str(error))
            self._connection.lost = True
            return Results.void(1, EndReason.LINK_LOST, len(spec.state_fields), str(error))
        except BaseException:
            self.make_safe("the host gives up")
            raise
        finally:
            self._interrupted = None

    def _make_ready(self, trials: Trials) -> None:
        """Simulator at the start, program and weights loaded; nothing has moved yet."""
        connection, life = self._connection, self._connection.life
        start = dict(zip(self._spec.start_fields, trials.starts[0].tolist(), strict=True))
        connection.put_at(start)
        code = connection.load(
            (trials.size, trials.dynamics),
            lambda target: network_code(trials.size, trials.dynamics, life, target),
        )
        self._load_weights(code, trials.weights[trials.genome_index[0]])

    def _load_weights(self, code: Code, weights: NDArray[np.int8]) -> None:
        values = tuple(np.ravel(weights).tolist())
        with self._connection.listening() as node:
            for _ in range(2):
                node.write(code.addresses["w"], values)
                if node.read(code.addresses["w"], len(values)) == values:
                    return
        raise RobotFault(f"{self._connection.place}: the robot did not take the weights of the controller")

    def _attempt(self, trials: Trials) -> Results:
        observer, number = self._observer, robot_number(trials)
        sensors = np.zeros((trials.max_steps, self._spec.n_sensors), np.uint16)
        hashes = np.zeros(trials.max_steps, np.uint16)
        heard_s = np.full(trials.max_steps, np.nan)
        ticks, task_end, done = 0, None, None
        if observer is not None:
            observer.begin(int(trials.ids[0]))
        try:
            with self._connection.listening() as node:
                node.forget_events()
                node.tell("sceann.start", number, trials.max_steps)
                beat_s = last_s = time.monotonic()
                quiet_s = max(QUIET_S, 5.0 * self._spec.tick_s)
                while done is None:
                    now_s = time.monotonic()
                    if now_s - beat_s >= BEAT_S:
                        node.tell("sceann.beat", number)
                        beat_s = now_s
                    event = node.heard(_LISTEN_S)
                    if event is None:
                        if time.monotonic() - last_s > quiet_s:
                            raise TrialLost(
                                f"{self._connection.place}: the robot fell silent in mid-trial: asleep, out of reach, "
                                "or its simulator stands still"
                            )
                        continue
                    name, words = event
                    if (words[0] & 0xFFFF) != number:
                        continue
                    last_s = time.monotonic()
                    if name == "sceann.tick":
                        wire = self._checked(words, ticks, trials.max_steps)
                        sensors[ticks], hashes[ticks], heard_s[ticks] = wire, words[2] & 0xFFFF, last_s
                        if observer is not None:
                            observer.step(ticks, wire, UNKNOWN_STATE)
                        ticks += 1
                        if task_end is None and self._ends is not None and (end := self._ends(wire)) is not None:
                            task_end = end, ticks
                            node.stop_motors()
                    elif name == "sceann.done":
                        done = Done.told(words)
        finally:
            if observer is not None:
                observer.end()
        for late_s in lateness_s(heard_s[:ticks]).tolist():
            self._lateness.add(late_s)
        if done.steps != ticks:
            raise TrialLost(f"{self._connection.place}: {done.steps} steps were done, {ticks} were heard")
        return self._judged(trials, done, task_end, sensors[:ticks], hashes[:ticks])

    def _checked(self, words: tuple[int, ...], ticks: int, most: int) -> NDArray[np.uint16]:
        """The sensors of the next tick."""
        wire = np.array(words[HEAD:])
        right = len(wire) == self._spec.n_sensors and bool(((wire >= 0) & (wire <= SENSOR_MAX)).all())
        if words[1] & 0xFFFF != ticks or ticks >= most or not right:
            raise TrialLost(f"{self._connection.place}: expected the sensors of step {ticks}, got {words}")
        return wire.astype(np.uint16)

    def _judged(
        self,
        trials: Trials,
        done: Done,
        task_end: tuple[EndReason, int] | None,
        sensors: NDArray[np.uint16],
        hashes: NDArray[np.uint16],
    ) -> Results:
        neurons = recompute(trials.weights[trials.genome_index[0]], trials.size, trials.dynamics, sensors)
        n_state, steps = len(self._spec.state_fields), len(sensors)
        told = np.append(hashes, np.uint16(done.state_hash)) if steps else hashes
        expected = np.append(neurons.hashes, neurons.hashes[-1:])
        if not np.array_equal(told, expected):
            step = min(int(np.argmax(told != expected)), steps - 1)
            self._complaint = (
                f"robot and host computed different neurons from the same sensors, first in step {step} of trial "
                f"{trials.ids[0]}"
            )
            return Results.void(1, EndReason.FAULT, n_state, self._complaint)
        if done.end is End.STEPS and task_end is None:
            reason = EndReason.TIME_UP
        elif task_end is not None:
            reason, steps = task_end
        elif done.end is End.SILENCE:
            reason, self._complaint = (
                EndReason.LINK_LOST,
                "this computer was silent for too long, and the robot stopped",
            )
        else:
            reason = self._interrupted or EndReason.OPERATOR
            self._complaint = "somebody pressed the robot's centre button" if done.end is End.BUTTON else ""
        if reason.is_void:
            return Results.void(1, reason, n_state, self._complaint)
        trace = Trace(np.zeros((steps + 1, 0), np.float32), sensors[:steps], neurons.u[:steps], neurons.x[:steps])
        return Results(
            end_reasons=np.array([reason], np.uint8),
            steps=np.array([steps], np.int32),
            hashes=np.array([neurons.hashes[steps - 1] if steps else 0xFFFF], np.uint16),
            final_states=np.zeros((1, 0), np.float32),
            durations_s=np.array([steps * self._spec.tick_s]),
            traces=[trace],
        )

    def settle(self, trials: Trials) -> Results:
        """What the robot remembers of a trial whose host died: taken if all its steps are done; else it is void.

        A trial that it never began is run now, if nobody has to put the robot back.
        """
        self._connection.reach()
        last, void = self._connection.last, super().settle(trials)
        if last is None or last.number != robot_number(trials):
            return void if self._spec.attended else self.run(trials)
        if last.end is not End.STEPS or last.steps != trials.max_steps or self._ends is not None:
            return void
        return Results(
            end_reasons=np.array([EndReason.TIME_UP], np.uint8),
            steps=np.array([last.steps], np.int32),
            hashes=np.array([last.state_hash], np.uint16),
            final_states=np.zeros((1, 0), np.float32),
            durations_s=np.array([last.steps * self._spec.tick_s]),
        )


def robot_number(trials: Trials) -> int:
    """The number 1..65535 by which the robot knows the one trial: consecutive in a run, apart between runs."""
    return 1 + (trials.run_id + int(trials.ids[0])) % 65_535
