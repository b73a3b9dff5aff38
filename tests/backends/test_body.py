"""Edited code is new code: a body's machine code and fingerprint follow everything that it computes with."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

from backends.cartpole import CartPole, CartPoleConfig
from backends.simulation.engine import SimulatedRobot
from backends.simulation.gap import Gap
from backends.simulation.lanes import RUNNING
from backends.simulation.stepwise import StepwiseBody
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.controller import Dynamics
from sceann_hil.network.neurons import LANES
from sceann_hil.robot import RobotSpec, Trials

HELPER = """
from sceann_hil.network.compiled import compiled_part
FACTOR = {factor}

@compiled_part
def speed(motor):
    return motor * FACTOR{helper}
"""
BODY = """
import numpy as np
import {helper_module}
from {helper_module} import speed
from backends.simulation.engine import SimulatedRobot
from backends.simulation.lanes import RUNNING
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES
from sceann_hil.robot import RobotSpec

OFFSET = {offset}

def made(bonus):
    @compiled_part
    def inner(x):
        return x + bonus
    return inner

add = made({bonus})

@compiled_part
def sense(state, sensors, work, parameters):
    for lane in range(LANES):
        sensors[0, lane] = state[0, lane]

@compiled_part
def advance(state, motors, noise, end_reasons, work, parameters):
    for lane in range(LANES):
        moved = speed(np.float32(1.0)) + {helper_module}.speed(np.float32(0.0))
        state[0, lane] = add(state[0, lane] + moved + OFFSET{body})
        end_reasons[lane] = np.int32(RUNNING)

class Base(SimulatedRobot):
    sense = staticmethod(sense)
    advance = staticmethod(advance)

class Mover(Base):
    @property
    def spec(self):
        return RobotSpec("mover", 1, 1, 0.1, ("x_m",), ("x_m",))
    @property
    def parameters(self):
        return np.zeros(1, np.float32)
