"""The `uncertainty` section: how simulated robots may differ from the one that is built, each drawn once.

``sceann transfer`` draws an ensemble of robots from it (`sceann_hil.run.transfer`).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Annotated, Any, NoReturn, Self

from pydantic import (
    AfterValidator,
    Field,
    SerializeAsAny,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from sceann_hil.errors import PluginError
from sceann_hil.plugins import RobotConfig, Section, TaskConfig


class UniformRange(Section):
    """Drawn evenly between two numbers."""

    uniform: tuple[float, float]
    """Smallest and largest value."""

    @model_validator(mode="after")
    def _right_way_up(self) -> Self:
        _check_order("uniform", self.uniform)
        return self


class NormalRange(Section):
    """Drawn from a normal distribution."""

    normal: tuple[float, Annotated[float, Field(ge=0.0)]]
    """Mean and standard deviation."""


class ScaledRange(Section):
    """The body's own value times a factor that is drawn evenly between two numbers."""

    scaled: tuple[Annotated[float, Field(gt=0.0)], float]
    """Smallest and largest factor."""

    @model_validator(mode="after")
    def _right_way_up(self) -> Self:
        _check_order("scaled", self.scaled)
        return self


class ShiftedRange(Section):
    """The body's own value plus a number that is drawn evenly between two numbers."""

    shifted: tuple[float, float]
    """Smallest and largest number that is added."""

    @model_validator(mode="after")
    def _right_way_up(self) -> Self:
        _check_order("shifted", self.shifted)
        return self


Drawn = UniformRange | NormalRange | ScaledRange | ShiftedRange
Range = float | Drawn
"""What is known of a quantity: a number, or how it is drawn, once per robot (and sensor or motor)."""

_KINDS: dict[str, type[Drawn]] = {
    "uniform": UniformRange,
    "normal": NormalRange,
    "scaled": ScaledRange,
    "shifted": ShiftedRange,
}


class Keys(dict[str, Range]):
    """Ranges by key, for good: a configuration never changes, and can be hashed."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(tuple(sorted((key, hash(value)) for key, value in self.items())))

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("a configuration does not change; make another one with config.with_changes")

    __setitem__ = __delitem__ = clear = pop = popitem = setdefault = update = __ior__ = _refuse


class UncertaintyConfig(Section):
    """What nobody knows of a robot. Keys that are not named are as the body's kind says (`docs/transfer.md`)."""

    robots: Annotated[int, Field(ge=20, le=2000)] = 200
    """Simulated robots that are drawn."""
    body: SerializeAsAny[RobotConfig] | None = None
    """The simulated body that they are drawn around; by default the robot's own one."""
    task: SerializeAsAny[TaskConfig] | None = None
    """What the simulated robots do, where they cannot begin like the real one; by default its own task. Its fitness has
    the same scale, and it has as many trials, or one that stands for all of them."""
    keys: Annotated[dict[str, Range], AfterValidator(Keys)] = Field(default_factory=Keys)
    """By key of the body's section, such as gap.motor_gain, radius_m or world.infrared.range_m: a number,
    {uniform: [smallest, largest]}, {normal: [mean, deviation]}, {scaled: [smallest, largest factor]} or
    {shifted: [smallest, largest number added]}."""

    @field_validator("body", "task", mode="before")
    @classmethod
    def _load_plugin(cls, value: Any, info: ValidationInfo) -> Any:
        # the registry knows the plug-ins, and imports this package's neighbours
        from sceann_hil import registry

        if not isinstance(value, dict):
            return value
        group = registry.Group.ROBOTS if info.field_name == "body" else registry.Group.TASKS
        try:
            model = registry.load(group, str(value.get("type")))
            return model.model_validate_json(json.dumps(value))
        except PluginError as error:
            raise ValueError(f"{info.field_name}.type: {error.message}") from error
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, (info.field_name, *first["loc"])))
            raise ValueError(f"{where}: {first['msg']}") from error

    @field_validator("keys", mode="before")
    @classmethod
    def _flat(cls, value: Any) -> Any:
        """``gap: {motor_gain: ...}`` is the same as ``gap.motor_gain: ...``."""
        if not isinstance(value, dict):
            return value
        return {key: _range(key, inner) for key, inner in _leaves("", value)}


def ranges_of(body: RobotConfig, keys: dict[str, Range]) -> dict[str, Range]:
    """What is known of a body's quantities by key: what its kind says, and over it what a configuration says."""
    return {**{key: _range(key, value) for key, value in body.usual_uncertainty.items()}, **keys}


def _range(key: str, value: Any) -> Range:
    if isinstance(value, Drawn):
        return value
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    kinds = [kind for name, kind in _KINDS.items() if isinstance(value, dict) and name in value]
    if len(kinds) != 1:
        raise ValueError(
            f"keys: {key}: expected a number, or one of uniform, normal, scaled or shifted with two numbers"
        )
    try:
        return kinds[0].model_validate_json(json.dumps(value))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in (key, *first["loc"]))
        raise ValueError(f"keys: {where}: {first['msg']}") from error


def _leaves(prefix: str, value: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, inner in value.items():
        name = f"{prefix}{key}"
        if isinstance(inner, dict) and not set(_KINDS) & set(inner):
            yield from _leaves(f"{name}.", inner)
        else:
            yield name, inner


def _check_order(name: str, pair: tuple[float, float]) -> None:
    low, high = pair
    if low > high:
        raise ValueError(f"{name}: expected [smallest, largest], got [{low:g}, {high:g}]")
