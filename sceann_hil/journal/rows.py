"""What is read from a journal, a row at a time."""

from __future__ import annotations

from dataclasses import dataclass

from sceann_hil.network.coding import Bits, genome_from_hex
from sceann_hil.robot import EndReason


@dataclass(frozen=True, slots=True)
class RunRow:
    """The run itself; see the table ``run``."""

    name: str
    created_at: str
    root_seed: int
    config: str
    versions: dict[str, str]
    parent_run: str | None


@dataclass(frozen=True, slots=True)
class GenerationRow:
    """One generation; the figures are None while it is being evaluated."""

    number: int
    finished_at: str | None
    wall_s: float | None
    robot_s: float | None
    best_fitness: float | None
    mean_fitness: float | None
    worst_fitness: float | None
    success_rate: float | None


@dataclass(frozen=True, slots=True)
class IndividualRow:
    """One individual; `genome` is hexadecimal, see `genome_bits`."""

    id: int
    generation: int
    number: int
    genome: str
    parent: int | None
    structure: str | None
    fitness: float | None

    def genome_bits(self, length: int) -> Bits:
        """The genome's `length` bits."""
        return genome_from_hex(self.genome, length)


@dataclass(frozen=True, slots=True)
class AttemptRow:
    """One attempt of one trial; the result is None while it is not known, the fitness also if it was void."""

    id: int
    generation: int
    individual: int
    trial: int
    attempt: int
    start: tuple[float, ...]
    noise_key: int
    end_reason: EndReason | None
    steps: int | None
    state_hash: int | None
    final_state: tuple[float, ...] | None
    robot_s: float | None
    fitness: float | None
    operator_s: float | None = None
    battery: float | None = None
    note: str | None = None


@dataclass(frozen=True, slots=True)
class ReferenceRow:
    """One run of the reference genome; the fitness is None if it was void."""

    id: int
    at: str
    attempt: int
    genome: str
    trial: int
    end_reason: EndReason
    steps: int
    robot_s: float
    fitness: float | None


@dataclass(frozen=True, slots=True)
class SpentRow:
    """What all sessions of a run have used up; attempts whose outcome is not known count as trials only.

    Attributes:
        robot_s: robot time.
        wall_s: time in which the run was being worked on.
        trials: attempts and reference runs.
        unsettled: attempts among them whose outcome is not known.
        battery_charges: full batteries.
    """

    robot_s: float
    wall_s: float
    trials: int
    unsettled: int
    battery_charges: float