"""
PLAIN = {"factor": "2.0", "helper": "", "offset": "0.0", "bonus": "0.0", "body": ""}
EDITS = [{"factor": "3.0"}, {"helper": " * 1.5"}, {"offset": "1.0"}, {"bonus": "1.0"}, {"body": " + 1.0"}]


def _write(folder: Path, name: str, edit: dict[str, str]) -> None:
    filled = {**PLAIN, **edit, "helper_module": f"{name}_helper"}
    (folder / f"{name}_helper.py").write_text(HELPER.format(**filled))
    (folder / f"{name}.py").write_text(BODY.format(**filled))


def _loaded(folder: Path, name: str, edit: dict[str, str]) -> ModuleType:
    _write(folder, name, edit)
    for module in (f"{name}_helper", name):
        sys.modules.pop(module, None)
        for stale in folder.glob(f"__pycache__/{module}.*"):
            stale.unlink()
    importlib.invalidate_caches()
    return importlib.import_module(name)


def _trials(robot: SimulatedRobot, n: int = 1, steps: int = 1) -> Trials:
    spec = robot.spec
    size = NetworkSize(spec.n_sensors, 1, spec.n_motors)
    return Trials(
        size=size,
        dynamics=Dynamics(),
        weights=np.zeros((1, size.n_neurons, size.n_sources), np.int8),
        genome_index=np.zeros(n, np.int32),
        starts=np.zeros((n, len(spec.start_fields))),
        keys=np.zeros(n, np.uint64),
        max_steps=steps,
        ids=np.arange(n),
    )


def _moved(robot: SimulatedRobot) -> float:
    """Where the body is after one step."""
    body = StepwiseBody(robot)
    body.reset(np.zeros(1), np.uint64(0))
    body.sense()
    body.move([0])
    return float(body.state[0])


def _run(robot: SimulatedRobot) -> float:
    """The same by the lane engine."""
    return float(robot.run(_trials(robot)).final_states[0, 0])


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: next(iter(edit)))
def test_an_edited_body_runs_its_new_code(
    edit: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    before = _loaded(tmp_path, "edited_body", {}).Mover()
    assert _moved(before) == 2.0
    after = _loaded(tmp_path, "edited_body", edit).Mover()
    assert _moved(after) == 3.0
    assert before.body_fingerprint() != after.body_fingerprint()
    again = _loaded(tmp_path, "edited_body", {}).Mover()
    assert _moved(again) == 2.0
    assert before.body_fingerprint() == again.body_fingerprint()


def test_a_constant_changed_in_this_process_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    module = _loaded(tmp_path, "notebook_body", {})
    assert _run(module.Mover()) == 2.0
    monkeypatch.setattr(sys.modules["notebook_body_helper"], "FACTOR", 5.0)
    assert _run(module.Mover()) == 5.0


def test_comments_and_names_of_files_do_not_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    before = _loaded(tmp_path, "commented_body", {}).Mover().body_fingerprint()
    source = tmp_path / "commented_body.py"
    source.write_text('"""A body."""\n# and a comment\n' + source.read_text())
    sys.modules.pop("commented_body")
    importlib.invalidate_caches()
    assert importlib.import_module("commented_body").Mover().body_fingerprint() == before


def test_an_edited_body_runs_its_new_code_in_the_next_process(tmp_path: Path) -> None:
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); sys.path.insert(0, sys.argv[2])\n"
        "from tests.backends.test_body import _moved\n"
        "from later_body import Mover\n"
        "print(_moved(Mover()))"
    )
    command = [sys.executable, "-B", "-c", program, str(Path(__file__).parents[2]), str(tmp_path)]
    for edit, expected in ({}, "2.0"), ({"factor": "3.0"}, "3.0"):
        _write(tmp_path, "later_body", edit)
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
        assert done.stdout.strip() == expected


@compiled_part
def _still(
    state: NDArray[np.float32],
    motors: NDArray[np.float32],
    noise: NDArray[np.float32],
    end_reasons: NDArray[np.int32],
    work: NDArray[np.float32],
    parameters: NDArray[np.float32],
) -> None:
    for lane in range(LANES):
        state[0, lane] = state[0, lane] + np.float32(0.25)
        end_reasons[lane] = np.int32(RUNNING)


class StillCart(CartPole):
    advance = staticmethod(_still)


def test_a_subclass_that_overrides_only_advance_is_another_body() -> None:
    shipped, own = CartPole(), StillCart()
    trials = _trials(own, steps=4)
    assert own.run(trials).final_states[0].tolist() == [1.0, 0.0, 0.0, 0.0]
    assert shipped.run(trials).final_states[0, 0] != 1.0
    body = StepwiseBody(own)
    body.sense()
    body.move([512])
    assert body.state.tolist() == [0.25, 0.0, 0.0, 0.0]
    assert shipped.body_fingerprint() != own.body_fingerprint()


def test_parameters_and_tick_are_part_of_the_body() -> None:
    prints = {
        CartPole().body_fingerprint(),
        CartPole(CartPoleConfig(n_sensors=2, tick_s=0.01)).body_fingerprint(),
        CartPole(CartPoleConfig(n_sensors=4)).body_fingerprint(),
    }
    assert len(prints) == 2  # the number of sensors changes what is seen, not how it moves
    assert CartPole().body_fingerprint() == CartPole().body_fingerprint()


# -- start and state fields -------------------------------------------------------------------------------------------


def _plain_sense(state, sensors, work, parameters):  # type: ignore[no-untyped-def]
    for lane in range(LANES):
        sensors[0, lane] = state[0, lane]


def _plain_advance(state, motors, noise, end_reasons, work, parameters):  # type: ignore[no-untyped-def]
    for lane in range(LANES):
        for k in range(state.shape[0]):
            state[k, lane] = state[k, lane] + np.float32(1.0)
        end_reasons[lane] = np.int32(RUNNING)


class Fields(SimulatedRobot):
    """A body of plain functions with fields as given."""

    sense = staticmethod(_plain_sense)
    advance = staticmethod(_plain_advance)

    def __init__(self, start: tuple[str, ...], state: tuple[str, ...]) -> None:
        super().__init__(Gap())
        self._spec = RobotSpec("fields", 1, 1, 0.1, start, state)

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    @property
    def parameters(self) -> NDArray[np.float32]:
        return np.zeros(0, np.float32)


class Derived(Fields):
    def initial_states(self, starts: NDArray[np.float64]) -> NDArray[np.float64]:
        return starts.sum(axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("start", "state", "expected"),
    [(("a",), ("a", "b", "c"), [8.0, 1.0, 1.0]), (("c", "a"), ("a", "b", "c"), [10.0, 1.0, 8.0])],
)
def test_a_body_may_have_more_states_than_start_values(
    start: tuple[str, ...], state: tuple[str, ...], expected: list[float]
) -> None:
    robot, values = Fields(start, state), np.array([7.0, 9.0])[: len(start)]
    trials = _trials(robot)
    object.__setattr__(trials, "starts", values[None])
    results = robot.trace(trials)
    assert results.final_states[0].tolist() == expected
    assert results.traces is not None
    assert results.traces[0].state.shape == (2, 3)
    body = StepwiseBody(robot)
    body.reset(values, np.uint64(0))
    body.sense()
    body.move([0])
    assert body.state.tolist() == expected


def test_a_body_may_have_more_start_values_than_states_if_it_says_what_they_mean() -> None:
    robot = Derived(("a", "b"), ("x",))
    trials = _trials(robot)
    object.__setattr__(trials, "starts", np.array([[2.0, 3.0]]))
    assert robot.run(trials).final_states.tolist() == [[6.0]]
    with pytest.raises(ValueError, match=r"start_fields: fields starts from a, b, which is none of its states x"):
        Fields(("a", "b"), ("x",)).connect()


def test_starts_of_another_number_are_refused_before_compiled_code_sees_them() -> None:
    trials = _trials(Fields(("a", "b"), ("a", "b")))
    with pytest.raises(ValueError, match=r"starts: cartpole starts from 4 values \(x_m, .*\), got 2"):
        CartPole(CartPoleConfig(n_sensors=1 + trials.size.n_sensors)).run(_trials_of_size(trials, NetworkSize(2, 1, 1)))


def _trials_of_size(trials: Trials, size: NetworkSize) -> Trials:
    weights = np.zeros((1, size.n_neurons, size.n_sources), np.int8)
    return Trials(size, trials.dynamics, weights, trials.genome_index, trials.starts, trials.keys, 5, trials.ids)
