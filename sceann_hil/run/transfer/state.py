"""Where a transfer stands: candidates, trials so far, and what is to be done next. One generation is one trial."""

from __future__ import annotations

import base64
import json
from dataclasses import asdict, dataclass
from enum import StrEnum

import numpy as np

from sceann_hil.evolution import State
from sceann_hil.network.coding import Bits
from sceann_hil.run.transfer.model import Observations

_VERSION = 1


class Verdict(StrEnum):
    """Why there are no more trials to choose by."""

    OPEN = "open"
    """There are more."""
    TRIALS_DONE = "trials_done"
    """As many as were wanted."""
    ENOUGH = "enough"
    """One more trial would bring next to nothing."""
    TARGET = "target"
    """The wanted fitness is expected with great certainty."""
    NONE_SUCCEEDS = "none_succeeds"
    """No candidate is expected to succeed on this robot."""


@dataclass(frozen=True, slots=True)
class Outlook:
    """What is expected after the trials so far.

    Attributes:
        fitness: expected fitness of the recommended candidate on this robot.
        deviation: standard deviation of that.
        success: expected part of its trials that succeed; None if success is not a matter of fitness.
        most_success: no candidate is expected to succeed more often, upper end of the 95 % interval.
        gain: by how much one more trial is expected to raise the recommended candidate's fitness.
    """

    fitness: float
    deviation: float
    success: float | None
    most_success: float | None
    gain: float

    @property
    def interval(self) -> tuple[float, float]:
        """95 % of what the fitness may be."""
        return self.fitness - 1.96 * self.deviation, self.fitness + 1.96 * self.deviation


@dataclass(frozen=True, slots=True)
class TransferState(State):
    """One trial that is to be done, or the recommended controller's measurement.

    Attributes:
        candidates: all controllers to choose from, shape ``(K, L)``.
        observed: the trials so far.
        candidate: the one whose trial this is.
        start: index of its start; None if it is measured in all trials of the task.
        recommended: the best candidate so far.
        ranking: the best candidates, best first.
        outlook: what is expected before this trial.
        verdict: why there are no more trials to choose by.
        rounds: measurements of the recommended controller that are still to come, this one included.
        inherited: how many of the trials are of an earlier transfer.
    """

    candidates: Bits
    observed: Observations
    candidate: int
    start: int | None
    recommended: int
    ranking: tuple[int, ...]
    outlook: Outlook
    verdict: Verdict
    rounds: int
    inherited: int

    def dumped(self) -> bytes:
        """As bytes; equal states give equal bytes."""
        observed = self.observed
        document = {
            "version": _VERSION,
            "shape": list(self.candidates.shape),
            "candidates": base64.b64encode(np.packbits(self.candidates).tobytes()).decode(),
            "observed": [
                column.tolist() for column in (observed.candidate, observed.start, observed.value, observed.operator_s)
            ],
            "candidate": self.candidate,
            "start": self.start,
            "recommended": self.recommended,
            "ranking": list(self.ranking),
            "outlook": asdict(self.outlook),
            "verdict": self.verdict.value,
            "rounds": self.rounds,
            "inherited": self.inherited,
        }
        return json.dumps(document, sort_keys=True).encode()

    @classmethod
    def loaded(cls, data: bytes, genome_length: int) -> TransferState:
        """The inverse of `dumped`.

        Raises:
            ValueError: that is something else.
        """
        try:
            document = json.loads(data)
            if document["version"] != _VERSION:
                raise ValueError(f"state: expected version {_VERSION}, got {document['version']}")
            n, length = document["shape"]
            if length != genome_length:
                raise ValueError(f"state: expected genomes of {genome_length} bits, got {length}")
            packed = np.frombuffer(base64.b64decode(document["candidates"]), np.uint8)
            candidates = np.unpackbits(packed, count=n * length).reshape(n, length)
            # earlier ones do not know what people needed
            candidate, start, value, *operator_s = document["observed"]
            return cls.of(
                candidates,
                Observations.of(
                    np.array(candidate, np.int64),
                    np.array(start, np.int64),
                    np.array(value, np.float64),
                    np.array(operator_s[0], np.float64) if operator_s else None,
                ),
                candidate=document["candidate"],
                start=document["start"],
                recommended=document["recommended"],
                ranking=tuple(document["ranking"]),
                outlook=Outlook(**document["outlook"]),
                verdict=Verdict(document["verdict"]),
                rounds=document["rounds"],
                inherited=document["inherited"],
            )
        except (KeyError, TypeError, UnicodeDecodeError) as error:
            raise ValueError(f"state: this is no state of a transfer ({error})") from error

    @classmethod
    def of(
        cls,
        candidates: Bits,
        observed: Observations,
        *,
        candidate: int,
        start: int | None,
        recommended: int,
        ranking: tuple[int, ...],
        outlook: Outlook,
        verdict: Verdict,
        rounds: int,
        inherited: int,
    ) -> TransferState:
        """With the genome that is next; arrays become read-only."""
        genomes = candidates[candidate : candidate + 1].copy()
        parents = np.full(1, -1, np.int32)
        for array in (genomes, parents, candidates):
            array.flags.writeable = False
        return cls(
            genomes=genomes,
            parents=parents,
            candidates=candidates,
            observed=observed,
            candidate=candidate,
            start=start,
            recommended=recommended,
            ranking=ranking,
            outlook=outlook,
            verdict=verdict,
            rounds=rounds,
            inherited=inherited,
        )
