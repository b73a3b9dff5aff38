"""Evolving: start a run, go on with a run."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from sceann_hil.commands.arguments import (
    AsJson,
    BudgetRobot,
    BudgetTrials,
    BudgetWall,
    ConfigFile,
    NewRun,
    OperatorOption,
    Overrides,
    RunDirectory,
    Seed,
    more_of,
    operator_override,
    overrides_of,
    print_json,
)
from sceann_hil.commands.printing import print_table
from sceann_hil.commands.progress import show_preparation, show_progress
from sceann_hil.commands.recording import (
    Live,
    Record,
    RecordChoice,
    live_view,
    must_be_watchable,
    recorded,
    watched_live,
)
from sceann_hil.commands.watching import WATCH_S, Watching, WatchSeconds, must_be_a_terminal, watched
from sceann_hil.config import ExperimentConfig, load_config
from sceann_hil.errors import ExitCode, RunExists, RunIsLocked, as_user_error
from sceann_hil.pasting import pasteable
from sceann_hil.run.ancestor import Ancestor, Take
from sceann_hil.run.champion import champion_of
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.operators.staff import staffed_desk
from sceann_hil.supervision.signals import Signals
from sceann_hil.supervision.stopping import StopRequest
from sceann_hil.timespans import duration_text


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(evolve)
    app.command()(resume)


def evolve(
    config: ConfigFile,
    out: NewRun = None,
    seed: Seed = None,
    overrides: Overrides = None,
    ancestor: Annotated[
        Path | None, typer.Option("--from", metavar="RUN", help="Go on from this run's population, on CONFIG's robot.")
    ] = None,
    take: Annotated[
        Take, typer.Option("--take", help="What of that run: its population, or its best.")
    ] = Take.POPULATION,
    record: Record = RecordChoice.ALL,
    live: Live = False,
    watch: Watching = False,
    watch_s: WatchSeconds = WATCH_S,
    operator: OperatorOption = None,
    budget_robot: BudgetRobot = None,
    budget_wall: BudgetWall = None,
    budget_trials: BudgetTrials = None,
    as_json: AsJson = False,
) -> None:
    """Evolve controllers as a configuration says.

    Ctrl-C stops after the current generation, Ctrl-C twice at once; `sceann resume` continues either.

    Example: sceann evolve configs/quickstart.yaml --out runs/first --seed 7

    Example: sceann evolve my_robot.yaml --from runs/first --take population
    """
    settings = load_config(config, [*overrides_of(overrides, seed), *operator_override(operator)])
    more = more_of(budget_robot, budget_wall, budget_trials)
    with new_run(settings, out, config.stem, Ancestor(ancestor, take) if ancestor else None) as experiment:
        run_experiment(experiment, record, live, as_json, watch_s=watch_s if watch else None, more=more)


@contextmanager
def new_run(
    config: ExperimentConfig, out: Path | None, name: str, ancestor: Ancestor | None = None
) -> Iterator[Experiment]:
    """A run that begins in this block; if it cannot begin, nothing is left of it.

    Args:
        config: what it does.
        out: its folder; None for one in ``runs`` that nobody else has.
        name: what such a folder's name begins with.
        ancestor: the run whose population it goes on from.

    Raises:
        RunExists: there is something at `out`.
    """
    with _created(config, out, name, ancestor) as experiment:
        try:
            yield experiment
        except (Exception, KeyboardInterrupt) as error:
            # no robot, no panel, Ctrl-C meanwhile: the same command should work once that is put right
            if as_user_error(error) is not None and experiment.forget():
                Console(stderr=True, highlight=False).print("Nothing was begun; no run was kept.")
            raise


def _created(config: ExperimentConfig, out: Path | None, name: str, ancestor: Ancestor | None) -> Experiment:
    if out is not None:
        return Experiment.create(config, out, ancestor)
    now = f"{name}-{datetime.now().astimezone():%Y%m%d-%H%M%S}"
    number = 1
    while True:
        folder = now if number == 1 else f"{now}-{number}"
        with suppress(RunExists, RunIsLocked):
            return Experiment.create(config, Path("runs") / folder, ancestor)
        # somebody else started in the same second
        number += 1


def resume(
    directory: RunDirectory,
    record: Record = RecordChoice.ALL,
    live: Live = False,
    watch: Watching = False,
    watch_s: WatchSeconds = WATCH_S,
    operator: OperatorOption = None,
    budget_robot: BudgetRobot = None,
    budget_wall: BudgetWall = None,
    budget_trials: BudgetTrials = None,
    accept_versions: Annotated[
        bool, typer.Option("--accept-versions", help="Go on although versions, or the simulated body, are others.")
    ] = False,
    from_generation: Annotated[
        int | None,
        typer.Option(
            "--from-generation", min=0, metavar="N", help="Go back to generation N; the journal of before is kept."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Go on with a run that was stopped, paused or killed, or whose budget was spent.

    Example: sceann resume runs/first --budget-robot 2h
    """
    more = more_of(budget_robot, budget_wall, budget_trials)
    with Experiment.open(
        directory, accept_other_versions=accept_versions, from_generation=from_generation
    ) as experiment:
        run_experiment(
            experiment, record, live, as_json, watch_s=watch_s if watch else None, operator=operator, more=more
        )


