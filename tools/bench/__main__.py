"""Measure what the project promises, each figure as a ratio against a baseline of the same run.

    .venv/bin/python tools/bench [NAME ...]        all benchmarks, or the named ones
    .venv/bin/python tools/bench --json            for programs

A benchmark is a module beside this one with a function ``run() -> list[Figure]``. Machines differ and are noisy: read
the ratios, and the medians.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(1, str(Path(__file__).parents[2]))

from figures import Figure
from rich.console import Console
from rich.table import Table

HERE = Path(__file__).parent
HELPERS = {"__main__", "figures", "many_runs", "numpy_baseline", "c_baseline", "panel_crowd", "transfer_methods"}
NAMES = sorted(path.stem for path in HERE.glob("*.py") if path.stem not in HELPERS)


def main() -> None:
    """Run the benchmarks that were asked for and print their figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of: {', '.join(NAMES)}")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    if unknown := set(arguments.names) - set(NAMES):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; there are {', '.join(NAMES)}")
    console = Console(stderr=arguments.json, highlight=False)
    results: dict[str, list[Figure]] = {}
    for name in arguments.names or NAMES:
        with console.status(f"measuring {name}..."):
            results[name] = importlib.import_module(name).run()
        table = Table("figure", "measured", "promised", "", title=name)
        for figure in results[name]:
            mark = "" if figure.kept is None else "[green]kept[/]" if figure.kept else "[red]NOT KEPT[/]"
            table.add_row(figure.name, figure.measured, figure.promised, mark)
        console.print(table)
    if arguments.json:
        print(json.dumps({name: [asdict(f) for f in figures] for name, figures in results.items()}, indent=2))


if __name__ == "__main__":
    main()
