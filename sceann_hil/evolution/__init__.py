"""Genetic algorithms behind ask and tell: explicit state, explicit Generator, larger fitness is better.

Other packages add an algorithm by an entry point in the group ``sceann_hil.algorithms`` that names its config
class; a config has the fields ``type`` and ``generations`` and a method ``build(genome_length)``.
"""

from sceann_hil.evolution.algorithm import Algorithm, State
from sceann_hil.evolution.generational import GenerationalAlgorithm, GenerationalConfig
from sceann_hil.evolution.oga import OGA, OGAConfig, OGAState
from sceann_hil.evolution.oga_options import OGAOptions
from sceann_hil.evolution.sga import SGA, SGAConfig

__all__ = [
    "OGA",
    "SGA",
    "Algorithm",
    "GenerationalAlgorithm",
    "GenerationalConfig",
    "OGAConfig",
    "OGAOptions",
    "OGAState",
    "SGAConfig",
    "State",
]