def run_experiment(
    experiment: Experiment,
    record: RecordChoice,
    live: bool,
    as_json: bool,
    *,
    watch_s: float | None = None,
    operator: str | None = None,
    more: dict[str, float] | None = None,
) -> None:
    """Run an experiment from wherever it stands, with all that a person sees of it; leaves with an exit code.

    Args:
        experiment: what is run.
        record: which trials go to the viewer.
        live: the viewer shows what happens.
        as_json: standard output gets a document instead of a table.
        watch_s: the best of every generation is shown again, for so many seconds at most; None for no such thing.
        operator: who stands beside the robot, if it is somebody else than the configuration says.
        more: what this session may spend.
    """
    console = Console(stderr=True, highlight=False)
    if watch_s is not None:
        must_be_a_terminal(console)
    settings = experiment.config.operator
    if operator is not None:
        settings = experiment.config.with_changes(settings=operator_override(operator)).operator
    with show_preparation(console) as preparing:
        experiment.config.algorithm.prepare(experiment.config, preparing)
    robot = experiment.config.robot.build()
    if live:
        must_be_watchable(robot, again=watch_s is not None)
    with ExitStack() as connected:
        # entered first, so left last: the robot is let go before anybody waits for recordings
        connected.enter_context(recorded(console, experiment.directory, record))
        with console.status(f"Getting {robot.spec.name} ready (compiled once, which takes some seconds)..."):
            connected.enter_context(robot)
        show, viewer = partial(_show, console), None
        if live and robot.spec.batch_size == 1:
            connected.enter_context(watched_live(robot, experiment.directory, show))
        elif live:
            viewer = connected.enter_context(live_view(experiment.directory, show))
        started = time.monotonic()
        last = experiment.config.algorithm.generations
        signals = Signals(show, first=StopRequest.AFTER_GENERATION, soon=lambda: _soon(desk))
        with (
            signals.watched(),
            staffed_desk(robot, settings, show, signals.request) as desk,
            watched(
                experiment.directory, console, signals.request, watch_s, own_keys=not desk.asks, viewer=viewer
            ) as watch,
            show_progress(
                console,
                last,
                desk,
                by_trial=robot.spec.batch_size == 1,
                picture=watch.picture if watch is not None else None,
            ) as report,
        ):
            signals.guard(robot, desk)
            if watch is None:
                outcome = experiment.evolve(robot, report, signals.request, desk, more)
            else:
                outcome = experiment.evolve(robot, watch.after(report), watch.request, desk, more)
        evolved_s = time.monotonic() - started
        if outcome in (Outcome.TERMINATED, Outcome.HUNG_UP):
            # whoever asks for the end waits for no recordings
            raise typer.Exit(_EXIT_CODES[outcome])
    summary = _summary(experiment, outcome, evolved_s)
    conclusion = _conclusion(experiment)
    if as_json:
        print_json(summary if conclusion is None else {**summary, "conclusion": conclusion.document})
    else:
        _print_summary(Console(highlight=False), summary, record)
        for line in conclusion.lines if conclusion is not None else ():
            Console(highlight=False).print(line, markup=False, soft_wrap=True)
    if outcome in _EXIT_CODES:
        raise typer.Exit(_EXIT_CODES[outcome])


