"""What every task must do: a trial is worth the same alone, in a batch, and when the journal tells of it later."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace

import numpy as np

from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.plugins import RobotConfig, TaskConfig
from sceann_hil.robot import EndReason, Results, Trials
from sceann_hil.robot.task import Task
from sceann_hil.testing.checks import check


class TaskConformance(ABC):
    """Derive from it, name the class ``Test...``, and say which task is meant, and a simulated robot that can do it.

    Attributes:
        n_individuals: how many random networks do all trials of the task.
    """

    n_individuals: int = 12

    @abstractmethod
    def config(self) -> TaskConfig:
        """The task's configuration. Called once or more in every test."""

    @abstractmethod
    def robot(self) -> RobotConfig:
        """A simulated robot for it."""

    # -- what a trial is --------------------------------------------------------------------------------------------

    def test_the_task_and_its_robot_go_together(self) -> None:
        """Starts are rows of numbers, one for each trial, and mean what the robot's start values mean."""
        self.config().check(self.robot())
        task = self._task()
        task.check_robot(self.robot().spec)
        check(task.n_trials == len(task.starts), "n_trials: expected one for each row of starts")
        check(bool(task.name), "name: expected a word for messages")
        check(task.worst_fitness < task.best_fitness, "best_fitness: expected more than worst_fitness")

    def test_a_robot_that_starts_from_other_values_is_refused(self) -> None:
        """By a ValueError, before anything moves."""
        spec = replace(self.robot().spec, start_fields=("something_else",))
        try:
            self._task().check_robot(spec)
        except ValueError:
            return
        check(False, "check_robot: expected a ValueError for a robot that starts from something else")

    def test_it_says_what_a_person_has_to_do_before_each_trial(self) -> None:
        """A sentence for each."""
        task = self._task()
        for trial in range(task.n_trials):
            words = task.instruction(trial)
            check(isinstance(words, str) and bool(words.strip()), f"instruction({trial}): expected a sentence")

    def test_the_same_configuration_gives_the_same_task(self) -> None:
        """Or a run could not be resumed."""
        a, b = self._task(), self._task()
        check(np.array_equal(a.starts, b.starts), "starts: they differ between two builds")
        check((a.max_steps, a.start_fields) == (b.max_steps, b.start_fields), "the task differs between two builds")

    # -- what it is worth -------------------------------------------------------------------------------------------

    def test_fitness_is_one_number_within_its_limits_for_each_trial(self) -> None:
        """And success one truth value."""
        task, _, results = self._run()
        fitness, succeeded = np.asarray(task.fitness(results)), np.asarray(task.succeeded(results))
        n = len(results)
        check(fitness.shape == (n,), f"fitness: expected shape ({n},), got {fitness.shape}")
        check(fitness.dtype == np.float64, f"fitness: expected float64, got {fitness.dtype}")
        check(bool(np.isfinite(fitness).all()), "fitness: expected numbers")
        low, high = task.worst_fitness, task.best_fitness
        check(bool((fitness >= low).all()), f"fitness: expected at least worst_fitness {low}, got {fitness.min()}")
        check(bool((fitness <= high).all()), f"fitness: expected at most best_fitness {high}, got {fitness.max()}")
        check(succeeded.shape == (n,), f"succeeded: expected shape ({n},), got {succeeded.shape}")
        check(succeeded.dtype == np.bool_, f"succeeded: expected truth values, got {succeeded.dtype}")

    def test_a_trial_is_worth_the_same_alone(self) -> None:
        """Nothing of one trial's worth comes from another's."""
        task, _, results = self._run()
        together, reached = task.fitness(results), task.succeeded(results)
        for i in range(len(results)):
            one = _part(results, i)
            check(bool(task.fitness(one)[0] == together[i]), f"fitness: trial {i} is worth something else alone")
            check(bool(task.succeeded(one)[0] == reached[i]), f"succeeded: trial {i} says something else alone")

    def test_a_trial_is_worth_the_same_when_the_journal_tells_of_it(self) -> None:
        """The journal keeps the result and the total of the steps, no traces: a run is resumed from that."""
        task, trials, _ = self._run()
        with self.robot().build() as robot:
            traced = trials.completed(robot.trace(trials))
        journalled = replace(traced, traces=None)
        check(np.array_equal(task.fitness(traced), task.fitness(journalled)), "fitness: it needs the traces")
        check(np.array_equal(task.succeeded(traced), task.succeeded(journalled)), "succeeded: it needs the traces")

    def test_the_steps_that_a_robot_tells_of_are_worth_the_same_as_in_simulation(self) -> None:
        """For a task that adds something up; nothing to do for others."""
        task, trials, results = self._run()
        if trials.accumulation is None:
            return
        with self.robot().build() as robot:
            told = trials.completed(replace(robot.trace(trials), values=None))
        check(np.array_equal(task.fitness(told), task.fitness(results)), "fitness: the steps give other bits")

    def test_a_void_trial_does_no_harm(self) -> None:
        """Its fitness has no meaning, but asking for it must not fail, and it is never a success."""
        task = self._task()
        void = Results.void(3, EndReason.LINK_LOST, len(self.robot().spec.state_fields))
        check(np.asarray(task.fitness(void)).shape == (3,), "fitness: expected one value for each void trial too")
        succeeded = np.asarray(task.succeeded(void))
        check(succeeded.shape == (3,) and not succeeded.any(), "succeeded: a void trial is no success")

    # -- tools ------------------------------------------------------------------------------------------------------

    def _task(self) -> Task:
        return self.config().build_for(self.robot())

    def _run(self) -> tuple[Task, Trials, Results]:
        task, spec = self._task(), self.robot().spec
        phenotype = Phenotype(Coding.SCEANN3, NetworkSize(spec.n_sensors, 1, spec.n_motors), Dynamics())
        rng, n = np.random.default_rng(7), self.n_individuals
        weights = phenotype.decode(rng.integers(0, 2, (n, phenotype.genome_length), np.uint8))
        noise = rng.integers(0, 2**64, (n, task.n_trials), np.uint64)
        trials = task.trials(phenotype, weights, np.arange(n)[:, None], np.arange(task.n_trials), noise)
        with self.robot().build() as robot:
            results = trials.completed(robot.run(trials))
        check(bool(results.counts.all()), "the simulated robot's trials: expected all to count")
        return task, trials, results


def _part(results: Results, i: int) -> Results:
    part = slice(i, i + 1)
    return Results(
        end_reasons=results.end_reasons[part],
        steps=results.steps[part],
        hashes=results.hashes[part],
        final_states=results.final_states[part],
        durations_s=results.durations_s[part],
        values=None if results.values is None else results.values[part],
    )
