"""A whole run without the robot: a simulated body takes its place, a script the operator's.

Everything between them is the real thing: desk, budget, suspenders, journal, and the prompts of an attended robot. Time
is the only thing that is made up: a trial takes no time here, and what robot and person would need is added up. With
its firmware in the loop, on a virtual board of this computer, link and firmware are the real thing too, and trials take
the time that they take.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace

from sceann_hil import registry
from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.plugins import RobotConfig
from sceann_hil.registry import Group
from sceann_hil.robot import EndReason, Results, Robot, RobotSpec, Trials
from sceann_hil.robot.drawing import Drawing
from sceann_hil.supervision.operators import Prompt, Who


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """What is played.

    Attributes:
        config: of the run, with the stand-in's robot section and a script instead of a person.
        robot: the stand-in.
    """

    config: ExperimentConfig
    robot: Robot


class StandIn(Robot):
    """A simulated robot that behaves to the rest as the real one of a configuration: one trial at a time, attended.

    Args:
        body: simulated.
        attended: whether the real one needs a person.
        deterministic: whether the real one can repeat a trial; one that cannot has reference runs.
    """

    def __init__(self, body: Robot, *, attended: bool, deterministic: bool) -> None:
        self._body = body
        name = f"stand-in for the robot ({body.spec.name})"
        self._spec = replace(body.spec, name=name, attended=attended, batch_size=1, deterministic=deterministic)

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    @property
    def drawing(self) -> Drawing | None:
        return self._body.drawing

    def run(self, trials: Trials) -> Results:
        return self._body.run(trials)

    def body_fingerprint(self) -> str | None:
        return self._body.body_fingerprint()

    def connect(self) -> None:
        self._body.connect()

    def interrupt(self, reason: EndReason) -> None:
        """Its trials are over before anybody could."""


@contextmanager
def rehearsal(
    config: ExperimentConfig, body: RobotConfig | None = None, *, firmware: bool = False
) -> Iterator[Rehearsal]:
    """The same run on a stand-in, for as long as the block lasts.

    Args:
        config: of the run that is to be rehearsed.
        body: the simulated robot that stands in; by default the robot itself if it is simulated, the body of its
            configuration (mode hil), or the task's usual one with as many sensors.
        firmware: the robot's firmware takes part, on a virtual board with this body; trials take their time.

    Raises:
        ConfigError: there is no body that fits, or no firmware.
    """
    real = config.robot
    simulated = body or simulated_body(config)
    attended = real.spec.attended or simulated is real
    verdict = "accept 5" if config.build_task().score_by_operator else "accept"
    script = ("ready", verdict) if config.operator.confirm else ("ready",)
    operator = config.operator
    if operator.who != (Who.NONE,):  # a run that asks nobody is rehearsed without anybody
        told = {"who": (Who.SCRIPT,), "script": operator.script or script, "repeat_script": True, "prompt": Prompt.NONE}
        operator = operator.model_copy(update=told)
    with real.on_virtual_board(simulated) if firmware else nullcontext() as twin:
        if firmware and twin is None:
            raise ConfigError(
                f"--firmware: robot {real.type} has no firmware to rehearse.",
                "Leave it out, or name a configuration with a robot of type remote.",
            )
        # a simulated body has no battery that could end, no temperature and no link
        never = {"temperature_c": None} if twin else dict.fromkeys(("battery", "temperature_c", "link_quality"))
        suspenders = config.suspenders.model_copy(update=never)
        checked = config.with_changes(operator=operator, suspenders=suspenders, robot=twin or simulated)
        robot = (
            checked.robot.build()
            if twin
            else StandIn(simulated.build(), attended=attended, deterministic=real.spec.deterministic)
        )
        yield Rehearsal(checked, robot)


def simulated_body(config: ExperimentConfig) -> RobotConfig:
    """The simulated robot of an experiment: its own, the body of its robot, or the task's usual one of its size.

    Raises:
        ConfigError: there is none.
    """
    if (known := config.robot.simulated) is not None:
        return known
    kind = config.task.usual_robot
    if kind is None:
        raise ConfigError(
            f"task {config.task.type}: there is no simulated body to stand in for robot {config.robot.type}.",
            "Name one: a file with a robot section (--body FILE), or with_changes(robot={...}).",
        )
    spec = config.robot.spec
    return registry.load(Group.ROBOTS, kind).model_validate(
        {"type": kind, "n_sensors": spec.n_sensors, "tick_s": spec.tick_s}
    )
