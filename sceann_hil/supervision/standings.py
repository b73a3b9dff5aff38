"""Who leads in a generation that is not finished yet."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Leader:
    """The best individual so far.

    Attributes:
        individual: its place in the generation.
        fitness: mean over its trials so far.
        trials: how many they are.
    """

    individual: int
    fitness: float
    trials: int

    @property
    def words(self) -> str:
        """For people."""
        trials = f"{self.trials} trial{'s' if self.trials > 1 else ''}"
        return f"best so far {self.fitness:.4g} (individual {self.individual}, {trials})"


class Standings:
    """What the trials of one generation that counted so far say of its individuals.

    Only those are compared of whom most is known: one lucky trial does not lead before the mean of eight.
    """

    def __init__(self) -> None:
        self._fitness: dict[int, list[float]] = {}

    def add(self, individual: int, fitness: float) -> None:
        """One more trial that counts."""
        self._fitness.setdefault(individual, []).append(fitness)

    @property
    def leader(self) -> Leader | None:
        """The first of equals; None before a trial counted."""
        most = max(map(len, self._fitness.values()), default=0)
        means = {who: sum(told) / most for who, told in self._fitness.items() if len(told) == most}
        if not means:
            return None
        best = min(means, key=lambda who: (-means[who], who))
        return Leader(best, means[best], most)
