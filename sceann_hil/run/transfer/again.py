"""A further transfer on the same robot: its trials count, and new candidates evolve in the robots that it resembles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import journalled_config
from sceann_hil.errors import ConfigError, NotARun
from sceann_hil.journal import JournalReader
from sceann_hil.network.coding import Bits
from sceann_hil.run.breeding import operator_s
from sceann_hil.run.transfer.ensemble import Ensemble
from sceann_hil.run.transfer.model import Model, Observations
from sceann_hil.run.transfer.preparation import Preparation
from sceann_hil.run.transfer.settings import TransferConfig
from sceann_hil.run.transfer.sources import misfit
from sceann_hil.run.transfer.state import TransferState

MOST_ALIKE = 20
"""Robots to evolve in, at most."""
_LEAST_WEIGHT = 1e-3


def read_transfer(directory: Path) -> tuple[TransferState, NDArray[np.float64]]:
    """Where a transfer stands, and the fitness of its measurements so far (one a round).

    Raises:
        NotARun: it is no transfer, or has no finished trial.
    """
    reader = JournalReader(directory)
    try:
        config = journalled_config(reader)
        if not isinstance(config.algorithm, TransferConfig):
            raise NotARun(
                f"{directory} is a run of algorithm {config.algorithm.type}, not of transfer.",
                "Name a folder that `sceann transfer` made.",
            )
        algorithm = config.algorithm.build(config.genome_length)
        finished = reader.generations(finished=True)
        if not finished:
            raise NotARun(f"{directory} has no finished trial yet.", f"`sceann resume {directory}` first.")
        measured: list[float] = []
        for row in finished:
            state = algorithm.load(reader.algorithm_state(row.number))
            if state.start is None:
                measured += reader.fitness(row.number).tolist()
        if (start := state.start) is not None:
            # what this trial brought is only in the state of the next generation, if it was begun
            newest = reader.last_generation()
            if newest is not None and newest.number > row.number:
                state = algorithm.load(reader.algorithm_state(newest.number))
            else:
                value, needed_s = float(reader.fitness(row.number)[0]), operator_s(reader, row.number)
                state = replace(state, observed=state.observed.and_one(state.candidate, start, value, needed_s))
        return state, np.array(measured)
    finally:
        reader.close()


def candidates_and_trials(directory: Path, preparation: Preparation) -> tuple[Bits, Observations]:
    """Candidates for a further transfer, and the trials of the one before.

    Raises:
        ConfigError: that one was of another controller, or in other simulated robots.
    """
    reader = JournalReader(directory)
    try:
        theirs = journalled_config(reader)
    finally:
        reader.close()
    told = misfit(theirs, preparation.config)
    if told is None and theirs.task != preparation.config.task:
        told = "task: expected the same task"
    if told is not None:
        raise ConfigError(f"{directory}: {told}.", "Nothing was started.")
    state, _ = read_transfer(directory)
    ensemble = preparation.prepared(state.candidates).ensemble
    weights = resemblance(ensemble, state.observed)
    alike = np.argsort(-weights, kind="stable")[:MOST_ALIKE]
    alike = alike[weights[alike] > _LEAST_WEIGHT] if (weights[alike] > _LEAST_WEIGHT).any() else alike[:1]
    tried = np.unique(state.observed.candidate)
    keep = np.unique(np.concatenate([tried, np.array(state.ranking, np.int64)]))
    fresh = preparation.candidates(state.candidates[keep], tuple(sorted(alike.tolist())))
    place = {genome.tobytes(): k for k, genome in enumerate(fresh)}
    moved = np.array([place[state.candidates[k].tobytes()] for k in state.observed.candidate.tolist()], np.int64)
    return fresh, replace(state.observed, candidate=moved)


def resemblance(ensemble: Ensemble, observed: Observations) -> NDArray[np.float64]:
    """How much the robot resembles each simulated one: their likelihood, shape ``(M,)``, sum 1.

    A robot that did the same trials as well in simulation is alike; the scatter is the model's own discrepancy and
    noise, so that a few trials do not decide too much.
    """
    n_robots = len(ensemble.fitness)
    if not len(observed):
        return np.full(n_robots, 1.0 / n_robots)
    model = Model(ensemble.fitness, 1e-9)
    tau, s = model.condition(observed).likeliest
    simulated = ensemble.fitness[:, observed.candidate, observed.start].astype(np.float64)
    logs = -0.5 * ((simulated - observed.value) ** 2).sum(axis=1) / (tau**2 + s**2)
    weights = np.exp(logs - logs.max())
    return np.asarray(weights / weights.sum())
