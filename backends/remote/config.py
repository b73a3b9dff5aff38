"""The ``robot`` section of type ``remote``."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any, Literal, Self

from can import BusABC
from pydantic import Field, SerializeAsAny, ValidationError, ValidationInfo, field_validator, model_validator

import sceann_hil.link.serial_bus as serial_bus
from backends.remote.connection import RemoteSettings
from backends.remote.robot import RemoteRobot
from backends.simulation.body import SimulatedBody
from sceann_hil import registry
from sceann_hil.errors import PluginError
from sceann_hil.firmware.build import Board
from sceann_hil.link.can_bus import known_interfaces, open_can
from sceann_hil.link.numbers import MAX_MOTORS, MAX_SENSORS
from sceann_hil.link.vocabulary import Mode
from sceann_hil.plugins import Misfit, RobotConfig, Section
from sceann_hil.registry import Group
from sceann_hil.robot import EndReason, RobotSpec
from sceann_hil.robot.sensor_ends import SensorEnd, SensorWatch, TaskEnd

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]


class CanChannel(Section):
    """A CAN bus, as python-can names it."""

    interface: str
    """python-can's interface: socketcan, slcan, udp_multicast, pcan, ..."""
    channel: str
    """The interface's channel: can0, a port, an address."""
    bitrate: Annotated[int, Field(gt=0)] = 500_000
    """Bits per second."""
    options: dict[str, str | int | float | bool] = Field(default_factory=dict)
    """Whatever else this interface wants."""

    @field_validator("interface")
    @classmethod
    def _is_known(cls, value: str) -> str:
        if value not in known_interfaces():
            raise ValueError(f"expected one of {', '.join(known_interfaces())}; got {value!r}")
        return value


