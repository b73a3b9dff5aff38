"""Work on a robot for a run: who is present and what may be spent, and the trial runner that obeys them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace

from sceann_hil.config import ExperimentConfig
from sceann_hil.journal import Journal, JournalReader, SpentRow
from sceann_hil.robot import Robot
from sceann_hil.robot.task import Task
from sceann_hil.run.trial_runner import TrialRunner
from sceann_hil.supervision.budget import Amounts, Meter
from sceann_hil.supervision.forecast import Forecast
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.stopping import StopRequest, nobody
from sceann_hil.supervision.supervisor import RunFacts, Supervisor
from sceann_hil.supervision.suspension import Suspension


@dataclass(frozen=True, slots=True)
class Presence:
    """Who is there while a robot works, and what it may cost.

    Attributes:
        desk: where the operators are; nobody by default.
        stop: what somebody outside wants; asked before every batch of trials.
        more: what this session may spend on top of what is spent, by names of `Amounts`; if nothing is asked for, the
            limits of the session before with the same robot hold, or, in the first one, those of the configuration.
    """

    desk: Desk | None = None
    stop: Callable[[], StopRequest] = nobody
    more: dict[str, float] = field(default_factory=dict)


def begin_session(
    journal: Journal,
    config: ExperimentConfig,
    robot: Robot,
    forecast: Forecast,
    presence: Presence,
    task: Task | None = None,
) -> TrialRunner:
    """Begin to work; nothing has moved yet when this returns.

    Args:
        journal: open for writing; the caller holds the run's lock.
        config: what is done: task, controller, operators, suspenders, budget.
        robot: connected.
        forecast: when the work will end.
        presence: who is there.
        task: what is done, if it is not the configuration's task.

    Raises:
        ConfigError: a suspender would never see its value.
    """
    task, spec = task or config.build_task(), robot.spec
    desk = presence.desk or Desk(asks=False, stop=presence.stop)
    suspension = Suspension(config.suspenders.build(), robot, desk, journal.reader.directory)
    suspension.check()
    limits = limits_of(journal.reader, config, spec.name, presence.more)
    meter = Meter(limits, amounts(journal.reader.spent(spec.name)), task.max_steps * spec.tick_s)
    finite = {name: None if value == float("inf") else value for name, value in asdict(limits).items()}
    operators = config.operator.resolved(attended=spec.attended)
    journal.begin_session(spec.name, ", ".join(operators) or "none", finite, body=robot.body_fingerprint())
    supervisor = Supervisor(
        robot,
        journal,
        desk,
        meter,
        forecast,
        suspension,
        RunFacts(journal.reader.run().name, task, config.algorithm.generations),
        stop=presence.stop,
        confirm=config.operator.confirm,
        whole_generations=config.budget.whole_generations,
    )
    return TrialRunner(config.phenotype, task, robot, journal, supervisor)


def limits_of(reader: JournalReader, config: ExperimentConfig, robot: str, more: dict[str, float]) -> Amounts:
    """What may be spent with a robot, over all sessions of a run.

    Args:
        reader: the run's journal.
        config: for the first session.
        robot: its name.
        more: see `Presence`.
    """
    known = reader.limits(robot)
    limits = config.budget.limits
    if known is not None:
        limits = Amounts(**{name: float("inf") if value is None else value for name, value in known.items()})
    spent = amounts(reader.spent(robot))
    return replace(limits, **{name: getattr(spent, name) + amount for name, amount in more.items()})


def amounts(spent: SpentRow) -> Amounts:
    """What the journal says is spent, as amounts."""
    return Amounts(spent.robot_s, spent.wall_s, float(spent.trials), spent.battery_charges)
