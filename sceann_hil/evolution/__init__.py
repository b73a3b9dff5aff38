"""Genetic algorithms behind ask and tell: explicit state, explicit Generator, larger fitness is better.

``docs/adding-an-algorithm.md`` shows how another package adds one; `AskTellAlgorithm` wraps a library's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sceann_hil.lazily import lazily

if TYPE_CHECKING:
    from sceann_hil.evolution.algorithm import Algorithm, Archive, State
    from sceann_hil.evolution.ask_tell import AskTellAlgorithm, Optimiser, WrappedState
    from sceann_hil.evolution.generational import GenerationalAlgorithm, GenerationalConfig
    from sceann_hil.evolution.map_elites import MapElites, MapElitesConfig, MapElitesState
    from sceann_hil.evolution.oga import OGA, OGAConfig, OGAState
    from sceann_hil.evolution.oga_options import OGAOptions
    from sceann_hil.evolution.random_search import RandomSearch, RandomSearchConfig
    from sceann_hil.evolution.sga import SGA, SGAConfig

__all__ = [
    "OGA",
    "SGA",
    "Algorithm",
    "Archive",
    "AskTellAlgorithm",
    "GenerationalAlgorithm",
    "GenerationalConfig",
    "MapElites",
    "MapElitesConfig",
    "MapElitesState",
    "OGAConfig",
    "OGAOptions",
    "OGAState",
    "Optimiser",
    "RandomSearch",
    "RandomSearchConfig",
    "SGAConfig",
    "State",
    "WrappedState",
]

__getattr__ = lazily(
    __name__,
    {
        "algorithm": (
            "Algorithm",
            "Archive",
            "State",
        ),
        "ask_tell": (
            "AskTellAlgorithm",
            "Optimiser",
            "WrappedState",
        ),
        "generational": (
            "GenerationalAlgorithm",
            "GenerationalConfig",
        ),
        "map_elites": (
            "MapElites",
            "MapElitesConfig",
            "MapElitesState",
        ),
        "oga": (
            "OGA",
            "OGAConfig",
            "OGAState",
        ),
        "oga_options": ("OGAOptions",),
        "random_search": (
            "RandomSearch",
            "RandomSearchConfig",
        ),
        "sga": (
            "SGA",
            "SGAConfig",
        ),
    },
)
