"""The generations that a run still has to evaluate, each journalled before it is evaluated."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sceann_hil.evolution import Algorithm, State
from sceann_hil.journal import Journal, JournalReader
from sceann_hil.run.measures import Measures
from sceann_hil.seeds import Purpose, generator


def generations(
    journal: Journal, algorithm: Algorithm[Any], root_seed: int, last: int, measures: Measures | None = None
) -> Iterator[tuple[int, State]]:
    """From wherever the journal stands.

    Args:
        journal: of the run; a generation that was yielded must be finished in it before the next one is asked for.
        algorithm: what makes the next generation.
        root_seed: of the run's seed tree.
        last: number of the last generation.
        measures: what the algorithm is told besides fitness.

    Yields:
        Number and algorithm's state.
    """
    row = journal.reader.last_generation()
    if row is None:
        number, state = 0, algorithm.start(generator(root_seed, Purpose.ALGORITHM, 0))
        _begin(journal, algorithm, number, state, {})
    else:
        number, state = row.number, algorithm.load(journal.reader.algorithm_state(row.number))
        if row.finished_at is not None:
            if number >= last or algorithm.is_last(state):
                return
            number, state = _breed(journal, algorithm, root_seed, number, state, measures)
    while True:
        yield number, state
        if number >= last or algorithm.is_last(state):
            return
        number, state = _breed(journal, algorithm, root_seed, number, state, measures)


def operator_s(reader: JournalReader, number: int) -> float:
    """Time that a person needed for all attempts of a generation, void ones too."""
    return sum(row.operator_s or 0.0 for row in reader.attempts(number))


def _breed(
    journal: Journal,
    algorithm: Algorithm[Any],
    root_seed: int,
    number: int,
    state: State,
    measures: Measures | None,
) -> tuple[int, State]:
    rows = journal.reader.individuals(number)
    fitness = journal.reader.fitness(number)
    rng = generator(root_seed, Purpose.ALGORITHM, number + 1)
    if algorithm.attended:
        child = algorithm.tell_attended(state, fitness, operator_s(journal.reader, number), rng)
    elif measures is None:
        child = algorithm.tell(state, fitness, rng)
    else:
        measured = measures.of_generation(journal.reader, number, len(rows))
        child = algorithm.tell_with_measures(state, fitness, measured, rng)
    _begin(journal, algorithm, number + 1, child, {row.number: row.id for row in rows})
    return number + 1, child


def _begin(journal: Journal, algorithm: Algorithm[Any], number: int, state: State, ids: dict[int, int]) -> None:
    journal.begin_generation(
        number,
        algorithm.dump(state),
        state.genomes,
        [ids.get(parent) for parent in state.parents.tolist()],
        algorithm.structures(state),
    )
