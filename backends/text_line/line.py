"""Questions and answers on a line of text: an answer that is late, half, doubled or unasked for is never believed."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

import serial

from backends.text_line.answers import Pattern
from sceann_hil.robot import LinkError
from sceann_hil.robot.durations import Durations

_LONGEST = 1024
"""Bytes of a line; a robot that sends more without an end speaks something else."""
_QUIET_S = 0.05
"""Silence after which nothing more is coming."""
_CLEAR_S = 2.0
"""How long a robot that goes on talking is listened to before the line counts as unusable."""


@dataclass(frozen=True, slots=True)
class Question:
    """A line to the robot, and what its answer looks like; None if it gives none."""

    say: str
    answer: Pattern | None


class TextLine:
    """A serial port, or whatever pyserial can open, spoken to in lines.

    Args:
        port: path or pyserial URL.
        baud: speed.
        line_end: what ends a line to the robot.
        answer_s: how long an answer may take.
    """

    def __init__(self, port: str, baud: int, line_end: str, answer_s: float) -> None:
        self.port = port
        self.answered = Durations()
        self._serial = serial.serial_for_url(port, baud, timeout=answer_s, write_timeout=1.0, do_not_open=True)
        self._line_end = line_end
        self._answer_s = answer_s
        self._asking = threading.RLock()
        self._writing = threading.Lock()

    def open(self) -> None:
        """Open the port, or open it again.

        Raises:
            LinkError: it cannot be opened; the message says why.
        """
        with self._asking:
            self.close()
            try:
                self._serial.open()
            except (serial.SerialException, OSError, ValueError) as error:
                raise LinkError(f"{self.port}: the port cannot be opened: {error}") from error

    def close(self) -> None:
        """Give the port back; may be called twice."""
        self._serial.close()

    def ask(self, question: Question, *numbers: str) -> tuple[float, ...]:
        """Say a line and hear its answer.

        Args:
            question: what to say.
            numbers: stand in the places of the line.

        Returns:
            The numbers of the answer.

        Raises:
            LinkError: no answer, half of one, another one than expected, or the robot had said something by itself.
        """
        said = question.say.replace("{}", "%s") % numbers if numbers else question.say
        with self._asking:
            waiting = self._waiting()
            if waiting:
                raise LinkError(f"{self.port}: it said {_shown(waiting)} without being asked")
            asked_s = time.monotonic()
            self.write(said)
            if question.answer is None:
                return ()
            line = self._read_line(said)
            self.answered.add(time.monotonic() - asked_s)
            try:
                return question.answer.read(line)
            except ValueError as error:
                raise LinkError(f"{self.port}: to {said!r} it {error}") from None

    def busy(self) -> bool:
        """Whether another thread waits for an answer at this moment."""
        if self._asking.acquire(blocking=False):
            self._asking.release()
            return False
        return True

    def write(self, said: str) -> None:
        """Say a line without listening; any thread may, at any time."""
        try:
            with self._writing:
                self._serial.write((said + self._line_end).encode("ascii"))
        except (serial.SerialException, OSError) as error:
            raise LinkError(f"{self.port}: the port went away: {error}") from error

    def clear(self) -> None:
        """Listen until the robot is quiet, so that an old answer is not taken for a new one.

        Raises:
            LinkError: it goes on talking.
        """
        with self._asking:
            deadline_s = time.monotonic() + _CLEAR_S
            while True:
                time.sleep(_QUIET_S)
                heard = self._waiting()
                if not heard:
                    return
                if time.monotonic() > deadline_s:
                    raise LinkError(f"{self.port}: it talks without being asked: {_shown(heard)}")

    def _waiting(self) -> bytes:
        """What has come and nobody has read."""
        try:
            self._serial.timeout = 0
            return bytes(self._serial.read(_LONGEST))
        except (serial.SerialException, OSError) as error:
            raise LinkError(f"{self.port}: the port went away: {error}") from error

    def _read_line(self, said: str) -> str:
        deadline_s = time.monotonic() + self._answer_s
        heard = b""
        try:
            while not heard.endswith(b"\n"):
                left_s = deadline_s - time.monotonic()
                if left_s <= 0.0:
                    what = f"only {_shown(heard)}, no whole line," if heard else "nothing"
                    raise LinkError(f"{self.port}: to {said!r} it answered {what} within {self._answer_s:g} s")
                self._serial.timeout = left_s
                heard += self._serial.read(1)
                if len(heard) > _LONGEST:
                    raise LinkError(f"{self.port}: to {said!r} it answered with more than {_LONGEST} bytes")
        except (serial.SerialException, OSError) as error:
            raise LinkError(f"{self.port}: the port went away: {error}") from error
        return heard.decode("ascii", errors="backslashreplace").rstrip("\r\n")


def _shown(heard: bytes) -> str:
    text = heard[:40].decode("ascii", errors="backslashreplace")
    return repr(text) + (" ..." if len(heard) > 40 else "")
