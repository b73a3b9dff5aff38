"""The canonical text: loadable, complete, and the same bytes for the same configuration."""

from __future__ import annotations

from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sceann_hil.config import ControllerConfig, ExperimentConfig, config_difference, dump_config, parse_config
from sceann_hil.network.coding import Coding
from sceann_hil.network.controller import Neuron

pytestmark = pytest.mark.usefixtures("bench")
same_bench = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=200)

numbers = st.floats(allow_nan=False, allow_infinity=False)
probabilities = st.floats(0, 1)
ports = st.text(st.characters(exclude_categories=["Cs"]), max_size=20) | st.sampled_from(
    [
        "yes",
        "null",
        "~",
        "\x85",
        "\u2028",
        "a\n b\n",
        "1e-3",
        "0x1F",
        "0o17",
        "010",
        "1_000",
        "1:30",
        "2024-01-01",
        ".5",
        "",
        "- a",
        "a: b",
        "#",
    ]
)


@st.composite
def configurations(draw: st.DrawFn) -> ExperimentConfig:
    import bench_plugins as bench

    pairs = st.tuples(numbers, numbers)
    ranges = pairs.map(lambda pair: (min(pair), max(pair)))
    spreads = numbers | st.builds(bench.Uniform, uniform=ranges) | st.builds(bench.Normal, normal=pairs)
    return ExperimentConfig(
        name=draw(st.none() | st.from_regex(r"[A-Za-z0-9]([A-Za-z0-9 ._-]{0,78}[A-Za-z0-9])?", fullmatch=True)),
        seed=draw(st.integers(0, 2**63 - 1)),
        task=bench.ReachConfig(
            max_steps=draw(st.integers(1, 10_000)),
            start_m=draw(pairs),
            headings_deg=draw(st.lists(numbers, min_size=1, max_size=8).map(tuple)),
        ),
        robot=bench.RoverConfig(
            n_sensors=draw(st.integers(1, 12)),
            tick_s=draw(st.floats(0, 1, exclude_min=True)),
            attended=draw(st.booleans()),
            port=draw(ports),
            gap=bench.Gap(sensor_offset=draw(spreads), motor_gain=draw(spreads)),
        ),
        controller=ControllerConfig(
            coding=draw(st.sampled_from(Coding)),
            n_hidden=draw(st.integers(0, 9)),
            neuron=draw(st.sampled_from(Neuron)),
            initial_output=draw(probabilities),
        ),
        algorithm=bench.ClimbConfig(elites=draw(st.integers(0, 24)), mutation_rate=draw(st.none() | probabilities)),
    )


@same_bench
@given(st.data())
def test_a_dumped_configuration_loads_equal_and_dumps_to_the_same_bytes(data: st.DataObject) -> None:
    config = data.draw(configurations())
    text = dump_config(config)
    again = parse_config(text, "dump")
    assert again == config
    assert dump_config(again) == text
    assert config_difference(config, again) == []


@same_bench
@given(st.data())
def test_a_plain_yaml_reader_sees_the_same_values(data: st.DataObject) -> None:
    """People open the journal with other tools; most of them read YAML 1.1."""
    config = data.draw(configurations())
    assert yaml.safe_load(dump_config(config)) == config.model_dump(mode="json")


@same_bench
@given(st.data())
def test_overriding_a_key_gives_the_same_as_writing_it(data: st.DataObject) -> None:
    config = data.draw(configurations())
    leaves = [
        ("seed", data.draw(st.integers(0, 2**63 - 1))),
        ("robot.port", data.draw(ports)),
        ("robot.gap.motor_gain", data.draw(numbers)),
        ("task.start_m", data.draw(st.lists(numbers, min_size=2, max_size=2))),
        ("controller.neuron", data.draw(st.sampled_from(list(map(str, Neuron))))),
    ]
    chosen = dict(data.draw(st.lists(st.sampled_from(leaves), unique_by=lambda leaf: leaf[0])))
    overrides = [f"{key}={flow(value)}" for key, value in chosen.items()]
    result = parse_config(dump_config(config), "dump", overrides)
    written = yaml.safe_load(dump_config(config))
    for key, value in chosen.items():
        *sections, last = key.split(".")
        section = written
        for name in sections:
            section = section[name]
        section[last] = value
    assert result.model_dump(mode="json") == written
    assert {difference.key for difference in config_difference(config, result)} <= chosen.keys() | {
        "robot.gap.motor_gain.uniform",
        "robot.gap.motor_gain.normal",
    }


def flow(value: Any) -> str:
    """A value in quotes where it is text, as a careful shell user types it."""
    text: str = yaml.safe_dump(value, default_style='"' if isinstance(value, str) else None, width=2**30)
    return text.removesuffix("\n").removesuffix("\n...")


MINIMAL = """\
task: {type: reach}
robot: {type: rover}
controller: {coding: sceann3, n_hidden: 2}
algorithm: {type: climb}
"""

CANONICAL = """\
name: null
seed: 1
task:
  type: reach
  max_steps: 200
  start_m: [0.0275, 0.0275]
  headings_deg: [0.0, 90.0]
robot:
  type: rover
  n_sensors: 3
  tick_s: 0.1
  attended: false
  port: loop
  gap:
    sensor_offset: 0.0
    motor_gain: 1.0
    latency_steps: 0
controller:
  coding: sceann3
  n_hidden: 2
  neuron: accumulating
  initial_output: 0.5
algorithm:
  type: climb
  population: 25
  generations: 50
  elites: 1
  mutation_rate: null
  step_bits: 1
  tournament: 2
operator:
  who: null
  confirm: true
  prompt: none
  host: 127.0.0.1
  port: 8075
  keys: []
  script: []
  repeat_script: false
budget:
  robot_time: null
  wall_time: null
  trials: null
  battery_charges: null
  whole_generations: false
suspenders:
  battery: null
  temperature_c: null
  link_quality: null
  disk_free_mb: null
  operator_absent_s: null
saving:
  reuse: false
  pool: null
  racing: 'off'
  shuffle: false
reference:
  every: null
  genome: null
  trial: 0
uncertainty:
  robots: 200
  body: null
  task: null
  keys: {}
"""


def test_every_default_is_spelled_out() -> None:
    text = dump_config(parse_config(MINIMAL, "minimal"))
    assert sorted(text.splitlines()) == sorted(CANONICAL.splitlines())


def test_differences_name_keys_and_both_values() -> None:
    before = parse_config(MINIMAL, "minimal")
    after = parse_config(
        MINIMAL,
        "minimal",
        ["controller.n_hidden=3", "task.start_m=[0, 1]", "robot={type: rover, port: 'yes'}"],
    )
    assert [str(difference) for difference in config_difference(before, after)] == [
        "task.start_m: [0.0275, 0.0275] -> [0.0, 1.0]",
        "robot.port: loop -> 'yes'",
        "controller.n_hidden: 2 -> 3",
    ]


def test_differences_show_keys_that_only_one_side_has() -> None:
    before = parse_config(MINIMAL, "minimal")
    after = parse_config(
        MINIMAL, "minimal", ["task={type: stand, max_steps: 200}", "robot.gap.motor_gain={normal: [1, 2]}"]
    )
    assert [str(difference) for difference in config_difference(before, after)] == [
        "task.type: reach -> stand",
        "task.start_m: [0.0275, 0.0275] -> null",
        "task.headings_deg: [0.0, 90.0] -> null",
        "robot.gap.motor_gain: 1.0 -> null",
        "robot.gap.motor_gain.normal: null -> [1.0, 2.0]",
    ]
