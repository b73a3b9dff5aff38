"""Savings: off they change nothing, exact ones change nothing but the time, and every one survives a resume."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sceann_hil.evolution.sga import SGA, SGAConfig
from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.supervision.saving import Pool, Racing, bounds, raced_fitness, rounds, still_open
from sceann_hil.supervision.stopping import StopRequest
from tests.runs import GOAL, POLE, config_of, contents, evolve, resume

LONG_GOAL = (GOAL, "algorithm.generations=6", "algorithm.population=8", "task.max_steps=120")


def genomes(directory: Path) -> list[tuple[str, ...]]:
    return sqlite3.connect(directory / JOURNAL_NAME).execute("SELECT genome FROM individual ORDER BY id").fetchall()


def count(directory: Path) -> int:
    return int(sqlite3.connect(directory / JOURNAL_NAME).execute("SELECT count(*) FROM attempt").fetchone()[0])


@settings(deadline=None)
@given(
    st.integers(2, 12).flatmap(
        lambda n: st.lists(st.lists(st.integers(0, 4), min_size=5, max_size=5), min_size=n, max_size=n)
    ),
    st.integers(0, 2**32),
)
def test_whatever_the_rest_would_give_the_next_generation_is_the_same(trials: list[list[int]], seed: int) -> None:
    """The proof in `sceann_hil.supervision.saving.racing`, tried on races that are made to end."""
    whole = np.array(trials, np.float64) / 4.0
    # some individuals far apart, so that races do end
    whole[::3] *= 0.1
    seen = np.full_like(whole, np.nan)
    is_open = np.ones(len(whole), np.bool_)
    for trial in range(whole.shape[1]):
        seen[is_open, trial] = whole[is_open, trial]
        is_open &= still_open(seen, 0.0, 1.0, Racing.EXACT)
    raced, full = raced_fitness(seen, 0.0, 1.0, Racing.EXACT), raced_fitness(whole, 0.0, 1.0, Racing.EXACT)
    assert (np.sign(raced[:, None] - raced) == np.sign(full[:, None] - full)).all()
    assert raced.max() == full.max()
    algorithm = SGA(24, SGAConfig(population=len(whole)))
    state = algorithm.start(np.random.default_rng(seed))
    one, other = (algorithm.tell(state, f, np.random.default_rng(seed)) for f in (raced, full))
    assert (one.genomes == other.genomes).all()


def test_an_exact_race_ends_when_the_order_is_settled_and_not_before() -> None:
    values = np.array([[1.0, 1.0, 1.0, 0.7], [0.0, 0.0, 0.0, np.nan], [0.9, 0.9, 0.9, np.nan]])
    assert still_open(values, 0.0, 1.0, Racing.EXACT).tolist() == [False, False, True]
    low, high = bounds(values, 0.0, 1.0)
    assert (low[1], high[1]) == (0.0, 0.25)
    tied = np.array([[0.0, 0.0, 0.0, np.nan], [0.0, 0.0, 0.0, np.nan], [1.0, 1.0, 1.0, 1.0]])
    assert still_open(tied, 0.0, 1.0, Racing.EXACT).tolist() == [True, True, False]


def test_a_run_with_exact_racing_breeds_the_same_genomes(tmp_path: Path) -> None:
    evolve(tmp_path / "plain", *LONG_GOAL)
    evolve(tmp_path / "raced", *LONG_GOAL, "saving.racing=exact")
    assert genomes(tmp_path / "raced") == genomes(tmp_path / "plain")
    assert count(tmp_path / "raced") <= count(tmp_path / "plain")


def test_reuse_on_a_noise_free_task_gives_the_same_run_with_fewer_trials(tmp_path: Path) -> None:
    evolve(tmp_path / "plain", POLE)
    evolve(tmp_path / "reused", POLE, "saving.reuse=true")
    assert contents(tmp_path / "reused")["individual"] == contents(tmp_path / "plain")["individual"]
    assert count(tmp_path / "reused") < count(tmp_path / "plain")
    once = (
        "SELECT count(*) = count(DISTINCT genome || trial) FROM attempt a JOIN individual i "
        "ON i.generation = a.generation AND i.number = a.individual"
    )
    assert sqlite3.connect(tmp_path / "reused" / JOURNAL_NAME).execute(once).fetchone() == (1,)


def test_reuse_does_nothing_where_noise_has_influence(tmp_path: Path) -> None:
    evolve(tmp_path / "plain", GOAL)
    evolve(tmp_path / "reused", GOAL, "saving.reuse=true")
    assert contents(tmp_path / "reused")["attempt"] == contents(tmp_path / "plain")["attempt"]


def test_pooled_fitness_is_the_mean_over_all_attempts_of_a_genome(tmp_path: Path) -> None:
    evolve(tmp_path / "run", *LONG_GOAL, "saving.pool=2")
    db = sqlite3.connect(tmp_path / "run" / JOURNAL_NAME)
    attempts = db.execute(
        "SELECT genome, a.trial, a.generation, count(*) FROM attempt a JOIN individual i "
        "ON i.generation = a.generation AND i.number = a.individual "
        "GROUP BY genome, a.trial, a.generation ORDER BY a.generation"
    ).fetchall()
    so_far: dict[tuple[str, int], int] = {}
    beyond: dict[int, set[str]] = {}
    for genome, trial, generation, n in attempts:
        so_far[genome, trial] = so_far.get((genome, trial), 0) + n
        if so_far[genome, trial] > 2:
            beyond.setdefault(generation, set()).add(genome)
    assert max(so_far.values()) >= 2
    # the best of a generation, and nobody else
    assert all(len(genomes_) == 1 for genomes_ in beyond.values())
    for genome, generation, fitness in db.execute("SELECT genome, generation, fitness FROM individual").fetchall():
        means = db.execute(
            "SELECT avg(a.fitness) FROM attempt a JOIN individual i ON i.generation = a.generation "
            "AND i.number = a.individual WHERE genome = ? AND a.generation <= ? GROUP BY trial",
            (genome, generation),
        ).fetchall()
        assert fitness == pytest.approx(np.mean(means))


def test_shuffled_trials_give_the_same_results_in_another_order(tmp_path: Path) -> None:
    evolve(tmp_path / "plain", GOAL)
    evolve(tmp_path / "shuffled", GOAL, "saving.shuffle=true")
    plain, shuffled = contents(tmp_path / "plain"), contents(tmp_path / "shuffled")
    assert shuffled["individual"] == plain["individual"]
    without_ids = [sorted(row[1:] for row in journal["attempt"]) for journal in (plain, shuffled)]
    assert without_ids[0] == without_ids[1]
    assert shuffled["attempt"] != plain["attempt"]


@pytest.mark.parametrize(
    ("text", "saving"),
    [
        (LONG_GOAL, "{racing: exact}"),
        (LONG_GOAL, "{racing: approximate}"),
        (LONG_GOAL, "{pool: 2}"),
        (LONG_GOAL, "{pool: 1, racing: approximate, shuffle: true}"),
        ((POLE,), "{reuse: true}"),
    ],
)
def test_a_run_that_was_stopped_anywhere_goes_on_as_if_it_had_not(
    text: tuple[str, ...], saving: str, tmp_path: Path
) -> None:
    settings = (*text, f"saving={saving}")
    evolve(tmp_path / "whole", *settings)
    config = config_of(*settings)
    asked = 0

    def stop() -> StopRequest:
        nonlocal asked
        asked += 1
        return StopRequest.NOW if asked % 5 == 0 else StopRequest.NONE

    with Experiment.create(config, tmp_path / "run") as experiment, config.robot.build() as robot:
        outcome = experiment.evolve(robot, stop=stop)
    while outcome is not Outcome.FINISHED:
        with Experiment.open(tmp_path / "run") as experiment, config.robot.build() as robot:
            outcome = experiment.evolve(robot, stop=stop)
    assert resume(tmp_path / "run") is Outcome.FINISHED
    assert contents(tmp_path / "run")["attempt"] == contents(tmp_path / "whole")["attempt"]
    assert contents(tmp_path / "run")["individual"] == contents(tmp_path / "whole")["individual"]


def test_rounds_hold_every_place_once() -> None:
    for by_trial in (False, True):
        for shuffle in (False, True):
            parts = rounds(5, 3, trial_by_trial=by_trial, shuffle=shuffle, root_seed=1, generation=2)
            places = [tuple(place) for part in parts for place in part.tolist()]
            assert sorted(places) == [(i, t) for i in range(5) for t in range(3)]
            assert len(parts) == (3 if by_trial else 1)


def test_a_pool_runs_the_first_of_identical_individuals() -> None:
    pool = Pool(n_trials=2, limit=1, noisy=False)
    same = np.zeros((3, 4), np.uint8)
    assert pool.wanted(same).tolist() == [[True, True], [False, False], [False, False]]
    pool.add(same[0].tobytes(), 0, 0.5, True)
    assert pool.wanted(same).tolist() == [[False, True], [False, False], [False, False]]


def test_the_best_that_is_known_is_run_again_where_it_may_be_luck() -> None:
    genomes_ = np.eye(3, dtype=np.uint8)
    for noisy in (False, True):
        pool = Pool(n_trials=2, limit=1, noisy=noisy)
        for genome, value in zip(genomes_[:2], (0.4, 0.6), strict=True):
            for trial in (0, 1):
                pool.add(genome.tobytes(), trial, value, True)
        assert pool.wanted(genomes_).tolist() == [[False, False], [noisy, noisy], [True, True]]


def test_who_ran_only_the_easy_trials_is_not_taken_for_better() -> None:
    """Regression: a mean over the first, easy trials stood beside means over all of them."""
    easiness = np.array([0.4, 0.4, 0.0, 0.0])
    worth = np.array([0.1, 0.2, 0.3, 0.4, 0.5])
    values = worth[:, None] + easiness
    values[:2, 2:] = np.nan
    fitness = raced_fitness(values, 0.0, 1.0, Racing.APPROXIMATE)
    assert fitness == pytest.approx(worth + easiness.mean(), abs=1e-3)


def test_an_approximate_race_ends_for_the_lower_half_after_half_of_the_trials() -> None:
    rng = np.random.default_rng(1)
    values = np.linspace(0.1, 0.9, 9)[:, None] + rng.normal(0.0, 0.01, (9, 8))
    for done in range(1, 8):
        seen = values.copy()
        seen[:, done:] = np.nan
        is_open = still_open(seen, 0.0, 1.0, Racing.APPROXIMATE)
        if done < 4:
            assert is_open.all()
        else:
            assert is_open[4:].all()
            assert not is_open[:3].any()
