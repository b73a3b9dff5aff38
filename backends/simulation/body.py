"""A simulated body: what `engine` runs by the thousand and `stepwise` moves one tick at a time."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from backends.simulation.gap import FIRST_SENSOR_CHANNEL, Gap
from sceann_hil.network.compiled import as_part, bound
from sceann_hil.network.fingerprint import fingerprint
from sceann_hil.robot import Robot

Float32Array = NDArray[np.float32]
Sense = Callable[[Float32Array, Float32Array, Float32Array, Float32Array], None]
Advance = Callable[[Float32Array, Float32Array, Float32Array, NDArray[np.int32], Float32Array, Float32Array], None]


class SimulatedBody(Robot):
    """A robot whose body is two functions over lanes (see `backends.simulation.lanes`) and some parameters.

    Args:
        gap: the body's imperfections.
    """

    sense: Sense
    advance: Advance
    n_noise: int = 0
    """Normal deviates that `advance` wants per step, at most 16."""
    draws_noise: bool = True
    """False: `advance` multiplies its deviates by zero, so it gets zeros, which cost nothing."""
    neutral_motor: float = 0.0
    """The motor value at which nothing moves."""

    def __init__(self, gap: Gap = Gap()) -> None:  # noqa: B008
        self.gap = gap

    @property
    @abstractmethod
    def parameters(self) -> Float32Array:
        """The body's parameters as its two functions expect them."""

    def initial_states(self, starts: NDArray[np.float64]) -> NDArray[np.float64]:
        """Body states at the start of trials.

        A state takes the start value of its own name, and is 0 if there is none. A body whose start values mean
        something else computes its states here.

        Args:
            starts: in the order of ``spec.start_fields``, shape ``(n, n_start)``.

        Returns:
            In the order of ``spec.state_fields``, shape ``(n, n_state)``.

        Raises:
            ValueError: a start value is no state, so it would have no effect.
        """
        spec = self.spec
        lost = [field for field in spec.start_fields if field not in spec.state_fields]
        if lost:
            raise ValueError(
                f"start_fields: {spec.name} starts from {', '.join(lost)}, which is none of its states "
                f"{', '.join(spec.state_fields)}; expected a method initial_states that says what follows from it"
            )
        states = np.zeros((len(starts), len(spec.state_fields)))
        for column, field in enumerate(spec.start_fields):
            states[:, spec.state_fields.index(field)] = starts[:, column]
        return states

    def states_of(self, starts: NDArray[np.float64], keys: NDArray[np.uint64]) -> NDArray[np.float64]:
        """Body states at the start of trials, where something in them is drawn from the trials' keys.

        Args:
            starts: as in `initial_states`, which this gives unless a body draws something.
            keys: the trials' 64-bit noise keys from the seed tree, shape ``(n,)``.
        """
        return self.initial_states(starts)

    def body_fingerprint(self) -> str:
        spec, fixed = self.spec, (self.n_noise, self.neutral_motor)
        drawn = () if type(self).states_of is SimulatedBody.states_of else (type(self).states_of,)
        return fingerprint(
            type(self).sense,
            type(self).advance,
            type(self).initial_states,
            *drawn,
            fixed,
            self.parameters,
            (spec.tick_s, spec.start_fields, spec.state_fields),
        )

    def checked_states(self, starts: NDArray[np.float64], keys: NDArray[np.uint64]) -> Float32Array:
        """`states_of` as compiled code may have them.

        Raises:
            ValueError: the body and these starts do not go together.
        """
        spec, name = self.spec, self.spec.name
        if starts.shape[1:] != (len(spec.start_fields),):
            raise ValueError(
                f"starts: {name} starts from {len(spec.start_fields)} values ({', '.join(spec.start_fields)}), "
                f"got {starts.shape[1]}"
            )
        states = np.asarray(self.states_of(starts, keys))
        expected = (len(starts), len(spec.state_fields))
        if states.shape != expected:
            raise ValueError(f"initial_states of {name}: expected shape {expected}, got {states.shape}")
        return np.ascontiguousarray(states, np.float32)

    def checked_parameters(self) -> Float32Array:
        """`parameters` as compiled code may have them.

        Raises:
            ValueError: what is wrong about the body.
        """
        parameters, name = np.asarray(self.parameters), self.spec.name
        if parameters.dtype != np.float32 or parameters.ndim != 1 or not np.isfinite(parameters).all():
            raise ValueError(
                f"parameters of {name}: expected finite float32 values in one row, got {parameters.dtype} of shape "
                f"{parameters.shape}"
            )
        if not 0 <= self.n_noise <= FIRST_SENSOR_CHANNEL:
            raise ValueError(f"n_noise of {name}: expected 0..{FIRST_SENSOR_CHANNEL}, got {self.n_noise}")
        return np.ascontiguousarray(parameters)

    @property
    def noise_rows(self) -> tuple[int, int]:
        """Rows of noise for compiled code, an even number, and how many of them are drawn."""
        rows = self.n_noise + self.n_noise % 2
        return rows, rows if self.draws_noise else 0

    def bind(self, loop: Callable[..., None], **parts: Callable[..., Any]) -> Callable[..., None]:
        """A loop's machine code for this body.

        Args:
            loop: a function of a module that calls them.
            parts: other functions that the loop calls.
        """
        body: dict[str, Callable[..., Any]] = {
            "sense": as_part(type(self).sense),
            "advance": as_part(type(self).advance),
            **parts,
        }
        return bound(loop, **body)
