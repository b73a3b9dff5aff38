"""A transfer's ensemble on a Dask cluster: what it computes is kept here, as if this machine had done it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from sceann_hil.config import ExperimentConfig, dump_config, parse_config
from sceann_hil.network.coding import Bits
from sceann_hil.run.transfer.ensemble import Arrays, Report, World, part_of_ensemble
from sceann_hil.run.transfer.preparation import Preparation, simulated_body
from sceann_hil.study.cluster import ClusterWorkers


@dataclass(frozen=True)
class Part:
    """Some robots of an ensemble.

    Attributes:
        config: the experiment's text; its `uncertainty.body` is there, so that no folder of a run is needed.
        genomes: candidates, shape ``(K, L)``.
        numbers: of the robots.
    """

    config: str
    genomes: Bits
    numbers: range


def prepare_on(workers: ClusterWorkers, config: ExperimentConfig, report: Report) -> None:
    """Prepare a transfer, its ensemble on a cluster.

    Raises:
        ConfigError: what does not fit.
        WorkersLost: the cluster's.
    """
    algorithm = config.algorithm.for_experiment(config, report)
    preparation: Preparation = algorithm.prepared_by()
    body = simulated_body(config, preparation.sources)
    # a robot's port is none of a worker's business, and its sources lie here
    given = {"uncertainty.body": body.model_dump(mode="json"), "algorithm.sources": []}
    text = dump_config(config.with_changes(given))

    def on_the_cluster(_: World, genomes: Bits, parts: list[range]) -> Iterator[tuple[range, Arrays]]:
        pieces = (Part(text, genomes, numbers) for numbers in parts)
        yield from workers.map(compute_part, pieces, lambda it: f"robots {it.numbers.start} to {it.numbers.stop - 1}")

    preparation.compute = on_the_cluster
    algorithm.prepare()


def compute_part(part: Part) -> tuple[range, Arrays]:
    """On a worker: what the candidates do in the robots of a part."""
    config = parse_config(part.config, "transfer")
    world = Preparation(config, (), 0, len(part.genomes)).world
    return part.numbers, part_of_ensemble(world, part.genomes, part.numbers)
