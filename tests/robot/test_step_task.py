"""Fitness over a trial: one formula, the same bits from the simulation's loop and from the steps that a robot told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from backends.cartpole import CartPole
from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from backends.simulation.gap import Gap, Spread
from sceann_hil.errors import PluginError
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import EndReason, Results, Trials
from sceann_hil.robot.accumulation import Combine
from sceann_hil.robot.step_task import StepTask
from sceann_hil.robot.step_value import max_of, mean_of, min_of, sqrt, step_value, sum_of

Floats = NDArray[np.float64]
FIELDS = ("x_m", "y_m", "heading_rad")
STARTS = np.array([[0.1, 0.1, 0.0], [0.3, 0.3, 1.0], [0.5, 0.1, 3.0]])
FIVE = DifferentialDriveConfig(n_sensors=5)
GAP = Gap(sensor_noise=Spread(0.02), motor_gain=Spread(0.9, half_width=0.1), latency_steps=Spread(1.0))


@step_value
def avoid(sensors: Floats, motors: Floats, state: Floats) -> float:
    left, right = motors[0], motors[1]
    return 0.5 * (left + right) * (1 - sqrt(abs(left - right))) * (1 - max_of(sensors))  # type: ignore[no-any-return]


@step_value
def centre(sensors: Floats, motors: Floats, state: Floats) -> float:
    return -((state[0] - 0.3) ** 2) - np.sin(state[2]) * min_of(motors) + sum_of(sensors) + mean_of(sensors)  # type: ignore[no-any-return]


@step_value
def speed(sensors: Floats, motors: Floats) -> float:
    return motors[0] + motors[1]  # type: ignore[no-any-return]


@step_value
def sees(sensors: Floats, motors: Floats, state: Floats) -> float:
    return max_of(sensors) > 0.0


VALUES = [avoid, centre, speed]


def _task(value: Any, combine: str = "mean", **more: Any) -> StepTask:
    return StepTask(value=value, combine=combine, max_steps=60, start_fields=FIELDS, starts=STARTS, **more)


def _trials(task: StepTask, robot: DifferentialDrive, n: int = 40) -> Trials:
    size = NetworkSize(robot.spec.n_sensors, 2, 2)
    phenotype = Phenotype(Coding.SCEANN3, size, Dynamics())
    rng = np.random.default_rng(5)
    weights = phenotype.decode(rng.integers(0, 2, (n, phenotype.genome_length), np.uint8))
    noise = rng.integers(0, 2**64, (n, 3), np.uint64)
    return task.trials(phenotype, weights, np.arange(n)[:, None], np.arange(3), noise)


@pytest.mark.parametrize("combine", Combine)
@pytest.mark.parametrize("value", VALUES, ids=lambda value: value.function.__name__)
def test_the_loop_and_the_trace_give_the_same_bits(value: Any, combine: str) -> None:
    robot = DifferentialDrive(FIVE, gap=GAP)
    trials = _trials(_task(value, combine), robot)
    run, traced = robot.run(trials), robot.trace(trials)
    assert run.values is not None
    assert traced.values is not None
    again = trials.completed(replace(traced, values=None))
    assert again.values is not None
    assert run.values.tobytes() == traced.values.tobytes() == again.values.tobytes()
    assert len(set(run.values.tolist())) > 10


def test_the_value_of_a_step_is_what_its_author_wrote_of_what_the_controller_saw_and_asked_for() -> None:
    robot = DifferentialDrive(FIVE, gap=GAP)
    for value in VALUES:
        task = _task(value, "sum")
        trials = _trials(task, robot, 2)
        results = robot.trace(trials)
        assert results.traces is not None
        assert results.values is not None
        for i, trace in enumerate(results.traces):
            expected = [
                value(wire / 1023.0, x[-2:] / 1024.0, state.astype(np.float64))
                for wire, x, state in zip(trace.sensors, trace.x, trace.state[:-1], strict=True)
            ]
            assert task.accumulation is not None
            np.testing.assert_allclose(task.accumulation.of_steps(trace, 2), expected, rtol=1e-12)
            np.testing.assert_allclose(results.values[i], np.sum(expected), rtol=1e-9)


def test_nothing_else_of_a_trial_changes_and_batches_and_threads_do_not_matter() -> None:
    alone, many = (
        DifferentialDrive(FIVE, gap=GAP, threads=1),
        DifferentialDrive(FIVE, gap=GAP, threads=3),
    )
    trials = _trials(_task(avoid), alone, 120)
    with_values, without = alone.run(trials), alone.run(replace(trials, accumulation=None))
    assert without.values is None
    for name in ("end_reasons", "steps", "hashes", "final_states"):
        assert np.array_equal(getattr(with_values, name), getattr(without, name))
    threaded, single = many.run(trials).values, alone.run(trials.take(slice(77, 78))).values
    assert threaded is not None
    assert with_values.values is not None
    assert single is not None
    assert threaded.tobytes() == with_values.values.tobytes()
    assert single[0] == with_values.values[77]


def test_mean_divides_by_the_steps_that_the_trial_lasted() -> None:
    robot = DifferentialDrive(FIVE)
    mean, total = _task(speed, "mean"), _task(speed, "sum")
    results = robot.run(_trials(total, robot))
    assert len(set(results.steps.tolist())) > 1
    np.testing.assert_array_equal(mean.fitness(results), total.fitness(results) / results.steps)


def test_success_is_a_question_about_fitness() -> None:
    robot = DifferentialDrive(FIVE)
    task = _task(speed, succeeded=lambda fitness: fitness > 1.0)
    results = robot.run(_trials(task, robot))
    assert np.array_equal(task.succeeded(results), task.fitness(results) > 1.0)
    assert not _task(speed).succeeded(results).any()


# -- steps that are not all known --------------------------------------------------------------------------------------


def _told(value: Any, n_state: int = 3) -> tuple[Trials, Results]:
    robot = DifferentialDrive(FIVE)
    trials = _trials(_task(value), robot, 1)
    results = replace(robot.trace(trials), values=None)
    if n_state == 0:
        assert results.traces is not None
        traces = [replace(trace, state=trace.state[:, :0]) for trace in results.traces]
        results = replace(results, traces=traces)
    return trials, results


def test_a_trial_whose_steps_are_not_all_known_is_void() -> None:
    trials, results = _told(avoid)
    assert results.traces is not None
    shorter = [replace(results.traces[0], sensors=results.traces[0].sensors[:-1]), *results.traces[1:]]
    completed = trials.completed(replace(results, traces=shorter))
    assert completed.counts.tolist() == [False, True, True]
    assert trials.completed(replace(results, traces=None)).counts.tolist() == [False] * 3


def test_a_void_trial_stays_void_for_its_own_reason() -> None:
    trials, results = _told(avoid)
    results.end_reasons[1] = EndReason.BATTERY
    assert trials.completed(results).end_reasons[1] == EndReason.BATTERY


def test_a_robot_that_does_not_know_its_state_does_for_a_value_that_does_not_use_it() -> None:
    trials, results = _told(avoid, n_state=0)
    assert trials.completed(results).counts.all()
    trials, results = _told(centre, n_state=0)
    assert not trials.completed(results).counts.any()


# -- faults of the author ----------------------------------------------------------------------------------------------


def _nan(sensors: Floats, motors: Floats, state: Floats) -> float:
    return np.nan


def _divides(sensors: Floats, motors: Floats, state: Floats) -> float:
    return motors[0] / (motors[0] + motors[1])  # type: ignore[no-any-return]


def _reads_too_far(sensors: Floats, motors: Floats, state: Floats) -> float:
    return sensors[5]  # type: ignore[no-any-return]


def _is_no_number(sensors: Floats, motors: Floats, state: Floats) -> Any:
    return {"speed": motors[0]}


def _cannot_be_compiled(sensors: Floats, motors: Floats, state: Floats) -> float:
    return float(np.gradient(sensors)[0])


def _root_of_less_than_nothing(sensors: Floats, motors: Floats, state: Floats) -> float:
    return sqrt(motors[0] - 0.5)


def _returns_nothing(sensors: Floats, motors: Floats, state: Floats) -> Any:
    if motors[0] > 0.5:
        return sensors[0]
    return None


def _is_complex(sensors: Floats, motors: Floats, state: Floats) -> Any:
    return 1j * sensors[0]


def _changes_what_it_is_given(sensors: Floats, motors: Floats, state: Floats) -> float:
    sensors[0] = 0.5
    return max_of(sensors)


def _throws_dice(sensors: Floats, motors: Floats, state: Floats) -> float:
    return float(np.random.random())  # noqa: NPY002 - the fault that is tried


FAULTS = [
    (_returns_nothing, r"expected one number for a step, got nothing \(None\)"),
    (_is_complex, r"expected one number for a step, got complex"),
    (_changes_what_it_is_given, r"ValueError in line \d+ \(sensors\[0\] = 0\.5\): assignment destination is read-only"),
    (_throws_dice, r"expected the same value for the same step"),
    (_nan, r"got nan with sensors \[0, 0, 0, 0, 0\]"),
    (_divides, r"invalid value .*|FloatingPointError in line \d+ \(return motors\[0\] / "),
    (_reads_too_far, r"IndexError in line \d+ \(return sensors\[5\]"),
    (_is_no_number, r"expected one number for a step, got dict"),
    (_cannot_be_compiled, r"cannot be compiled"),
    (_root_of_less_than_nothing, r"ValueError in line \d+ \(return sqrt\(motors\[0\] - 0\.5\)"),
]


@pytest.mark.parametrize(("function", "message"), FAULTS, ids=lambda value: getattr(value, "__name__", ""))
def test_a_fault_in_the_value_is_told_with_file_and_line_before_anything_runs(
    function: Callable[..., float], message: str
) -> None:
    with pytest.raises(PluginError, match=message) as caught:
        _task(step_value(function)).check_robot(DifferentialDrive(FIVE).spec)
    assert f"{function.__name__} ({__file__}, line {function.__code__.co_firstlineno})" in str(caught.value)


def test_a_value_may_be_true_or_false() -> None:
    robot, task = DifferentialDrive(FIVE), _task(sees, "sum")
    task.check_robot(robot.spec)
    results = robot.trace(_trials(task, robot, 2))
    assert results.traces is not None
    assert results.values is not None
    assert results.values.tolist() == [trace.sensors.any(axis=1).sum() for trace in results.traces]


def test_the_same_value_is_fine_on_a_robot_that_has_the_sensor() -> None:
    _task(step_value(_reads_too_far)).check_robot(DifferentialDrive(DifferentialDriveConfig(n_sensors=6)).spec)


def test_a_value_that_uses_the_state_is_refused_on_a_robot_that_does_not_know_it() -> None:
    blind = replace(DifferentialDrive(FIVE).spec, state_fields=(), name="blind")
    _task(avoid).check_robot(blind)
    with pytest.raises(PluginError, match="reads the body's state, which the robot blind does not know"):
        _task(centre).check_robot(blind)
    assert [value.uses_state for value in VALUES] == [False, True, False]


def _knots(sensors: Floats) -> float:
    return 0.0


def _late(sensors: Floats, motors: Floats, state: Floats) -> float:
    # unlike any step that is tried beforehand
    return np.log(0.5 - abs(state[0]))  # type: ignore[no-any-return]


def test_no_fitness_is_made_of_a_step_that_is_worth_no_number() -> None:
    robot = DifferentialDrive(FIVE)
    task = replace_starts(_task(step_value(_late)), [[0.3, 0.3, 0.0], [0.5, 0.3, 0.0], [0.1, 0.1, 0.0]])
    trials = replace(_trials(task, robot, 1), ids=np.array([41, 42, 43]))
    with pytest.raises(PluginError, match=r"_late .* trial 42 add up to -?(nan|inf); step 0 is worth -?(nan|inf)"):
        robot.run(trials)


def replace_starts(task: StepTask, starts: list[list[float]]) -> StepTask:
    """The same task, begun elsewhere."""
    task._starts = np.array(starts)
    return task


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: step_value(float), "expected a function of sensors, motors and state"),
        (lambda: step_value(_knots), "expected the arguments sensors, motors and state, got sensors"),
        (lambda: _task(_nan), "expected a function made by step_value"),
        (lambda: _task(avoid, "median"), "combine: expected mean, mean_of_all, sum, min, max, last, got 'median'"),
    ],
)
def test_a_task_that_cannot_be_meant_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(PluginError, match=message):
        make()


def test_a_robot_of_other_start_fields_is_refused() -> None:
    with pytest.raises(ValueError, match="the task avoid starts its trials from x_m, y_m, heading_rad, but the robot"):
        _task(avoid).check_robot(CartPole().spec)


@pytest.mark.parametrize("combine", Combine)
def test_the_fitness_so_far_ends_at_the_fitness(combine: str) -> None:
    robot, task = DifferentialDrive(FIVE), _task(speed, combine)
    trials = _trials(task, robot, 1)
    results = robot.trace(trials)
    assert results.traces is not None
    assert task.accumulation is not None
    for i, trace in enumerate(results.traces):
        values = task.accumulation.of_steps(trace, 2)
        so_far = task.accumulation.so_far(values)
        assert so_far[-1] == task.fitness(results)[i]
        assert so_far[0] == (values[0] / task.max_steps if combine == Combine.MEAN_OF_ALL else values[0])


def _too_far_when_bright(sensors: Floats, motors: Floats, state: Floats) -> float:
    # a step that is tried beforehand has no such sensors
    return sensors[7] if 0.2 < sensors[0] < 0.3 else motors[0]  # type: ignore[no-any-return]


def test_a_rare_step_that_reads_too_far_is_no_fitness_either() -> None:
    robot = DifferentialDrive(FIVE)
    task = _task(step_value(_too_far_when_bright))
    task.check_robot(robot.spec)
    trials = _trials(task, robot)
    with pytest.raises(PluginError, match=r"_too_far_when_bright .* that the robot does not have"):
        robot.run(trials)
    traced = robot.trace(replace(trials, accumulation=None))
    with pytest.raises(PluginError, match=r"_too_far_when_bright .* that the robot does not have"):
        trials.completed(traced)
