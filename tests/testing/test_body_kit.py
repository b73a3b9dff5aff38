"""Every shipped body passes the kit, and the kit finds what is wrong with others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from backends.cartpole import CartPole, CartPoleConfig
from backends.diffdrive import DifferentialDriveConfig
from backends.world.config import InfraredConfig, WorldConfig
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES
from sceann_hil.plugins import RobotConfig
from sceann_hil.robot import RobotSpec
from sceann_hil.testing import BodyConformance

Lanes = NDArray[np.float32]


class TestCartPole(BodyConformance):
    def config(self) -> RobotConfig:
        return CartPoleConfig()

    def start(self) -> tuple[float, ...]:
        return (0.0, 0.0, 0.01, 0.0)


class TestDifferentialDrive(BodyConformance):
    def config(self) -> RobotConfig:
        return DifferentialDriveConfig(n_sensors=3)

    def start(self) -> tuple[float, ...]:
        return (0.1, 0.1, 0.5)


class TestWorld(BodyConformance):
    def config(self) -> RobotConfig:
        world = WorldConfig(infrared=(InfraredConfig(direction_deg=0.0), InfraredConfig(direction_deg=40.0)))
        return DifferentialDriveConfig(world=world)

    def start(self) -> tuple[float, ...]:
        return (0.1, 0.1, 0.5)


@compiled_part
def _neighbour(state: Lanes, motors: Lanes, noise: Lanes, ends: NDArray[np.int32], work: Lanes, p: Lanes) -> None:
    """Reads another lane's column."""
    for lane in range(LANES):
        state[0, lane] = state[0, (lane + 1) % LANES] + motors[0, lane]
        ends[lane] = -1


@compiled_part
def _no_number(state: Lanes, motors: Lanes, noise: Lanes, ends: NDArray[np.int32], work: Lanes, p: Lanes) -> None:
    for lane in range(LANES):
        state[0, lane] = state[0, lane] / (state[1, lane] * np.float32(0.0))
        ends[lane] = -1


@compiled_part
def _too_far(state: Lanes, motors: Lanes, noise: Lanes, ends: NDArray[np.int32], work: Lanes, p: Lanes) -> None:
    for lane in range(LANES):
        work[3, lane] = p[70]
        ends[lane] = -1


class _Broken(BodyConformance):
    body: ClassVar[type[CartPole]]

    def config(self) -> RobotConfig:
        return _BrokenConfig(self.body)


class _BrokenConfig(RobotConfig):
    type: Literal["broken"] = "broken"

    def __init__(self, body: type[CartPole]) -> None:
        super().__init__()
        object.__setattr__(self, "_body", body)

    @property
    def spec(self) -> RobotSpec:
        return CartPoleConfig().spec

    def build(self) -> CartPole:
        body: type[CartPole] = self._body  # type: ignore[attr-defined]
        return body()


def _kit_of(advance: Any) -> _Broken:
    kind = type("BrokenCart", (CartPole,), {"advance": staticmethod(advance)})
    return type("Kit", (_Broken,), {"body": kind})()  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    ("advance", "test", "message"),
    [
        (_neighbour, "test_a_trial_is_the_same_alone_in_a_batch_and_on_any_number_of_threads", "gives? other bits"),
        (_no_number, "test_its_states_are_numbers_and_its_ends_are_task_ends", "a state is no number"),
        (_too_far, "test_it_stays_within_its_arrays", "reaches beyond its arrays"),
    ],
)
def test_the_kit_finds_what_is_wrong(advance: Callable[..., None], test: str, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        getattr(_kit_of(advance), test)()
