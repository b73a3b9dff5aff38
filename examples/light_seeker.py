"""A robot of one's own: a rover that answers "s" with three light readings and "m 120 80" (two wheels) with "ok"."""

from typing import ClassVar, Literal

import numpy as np
import serial
from numpy.typing import NDArray

from sceann_hil.plugins import RobotConfig
from sceann_hil.robot import EndReason, LinkError, RobotSpec
from sceann_hil.robot.stepped import SteppedRobot

SPEC = RobotSpec("light seeker", 3, 2, 0.05, ("x_m", "y_m", "heading_rad"), (), True, 1, deterministic=False)


class LightSeeker(SteppedRobot):
    spec: ClassVar[RobotSpec] = SPEC

    def __init__(self, port: str) -> None:
        super().__init__()
        self._line = serial.serial_for_url(port, 115_200, timeout=0.1, do_not_open=True)

    def connect(self) -> None:
        self._line.close()
        self._line.open()

    def reset(self, start: dict[str, float], key: int) -> None:
        self._lights = np.zeros(3)  # a person has put it back

    def sense(self) -> NDArray[np.float64]:
        self._lights = np.array(self._ask("s").split(), np.float64) / 1023.0
        return self._lights

    def drive(self, motors: NDArray[np.float64]) -> None:
        self._ask(f"m {255 * motors[0]:.0f} {255 * motors[1]:.0f}")

    def stop(self) -> None:
        self._ask("m 0 0")

    def ended(self) -> EndReason | None:
        return EndReason.GOAL if self._lights.max() > 0.95 else None

    def _ask(self, question: str) -> str:
        self._line.write(f"{question}\n".encode())
        answer = self._line.readline().decode().strip()
        if not answer:
            raise LinkError(f"light seeker: no answer to {question!r}")
        return answer


class LightSeekerConfig(RobotConfig):
    """A rover that looks for a lamp."""

    type: Literal["light_seeker"] = "light_seeker"
    port: str
    spec: ClassVar[RobotSpec] = SPEC

    def build(self) -> LightSeeker:
        return LightSeeker(self.port)
