"""What a text-line robot talks to: a rover on a pseudo-terminal that can be made to misbehave."""

from __future__ import annotations

import os
import pty
import threading
import time
import tty
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

from backends.text_line import TextLineConfig

Answer = Callable[[str], str]
"""From a question to what is sent, line ends included; an empty text is no answer."""


def right_answer(question: str) -> str:
    """What the rover of ``examples/light_seeker.yaml`` answers."""
    if question == "s":
        return "300 512 700\n"
    return "7.4\n" if question == "b" else "ok\n"


class Sketch:
    """A rover; `answer` may be replaced at any time.

    Attributes:
        heard: every line that came.
        answer: from a question to what is sent.
    """

    def __init__(self, answer: Answer = right_answer, silent_s: float = 0.0) -> None:
        self.answer = answer
        self.heard: list[str] = []
        self._ready_s = time.monotonic() + silent_s
        near, far = pty.openpty()
        tty.setraw(far)
        self.port = os.ttyname(far)
        self._descriptors = (near, far)
        self._thread = threading.Thread(target=self._run, daemon=True)

    @property
    def wheels(self) -> list[str]:
        """The lines that drove or stopped it."""
        return [line for line in self.heard if line.startswith("m")]

    def say(self, text: str) -> None:
        """Something that nobody asked for."""
        os.write(self._descriptors[0], text.encode())

    def _run(self) -> None:
        question = b""
        while (byte := os.read(self._descriptors[0], 1)) != b"\x04":
            if byte != b"\n":
                question += byte
                continue
            said = question.decode()
            question = b""
            if time.monotonic() < self._ready_s:
                continue
            self.heard.append(said)
            text = self.answer(said)
            if text:
                self.say(text)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.write(self._descriptors[1], b"\x04")
        self._thread.join()
        for descriptor in self._descriptors:
            os.close(descriptor)


def rover(port: str, **changes: Any) -> TextLineConfig:
    """The robot section of ``examples/light_seeker.yaml``, with changes; ticks short, and 150 ms for an answer."""
    section: dict[str, Any] = {
        "port": port,
        "tick_s": 0.04,
        "answer_s": 0.15,
        "start_s": 2.0,
        "start_fields": ["x_m", "y_m", "heading_rad"],
        "sense": {"say": "s", "answer": "{} {} {}"},
        "sensors": [{"at_0": 0, "at_1": 1023}] * 3,
        "drive": {"say": "m {} {}", "answer": "ok"},
        "motors": [{"at_0": 0, "at_1": 255}] * 2,
        "stop": {"say": "m 0 0", "answer": "ok"},
    }
    return TextLineConfig.model_validate(section | changes, strict=False)
