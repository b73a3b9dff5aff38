"""Simulation against robot: the same genomes here and there, one genome again and again, and drift."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from sceann_hil.commands.arguments import (
    AsJson,
    BudgetRobot,
    BudgetTrials,
    BudgetWall,
    Genome,
    OperatorOption,
    RunDirectory,
    json_text,
    more_of,
    operator_override,
    print_json,
)
from sceann_hil.commands.measure import measure, must_be_computable
from sceann_hil.commands.printing import print_table
from sceann_hil.config import ExperimentConfig, journalled_config, with_robot_of
from sceann_hil.errors import ConfigError, NotARun
from sceann_hil.journal import AttemptKind, IndividualRow, JournalReader
from sceann_hil.places import make_folder
from sceann_hil.robot import GapEstimate
from sceann_hil.robot.signal_names import motor_names, sensor_names
from sceann_hil.run.chosen import chosen_individual
from sceann_hil.run.measuring import Measurement
from sceann_hil.study.gap import GapReport, Spread, estimate_rows, gap_section
from sceann_hil.supervision.drift import Drift
from sceann_hil.timespans import duration_text
from sceann_hil.versions import running_versions

OnRobot = Annotated[
    Path | None,
    typer.Option(
        "--on",
        metavar="ROBOT",
        help="YAML file with the other robot's section robot; its operator, budget and suspenders hold too.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    for command in (compare, repeat, drift):
        app.command()(command)


def compare(
    directory: RunDirectory,
    on: OnRobot = None,
    top: Annotated[int, typer.Option("--top", min=1, help="So many of the best genomes.")] = 5,
    repeats: Annotated[int, typer.Option("--repeats", min=1, help="How often each runs all its trials.")] = 3,
    operator: OperatorOption = None,
    budget_robot: BudgetRobot = None,
    budget_wall: BudgetWall = None,
    budget_trials: BudgetTrials = None,
    as_json: AsJson = False,
) -> None:
    """Compare simulation and robot: run the best genomes of a run on both, and show the difference and its causes.

    The robot's trials are in the run's journal: a comparison that was interrupted goes on where it was.

    Example: sceann compare runs/first --on my_robot.yaml --top 5 --repeats 3
    """
    more = more_of(budget_robot, budget_wall, budget_trials)
    reader = JournalReader(directory)
    simulated, real = _pair(journalled_config(reader), on, operator)
    must_be_computable(simulated)
    rows = _best(reader, top, keeps_best=simulated.algorithm.keeps_best)
    genomes = np.stack([row.genome_bits(simulated.genome_length) for row in rows])
    # before the robot moves: a place that cannot be written to must not cost a measurement
    folder = _folder(directory, "compare")
    names = [row.genome for row in rows]
    there, timing = measure(directory, real, "compare", genomes, repeats, more)
    here, _ = measure(directory, simulated, "compare", genomes, repeats, more)
    estimate = _estimate(simulated, there)
    report = GapReport.of(names, here, there, estimate)
    # drawing takes a second to import
    from sceann_hil.study.gap import figures

    figures.draw_gap(report, here, there, folder / "gap.png")
    drawing = simulated.robot.build().drawing
    signals = sensor_names(simulated.size, drawing), motor_names(simulated.size, drawing)
    shown = figures.Shown(drawing, simulated.robot.spec.state_fields, *signals)
    figures.draw_trajectories(here, there, names, shown, folder / "trajectories.png")
    if timing:
        figures.draw_timing(timing, folder / "timing.png")
    document = {
        **report.as_dict(),
        "gap_section": gap_section(estimate),
        "folder": str(folder),
        "versions": running_versions(),
    }
    (folder / "compare.json").write_text(json_text(document), encoding="utf-8")
    if as_json:
        print_json(document)
    else:
        _print_comparison(report, signals, folder)


def repeat(
    directory: RunDirectory,
    genome: Genome = "best",
    n: Annotated[int, typer.Option("-n", min=2, help="How often it runs all its trials.")] = 20,
    on: OnRobot = None,
    operator: OperatorOption = None,
    budget_robot: BudgetRobot = None,
    budget_wall: BudgetWall = None,
    budget_trials: BudgetTrials = None,
    as_json: AsJson = False,
) -> None:
    """Run one genome again and again: how its fitness scatters, and how many repeats tell two genomes apart.

    A robot's trials are in the run's journal: what was interrupted goes on where it was.

    Example: sceann repeat runs/first --genome best -n 20
    """
    more = more_of(budget_robot, budget_wall, budget_trials)
    reader = JournalReader(directory)
    config = journalled_config(reader).with_changes(settings=operator_override(operator))
    if on is not None:
        config = with_robot_of(config, on).with_changes(settings=operator_override(operator))
    row, note = chosen_individual(reader, genome)
    if note:
        typer.echo(f"note: {note}", err=True)
    folder = _folder(directory, "repeat")
    measurement, _ = measure(directory, config, "repeat", row.genome_bits(config.genome_length)[None], n, more)
    fitness = measurement.repeats[0]
    spread = Spread.of(fitness)
    task = config.build_task()
    width = task.best_fitness - task.worst_fitness
    if not math.isfinite(width):  # the task does not say what a trial can be worth
        width = float(np.ptp(measurement.fitness)) or 1.0
    differences = [part * width for part in (0.02, 0.05, 0.1, 0.2)]
    from sceann_hil.study.gap import figures

    drawn = folder / f"individual-{row.generation}-{row.number}.png"
    figures.draw_spread(fitness.tolist(), spread, drawn)
    document = {
        "individual": row.id,
        "generation": row.generation,
        "number": row.number,
        "genome": row.genome,
        "robot": measurement.robot,
        "fitness": fitness.tolist(),
        "mean": spread.mean,
        "interval": [spread.low, spread.high],
        "deviation": spread.deviation,
        "robot_s": float(measurement.durations_s.sum()),
        "repeats_to_tell": {f"{difference:.4g}": spread.repeats_to_tell(difference) for difference in differences},
        "folder": str(folder),
        "versions": running_versions(),
    }
    drawn.with_suffix(".json").write_text(json_text(document), encoding="utf-8")
    if as_json:
        print_json(document)
        return
    table = Table(show_header=False)
    table.add_row("fitness", f"{spread.mean:.4g}, 95 % interval {spread.low:.4g} to {spread.high:.4g}")
    table.add_row("standard deviation of one repeat", f"{spread.deviation:.3g}")
    table.add_row("robot time", duration_text(float(measurement.durations_s.sum())))
    for difference in differences:
        needed = spread.repeats_to_tell(difference)
        table.add_row(f"repeats of each to tell a difference of {difference:.3g}", str(needed))
    print_table(Console(), f"{row.place.capitalize()}: {n} times on {measurement.robot}", table)
    typer.echo(folder)


def drift(directory: RunDirectory, as_json: AsJson = False) -> None:
    """Show the reference genome's fitness over a run, and whether the robot drifts.

    Example: sceann drift runs/first
    """
    rows = JournalReader(directory).attempts_of_kind(AttemptKind.REFERENCE)
    if not rows:
        raise NotARun(
            f"{directory} has no reference runs.", "Ask for some in the configuration: reference: {every: 50}."
        )
    found = Drift.of([row.fitness for row in rows if row.fitness is not None])
    path = _folder(directory, "drift") / "drift.png"
    from sceann_hil.study.gap import figures

    figures.draw_drift(rows, path)
    if as_json:
        print_json(
            {"runs": found.runs, "tau": found.tau, "p": found.p_value, "warning": found.warning, "chart": str(path)}
        )
        return
    typer.echo(found.warning or f"No drift: {found.runs} reference runs, p = {found.p_value:.2g}.")
    typer.echo(path)


def _pair(config: ExperimentConfig, on: Path | None, operator: str | None) -> tuple[ExperimentConfig, ExperimentConfig]:
    """The run's configuration on the simulated robot, and on the other one."""
    config = config.with_changes(settings=operator_override(operator))
    other = None
    if on is not None:
        other = with_robot_of(config, on).with_changes(settings=operator_override(operator))
    if config.robot.spec.deterministic and other is not None:
        return config, other
    body = config.robot.simulated
    if not config.robot.spec.deterministic and (other is not None or body is not None):
        simulated = other if other is not None else config.model_copy(update={"robot": body})
        if simulated.robot.spec.deterministic:
            return simulated, config
    raise ConfigError(
        f"compare needs a simulated robot and another one; the run's own is {config.robot.spec.name}.",
        "Name the other one: --on ROBOT.yaml, a file with a robot section.",
    )


