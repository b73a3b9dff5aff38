"""Controllers to choose from: the genomes of earlier runs, or of runs that evolve in the simulated robots first.

Evolution happens in drawn robots, each run in one of its own: what is best in one robot or another is wanted, not what
is fair in all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import ConfigError
from sceann_hil.evolution import SGA, SGAConfig
from sceann_hil.network.coding import Bits
from sceann_hil.plugins import RobotConfig
from sceann_hil.run.transfer import cache
from sceann_hil.run.transfer.ensemble import Report, World, silent
from sceann_hil.seeds import Purpose, generator, keys

POPULATION = 25
GENERATIONS = 50
"""Of one run, as the paper has them."""
POOL = 8000
"""Most genomes that are looked at more closely."""
SCREENING_ROBOTS = 40
_OWN_WEIGHT = 0.75
"""Weight of a genome's fitness in one robot against its mean over all: few trials scatter."""
_ROOT = 0


def evolve(world: World, runs: int, report: Report = silent, numbers: Sequence[int] = ()) -> Bits:
    """Genomes of plain GA runs, each in a simulated robot of its own.

    Args:
        world: robots and task.
        runs: how many.
        report: told after every run.
        numbers: of the robots, in turn; all of them by default.

    Returns:
        The fittest different genomes of every run, shape ``(n, L)``, at most `POOL`.
    """
    turn = list(numbers) or list(range(len(world.robots)))
    folder = cache.cache_folder("candidates", world.digest(f"{runs} {turn}"))
    path = folder / "evolved.npz"
    known = cache.load(path)
    if known is not None:
        return np.asarray(known["genomes"], np.uint8)
    best = []
    for run in range(runs):
        genomes, fitness = _run(world, world.robots.bodies[turn[run % len(turn)]], run)
        best.append(_fittest(genomes, fitness, max(1, POOL // runs)))
        report("evolution in simulated robots", run + 1, runs)
    found = np.unique(np.concatenate(best), axis=0)
    cache.save(path, {"genomes": found})
    return found


def _run(world: World, body: RobotConfig, number: int) -> tuple[Bits, NDArray[np.float64]]:
    """Every genome of one run and its fitness."""
    evaluator = world.evaluator(body)
    algorithm = SGA(world.phenotype.genome_length, SGAConfig(population=POPULATION))
    rng = generator(_ROOT, Purpose.ENSEMBLE, 1_000_000 + number)
    state = algorithm.start(rng)
    genomes, fitness = [], []
    for generation in range(GENERATIONS + 1):
        noise = keys(_ROOT, Purpose.ENSEMBLE, number, 2 + generation, np.arange(POPULATION)[:, None], world.starts)
        values = evaluator.evaluate(state.genomes, noise, world.simulated_starts).mean_fitness
        genomes.append(state.genomes)
        fitness.append(values)
        if generation < GENERATIONS:
            state = algorithm.tell(state, values, rng)
    return np.concatenate(genomes), np.concatenate(fitness)


def _fittest(genomes: Bits, fitness: NDArray[np.float64], count: int) -> Bits:
    order = np.argsort(-fitness, kind="stable")
    _, first = np.unique(genomes[order], axis=0, return_index=True)
    return genomes[order[np.sort(first)[:count]]]


def screen(world: World, pool: Bits, count: int, report: Report = silent, numbers: Sequence[int] = ()) -> Bits:
    """The `count` genomes that are best in one robot or another.

    Args:
        world: robots and task.
        pool: different genomes, shape ``(n, L)``.
        count: K, how many to keep.
        report: told after every robot.
        numbers: of the robots to look at them in; the first `SCREENING_ROBOTS` by default.
    """
    if len(pool) <= count:
        return pool
    turn = list(numbers) or list(range(min(SCREENING_ROBOTS, len(world.robots))))
    what = f"screen {count} {turn} {pool.shape}"
    folder = cache.cache_folder("candidates", world.digest(what, np.packbits(pool).tobytes()))
    path = folder / "screened.npz"
    known = cache.load(path)
    if known is not None:
        return np.asarray(pool[known["kept"]])
    fitness = np.empty((len(turn), len(pool)))
    for place, number in enumerate(turn):
        body = world.robots.bodies[number]
        noise = keys(_ROOT, Purpose.ENSEMBLE, number, 1_000, np.arange(len(pool))[:, None], world.starts)
        fitness[place] = world.evaluator(body).evaluate(pool, noise, world.simulated_starts).mean_fitness
        report("screening", place + 1, len(turn))
    mean = fitness.mean(axis=0)
    mixed = _OWN_WEIGHT * fitness + (1.0 - _OWN_WEIGHT) * mean
    ranks = np.argsort(np.argsort(-mixed, axis=1, kind="stable"), axis=1, kind="stable").min(axis=0)
    kept = np.sort(np.lexsort((-mean, ranks))[:count])
    cache.save(path, {"kept": kept})
    return pool[kept]


def different(genomes: Sequence[Bits], length: int, most: int = POOL) -> Bits:
    """Different genomes of several sources, best of each first, in turn until there are `most`.

    Args:
        genomes: of each source, fittest first.
        length: L.
        most: how many at most.
    """
    share = max(1, most // max(1, len(genomes)))
    some = [source[:share] for source in genomes if len(source)]
    return np.unique(np.concatenate(some), axis=0) if some else np.zeros((0, length), np.uint8)


def nothing_to_choose(sources: Sequence[Path]) -> ConfigError:
    """What to say where there is not a single candidate."""
    named = ", ".join(map(str, sources)) or "nothing"
    return ConfigError(
        f"There is no controller to choose from: {named} has no genomes.",
        "Name a run with finished generations (--from), or let evolution in simulation find some (--evolve 100).",
    )
