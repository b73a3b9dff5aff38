"""The model is the algebra of Gaussian processes, and the choice is the one that brings most."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sceann_hil.run.transfer.choice import choose
from sceann_hil.run.transfer.model import NOTHING, Model, Observations


def some_ensemble(seed: int) -> Model:
    rng = np.random.default_rng(seed)
    fitness = rng.random((30, 20, 3)) + rng.random((30, 1, 1)) * rng.normal(0, 2, (1, 20, 1))
    return Model(fitness.astype(np.float32), 0.01)


def some_trials(seed: int, n: int) -> Observations:
    rng = np.random.default_rng(seed + 1)
    return Observations.of(rng.integers(0, 20, n), rng.integers(0, 3, n), rng.random(n))


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 1000), n=st.integers(1, 25))
def test_mean_and_variance_are_those_of_the_whole_covariance(seed: int, n: int) -> None:
    model, trials = some_ensemble(seed), some_trials(seed, n)
    known = model.condition(trials)
    tau, s = known.likeliest
    k, h = trials.candidate, trials.start
    a = model.a.astype(np.float64)
    rows = a[k, h]
    within = rows @ rows.T + tau**2 * (k[:, None] == k) + s**2 * np.eye(n)
    cross = model.b @ rows.T + tau**2 * (np.arange(20)[:, None] == k)
    mean = model.mu.mean(axis=1) + cross @ np.linalg.solve(within, trials.value - model.mu[k, h])
    variance = (model.b**2).sum(axis=1) + tau**2 - np.einsum("kn,nk->k", cross, np.linalg.solve(within, cross.T))
    got_mean, got_variance = known._given(tau, s)
    np.testing.assert_allclose(got_mean, mean, atol=1e-9)
    np.testing.assert_allclose(got_variance, np.maximum(variance, 1e-12), atol=1e-9)
    options = np.array([0, 5, 7])
    everybody = np.arange(20)
    singles = known.covariance(everybody, options)
    # a candidate's own mean over starts has the variance that the posterior says
    np.testing.assert_allclose(singles.mean(axis=2)[options, np.arange(3)], got_variance[options], atol=1e-6)
    assert (known.trial_variance(options) > 0.0).all()


def test_before_any_trial_the_model_says_what_the_ensemble_says() -> None:
    model = some_ensemble(3)
    posterior = model.condition(NOTHING).posterior
    np.testing.assert_allclose(posterior.mean, model.mu.mean(axis=1))


def test_noise_is_found_in_the_trials_themselves() -> None:
    model = some_ensemble(4)
    rng = np.random.default_rng(0)
    k, h = np.repeat(np.arange(4), 20), np.tile(np.arange(2), 40)
    quiet = Observations.of(k, h, model.mu[k, h] + rng.normal(0, 0.05 * model.spread, 80))
    loud = Observations.of(k, h, model.mu[k, h] + rng.normal(0, 1.5 * model.spread, 80))
    assert model.condition(quiet).likeliest[1] < 0.3 * model.spread
    assert model.condition(loud).likeliest[1] > 0.9 * model.spread


def test_trials_on_a_robot_of_the_ensemble_find_its_best_candidate() -> None:
    rng = np.random.default_rng(7)
    skill = rng.normal(0, 1, (60, 5))
    wants = rng.normal(0, 1, (5, 40, 2))
    fitness = np.einsum("mf,fkh->mkh", skill, wants).astype(np.float32)
    model = Model(fitness[:-1], 0.01)
    truth = fitness[-1].mean(axis=1)
    k: list[int] = []
    h: list[int] = []
    y: list[float] = []
    for _ in range(12):
        chosen = choose(
            model.condition(Observations.of(np.array(k, int), np.array(h, int), np.array(y))), np.ones((40, 2))
        )
        k.append(chosen.candidate)
        h.append(chosen.start)
        y.append(float(fitness[-1, chosen.candidate, chosen.start]))
    best = model.condition(Observations.of(np.array(k), np.array(h), np.array(y))).posterior.best
    assert truth[best] > np.sort(truth)[-3]


def test_of_starts_that_bring_the_same_the_cheapest_is_taken() -> None:
    fitness = np.random.default_rng(1).random((30, 10, 1)).repeat(4, axis=2).astype(np.float32)
    costs = np.tile([5.0, 3.0, 1.0, 4.0], (10, 1))
    assert choose(Model(fitness, 0.01).condition(NOTHING), costs).start == 2


def test_where_a_person_needs_long_a_trial_begins_only_if_it_matters() -> None:
    fitness = np.random.default_rng(1).random((30, 10, 1)).repeat(3, axis=2).astype(np.float32)
    k, h = np.array([7, 8, 9]), np.array([0, 1, 2])
    robot_s = np.tile([2.0, 3.0, 4.0], (10, 1))
    for operator_s, cheapest in (([0.0, 0.0, 0.0], 0), ([60.0, 1.0, 10.0], 1), ([60.0, 30.0, 1.0], 2)):
        seen = Observations.of(k, h, fitness[0, k, h].astype(np.float64), np.array(operator_s))
        assert choose(Model(fitness, 0.01).condition(seen), robot_s).start == cheapest
    # one slow trial proves little
    assert seen.expected_operator_s(4) == pytest.approx(
        [(60 + 91 / 3) / 2, (30 + 91 / 3) / 2, (1 + 91 / 3) / 2, 91 / 3]
    )


def test_when_nothing_is_left_to_learn_a_trial_brings_nothing() -> None:
    model = some_ensemble(5)
    k, h = np.repeat(np.arange(20), 24), np.tile(np.arange(3), 160)
    values = model.mu[k, h] + np.where(k == 3, 5.0, 0.0)
    assert choose(model.condition(Observations.of(k, h, values)), np.ones((20, 3))).gain == pytest.approx(0.0, abs=2e-3)
