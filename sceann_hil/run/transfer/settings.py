"""The `algorithm` section of a transfer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from sceann_hil.plugins import AlgorithmConfig

if TYPE_CHECKING:
    from collections.abc import Callable

    from sceann_hil.config import ExperimentConfig
    from sceann_hil.run.transfer.algorithm import Transfer


class TransferConfig(AlgorithmConfig):
    """From simulation to a robot in a few trials: choose among candidates by an ensemble of simulated robots."""

    weighs_trials: ClassVar[bool] = True
    conclusion: ClassVar[str | None] = "sceann_hil.study.transfer:conclude"
    type: Literal["transfer"] = "transfer"
    trials: Annotated[int, Field(ge=1, le=10_000)] = 40
    """Most trials on the robot to choose by, one a generation."""
    rounds: Annotated[int, Field(ge=1, le=100)] = 2
    """At the end the recommended controller does all trials of the task so many times."""
    target: float | None = None
    """Stop when this fitness is expected with great certainty; null = as good as possible."""
    least_gain: Annotated[float, Field(ge=0.0, le=1.0)] = 0.001
    """Stop when one more trial is expected to bring less than this part of the range of fitness."""
    sources: tuple[str, ...] = ()
    """Folders of runs and studies whose genomes are candidates."""
    evolve: Annotated[int, Field(ge=0, le=10_000)] | None = None
    """Runs of evolution in simulated robots that give candidates; null = 100 without sources, else 0."""
    candidates: Annotated[int, Field(ge=2, le=10_000)] = 1500
    """Candidates that are kept."""
    again: str | None = None
    """Folder of an earlier transfer on this robot: its trials count, and new candidates evolve in robots like it."""
    population: Literal[1] = 1
    """One trial of one controller at a time."""
    generations: Annotated[int, Field(ge=0)] = 0
    """Follows from trials and rounds; leave it out."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        follows = self.trials + self.rounds - 1
        if not self.generations:
            object.__setattr__(self, "generations", follows)
        if self.generations != follows:
            raise ValueError(
                f"generations: expected {follows} (trials + rounds - 1), got {self.generations}; leave it out"
            )
        return self

    @property
    def keeps_best(self) -> bool:
        """What it recommends is measured last, and again."""
        return True

    def build(self, genome_length: int) -> Transfer:
        """For looking at a transfer's states; `for_experiment` makes one that can go on."""
        from sceann_hil.run.transfer.algorithm import Transfer

        return Transfer(genome_length, self.trials, self.rounds, self.target, self.least_gain)

    def for_experiment(
        self, config: ExperimentConfig, report: Callable[[str, int, int], None] | None = None
    ) -> Transfer:
        """The algorithm for one experiment, which prepares candidates and simulated robots when it starts."""
        from sceann_hil.run.transfer.algorithm import Transfer
        from sceann_hil.run.transfer.ensemble import silent
        from sceann_hil.run.transfer.preparation import Preparation

        evolve = self.evolve if self.evolve is not None else 0 if self.sources else 100
        preparation = Preparation(
            config, tuple(Path(source) for source in self.sources), evolve, self.candidates, report or silent
        )
        again = Path(self.again) if self.again is not None else None
        return Transfer(
            config.genome_length, self.trials, self.rounds, self.target, self.least_gain, preparation, again
        )

    def prepare(self, config: ExperimentConfig, report: Callable[[str, int, int], None] | None = None) -> None:
        """Candidates and simulated robots, into the cache: no robot has to wait for them."""
        self.for_experiment(config, report).prepare()
