"""A two-wheeled robot that sees what is there: walls, obstacles, shades of the floor, lamps and their shadows."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from backends.simulation.engine import SimulatedRobot
from backends.simulation.gap import Gap
from backends.world.drawn import KeptFree, placed
from backends.world.layout import Motion, Senses, World, packed
from backends.world.moving import advance
from backends.world.picture import draw
from backends.world.sensing import sense
from sceann_hil.robot import GapEstimate, RobotSpec, Trace
from sceann_hil.robot.drawing import Drawing

_POSE = ("x_m", "y_m", "heading_rad")


class WorldDrive(SimulatedRobot):
    """A round robot with two wheels in a world. Motors: left, right; see `Motion` for what their values mean.

    Args:
        world: what is there.
        senses: what it can feel of it.
        motion: its size, speed and errors.
        tick_s: control step.
        gap: the body's imperfections.
        threads: cores to use; None for all.
    """

    sense = staticmethod(sense)
    advance = staticmethod(advance)
    n_noise = 3

    def __init__(
        self,
        world: World,
        senses: Senses,
        motion: Motion,
        tick_s: float,
        gap: Gap = Gap(),  # noqa: B008
        threads: int | None = None,
    ) -> None:
        super().__init__(gap, threads)
        self.world, self.senses, self.motion = world, senses, motion
        self.neutral_motor, self.draws_noise = motion.rest, motion.noise > 0.0
        self._spec = RobotSpec(
            name="diffdrive in a world",
            n_sensors=senses.count,
            n_motors=2,
            tick_s=tick_s,
            start_fields=_POSE,
            state_fields=(*_POSE, *(field for thing in world.drawn_in_order for field in thing.fields)),
            noise_free=gap.is_none and motion.noise == 0.0 and not world.drawn,
        )

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    @property
    def drawing(self) -> Drawing:
        return draw(self.world, self.senses, self.motion)

    @cached_property
    def parameters(self) -> NDArray[np.float32]:
        return packed(self.world, self.senses, self.motion)

    def states_of(self, starts: NDArray[np.float64], keys: NDArray[np.uint64]) -> NDArray[np.float64]:
        """The robots at their starts, and in each trial the drawn obstacles at places of their own.

        Raises:
            ConfigError: an obstacle finds no place beside a robot and its target.
        """
        states = self.initial_states(starts)
        if self.world.drawn:
            columns = placed(self.world.drawn_in_order, self._kept_free, starts, keys)
            states[:, len(_POSE) :] = np.concatenate(columns, axis=1)
        return states

    @property
    def _kept_free(self) -> KeptFree:
        return KeptFree(self.motion.radius_m, self.world.goal_m, self.world.goal_radius_m)

    def estimate_gap(self, starts: NDArray[np.float64], traces: Sequence[Trace]) -> GapEstimate:
        """As every body does, unless nobody knows where the obstacles of the robot's trials stood."""
        if self.world.drawn:
            raise NotImplementedError(
                "obstacles are drawn per trial, and the traces do not tell where a robot met them"
            )
        return super().estimate_gap(starts, traces)
