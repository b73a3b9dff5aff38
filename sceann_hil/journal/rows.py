"""What is read from a journal, a row at a time."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from typing import Any

from sceann_hil.errors import NotARun
from sceann_hil.journal.entries import AttemptKind
from sceann_hil.journal.schema import columns_of
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
    attempts: int | None
    robot_s: float | None
    operator_s: float | None
    best_fitness: float | None
    mean_fitness: float | None
    worst_fitness: float | None
    success_rate: float | None


@dataclass(frozen=True, slots=True)
class IndividualRow:
    """One individual; `genome` is hexadecimal, see `genome_bits`; `ancestor` is its parent in another run.

    People know it by its `place`; `id` is for the tables.
    """

    id: int
    generation: int
    number: int
    genome: str
    parent: int | None
    ancestor: int | None
    structure: str | None
    fitness: float | None

    @property
    def place(self) -> str:
        """Which one it is, for people: the same words everywhere."""
        return f"generation {self.generation}, individual {self.number}"

    @property
    def short_place(self) -> str:
        """The same for ``--genome``: ``12:3``."""
        return f"{self.generation}:{self.number}"

    def genome_bits(self, length: int) -> Bits:
        """The genome's `length` bits."""
        return genome_from_hex(self.genome, length)


@dataclass(frozen=True, slots=True)
class AttemptRow:
    """One attempt of one trial; the result is None while it is not known, the fitness also if it was void.

    Attempts outside evolution have a genome (hexadecimal) of their own and no generation.
    """

    id: int
    kind: AttemptKind
    session: int | None
    generation: int | None
    individual: int
    trial: int
    attempt: int
    genome: str | None
    start: tuple[float, ...]
    noise_key: int
    end_reason: EndReason | None
    steps: int | None
    value: float | None
    state_hash: int | None
    final_state: tuple[float, ...] | None
    robot_s: float | None
    fitness: float | None
    operator_s: float | None = None
    battery: float | None = None
    note: str | None = None
    measurement: int | None = None

    @property
    def own_generation(self) -> int:
        """The generation that it is part of.

        Raises:
            NotARun: it is not part of evolution.
        """
        if self.generation is None:
            raise NotARun(
                f"Trial {self.id} is no part of evolution: it was run as a {self.kind}.",
                "Choose another one: `sceann status` tells how many there are.",
            )
        return self.generation


@dataclass(frozen=True, slots=True)
class MeasurementRow:
    """Genomes that were run on a robot outside evolution; `finished_at` is None if it can be gone on with."""

    id: int
    kind: str
    begun_at: str
    finished_at: str | None
    robot: str
    config: str
    plan: str


@dataclass(frozen=True, slots=True)
class SessionRow:
    """One process that worked on a run; `body` is the fingerprint of the simulated body's code."""

    id: int
    started_at: str
    robot: str
    operators: str
    wall_s: float
    paused_s: float
    versions: dict[str, str]
    body: str | None


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


def generation_row(row: tuple[Any, ...]) -> GenerationRow:
    """From a row of the table."""
    return GenerationRow(row[0], *row[4:13])


def session_row(row: dict[str, Any]) -> SessionRow:
    """From a row of the table, by names."""
    row["versions"] = json.loads(row["versions"])
    return SessionRow(**{field.name: row[field.name] for field in fields(SessionRow)})


def place_of(table: str, row: tuple[Any, ...]) -> str:
    """What a row is, for messages."""
    names = dict(zip(columns_of(table), row, strict=False))
    match table:
        case "attempt":
            of = "" if names["generation"] is None else f" of generation {names['generation']}"
            return f"trial {names['id']}{of}"
        case "individual":
            return f"individual {names['id']} of generation {names['generation']}"
        case "trace":
            return f"what the robot sent in trial {names['attempt']}"
        case "run":
            return "the run itself (name, configuration, versions)"
        case _:
            return f"{table} {row[0]}"
