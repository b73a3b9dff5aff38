"""What a Thymio is at the other end of a connection, wherever its controller runs."""

from __future__ import annotations

from collections.abc import Iterator

from backends.thymio.connection import Connection
from backends.thymio.doctor import examine
from sceann_hil.robot import Health, Robot, RobotError, RobotSpec
from sceann_hil.robot.diagnosis import Finding, Mover
from sceann_hil.robot.drawing import Drawing
from sceann_hil.robot.sensor_ends import SensorWatch


class ReachedThymio(Robot):
    """Opened, closed, tried and examined over its connection.

    Args:
        spec: what it is.
        connection: the way to it.
        ends: what its sensors say of the task.
        drawing: what it and its arena look like.
    """

    def __init__(
        self, spec: RobotSpec, connection: Connection, ends: SensorWatch | None, drawing: Drawing | None
    ) -> None:
        super().__init__()
        self._spec = spec
        self._connection = connection
        self._ends = ends
        self._drawing = drawing
        self._complaint = ""

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    @property
    def drawing(self) -> Drawing | None:
        return self._drawing

    def connect(self) -> None:
        """Find it; the motors are stopped.

        Raises:
            LinkError: it is not there, or it is another one.
        """
        self._connection.open()

    def disconnect(self) -> None:
        self.make_safe("disconnect")
        self._connection.close()

    def health(self) -> Health:
        return Health(self._connection.is_connected, messages=(self._complaint,) if self._complaint else ())

    def probe(self) -> None:
        try:
            self._connection.reach()
        except RobotError as error:
            self._complaint = str(error)

    def diagnose(self, mover: Mover | None = None) -> Iterator[Finding]:
        yield from examine(self._connection, mover)