def _estimate(simulated: ExperimentConfig, there: Measurement) -> GapEstimate | None:
    """The gap that explains what the robot did; None without its traces, or where nobody could tell."""
    if not there.traces:
        return None
    with simulated.robot.build() as body:
        try:
            return body.estimate_gap(there.starts, there.traces)
        except NotImplementedError as reason:
            typer.echo(f"No gap is estimated for {body.spec.name}: {reason}.", err=True)
            return None


def _best(reader: JournalReader, top: int, *, keeps_best: bool) -> list[IndividualRow]:
    """The best different genomes of a run, its champion first."""
    finished = reader.generations(finished=True)
    if not finished:
        raise NotARun(f"{reader.directory} has no finished generation yet.", "`sceann resume` it first.")
    # where the best are not kept, any generation may have them
    numbers = [finished[-1].number] if keeps_best else [row.number for row in finished]
    rows = [row for number in numbers for row in reader.individuals(number)]
    rows.sort(key=lambda row: -(row.fitness or 0.0))
    return list({row.genome: row for row in reversed(rows)}.values())[::-1][:top]


def _folder(directory: Path, name: str) -> Path:
    folder = directory / "reports" / name
    make_folder(folder)
    return folder


def _print_comparison(report: GapReport, names: Sequence[Sequence[str]], folder: Path) -> None:
    console = Console(highlight=False)
    table = Table("genome", report.simulation, report.robot, "gap", "95 %")
    for gap in report.genomes:
        interval = "needs --repeats 2" if gap.low is None else f"{gap.low:+.3g} to {gap.high:+.3g}"
        table.add_row(gap.genome, f"{gap.simulated:.4g}", f"{gap.measured:.4g}", f"{gap.gap:+.3g}", interval)
    print_table(console, "Simulation and robot", table)
    if report.rank_correlation is not None:
        console.print(f"rank correlation {report.rank_correlation:.2f} (p = {report.p_value:.2g})")
    if report.estimate is not None:
        _print_estimate(console, report.estimate, names)
    typer.echo(folder)


def _print_estimate(console: Console, estimate: GapEstimate, names: Sequence[Sequence[str]]) -> None:
    title = f"Gap of the robot, estimated from {estimate.trials} different trials"
    table = Table("quantity", "estimate", "95 %")
    for row in estimate_rows(estimate, *names):
        table.add_row(*row)
    print_table(console, title, table)
    section = gap_section(estimate)
    if not section:
        console.print("These trials tell nothing of the robot's gap: run more, and more different ones (--top).")
        return
    console.print(
        f"With this section the simulated sensors differ from the robot's by {estimate.residual:.3g} of full scale "
        f"(root mean square), without a gap by {estimate.residual_without:.3g}:"
    )
    typer.echo(section)
