"""Run a journalled trial again and compare: the proof that a run can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import NotARun
from sceann_hil.journal import AttemptRow, JournalReader, sound_trials, trial_arrays
from sceann_hil.network.coding import Weights
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.network.recompute import recompute
from sceann_hil.robot import EndReason, Results, Robot, Trace, Trials


@dataclass(frozen=True, slots=True)
class Comparison:
    """One quantity of one trial, as journalled and as it came out again."""

    quantity: str
    journalled: object
    replayed: object

    @property
    def equal(self) -> bool:
        """Equal to the last bit."""
        return self.journalled == self.replayed


def journalled_trials(reader: JournalReader, config: ExperimentConfig, attempts: list[AttemptRow]) -> Trials:
    """Attempts of one generation as trials that a robot can run again.

    Args:
        reader: the run's journal.
        config: the run's configuration.
        attempts: of one generation, at least one.
    """
    individuals = reader.individuals(attempts[0].own_generation)
    genomes = np.stack([row.genome_bits(config.genome_length) for row in individuals])
    individual, trial = np.array([(row.individual, row.trial) for row in attempts]).T
    phenotype = config.phenotype
    weights = phenotype.decode(genomes)
    with sound_trials(reader.path):
        starts, keys, ids = trial_arrays(attempts)
        return config.build_task().trials(phenotype, weights, individual, trial, keys, ids, starts=starts)


def trace_from_sensors(reader: JournalReader, attempt: int, weights: Weights, phenotype: Phenotype) -> Trace | None:
    """What happened in a trial that nobody can repeat: journalled sensors, and the neurons computed from them again.

    Args:
        reader: the run's journal.
        attempt: its id.
        weights: of the network that ran, shape ``(n_neurons, n_sources)``.
        phenotype: what the weights are of.

    Returns:
        None if the journal has no sensors of this attempt.
    """
    measured = reader.sensor_trace(attempt)
    if measured is None:
        return None
    sensors, states = measured
    neurons = recompute(weights, phenotype.size, phenotype.dynamics, sensors)
    return Trace(states, sensors, neurons.u, neurons.x)


def sessions_of_another_body(reader: JournalReader, robot: Robot, sessions: set[int | None]) -> list[int]:
    """Those of some sessions that had another simulated body than this one.

    Args:
        reader: the run's journal.
        robot: that is to run them again.
        sessions: their numbers.
    """
    now = robot.body_fingerprint()
    others = {row.id for row in reader.sessions() if row.body is not None and row.body != now}
    return sorted(others & sessions)


def replay(
    reader: JournalReader, config: ExperimentConfig, robot: Robot, attempts: list[AttemptRow]
) -> list[list[Comparison]]:
    """Run attempts of one generation again.

    Args:
        reader: the run's journal.
        config: the run's configuration.
        robot: connected, and deterministic.
        attempts: of one generation, each with a result.

    Returns:
        For each attempt what was compared.

    Raises:
        NotARun: the robot cannot repeat a trial, or an attempt has no result.
    """
    if not robot.spec.deterministic:
        raise NotARun(
            f"the trials of {reader.directory} were measured on {robot.spec.name}, which cannot repeat them.",
            "`sceann status` and the recording show what was measured.",
        )
    for row in attempts:
        if row.end_reason is None or row.fitness is None:
            raise NotARun(f"trial {row.id} of {reader.directory} has no result to compare with.", "")
    trials = journalled_trials(reader, config, attempts)
    results = trials.completed(robot.run(trials))
    task = config.build_task()
    if task.score_by_operator:
        # nobody says it again: what is compared is everything else
        results = replace(results, values=np.array([np.nan if row.value is None else row.value for row in attempts]))
    fitness = task.fitness(results)
    return [
        [
            Comparison("end reason", row.end_reason, EndReason(results.end_reasons[i])),
            Comparison("steps", row.steps, int(results.steps[i])),
            Comparison("neuron states (CRC-16)", row.state_hash, int(results.hashes[i])),
            Comparison("final body state", row.final_state, tuple(results.final_states[i].tolist())),
            *_compared_values(row, results, i),
            Comparison("fitness", row.fitness, float(fitness[i])),
        ]
        for i, row in enumerate(attempts)
    ]


def _compared_values(row: AttemptRow, results: Results, place: int) -> list[Comparison]:
    """What the task added up over the steps, if it does and if the run is not older than that."""
    if results.values is None or row.value is None:
        return []
    return [Comparison("total of the steps' values", row.value, float(results.values[place]))]
