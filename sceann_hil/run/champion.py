"""The champion of a run: the same one for `status`, `champion`, `export`, reports and studies.

Where the algorithm keeps its best unchanged, it is the best of the last finished generation: on a noisy robot an
earlier one may only have been lucky, and a kept one has stood the test again. Where it keeps none, the best may be lost
in any generation, so it is the best of the whole run. The first of equals. An algorithm that recommends a genome
(`JournalReader.champion`) is believed.

Before a generation is finished there is none; whoever cannot wait takes the best so far (`best_so_far`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from sceann_hil.errors import NotARun
from sceann_hil.journal import IndividualRow, JournalReader
from sceann_hil.supervision.standings import Standings


@dataclass(frozen=True, slots=True)
class BestSoFar:
    """Who leads in the newest generation while that is not finished.

    Attributes:
        individual: its row, with the mean of its trials so far as its fitness.
        trials: how many of its trials count so far.
        counted: trials of the whole generation that count so far.
    """

    individual: IndividualRow
    trials: int
    counted: int

    @property
    def note(self) -> str:
        """What people should know of it: a sentence."""
        row = self.individual
        so_far = f"{self.trials} trial{'s' if self.trials > 1 else ''}"
        return (
            f"Generation {row.generation} is not finished: the best so far is its individual {row.number}, with "
            f"fitness {row.fitness:.4g} over {so_far}."
        )


def champion_of(reader: JournalReader, *, keeps_best: bool) -> IndividualRow | None:
    """The champion so far; None before a generation is finished.

    Args:
        reader: the run's journal.
        keeps_best: what the algorithm's configuration says of itself.
    """
    return reader.champion() if keeps_best else reader.best_ever()


def best_so_far(reader: JournalReader) -> BestSoFar | None:
    """Who leads in the newest generation; None if that is finished, or has no trial yet that counts."""
    newest = reader.last_generation()
    if newest is None or newest.finished_at is not None:
        return None
    counted = [row for row in reader.attempts(newest.number) if row.fitness is not None]
    standings = Standings()
    for row in counted:
        standings.add(row.individual, row.fitness or 0.0)
    leader = standings.leader
    if leader is None:
        return None
    individual = reader.individuals(newest.number)[leader.individual]
    return BestSoFar(replace(individual, fitness=leader.fitness), leader.trials, len(counted))


def champion_or_best_so_far(reader: JournalReader, *, keeps_best: bool) -> tuple[IndividualRow, str]:
    """The champion, or in a run's first generation the best so far, and then what people should know of it.

    Raises:
        NotARun: no trial counts yet.
    """
    champion = champion_of(reader, keeps_best=keeps_best)
    if champion is not None:
        return champion, ""
    best = best_so_far(reader)
    if best is None:
        raise NotARun(f"{reader.directory} has no trial yet that counts.", "Let it run on: `sceann resume`.")
    return best.individual, best.note
