"""The best controllers of a run or a study."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from sceann_hil.commands.arguments import AsJson, print_json
from sceann_hil.commands.printing import print_table
from sceann_hil.config import ExperimentConfig, noted_config, require_installed
from sceann_hil.errors import NotARun, PackageMissing
from sceann_hil.journal import JournalReader
from sceann_hil.network.coding import genome_from_hex
from sceann_hil.run.champion import best_so_far, champion_or_best_so_far
from sceann_hil.study import STUDY_NAME, StudyReader
from sceann_hil.study.robustness import Criterion, Robustness, measure

_MOST_CANDIDATES = 200


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A controller: where it comes from, its fitness there, its genome."""

    origin: str
    fitness: float
    genome: str
    is_champion: bool = False


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(champion)


def champion(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of a run, or of a study.", show_default=False)
    ],
    robust: Annotated[
        bool, typer.Option("--robust", help="Pick by what they do in disturbed bodies instead of in the ideal one.")
    ] = False,
    by: Annotated[
        Criterion, typer.Option("--by", help="With --robust: by mean fitness, or by the part of trials that succeed.")
    ] = Criterion.FITNESS,
    condition: Annotated[
        int | None, typer.Option("--condition", min=0, help="Of a study: take this condition.", show_default="the best")
    ] = None,
    top: Annotated[int, typer.Option("--top", min=1, help="Show so many.")] = 5,
    as_json: AsJson = False,
) -> None:
    """Show the best controllers of a run or a study; with --robust, those to put on a robot.

    Example: sceann champion studies/tables --robust
    """
    source, config, candidates = _candidates(directory, condition)
    order = list(range(len(candidates)))
    found: Robustness | None = None
    if robust:
        require_installed(config)
        genomes = np.stack([genome_from_hex(c.genome, config.genome_length) for c in candidates])
        found = measure(config, genomes)
        scores = found.mean(by)
        order.sort(key=lambda k: (-scores[k], -candidates[k].fitness))
    shown = order[:top]
    if as_json:
        print_json({"from": source, "champions": [_as_dict(candidates[k], found, k, by) for k in shown]})
        return
    _print(source, candidates, found, shown)


def _candidates(directory: Path, condition: int | None) -> tuple[str, ExperimentConfig, list[_Candidate]]:
    """Where they come from, the experiment, and different genomes: the run's champion, then the fittest."""
    source, config, listed = (
        _of_study(directory, condition) if (directory / STUDY_NAME).exists() else _of_run(directory, condition)
    )
    listed.sort(key=lambda candidate: (not candidate.is_champion, -candidate.fitness))
    different = list({candidate.genome: candidate for candidate in reversed(listed)}.values())[::-1]
    different.sort(key=lambda candidate: (not candidate.is_champion, -candidate.fitness))
    return source, config, different[:_MOST_CANDIDATES]


def _of_run(directory: Path, condition: int | None) -> tuple[str, ExperimentConfig, list[_Candidate]]:
    if condition is not None:
        raise typer.BadParameter("--condition is for studies; this is one run", param_hint="--condition")
    reader = JournalReader(directory)
    try:
        config = noted_config(reader)
        rows = [row for g in reader.generations(finished=True) for row in reader.individuals(g.number)]
        best, note = champion_or_best_so_far(reader, keeps_best=config.algorithm.keeps_best)
        leading = best_so_far(reader)
    finally:
        reader.close()
    listed = [_Candidate(row.place, row.fitness or 0.0, row.genome, row.id == best.id) for row in rows]
    if leading is not None:
        row, so_far = leading.individual, f"so far, {leading.trials}{_of_all(config)} trials"
        listed.append(_Candidate(f"{row.place} ({so_far})", row.fitness or 0.0, row.genome, bool(note)))
    return f"Run {directory}", config, listed


def _of_all(config: ExperimentConfig) -> str:
    try:
        return f" of {config.build_task().n_trials}"
    except PackageMissing:
        return ""


def _of_study(directory: Path, number: int | None) -> tuple[str, ExperimentConfig, list[_Candidate]]:
    with StudyReader(directory) as reader:
        conditions = reader.conditions()
        if number is not None and number >= len(conditions):
            raise NotARun(
                f"{directory} has no condition {number}.", f"Conditions are numbered from 0 to {len(conditions) - 1}."
            )
        runs = {c.number: reader.runs(c.number) for c in conditions if number in (None, c.number)}
        seed = reader.seed
    filled = {key: value for key, value in runs.items() if len(value)}
    if not filled:
        raise NotARun(f"{directory} has no finished runs yet.", "`sceann study` fills it.")
    best = max(filled, key=lambda key: float(filled[key].fitness.mean()))
    chosen = filled[best]
    source = f"Condition {best}: {conditions[best].label}"
    return (
        source,
        conditions[best].config.model_copy(update={"seed": seed}),
        [
            _Candidate(f"run {run}", float(fitness), genome)
            for run, fitness, genome in zip(chosen.numbers, chosen.fitness, chosen.genomes, strict=True)
        ],
    )


def _as_dict(candidate: _Candidate, found: Robustness | None, place: int, by: Criterion) -> dict[str, Any]:
    told: dict[str, Any] = {"origin": candidate.origin, "fitness": candidate.fitness, "genome": candidate.genome}
    if found is not None:
        interval = found.fitness_interval(place)
        told["robust_by"] = str(by)
        told["robust_score"] = float(found.mean(by)[place])
        told["robust_success"] = float(found.score[place])
        told["robust_fitness"] = {"mean": interval.estimate, "low": interval.low, "high": interval.high}
        for name, measured in (("success", found.success), ("disturbed_fitness", found.fitness)):
            told[name] = {
                disturbance.name: dict(zip(map(str, disturbance.levels), levels[:, place].tolist(), strict=True))
                for disturbance, levels in zip(found.disturbances, measured, strict=True)
            }
    return told


def _print(source: str, candidates: list[_Candidate], found: Robustness | None, shown: list[int]) -> None:
    console = Console(highlight=False)
    if found is None:
        table = Table("genome", "fitness", "from")
        for place in shown:
            table.add_row(candidates[place].genome, f"{candidates[place].fitness:.4g}", candidates[place].origin)
        print_table(console, source, table)
        return
    table = Table("genome", "from", "ideal", "disturbed: mean [95 %]", "to the first", "success")
    for place in shown:
        candidate, interval = candidates[place], found.fitness_interval(place)
        difference = found.fitness_difference(place, shown[0])
        table.add_row(
            candidate.genome,
            candidate.origin,
            f"{candidate.fitness:.4g}",
            f"{interval.estimate:.4g} [{interval.low:.4g}, {interval.high:.4g}]",
            "" if place == shown[0] else f"{difference.estimate:+.3g}{' (?)' if difference.contains_zero else ''}",
            f"{found.score[place]:.1%}",
        )
    print_table(console, source, table)
    details = Table("genome", *(disturbance.name for disturbance in found.disturbances))
    for place in shown:
        details.add_row(candidates[place].genome, *(f"{levels[1:, place].mean():.4g}" for levels in found.fitness))
    print_table(console, "Mean fitness under each disturbance", details)
    console.print(
        f"Means over the levels of each disturbance, {found.repeats} repeats of every trial. (?): the 95 % interval of "
        "the difference holds 0. Success: part of these trials that reach the task's aim."
    )
