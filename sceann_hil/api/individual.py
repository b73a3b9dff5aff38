"""One controller: its genome, its network with names, and the way to a C header."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from sceann_hil.api.frames import pandas_module
from sceann_hil.network.coding import Bits, Weights, genome_from_hex, genome_to_hex
from sceann_hil.network.controller import Controller
from sceann_hil.network.image import ControllerImage
from sceann_hil.network.phenotype import Phenotype

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, slots=True, eq=False)
class Individual:
    """One controller.

    Attributes:
        phenotype: coding, network and neuron.
        genome: bits, uint8, shape ``(L,)``.
        fitness: what it reached; None if nobody knows yet.
        id: its number in its run; None outside a run.
        generation: in which it was evaluated; None outside a run.
        parent: id of its parent; None for the first generation and outside a run.
        provenance: the command that exports it again; empty outside a run.

    Raises:
        ValueError: the genome has not the length that the phenotype asks for.
    """

    phenotype: Phenotype
    genome: Bits
    fitness: float | None = None
    id: int | None = None
    generation: int | None = None
    parent: int | None = None
    provenance: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "genome", np.ascontiguousarray(self.genome, np.uint8))
        self.phenotype.decode(self.genome)

    @classmethod
    def from_hex(cls, phenotype: Phenotype, text: str) -> Self:
        """The controller of a genome in hexadecimal, as journal and commands write it."""
        return cls(phenotype, genome_from_hex(text, phenotype.genome_length))

    @property
    def hex(self) -> str:
        """The genome in hexadecimal, first bit first."""
        return genome_to_hex(self.genome)

    @property
    def weight_matrix(self) -> Weights:
        """Weights -1, 0, +1, int8, shape ``(n_neurons, n_sources)``: a row listens, a column speaks."""
        return self.phenotype.decode(self.genome)

    @property
    def weights(self) -> pandas.DataFrame:
        """The same with names: rows are neurons (h1, h2, ..., m1, ...), columns what they listen to (s1, ..., m1, ...).

        Raises:
            PackageMissing: pandas is not installed; `weight_matrix` does without.
        """
        size = self.phenotype.size
        frame: pandas.DataFrame = pandas_module().DataFrame(
            self.weight_matrix, index=list(size.neuron_names), columns=list(size.source_names)
        )
        return frame

    def controller(self) -> Controller:
        """Its network, to be stepped by hand: the reference implementation."""
        return Controller(self.weight_matrix, self.phenotype.size, self.phenotype.dynamics)

    @property
    def image(self) -> ControllerImage:
        """What export and flash need."""
        phenotype = self.phenotype
        return ControllerImage(
            self.genome, phenotype.coding, phenotype.size, phenotype.dynamics, self.fitness, self.provenance
        )

    def __repr__(self) -> str:
        size = self.phenotype.size
        parts = [] if self.id is None else [f"{self.id} of generation {self.generation}"]
        parts += [] if self.fitness is None else [f"fitness {self.fitness:.4g}"]
        network = f"{size.n_sensors}-{size.n_hidden}-{size.n_motors}"
        return f"<Individual {', '.join([*parts, f'{self.phenotype.coding.value} {network}', f'genome {self.hex}'])}>"


def export(individual: Individual, path: Path | str, name: str = "controller") -> Path:
    """Write a controller as one self-contained C99 header that tests itself.

    Args:
        individual: the controller.
        path: the file; a header of ours at this place is replaced, anything else is not.
        name: what its identifiers begin with.

    Returns:
        The file.

    Raises:
        RunExists: something else is at this place.
        FirmwareBuildFailed: `name` is no C identifier.
    """
    from sceann_hil.firmware.header import c_header, write_header

    path = Path(path)
    write_header(path, c_header(individual.image, name))
    return path
