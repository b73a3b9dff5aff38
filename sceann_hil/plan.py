"""What a configuration will cost, from the configuration alone."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Self

from sceann_hil.config import ExperimentConfig


@dataclass(frozen=True, slots=True)
class Plan:
    """A forecast without running anything.

    Attributes:
        genome_length: L, bits.
        network: sizes in words.
        population: individuals per generation.
        generations: generations that are evaluated, the first included.
        trials_per_individual: of the task.
        trials: in all, if none is void.
        longest_trial_s: robot time of a trial that reaches its step limit.
        longest_robot_s: robot time if every trial does.
        prompts: times that a person is asked to make the robot ready.
    """

    genome_length: int
    network: str
    population: int
    generations: int
    trials_per_individual: int
    trials: int
    longest_trial_s: float
    longest_robot_s: float
    prompts: int

    @classmethod
    def of(cls, config: ExperimentConfig) -> Self:
        """The forecast for one configuration."""
        task, spec, size = config.task.build(), config.robot.spec, config.size
        generations = config.algorithm.generations + 1
        trials = config.algorithm.population * generations * task.n_trials
        longest_trial_s = task.max_steps * spec.tick_s
        return cls(
            genome_length=config.genome_length,
            network=f"{size.n_sensors} sensors, {size.n_hidden} hidden, {size.n_motors} motors",
            population=config.algorithm.population,
            generations=generations,
            trials_per_individual=task.n_trials,
            trials=trials,
            longest_trial_s=longest_trial_s,
            longest_robot_s=trials * longest_trial_s,
            prompts=trials if spec.attended else 0,
        )

    @property
    def n_genomes_in_space(self) -> str:
        """How many genomes there are, in words."""
        return f"{2**self.genome_length:.3g} different genomes"

    def as_dict(self) -> dict[str, Any]:
        """The same for JSON."""
        return asdict(self)