_EXIT_CODES = {
    Outcome.STOPPED_AFTER_GENERATION: ExitCode.INTERRUPTED,
    Outcome.STOPPED_NOW: ExitCode.INTERRUPTED_NOW,
    Outcome.FINISHED_BY_OPERATOR: ExitCode.OPERATOR_FINISHED,
    Outcome.BUDGET_SPENT: ExitCode.BUDGET_SPENT,
    Outcome.TERMINATED: ExitCode.TERMINATED,
    Outcome.HUNG_UP: ExitCode.HUNG_UP,
}


def _conclusion(experiment: Experiment) -> Any:
    """What the algorithm has to say of the run so far, if it has anything to say."""
    where = experiment.config.algorithm.conclusion
    if where is None or not experiment.journal.reader.generations(finished=True):
        return None
    module, _, function = where.partition(":")
    return getattr(import_module(module), function)(experiment.directory)


def _soon(desk: Desk) -> str:
    """What the first Ctrl-C waits for, and how long."""
    status = desk.view().status
    left = status.todo - status.done
    took = f", about {duration_text(status.todo_s)}" if status.todo_s and status.todo_s >= 1.0 else ""
    return f"Stopping after this generation ({left} of its {status.todo} trials are left{took})."


def _show(console: Console, text: str) -> None:
    console.print(text, markup=False, soft_wrap=True)


def _summary(experiment: Experiment, outcome: Outcome, evolved_s: float) -> dict[str, Any]:
    reader = experiment.journal.reader
    champion = champion_of(reader, keeps_best=experiment.config.algorithm.keeps_best)
    generations = reader.generations(finished=True)
    return {
        "directory": str(experiment.directory),
        "outcome": outcome.name.lower(),
        "generations": len(generations),
        "trials": reader.count_attempts(),
        "evolved_s": round(evolved_s, 3),
        "why_stopped": "" if outcome is Outcome.FINISHED else reader.events()[-1][3],
        "champion": None
        if champion is None
        else {
            "individual": champion.id,
            "generation": champion.generation,
            "number": champion.number,
            "fitness": champion.fitness,
            "genome": champion.genome,
            "success_rate_of_its_generation": generations[-1].success_rate,
        },
    }


def _place_of(champion: dict[str, Any]) -> str:
    return f"generation {champion['generation']}, individual {champion['number']}"


def _print_summary(console: Console, summary: dict[str, Any], record: RecordChoice) -> None:
    directory, champion = summary["directory"], summary["champion"]
    table = Table(show_header=False)
    table.add_row("generations", f"{summary['generations']}")
    table.add_row("trials", f"{summary['trials']} in {summary['evolved_s']:.1f} s")
    if champion:
        table.add_row("best fitness", f"[bold]{champion['fitness']:.4g}[/] ({_place_of(champion)})")
        table.add_row("its genome", champion["genome"])
    print_table(console, f"Run {directory}: {summary['outcome'].replace('_', ' ')}", table)
    follow = ["status"] if summary["outcome"] == "finished" else ["resume", "status"]
    follow += [] if record is RecordChoice.NONE else ["view"]
    reason = summary["why_stopped"]
    if reason:
        console.print(f"{reason}.", soft_wrap=True)
    for command in follow:
        console.print(f"  sceann {command} {pasteable(directory)}", markup=False, soft_wrap=True)
