"""The ``robot`` section of type ``thymio``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from backends.thymio.connection import Connection
from backends.thymio.onboard import OnboardThymio
from backends.thymio.scene import scene
from backends.thymio.section import START_FIELDS, ThymioSection
from backends.thymio.tethered import TetheredThymio
from backends.thymio.twin import ThymioTwinConfig
from sceann_hil.plugins import Misfit, RobotConfig
from sceann_hil.robot import RobotSpec
from sceann_hil.robot.sensor_ends import SensorEnd, SensorWatch

if TYPE_CHECKING:
    from sceann_hil.firmware.emulated.playground import Playground


class ThymioConfig(ThymioSection):
    """A Thymio II at a USB cable, at its wireless dongle, behind a TCP port, or in the makers' simulator."""

    type: Literal["thymio"] = "thymio"
    port: str | None = None
    """Serial port of the robot's cable or of its dongle, by a path that stays the same (/dev/serial/by-id/...)."""
    host: Annotated[str, Field(pattern=r"^[^:\s]+(:\d+)?$")] | None = None
    """name or name:port of an Aseba switch or of Aseba Playground; 33333 is its usual port."""
    playground: bool = False
    """Start Aseba Playground here, without a screen, with the twin's arena; anew for every trial, at its start."""
    node: Annotated[int, Field(ge=1, le=0x7FFF)] | None = None
    """Which node, where there are several robots."""
    mode: Literal["onboard", "tethered"] = "onboard"
    """onboard: controller on the robot; tethered: controller here."""
    twin: ThymioTwinConfig | None = None
    """The simulated robot and its arena: what panel and viewer draw, and what `playground` and transfer need."""
    ends: tuple[SensorEnd, ...] = ()
    """Task ends that the sensors tell."""
    attended: bool | None = None
    """Somebody stands beside it and puts it back; default: yes, unless it is simulated."""
    reconnect_s: Annotated[float, Field(gt=0.0, le=3600.0)] = 10.0
    """How long to look for a robot that does not answer before the run pauses."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if [self.port is not None, self.host is not None, self.playground].count(True) != 1:
            raise Misfit("port: expected one of port, host and playground: true", "port", "host", "playground")
        if self.playground and self.twin is None:
            raise Misfit("twin: expected the simulated arena, because playground is true", "twin", "playground")
        if self.playground and self.twin is not None and any(it.drawn for it in self.twin.world.obstacles):
            raise Misfit("twin.world.obstacles: expected none that are drawn, because playground is true", "twin")
        count = self.aesl_life.senses.count
        for end in self.ends:
            if end.sensor is not None and end.sensor >= count:
                raise Misfit(f"ends: expected a sensor 0..{count - 1}, got {end.sensor}", "ends")
        if self.twin is not None:
            for name in ("tick_s", "sensors", "top_target"):
                own, its = getattr(self, name), getattr(self.twin, name)
                if own != its:
                    raise Misfit(f"twin.{name}: expected the robot's {own}, got {its}", f"twin.{name}", name)
        return self

    @property
    def spec(self) -> RobotSpec:
        return RobotSpec(
            name=f"Thymio II ({self.mode})",
            n_sensors=self.aesl_life.senses.count,
            n_motors=2,
            tick_s=self.tick_s,
            start_fields=START_FIELDS,
            state_fields=(),
            attended=not self.playground if self.attended is None else self.attended,
            batch_size=1,
            deterministic=False,
        )

    @property
    def simulated(self) -> RobotConfig | None:
        return self.twin

    def build(self) -> OnboardThymio | TetheredThymio:
        twin = self.twin

        def simulator(start: dict[str, float]) -> Playground:
            if twin is None:
                raise ValueError("expected a twin")
            # an emulator, which a robot's host does without
            from sceann_hil.firmware.emulated.playground import Playground

            return Playground(*scene(twin, start))

        connection = Connection(
            self.aesl_life,
            port=self.port,
            host=self.host,
            simulator=simulator if self.playground else None,
            node=self.node,
            reconnect_s=self.reconnect_s,
        )
        kind = OnboardThymio if self.mode == "onboard" else TetheredThymio
        watch = SensorWatch(self.ends) if self.ends else None
        return kind(self.spec, connection, watch, None if twin is None else twin.build().drawing)
