"""An environment by its id: made, and looked at before anything runs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from typing import Any

import numpy as np

from sceann_hil.errors import PluginError

Option = str | int | float | bool | None
_STANDARD = {"OrderEnforcing", "PassiveEnvChecker", "TimeLimit"}
_NO_LIMIT = 10**9
"""Steps: the task ends its trials itself."""


@dataclass(frozen=True, slots=True)
class Facts:
    """What an environment is.

    Attributes:
        low, high: bounds of the observation's numbers; infinite where there are none.
        n_actions: choices of a discrete action; 0 if the action is a row of numbers.
        action_low, action_high: bounds of these numbers.
        tick_s: simulated time of a step; None if the environment does not say.
    """

    low: tuple[float, ...]
    high: tuple[float, ...]
    n_actions: int
    action_low: tuple[float, ...]
    action_high: tuple[float, ...]
    tick_s: float | None


def gymnasium() -> Any:
    """The package, which is an extra.

    Raises:
        PluginError: it is not installed.
    """
    try:
        return import_module("gymnasium")
    except ModuleNotFoundError as error:
        raise PluginError(
            f"robot gymnasium: the package {error.name} is not installed.", "pip install 'sceann-hil[gymnasium]'"
        ) from error


def make(env: str, options: Mapping[str, Option]) -> Any:
    """The environment, without wrappers that only check or count.

    Raises:
        ValueError: there is no such environment, or it cannot be made with these options.
        PluginError: a package that it needs is missing.
    """
    package = gymnasium()
    try:
        made = package.make(env, disable_env_checker=True, max_episode_steps=_NO_LIMIT, **options)
    except ModuleNotFoundError as error:
        raise PluginError(
            f"env {env}: the package {error.name} is not installed.", "pip install 'sceann-hil[gymnasium]'"
        ) from error
    except package.error.DependencyNotInstalled as error:
        raise PluginError(f"env {env}: {error}", "pip install 'sceann-hil[gymnasium]'") from error
    except (package.error.Error, TypeError, ValueError, KeyError) as error:
        raise ValueError(f"env: {env} cannot be made: {error}") from error
    inner = made
    while type(inner).__name__ in _STANDARD:
        inner = inner.env
    return inner


def facts(env: str, options: Mapping[str, Option]) -> Facts:
    """What the environment is.

    Raises:
        ValueError: see `make`; or its observation or action is of a kind that no network can have.
    """
    return _facts(env, json.dumps(dict(options), sort_keys=True))


@lru_cache(maxsize=32)
def _facts(env: str, options: str) -> Facts:
    made = make(env, json.loads(options))
    try:
        seen, acts = made.observation_space, made.action_space
        if type(seen).__name__ != "Box" or len(seen.shape) != 1:
            raise ValueError(f"env: expected an observation that is a row of numbers, got {seen} from {env}")
        n_actions, low, high = 0, np.zeros(0), np.zeros(0)
        if type(acts).__name__ == "Discrete":
            n_actions = int(acts.n)
        elif type(acts).__name__ == "Box" and len(acts.shape) == 1:
            low, high = acts.low, acts.high
        else:
            raise ValueError(f"env: expected an action that is a row of numbers or one choice, got {acts} from {env}")
        return Facts(
            tuple(seen.low.astype(float).tolist()),
            tuple(seen.high.astype(float).tolist()),
            n_actions,
            tuple(low.astype(float).tolist()),
            tuple(high.astype(float).tolist()),
            _tick_s(made),
        )
    finally:
        made.close()


def _tick_s(made: Any) -> float | None:
    base = made.unwrapped
    for name in ("dt", "tau"):
        value = getattr(base, name, None)
        if isinstance(value, int | float) and value > 0:
            return float(value)
    fps = (getattr(base, "metadata", None) or {}).get("render_fps")
    return 1.0 / float(fps) if fps else None
