"""The simulated twin: the two-wheeled robot of `backends.world` with a Thymio's geometry and sensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from backends.simulation.settings import GapConfig, values_of_gap
from backends.thymio.geometry import GROUND, INFRARED, RADIUS_M, RANGE_M, RAY_ANGLES_RAD, WHEEL_INTERVAL_M
from backends.thymio.readings import MIDDLE_RAY, RAY_BESIDE, TOP_SPEED_M_S
from backends.thymio.section import ThymioSection
from backends.world.body import WorldDrive
from backends.world.config import GroundConfig, WorldConfig
from backends.world.layout import Infrared, Motion, Senses
from sceann_hil.firmware.aesl.program import TOP_TARGET
from sceann_hil.plugins import Misfit
from sceann_hil.robot import RobotSpec

_ITS_OWN = ("target", "lamps", "infrared", "ground", "light", "wheel_interval_m", "backwards", "bump")
_Positive = Annotated[float, Field(gt=0.0)]


class ThymioTwinConfig(ThymioSection):
    """A simulated Thymio II in an arena."""

    usual_uncertainty: ClassVar[Mapping[str, Any]] = {
        "gap.sensor_offset": {"normal": [0.0, 0.01]},
        "gap.sensor_gain": {"normal": [1.0, 0.1]},
        "gap.sensor_noise": 0.01,
        "gap.motor_gain": {"uniform": [0.85, 1.1]},
        "gap.motor_dead_band": {"uniform": [0.0, 0.04]},
        "gap.latency_steps": {"uniform": [0.0, 1.49]},
        "motion_noise": {"uniform": [0.0, 0.1]},
    }
    """Tolerances of a Thymio: its motors are regulated, its sensors calibrated by the makers."""

    type: Literal["thymio_twin"] = "thymio_twin"
    arena_m: tuple[_Positive, _Positive] = (1.1, 1.1)
    """Width and height of the arena, whose four walls it sees."""
    world: WorldConfig = WorldConfig()
    """Obstacles, inner walls, and the floor's line or shades."""
    top_speed_m_s: _Positive = TOP_SPEED_M_S
    """Speed of a wheel at motor target 500; the default is the simulator's, a real robot's is about 0.2."""
    motion_noise: Annotated[float, Field(ge=0.0, le=1.0)] = 0.01
    """Standard deviation of the motion errors, as a part of each step's displacement."""
    gap: GapConfig = GapConfig()
    """How the body differs from the ideal one."""

    @model_validator(mode="after")
    def _is_a_thymio(self) -> Self:
        given = [name for name in _ITS_OWN if getattr(self.world, name) != WorldConfig.model_fields[name].default]
        if given:
            raise Misfit(
                f"world.{given[0]}: expected nothing here, a Thymio has its own sensors and sees no lamps or targets",
                f"world.{given[0]}",
            )
        if min(self.arena_m) < 3.0 * RADIUS_M:
            raise Misfit(f"arena_m: expected at least {3.0 * RADIUS_M:g} m, got {min(self.arena_m):g}", "arena_m")
        return self

    def values_of(self, key: str) -> int:
        return values_of_gap(key, self.aesl_life.senses.count, 2)

    @property
    def spec(self) -> RobotSpec:
        # a world by itself has no sensors, and is refused
        self.world.model_copy(update={"ground": (GroundConfig(at_m=(0.0, 0.0)),)}).check(self.arena_m, (0.0, 0.0), 0.0)
        return self.build().spec

    def refuses_start(self, start: Mapping[str, float]) -> str:
        point = (start["x_m"], start["y_m"])
        for axis, value, length in zip("xy", point, self.arena_m, strict=True):
            if not RADIUS_M <= value <= length - RADIUS_M:
                return f"expected {axis} in {RADIUS_M:g}..{length - RADIUS_M:g} m (inside the arena), got {value:g}"
        thing = self.world.standing_in(point, RADIUS_M, (0.0, 0.0), 0.0)
        return f"expected a free place, got [{point[0]:g}, {point[1]:g}], where {thing}" if thing else ""

    def build(self) -> WorldDrive:
        senses = Senses(
            infrared=_infrared() if "infrared" in self.sensors else (),
            ground_at_m=GROUND if "ground" in self.sensors else (),
            light=(),
        )
        motion = Motion(
            step_m=self.top_speed_m_s * self.top_target / TOP_TARGET * self.tick_s,
            radius_m=RADIUS_M,
            wheel_interval_m=WHEEL_INTERVAL_M,
            noise=self.motion_noise,
            backwards=True,
            bump_ends=False,
        )
        world = self.world.world(self.arena_m, (0.0, 0.0), 0.0)
        return WorldDrive(world, senses, motion, self.tick_s, self.gap.build(senses.count, 2))


def _infrared() -> tuple[Infrared, ...]:
    # a ray stands in the middle of an equal part of the opening
    opening = RAY_ANGLES_RAD[-1] * len(RAY_ANGLES_RAD) / (len(RAY_ANGLES_RAD) - 1)
    curves = (RAY_BESIDE, MIDDLE_RAY, RAY_BESIDE)
    return tuple(
        Infrared(at_m, float(np.float64(direction)), RANGE_M, None, opening, len(curves), curves)
        for at_m, direction in INFRARED
    )
