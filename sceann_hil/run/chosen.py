"""The individual that somebody names at the command line."""

from __future__ import annotations

import re
from typing import NamedTuple

from sceann_hil.config import noted_config
from sceann_hil.errors import NotARun
from sceann_hil.journal import IndividualRow, JournalReader
from sceann_hil.run.champion import champion_or_best_so_far

BEST = "best"
_PLACE = re.compile(r"(\d{1,9}):(\d{1,9})")


class Chosen(NamedTuple):
    """An individual, and what people should know of it; mostly nothing."""

    individual: IndividualRow
    note: str = ""


def chosen_individual(reader: JournalReader, name: str = BEST) -> Chosen:
    """The individual that ``--genome`` names.

    Args:
        reader: the run's journal.
        name: ``best``; generation and individual, such as ``12:3``; or an id of the journal.

    Raises:
        NotARun: the run has no such individual, or no trial yet that counts.
    """
    if name == BEST:
        keeps_best = noted_config(reader).algorithm.keeps_best
        return Chosen(*champion_or_best_so_far(reader, keeps_best=keeps_best))
    if place := _PLACE.fullmatch(name):
        generation, number = int(place[1]), int(place[2])
        found = reader.individuals(generation)
        if number < len(found):
            return Chosen(found[number])
        what = f"individuals 0 to {len(found) - 1}" if found else "none: it has not begun"
        raise NotARun(
            f"{reader.directory} has no individual {number} in generation {generation}.", f"That generation has {what}."
        )
    if name.isdecimal():
        return Chosen(reader.individual(int(name)))
    raise NotARun(
        f"--genome: expected best, GENERATION:INDIVIDUAL such as 12:3, or an id of the journal, got {name!r}.",
        f"`sceann champion {reader.directory}` lists the best.",
    )
