"""A report's tables as files for other programs: CSV and LaTeX."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

from sceann_hil.versions import PROGRAM, running_versions

_LATEX = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
}


def write_csv(path: Path, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table whose cells are Markdown as comma-separated values, without the emphasis."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([_plain(cell) for cell in row] for row in (header, *rows))


def write_latex(path: Path, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """The same as a ``tabular`` with the rules of the package booktabs; its first line names what wrote it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [
        f"% sceann-hil {running_versions()[PROGRAM]}; needs \\usepackage{{booktabs}}",
        f"\\begin{{tabular}}{{{'l' * len(header)}}}",
        r"\toprule",
        _latex_row(header),
        r"\midrule",
        *map(_latex_row, rows),
        r"\bottomrule",
        r"\end{tabular}",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _latex_row(cells: Sequence[str]) -> str:
    # square brackets after a line's end would be read as its argument
    escaped = ("".join(_LATEX.get(letter, letter) for letter in _plain(cell)) for cell in cells)
    return " & ".join(f"{{{text}}}" if text.startswith("[") else text for text in escaped) + r" \\"


def _plain(cell: str) -> str:
    return re.sub(r"\*\*(.*?)\*\*", r"\1", cell)
