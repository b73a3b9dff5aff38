"""Simulated robots that differ as the `uncertainty` section says, each drawn once for its whole life."""

from __future__ import annotations

import json
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from sceann_hil.config.uncertainty import NormalRange, Range, ScaledRange, ShiftedRange, UniformRange, ranges_of
from sceann_hil.errors import ConfigError
from sceann_hil.plugins import RobotConfig
from sceann_hil.seeds import Purpose, generator

_MOST_DRAWS = 100
"""Draws of one robot: the tail of a normal distribution may be no body, and is drawn again."""
_ROOT = 0
"""Root of the robots' seed tree: whoever is uncertain of the same draws the same robots, so they can be kept."""


@dataclass(frozen=True, slots=True)
class DrawnRobots:
    """An ensemble of M robots with P drawn quantities.

    Attributes:
        names: of the quantities, such as ``gap.motor_gain[0]``.
        values: float64, shape ``(M, P)``.
        bodies: the robots' sections.
    """

    names: tuple[str, ...]
    values: NDArray[np.float64]
    bodies: tuple[RobotConfig, ...]

    def __len__(self) -> int:
        return len(self.bodies)


def draw_robots(body: RobotConfig, keys: Mapping[str, Range], count: int) -> DrawnRobots:
    """Robots like `body`.

    Args:
        body: simulated.
        keys: as in `sceann_hil.config.uncertainty.UncertaintyConfig`, over what is usual for such a body.
        count: M.

    Raises:
        ConfigError: the body has no such key, nothing is drawn, or a range is wider than the body allows.
    """
    ranges = ranges_of(body, dict(keys))
    draw = _Draw(body, ranges)
    draw.check()
    if not draw.names:
        raise ConfigError(
            f"uncertainty.keys: nothing of robot {body.type} is drawn, so all simulated robots are the same.",
            "Nothing was started. Say what nobody knows of the robot, such as radius_m: {scaled: [0.9, 1.1]}.",
        )
    robots = [draw.robot(number) for number in range(count)]
    return DrawnRobots(draw.names, np.array([values for values, _ in robots]), tuple(one for _, one in robots))


def robot_with(body: RobotConfig, names: tuple[str, ...], values: NDArray[np.float64]) -> dict[str, Any]:
    """The section of a robot that has these values of the quantities, as plain data."""
    data: dict[str, Any] = body.model_dump(mode="json")
    lists: dict[str, list[float]] = {}
    for name, value in zip(names, values.tolist(), strict=True):
        lists.setdefault(name.partition("[")[0], []).append(value)
    for key, some in lists.items():
        _put(data, key, some)
    return data


class _Draw:
    def __init__(self, body: RobotConfig, ranges: Mapping[str, Range]) -> None:
        self._body = body
        self._ranges = ranges
        self._base: dict[str, Any] = body.model_dump(mode="json")
        self._own = {key: self._own_values(key) for key in ranges}
        self.names: tuple[str, ...] = ()
        for key, known in ranges.items():
            count = len(self._own[key])
            if not isinstance(known, float):
                self.names += (key,) if count == 1 else tuple(f"{key}[{i}]" for i in range(count))

    def _own_values(self, key: str) -> list[Any]:
        """What the body itself has there, one for each value that the key takes."""
        last = key.rpartition(".")[2]
        own = [holder.get(last) for holder in _holders(self._base, key)]
        if len(own) != 1:
            return own
        count = self._body.values_of(key)
        if isinstance(own[0], list):
            return own[0] if len(own[0]) == count or count == 1 else [None] * count
        return own * count

    def check(self) -> None:
        """Refuse a key that the body does not have, and ends of ranges that it does not allow."""
        for key, known in self._ranges.items():
            own = self._own[key]
            if not own:
                raise ConfigError(
                    f"uncertainty.keys: {key}: robot {self._body.type} has none of these.", "Nothing was started."
                )
            odd = [it for it in own if not isinstance(it, (int, float))]
            if odd and isinstance(known, (ScaledRange, ShiftedRange)):
                raise ConfigError(
                    f"uncertainty.keys: {key}: expected a number of robot {self._body.type} to change, got {odd[0]!r}.",
                    "Nothing was started.",
                )
            for ends in zip(*(_ends(known, it) for it in own), strict=True):
                data = deepcopy(self._base)
                _put(data, key, list(ends))
                told = self._refusal(data)
                if told is not None:
                    raise ConfigError(
                        f"uncertainty.keys: {key}: {ends[0]:g} is more than robot {self._body.type} allows: {told}.",
                        "Nothing was started. Make the range narrower.",
                    )

    def robot(self, number: int) -> tuple[list[float], RobotConfig]:
        """Drawn quantities and section of one robot."""
        rng = generator(_ROOT, Purpose.ENSEMBLE, number)
        told: str | None = ""
        for _ in range(_MOST_DRAWS):
            data, drawn = deepcopy(self._base), []
            for key, known in self._ranges.items():
                some = [_value(known, own, rng) for own in self._own[key]]
                _put(data, key, some)
                drawn += [] if isinstance(known, float) else some
            told = self._refusal(data)
            if told is None:
                return drawn, self._made(data)
        raise ConfigError(
            f"uncertainty.keys: {_MOST_DRAWS} draws in a row gave no {self._body.type} that can be, the last: {told}.",
            "Nothing was started. Make the ranges narrower.",
        )

    def _made(self, data: dict[str, Any]) -> RobotConfig:
        return type(self._body).model_validate_json(json.dumps(data))

    def _refusal(self, data: dict[str, Any]) -> str | None:
        try:
            _ = self._made(data).spec
        except ValidationError as error:
            first = error.errors()[0]
            return f"{'.'.join(str(part) for part in first['loc'])}: {first['msg']}"
        except ValueError as error:
            return str(error)
        return None


def _ends(known: Range, nominal: Any) -> tuple[float, ...]:
    match known:
        case UniformRange():
            return known.uniform
        case NormalRange():
            return (known.normal[0],)
        case ScaledRange():
            return (known.scaled[0] * nominal, known.scaled[1] * nominal)
        case ShiftedRange():
            return (nominal + known.shifted[0], nominal + known.shifted[1])
        case _:
            return (known,)


def _value(known: Range, nominal: Any, rng: np.random.Generator) -> float:
    match known:
        case UniformRange():
            return float(rng.uniform(*known.uniform))
        case NormalRange():
            return float(rng.normal(*known.normal))
        case ScaledRange():
            return float(nominal * rng.uniform(*known.scaled))
        case ShiftedRange():
            return float(nominal + rng.uniform(*known.shifted))
        case _:
            return known


def _holders(data: dict[str, Any], key: str) -> list[dict[str, Any]]:
    """The sections that have the last part of a dotted key: one, or those of a list that the key runs through."""
    found: list[Any] = [data]
    for part in key.split(".")[:-1]:
        inner = [one.get(part) if isinstance(one, dict) else None for one in found]
        found = [one for it in inner for one in (it if isinstance(it, list) else [it])]
    return [one for one in found if isinstance(one, dict)]


def _put(data: dict[str, Any], key: str, values: list[float]) -> None:
    last = key.rpartition(".")[2]
    holders = _holders(data, key)
    if len(holders) == 1:
        holders[0][last] = values if len(values) > 1 else values[0]
        return
    for holder, value in zip(holders, values, strict=True):
        holder[last] = value
