"""What a configuration will cost, from the configuration alone."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Self

from sceann_hil.config import ExperimentConfig
from sceann_hil.supervision.budget import Amounts

PROMPT_S = 20.0
"""What a prompt is taken to cost a person before any is measured."""

_RECORDED_BYTES, _RECORDED_BYTES_PER_STEP = 20_000, 180
_RECORDED_S, _RECORDED_S_PER_STEP = 2.5e-3, 2e-6
"""What a trial's recording takes, measured on the shipped tasks; more or less by half with the number of signals."""


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
        prompts: times that a person is asked something, before and after trials.
        longest_wall_s: robot time if every trial takes as long as it may, and `PROMPT_S` for every prompt.
        simulated: the robot's time is simulated too, so that nobody waits for it.
        recording_bytes: what recordings of all trials take on the disk, if every trial takes as long as it may.
        recording_s: what they take of one core, at low priority, beside and after the run.
        fits: whether that is within the budget; in words, empty if nothing is limited.
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
    longest_wall_s: float
    simulated: bool
    recording_bytes: int
    recording_s: float
    fits: str

    @classmethod
    def of(cls, config: ExperimentConfig) -> Self:
        """The forecast for one configuration."""
        task, spec, size = config.build_task(), config.robot.spec, config.size
        generations = config.algorithm.generations + 1
        trials = config.algorithm.population * generations * task.n_trials
        longest_trial_s = task.max_steps * spec.tick_s
        per_trial = 2 if config.operator.confirm else 1
        prompts = trials * per_trial if spec.attended and config.operator.resolved(attended=True) else 0
        longest_wall_s = trials * longest_trial_s + prompts * PROMPT_S
        return cls(
            genome_length=config.genome_length,
            network=f"{_several(size.n_sensors, 'sensor')}, {size.n_hidden} hidden, {_several(size.n_motors, 'motor')}",
            population=config.algorithm.population,
            generations=generations,
            trials_per_individual=task.n_trials,
            trials=trials,
            longest_trial_s=longest_trial_s,
            longest_robot_s=trials * longest_trial_s,
            prompts=prompts,
            longest_wall_s=longest_wall_s,
            simulated=spec.deterministic,
            recording_bytes=trials * (_RECORDED_BYTES + _RECORDED_BYTES_PER_STEP * task.max_steps),
            recording_s=trials * (_RECORDED_S + _RECORDED_S_PER_STEP * task.max_steps),
            fits=_fits(config, Amounts(trials * longest_trial_s, longest_wall_s, float(trials))),
        )

    @property
    def n_genomes_in_space(self) -> str:
        """How many genomes there are, in words."""
        return f"{2**self.genome_length:.3g} different genomes"

    def as_dict(self) -> dict[str, Any]:
        """The same for JSON."""
        return asdict(self)


def _several(number: int, what: str) -> str:
    return f"{number} {what}{'s' if number != 1 else ''}"


def _fits(config: ExperimentConfig, cost: Amounts) -> str:
    limits = config.budget.limits
    if limits == Amounts.unlimited():
        return ""
    over = [name for name in ("robot_s", "wall_s", "trials") if getattr(cost, name) > getattr(limits, name)]
    return (
        "yes, even if every trial takes as long as it may"
        if not over
        else f"not surely: {', '.join(over)} may end first"
    )
