"""A robot of one's own, whole: a rover on a serial port that answers "s" with three light readings, "m a b" with "ok"."""

from __future__ import annotations

from typing import Literal

import numpy as np
import serial
from numpy.typing import ArrayLike, NDArray

from sceann_hil.plugins import RobotConfig
from sceann_hil.robot import EndReason, LinkError, RobotSpec
from sceann_hil.stepped import SteppedRobot


class LightSeeker(SteppedRobot):
    """Two wheels, three light sensors; the lamp is reached when one of them is nearly blinded."""

    def __init__(self, port: str, spec: RobotSpec) -> None:
        super().__init__()
        self._port, self._spec = port, spec
        self._lights = np.zeros(3)

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    def connect(self) -> None:
        self._line = serial.serial_for_url(self._port, 115_200, timeout=0.05)

    def disconnect(self) -> None:
        self.make_safe("disconnect")
        if hasattr(self, "_line"):
            self._line.close()

    def reset(self, start: dict[str, float], key: int) -> None:
        pass  # a person, or a rig, has put it at its start

    def sense(self) -> ArrayLike:
        self._lights = np.array(self._ask("s").split(), np.float64) / 1023.0
        return self._lights

    def drive(self, motors: NDArray[np.float64]) -> None:
        self._ask(f"m {255 * motors[0]:.0f} {255 * motors[1]:.0f}")

    def stop(self) -> None:
        self._ask("m 0 0")

    def ended(self) -> EndReason | None:
        return EndReason.GOAL if self._lights.max() > 0.95 else None

    def _ask(self, question: str) -> str:
        try:
            self._line.write(f"{question}\n".encode())
            answer = self._line.readline().decode().strip()
        except (OSError, AttributeError) as error:
            raise LinkError(f"light seeker: {error}") from error
        if not answer:
            raise LinkError(f"light seeker: no answer to {question!r}")
        return answer


class LightSeekerConfig(RobotConfig):
    """A rover that looks for a lamp."""

    type: Literal["light_seeker"] = "light_seeker"
    port: str
    """Its serial port."""

    @property
    def spec(self) -> RobotSpec:
        fields = ("x_m", "y_m", "heading_rad")
        return RobotSpec("light seeker", 3, 2, 0.05, fields, (), attended=True, batch_size=1, repeatable=False)

    def build(self) -> LightSeeker:
        return LightSeeker(self.port, self.spec)
