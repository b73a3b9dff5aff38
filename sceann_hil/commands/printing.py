"""Names and tables on a terminal: whatever is in a name is shown as it is, and what can be pasted is quoted."""

from __future__ import annotations

import shlex
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table


def shown(name: Path | str) -> str:
    """A name inside a text with markup."""
    return escape(str(name))


def pasted(name: Path | str) -> str:
    """A name inside a command that is printed to be pasted into a shell."""
    return escape(shlex.quote(str(name)))


def print_table(console: Console, title: str, table: Table) -> None:
    """A table below its title, which is plain text and never wraps with the table's width."""
    console.print(title, style="italic", markup=False, highlight=False, soft_wrap=True)
    console.print(table)
