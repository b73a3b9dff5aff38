"""Transfer as an algorithm: every generation is one trial of one candidate, the last ones measure the best.

So evolve, resume, rehearse and study know it, and whatever they promise (a person, a budget, the journal, exactly once)
holds. All randomness is in the simulated robots, and their seeds are fixed: the same trials lead to the same decisions.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.evolution import Algorithm
from sceann_hil.network.coding import Bits, genome_to_hex
from sceann_hil.run.transfer.choice import choose
from sceann_hil.run.transfer.ensemble import check_some_success
from sceann_hil.run.transfer.model import NOTHING, Observations, Posterior
from sceann_hil.run.transfer.preparation import Preparation, Prepared
from sceann_hil.run.transfer.state import Outlook, TransferState, Verdict

LEAST_TRIALS = 8
"""Trials before it is said that no candidate succeeds, or that a target is reached."""
EXPECTED = 0.5
"""A controller is expected to succeed that succeeds in at least so many of its trials."""
RANKED = 100
"""Candidates that another algorithm can start from."""
_TRUSTED = 1.64


class Transfer(Algorithm[TransferState]):
    """Chooses among candidates by a few trials.

    Args:
        genome_length: L.
        trials: most trials to choose by.
        rounds: measurements of the recommended controller in all trials of the task.
        target: fitness that is enough; None for the best there is.
        least_gain: a trial that is expected to bring less than this part of the fitness range is not worth it.
        preparation: makes candidates and ensemble; None for looking at states only.
        again: an earlier transfer whose trials count too.
    """

    attended = True

    def __init__(
        self,
        genome_length: int,
        trials: int,
        rounds: int,
        target: float | None,
        least_gain: float,
        preparation: Preparation | None = None,
        again: Path | None = None,
    ) -> None:
        self.genome_length = genome_length
        self.trials = trials
        self.rounds = rounds
        self.target = target
        self.least_gain = least_gain
        self._preparation = preparation
        self._again = again

    # -- ask and tell -----------------------------------------------------------------------------------------------

    def start(self, rng: np.random.Generator) -> TransferState:
        """Prepares everything; minutes, unless it was prepared before."""
        preparation = self.prepared_by()
        if self._again is not None:
            # the other way round it would be a circle
            from sceann_hil.run.transfer.again import candidates_and_trials

            candidates, observed = candidates_and_trials(self._again, preparation)
            return self._next(candidates, observed, len(observed))
        return self._next(preparation.candidates(), NOTHING, 0)

    def prepare(self) -> None:
        """What `start` would do, without a first trial: it is in the cache then."""
        self.start(np.random.default_rng(0))

    def adopt(self, genomes: Bits, rng: np.random.Generator) -> TransferState:
        """Another run's genomes are the candidates."""
        if genomes.ndim != 2 or not len(genomes) or genomes.shape[1] != self.genome_length:
            raise ValueError(f"genomes: expected shape (n, {self.genome_length}), got {genomes.shape}")
        return self._next(np.unique(np.asarray(genomes, np.uint8), axis=0), NOTHING, 0)

    def tell(self, state: TransferState, fitness: NDArray[np.float64], rng: np.random.Generator) -> TransferState:
        """What to do after this trial, which took nobody's time."""
        return self.tell_attended(state, fitness, 0.0, rng)

    def tell_attended(
        self, state: TransferState, fitness: NDArray[np.float64], operator_s: float, rng: np.random.Generator
    ) -> TransferState:
        """What to do after this trial."""
        checked = np.asarray(fitness, np.float64)
        if checked.shape != (1,) or not np.isfinite(checked).all():
            raise ValueError(f"fitness: expected one finite number, got {fitness}")
        if state.start is None:
            return replace(state, rounds=max(1, state.rounds - 1))
        more = state.observed.and_one(state.candidate, state.start, float(checked[0]), operator_s)
        return self._next(state.candidates, more, state.inherited)

    def _next(self, candidates: Bits, observed: Observations, inherited: int) -> TransferState:
        """The state after these trials, of which an earlier transfer brought some."""
        prepared = self.prepared_by().prepared(np.ascontiguousarray(candidates))
        if not len(observed):
            check_some_success(prepared.ensemble, self.prepared_by().world.task)
        known = prepared.fitness.condition(observed)
        posterior = known.posterior
        chosen = choose(known, prepared.ensemble.durations_s)
        outlook = _outlook(prepared, observed, posterior, chosen.gain)
        verdict = self._verdict(prepared, outlook, len(observed) - inherited)
        trying = verdict is Verdict.OPEN
        return TransferState.of(
            candidates,
            observed,
            candidate=chosen.candidate if trying else posterior.best,
            start=chosen.start if trying else None,
            recommended=posterior.best,
            ranking=tuple(np.argsort(-posterior.mean, kind="stable")[:RANKED].tolist()),
            outlook=outlook,
            verdict=verdict,
            rounds=1 if verdict is Verdict.NONE_SUCCEEDS else self.rounds,
            inherited=inherited,
        )

    def _verdict(self, prepared: Prepared, outlook: Outlook, own: int) -> Verdict:
        if outlook.most_success is not None and outlook.most_success < EXPECTED and own >= LEAST_TRIALS:
            return Verdict.NONE_SUCCEEDS
        if own >= self.trials:
            return Verdict.TRIALS_DONE
        if own < LEAST_TRIALS:
            return Verdict.OPEN
        if self.target is not None and outlook.fitness - _TRUSTED * outlook.deviation >= self.target:
            return Verdict.TARGET
        if outlook.gain < self.least_gain * prepared.fitness_range:
            return Verdict.ENOUGH
        return Verdict.OPEN

    def prepared_by(self) -> Preparation:
        """What makes candidates and ensemble."""
        if self._preparation is None:
            raise RuntimeError("a transfer that was built for looking at states only cannot go on")
        return self._preparation

    # -- what others want to know -----------------------------------------------------------------------------------

    def wanted(self, state: TransferState, n_trials: int) -> NDArray[np.bool_] | None:
        """The one trial that is next; all of the task's trials when the recommended controller is measured."""
        if state.start is None:
            return None
        wanted = np.zeros((1, n_trials), np.bool_)
        wanted[0, self.prepared_by().world.starts[state.start]] = True
        return wanted

    def is_last(self, state: TransferState) -> bool:
        return state.start is None and state.rounds <= 1

    def heirs(self, state: TransferState) -> Bits:
        """The best candidates, best first."""
        return state.candidates[list(state.ranking)]

    def remark(self, state: TransferState) -> str:
        """Which controller is next, and why."""
        from sceann_hil.run.transfer.words import remark

        return remark(state)

    def structures(self, state: TransferState) -> list[str | None]:
        """Which controller this is, why it is tried, and what is expected."""
        low, high = state.outlook.interval
        told: dict[str, Any] = {
            "candidate": state.candidate,
            "start": state.start,
            "trials": len(state.observed),
            "expected": round(state.outlook.fitness, 6),
            "interval": [round(low, 6), round(high, 6)],
            "gain": round(state.outlook.gain, 8),
            "verdict": state.verdict.value,
            "recommended": genome_to_hex(state.candidates[_best_tried(state)]),
            "why": self.remark(state),
        }
        return [json.dumps(told)]

    def dump(self, state: TransferState) -> bytes:
        return state.dumped()

    def load(self, data: bytes) -> TransferState:
        return TransferState.loaded(data, self.genome_length)


def _outlook(prepared: Prepared, observed: Observations, posterior: Posterior, gain: float) -> Outlook:
    success = most = None
    level = prepared.ensemble.level
    if prepared.success is not None and level is not None:
        succeeded = replace(observed, value=(observed.value >= level).astype(np.float64))
        expected = prepared.success.condition(succeeded).posterior
        success = float(np.clip(expected.mean[posterior.best], 0.0, 1.0))
        most = float(np.clip((expected.mean + _TRUSTED * expected.deviation).max(), 0.0, 1.0))
    best = posterior.best
    return Outlook(float(posterior.mean[best]), float(posterior.deviation[best]), success, most, gain)


def _best_tried(state: TransferState) -> int:
    """The best candidate that this run has measured, or the best of all before there is one."""
    if state.start is None:
        return state.recommended
    tried = set(state.observed.candidate[state.inherited :].tolist())
    return next((k for k in state.ranking if k in tried), state.recommended)
