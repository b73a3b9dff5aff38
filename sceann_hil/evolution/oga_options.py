"""OGA-R's options: every ambiguity of the operon-GA reconstruction as a named choice, the default first.

No full definition of the OGA (Ohkura & Ueda) is public; ours is a reconstruction, and A1 to A12 are the
points that its sources leave open. Compiled code sees an option as its position in the enum.

Two alternatives of A2, the genotype: *fixed lists of random values* are `initial_list = random_bits` with
`deletion = 0` (lists start full, and no other operator changes a length). The *gene string* ("messy": genes
that carry their locus, the first copy is expressed) is left out: its operators act on positions of a string
whose length varies and in which loci can be missing, so it shares neither the state nor the operators of the
algorithm here.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple, Self

from pydantic import Field, model_validator

from sceann_hil.plugins import Section

MAX_CAP = 32
"""Longest value list that the options allow."""


class _Option(StrEnum):
    @property
    def code(self) -> int:
        """The option as compiled code knows it."""
        return list(type(self)).index(self)


class Scope(_Option):
    """A1: how often an operator acts, and on what."""

    PER_OPERON = "per_operon"
    """Every operon draws on its own; connection and division draw once for each one there is at first."""
    PER_INDIVIDUAL = "per_individual"
    """Every operator draws once per child and acts on one operon, all operons being equally likely."""
    SIZE_BIASED = "size_biased"
    """As per_individual, but the operon is that of a random locus: a large one is hit more often."""
    PER_LOCUS = "per_locus"
    """Every locus draws on its own, so operons, which change as with per_operon, have no effect."""


class InitialOperons(_Option):
    """A3: the partition that every individual of the first generation has."""

    ONE = "one"
    """One operon of all loci."""
    SINGLETONS = "singletons"
    """Every locus is an operon."""
    RANDOM = "random"
    """Each locus gets one of k labels, k being uniform in 1..L; every individual draws its own."""
    PER_PARAMETER = "per_parameter"
    """Successive runs of `parameter_loci` loci."""


class InitialList(_Option):
    """A4: the value lists of the first generation."""

    ONE_VALUE = "one_value"
    """A single random bit."""
    EQUAL_COPIES = "equal_copies"
    """`cap` copies of one random bit."""
    RANDOM_BITS = "random_bits"
    """`cap` independent random bits."""


class FullList(_Option):
    """A6: what duplication does where the longer list exceeds `cap`."""

    DROP_OLDEST = "drop_oldest"
    """Duplicate, and lose the last values; the head, which is expressed, is never lost."""
    SKIP_LOCUS = "skip_locus"
    """Leave that locus alone."""
    SKIP_OPERON = "skip_operon"
    """Leave all loci of the operon alone."""


class Duplication(_Option):
    """A7: what duplication copies. None of them changes an expressed bit."""

    HEAD_TO_FRONT = "head_to_front"
    """A copy of the head in front of it."""
    HEAD_TO_TAIL = "head_to_tail"
    """A copy of the head at the end."""
    DOUBLE_LIST = "double_list"
    """A copy of the whole list behind it."""


class Deletion(_Option):
    """A8: what deletion removes. A list never loses its only value."""

    HEAD = "head"
    """The expressed value, so that the second one is expressed."""
    RANDOM_VALUE = "random_value"
    """Any value of the list."""
    TAIL = "tail"
    """The last value (neutral)."""
    WHOLE_OPERON = "whole_operon"
    """The heads of the operon as a whole: nothing if any of its loci has a single value."""


class Inversion(_Option):
    """A9: what inversion does to a list."""

    REVERSE_LIST = "reverse_list"
    """Reverse the order of its values."""
    COMPLEMENT_HEAD = "complement_head"
    """Flip the expressed value (very disruptive)."""
    SWAP_HEAD = "swap_head"
    """Swap the head with a random other value."""


class BitMutation(_Option):
    """A10: which values bit mutation may flip."""

    ALL_STORED = "all_stored"
    """Every stored value, expressed or not, with the mutation rate."""
    EXPRESSED_ONLY = "expressed_only"
    """Expressed values, with the mutation rate."""
    SHARED = "shared"
    """Every stored value, with the mutation rate times L / stored values: longer lists, no more flips."""


class Order(_Option):
    """A11: bit mutation and the five operators (which keep their order)."""

    STRUCTURE_FIRST = "structure_first"
    MUTATION_FIRST = "mutation_first"


class Division(_Option):
    """A12: which operon is divided, and where."""

    ANY_OPERON = "any_operon"
    """Any operon (a single locus stays as it is), its loci in ascending order, cut at a uniform place."""
    DIVISIBLE_OPERON = "divisible_operon"
    """An operon of two or more loci, cut at a uniform place."""
    RANDOM_BIPARTITION = "random_bipartition"
    """Any operon, each locus to one side or the other by a fair coin, neither side empty."""


class Rules(NamedTuple):
    """`OGAOptions` as compiled code takes them: probabilities, and enums by position."""

    connection: float
    division: float
    duplication: float
    deletion: float
    inversion: float
    scope: int
    full_list: int
    duplicates: int
    deletes: int
    inverts: int
    bit_mutation: int
    order: int
    divides: int


class OGAOptions(Section):
    """How the operon-GA varies a child. Frozen; probabilities from Katada & Nakazawa, Section IV."""

    connection: float = Field(default=0.3, ge=0, le=1, description="Probability, per draw, of merging two operons.")
    division: float = Field(default=0.3, ge=0, le=1, description="Probability, per draw, of cutting an operon in two.")
    duplication: float = Field(
        default=0.6,
        ge=0,
        le=1,
        description="Probability, per draw, of copying values in all lists of an operon.",
    )
    deletion: float = Field(
        default=0.3,
        ge=0,
        le=1,
        description="Probability, per draw, of removing a value from all lists of an operon.",
    )
    inversion: float = Field(
        default=0.3, ge=0, le=1, description="Probability, per draw, of inverting all lists of an operon."
    )
    cap: int = Field(default=6, ge=1, le=MAX_CAP, description="Most values that the list of a locus holds (A5).")
    scope: Scope = Field(
        default=Scope.PER_OPERON, strict=False, description="How often the operators act, and on what (A1)."
    )
    initial_operons: InitialOperons = Field(
        default=InitialOperons.ONE,
        strict=False,
        description="Partition of the loci in the first generation (A3).",
    )
    parameter_loci: int | None = Field(
        default=None,
        ge=1,
        description="Loci per operon; with initial_operons = per_parameter only, a divisor of L.",
    )
    initial_list: InitialList = Field(
        default=InitialList.ONE_VALUE, strict=False, description="Value lists of the first generation (A4)."
    )
    full_list: FullList = Field(
        default=FullList.DROP_OLDEST,
        strict=False,
        description="Duplication where a list would exceed cap (A6).",
    )
    duplicates: Duplication = Field(
        default=Duplication.HEAD_TO_FRONT, strict=False, description="What duplication copies (A7)."
    )
    deletes: Deletion = Field(default=Deletion.HEAD, strict=False, description="What deletion removes (A8).")
    inverts: Inversion = Field(
        default=Inversion.REVERSE_LIST, strict=False, description="What inversion does to a list (A9)."
    )
    bit_mutation: BitMutation = Field(
        default=BitMutation.ALL_STORED, strict=False, description="Values that bit mutation may flip (A10)."
    )
    order: Order = Field(
        default=Order.STRUCTURE_FIRST,
        strict=False,
        description="Bit mutation after or before the five operators (A11).",
    )
    divides: Division = Field(
        default=Division.ANY_OPERON, strict=False, description="Which operon is divided, and where (A12)."
    )

    @model_validator(mode="after")
    def _parameter_loci_where_needed(self) -> Self:
        if (self.initial_operons is InitialOperons.PER_PARAMETER) != (self.parameter_loci is not None):
            raise ValueError(
                f"parameter_loci: expected a number with initial_operons = per_parameter and none otherwise, "
                f"got {self.parameter_loci} with initial_operons = {self.initial_operons}"
            )
        return self

    def rules(self) -> Rules:
        """These options for compiled code."""
        return Rules(
            connection=float(self.connection),
            division=float(self.division),
            duplication=float(self.duplication),
            deletion=float(self.deletion),
            inversion=float(self.inversion),
            scope=self.scope.code,
            full_list=self.full_list.code,
            duplicates=self.duplicates.code,
            deletes=self.deletes.code,
            inverts=self.inverts.code,
            bit_mutation=self.bit_mutation.code,
            order=self.order.code,
            divides=self.divides.code,
        )
