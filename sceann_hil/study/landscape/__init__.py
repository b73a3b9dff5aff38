"""Exact fitness landscapes of short genomes: every one of the 2^L genomes is tried.

`enumerate_landscape` fills a `Landscape` folder (`enumeration`, `files`); `analyse` says what is in it (`analysis`).
Genome number g is the genome whose bits, first bit first, are the binary digits of g.
"""

from sceann_hil.study.landscape.analysis import Summary, analyse, champion_ranks
from sceann_hil.study.landscape.enumeration import MAX_BITS, enumerate_landscape, genomes_of
from sceann_hil.study.landscape.files import Landscape, landscapes_in

__all__ = [
    "MAX_BITS",
    "Landscape",
    "Summary",
    "analyse",
    "champion_ranks",
    "enumerate_landscape",
    "genomes_of",
    "landscapes_in",
]
