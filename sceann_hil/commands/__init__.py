"""The commands of `sceann`: thin functions that parse, call the library and print.

`COMMANDS` is the table of contents: `sceann --help` is printed from it, and only the module of the command that is
called is imported. A module has a function ``register(app)`` that adds its commands to a Typer app.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Topic(StrEnum):
    """The groups of ``sceann --help``, in their order."""

    EVOLVE = "Evolve"
    LOOK = "Look at a run"
    ROBOT = "Robots"
    CONTROLLER = "Controllers and firmware"
    STUDY = "Many runs"
    SETUP = "Configuration"


@dataclass(frozen=True, slots=True)
class Entry:
    """One command.

    Attributes:
        topic: its group in the help.
        module: of this package; it registers the command.
        summary: the first sentence of the command's docstring.
    """

    topic: Topic
    module: str
    summary: str


COMMANDS: dict[str, Entry] = {
    "evolve": Entry(Topic.EVOLVE, "evolve", "Evolve controllers as a configuration says."),
    "resume": Entry(
        Topic.EVOLVE, "evolve", "Go on with a run that was stopped, paused or killed, or whose budget was spent."
    ),
    "transfer": Entry(
        Topic.EVOLVE,
        "transfer",
        "Find the controller for a robot in a few trials, helped by many simulated robots.",
    ),
    "plan": Entry(Topic.EVOLVE, "prepare", "Show what a configuration will cost, without running anything."),
    "rehearse": Entry(
        Topic.EVOLVE,
        "rehearse",
        "Play a whole run, prompts included, with a simulated body for the robot and a script for the person.",
    ),
    "runs": Entry(Topic.LOOK, "runs", "Show all runs below a folder in one table."),
    "status": Entry(Topic.LOOK, "inspect", "Show how a run stands, also while it is running."),
    "view": Entry(
        Topic.LOOK, "observe", "Show all trials of a run sorted by fitness, one trial, or the run as a whole."
    ),
    "champion": Entry(
        Topic.LOOK,
        "champion",
        "Show the best controllers of a run or a study; with --robust, those to put on a robot.",
    ),
    "replay": Entry(Topic.LOOK, "inspect", "Run a journalled trial again and prove that it gives the same bits."),
    "record": Entry(
        Topic.LOOK,
        "observe",
        "Make the recordings of a run that are missing or damaged, from its journal; wait for whoever makes them "
        "already.",
    ),
    "check": Entry(
        Topic.LOOK,
        "soundness",
        "Check that nothing in a run or a study was changed, lost or damaged since it was written.",
    ),
    "copy": Entry(Topic.LOOK, "soundness", "Copy a run or a study, also while somebody works on it."),
    "export-csv": Entry(
        Topic.LOOK,
        "inspect",
        "Write a run's generations, individuals and trials, or a study's conditions and runs, as CSV files.",
    ),
    "doctor": Entry(
        Topic.ROBOT,
        "hardware",
        "Examine a robot: port, handshake, latency, losses, watchdog, sensors and motors, each with advice.",
    ),
    "compare": Entry(
        Topic.ROBOT,
        "gap",
        "Compare simulation and robot: run the best genomes of a run on both, and show the difference and its causes.",
    ),
    "repeat": Entry(
        Topic.ROBOT,
        "gap",
        "Run one genome again and again: how its fitness scatters, and how many repeats tell two genomes apart.",
    ),
    "drift": Entry(Topic.ROBOT, "gap", "Show the reference genome's fitness over a run, and whether the robot drifts."),
    "export": Entry(
        Topic.CONTROLLER,
        "firmware",
        "Write a controller as one self-contained C header, or as a program for a Thymio II.",
    ),
    "flash": Entry(Topic.CONTROLLER, "firmware", "Put a controller on a board, and say what is then on it."),
    "verify": Entry(
        Topic.CONTROLLER,
        "firmware",
        "Prove that a board computes what the simulator computed: every state of every neuron.",
    ),
    "set-node": Entry(
        Topic.CONTROLLER, "firmware", "Give a robot a node number of its own; it keeps it without power."
    ),
    "study": Entry(
        Topic.STUDY, "study", "Run every condition of a study many times; results go to DIR/NAME/study.sqlite."
    ),
    "enumerate": Entry(
        Topic.STUDY,
        "landscape",
        "Try every genome of an experiment, or of each condition of a study; NumPy arrays go to DIR/NAME/landscapes.",
    ),
    "report": Entry(
        Topic.STUDY,
        "report",
        "Write the paper's tables, figures and claims with our numbers beside them: Markdown, SVG, PNG and one HTML "
        "page.",
    ),
    "list": Entry(Topic.SETUP, "prepare", "Show the installed robots, tasks and algorithms."),
    "schema": Entry(Topic.SETUP, "prepare", "Print the JSON schema of a configuration, for editors."),
}
"""By name. A package of its own adds commands by an entry point in the group ``sceann_hil.commands`` instead."""
