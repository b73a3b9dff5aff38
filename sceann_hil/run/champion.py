"""Which individual is the champion of a run: the same one for `status`, `champion`, `export`, reports and studies.

Where the algorithm keeps its best unchanged, it is the best of the last finished generation: on a noisy robot an
earlier one may only have been lucky, and a kept one has stood the test again. Where it keeps none, the best may be lost
in any generation, so it is the best of the whole run. The first of equals. An algorithm that recommends a genome
(`JournalReader.champion`) is believed.
"""

from __future__ import annotations

from sceann_hil.journal import IndividualRow, JournalReader


def champion_of(reader: JournalReader, *, keeps_best: bool) -> IndividualRow | None:
    """The champion so far; None before a generation is finished.

    Args:
        reader: the run's journal.
        keeps_best: what the algorithm's configuration says of itself.
    """
    return reader.champion() if keeps_best else reader.best_ever()