class RemoteConfig(RobotConfig):
    """A robot with our firmware on a serial port or a CAN bus."""

    type: Literal["remote"] = "remote"
    port: str | None = None
    """Serial port, by a path that stays the same (/dev/serial/by-id/...), or a pyserial URL (socket://host:port)."""
    baud: Annotated[int, Field(gt=0)] = 115_200
    """Speed of the serial port."""
    can: CanChannel | None = None
    """A CAN bus instead of a serial port."""
    node: Annotated[int, Field(ge=1, le=127)] = 1
    """The robot's number."""
    mode: Literal["onboard", "tethered", "hil"] = "onboard"
    """onboard: controller on the robot; tethered: controller here; hil: controller on the robot, body simulated."""
    body: SerializeAsAny[RobotConfig] | None = None
    """Mode hil: the simulated robot whose body the host computes. This robot has its sensors, motors and tick."""
    twin: SerializeAsAny[RobotConfig] | None = None
    """Not in mode hil: the simulated robot that it and its arena look like. Panel, viewer and console draw it, and it
    stands in for the robot when a run is rehearsed."""
    n_sensors: Annotated[int, Field(ge=1, le=MAX_SENSORS)] | None = None
    """Sensors of the robot (not in mode hil)."""
    n_motors: Annotated[int, Field(ge=1, le=MAX_MOTORS)] | None = None
    """Motors of the robot (not in mode hil)."""
    tick_s: Annotated[float, Field(ge=0.0001, le=6.5)] | None = None
    """Control step, seconds (not in mode hil)."""
    start_fields: tuple[Name, ...] | None = None
    """Names of a trial's start values, which the task must have too (not in mode hil)."""
    ends: tuple[SensorEnd, ...] = ()
    """Task ends that the sensors tell (not in mode hil)."""
    bumper: TaskEnd | Literal["rig"] = "out_of_bounds"
    """What a hit bumper means; rig: the rig says it."""
    attended: bool | None = None
    """Somebody stands beside it and puts it back; default: yes, unless mode is hil or there is a rig."""
    rig: Annotated[str, Field(pattern=r"^[^:]+:\d+$")] | None = None
    """host:port of a machine that puts the robot back between trials."""
    battery_range_v: tuple[float, float] | None = None
    """Volts of an empty and a full battery."""
    reconnect_s: Annotated[float, Field(gt=0.0, le=3600.0)] = 10.0
    """How long to look for a robot that does not answer before the run pauses."""

    @field_validator("body", "twin", mode="before")
    @classmethod
    def _load_body(cls, value: Any, about: ValidationInfo) -> Any:
        if not isinstance(value, dict):
            return value
        try:
            model = registry.load(Group.ROBOTS, str(value.get("type")))
            return model.model_validate_json(json.dumps(value))
        except PluginError as error:
            raise ValueError(f"{about.field_name}.type: {error.message}") from error
        except ValidationError as error:
            first = error.errors()[0]
            raise ValueError(f"{about.field_name}.{'.'.join(map(str, first['loc']))}: {first['msg']}") from error

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if (self.port is None) == (self.can is None):
            raise Misfit("port: expected either port (serial) or can", "port", "can")
        own = {name: getattr(self, name) for name in ("n_sensors", "n_motors", "tick_s", "start_fields")}
        if self.mode == "hil":
            if self.twin is not None:
                raise Misfit("twin: expected nothing here in mode hil, the body is what it looks like", "twin")
            if self.body is None:
                raise Misfit("body: expected a simulated robot, because mode is hil", "body")
            if not isinstance(self.body.build(), SimulatedBody):
                raise Misfit(f"body: expected a simulated robot, got {self.body.type}", "body")
            spec = self.body.spec
            if spec.n_sensors > MAX_SENSORS or spec.n_motors > MAX_MOTORS:
                raise Misfit(
                    f"body: the link carries {MAX_SENSORS} sensors and {MAX_MOTORS} motors, got "
                    f"{spec.n_sensors} and {spec.n_motors}",
                    "body",
                )
            given = [name for name, value in own.items() if value is not None]
            if given or self.ends:
                raise Misfit(f"{(given or ['ends'])[0]}: expected nothing here in mode hil, the body has it", *given)
        else:
            if self.body is not None:
                raise Misfit(f"body: expected mode hil with a simulated body, got {self.mode}", "mode", "body")
            for name, value in own.items():
                if value is None:
                    raise Misfit(f"{name}: expected a value in mode {self.mode}", name)
            self._check_twin()
            for end in self.ends:
                if end.sensor is not None and end.sensor >= (self.n_sensors or 0):
                    raise Misfit(f"ends: expected a sensor 0..{(self.n_sensors or 0) - 1}, got {end.sensor}", "ends")
        if self.bumper == "rig" and self.rig is None:
            raise Misfit("bumper: expected a rig that can say what it means", "bumper", "rig")
        if self.battery_range_v is not None and self.battery_range_v[0] >= self.battery_range_v[1]:
            raise Misfit("battery_range_v: expected [empty, full]", "battery_range_v")
        return self

    def _check_twin(self) -> None:
        if self.twin is None:
            return
        if not self.twin.spec.deterministic:
            raise Misfit(f"twin: expected a simulated robot, got {self.twin.type}", "twin")
        twin = self.twin.spec
        for name, own, its in (
            ("n_sensors", self.n_sensors, twin.n_sensors),
            ("n_motors", self.n_motors, twin.n_motors),
            ("start_fields", self.start_fields, twin.start_fields),
        ):
            if own != its:
                raise Misfit(f"twin: expected the robot's {name} {own}, got {its}", "twin", name)

    @property
    def spec(self) -> RobotSpec:
        attended = self.attended if self.attended is not None else self.mode != "hil" and self.rig is None
        name = f"remote ({self.mode})"
        if self.body is not None:
            body = self.body.spec
            return RobotSpec(
                name=name,
                n_sensors=body.n_sensors,
                n_motors=body.n_motors,
                tick_s=body.tick_s,
                start_fields=body.start_fields,
                state_fields=body.state_fields,
                attended=attended,
                batch_size=1,
                deterministic=False,
            )
        if self.n_sensors is None or self.n_motors is None or self.tick_s is None or self.start_fields is None:
            raise ValueError(f"expected n_sensors, n_motors, tick_s and start_fields in mode {self.mode}")
        return RobotSpec(
            name=name,
            n_sensors=self.n_sensors,
            n_motors=self.n_motors,
            tick_s=self.tick_s,
            start_fields=self.start_fields,
            state_fields=(),
            attended=attended,
            batch_size=1,
            deterministic=False,
        )

    def build(self) -> RemoteRobot:
        body = self.body.build() if self.body is not None else None
        return RemoteRobot(
            self.spec,
            RemoteSettings(
                mode=Mode[self.mode.upper()],
                node=self.node,
                reconnect_s=self.reconnect_s,
                bumper=None if self.bumper == "rig" else EndReason[self.bumper.upper()],
                rig_address=self.rig,
                battery_range_v=self.battery_range_v,
            ),
            self.open_bus,
            body if isinstance(body, SimulatedBody) else None,
            SensorWatch(self.ends) if self.ends else None,
            self.twin.build().drawing if self.twin is not None else None,
        )

    @property
    def simulated(self) -> RobotConfig | None:
        """Mode hil has the body in its section; of another robot it is the twin, if somebody has described it."""
        return self.body or self.twin

    @contextmanager
    def on_virtual_board(self, body: RobotConfig) -> Iterator[RobotConfig]:
        # emulators are needed for this only
        from backends.virtual.power import switch_on

        with switch_on(Board.POSIX, body) as virtual:
            lead = RemoteConfig.model_validate_json(json.dumps(virtual.section(self.mode)))
            given = {"port": lead.port, "baud": lead.baud, "can": None, "node": 1, "rig": lead.rig}
            yield self.model_copy(
                update={**given, "battery_range_v": lead.battery_range_v, "attended": self.spec.attended}
            )

    def open_bus(self) -> BusABC:
        """The bus that the robot is on.

        Raises:
            can.CanError, OSError: it cannot be opened.
        """
        if self.can is None:
            return serial_bus.SceannSerialBus(self.port or "", self.baud)
        options: dict[str, Any] = dict(self.can.options)
        return open_can(self.can.interface, self.can.channel, self.can.bitrate, **options)
