"""Tables on a terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table


def print_table(console: Console, title: str, table: Table) -> None:
    """A table below its title, which is plain text and never wraps with the table's width."""
    console.print(title, style="italic", markup=False, highlight=False, soft_wrap=True)
    console.print(table)
