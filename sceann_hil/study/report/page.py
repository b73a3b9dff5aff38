"""A page under construction: Markdown with figures beside it, and the same as one HTML file that can be mailed."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from markdown_it import MarkdownIt

from sceann_hil.places import make_folder
from sceann_hil.study.report.table_files import write_csv, write_latex

_CSS = """
body { font: 16px/1.5 system-ui, "Segoe UI", sans-serif; color: #222 }
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem }
h1, h2, h3 { line-height: 1.2; margin-top: 2em } h1 { margin-top: 0 }
table { border-collapse: collapse; margin: 1em 0; font-size: 0.9em; display: block; overflow-x: auto }
th, td { border: 1px solid #ddd; padding: 0.3em 0.6em; text-align: left; vertical-align: top }
th { background: #f4f4f4 }
img { max-width: 100%; height: auto } code { background: #f4f4f4; padding: 0.1em 0.3em }
pre { background: #f4f4f4; padding: 0.8em; overflow-x: auto }
"""


class Page:
    """Sections in the order in which they are added.

    Args:
        title: of the page.
        directory: where it will be written.
        name: of its files: ``NAME.md``, ``NAME.html`` and the folder ``NAME`` with the figures.
    """

    def __init__(self, title: str, directory: Path, name: str) -> None:
        self._directory = directory
        self._name = name
        self._title = title
        self._parts: list[str] = [f"# {title}"] if title else []

    def heading(self, text: str, level: int = 2) -> None:
        """A heading."""
        self._parts.append(f"{'#' * level} {text}")

    def text(self, *paragraphs: str) -> None:
        """Paragraphs of Markdown."""
        self._parts.extend(paragraphs)

    def bullets(self, lines: Sequence[str]) -> None:
        """A list; nothing if there are no lines."""
        if not lines:
            return
        self._parts.append("\n".join(f"* {line}" for line in lines))

    def code(self, lines: Sequence[str], language: str = "sh") -> None:
        """A block to copy."""
        self._parts.append("\n".join([f"```{language}", *lines, "```"]))

    def table(self, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """A table; cells are Markdown."""
        lines = [_row(header), _row(["---"] * len(header)), *map(_row, rows)]
        self._parts.append("\n".join(lines))

    def data_table(self, name: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """A table that is also written as ``NAME.csv`` and ``NAME.tex``, beside the figures."""
        self.table(header, rows)
        folder = self._directory / self._name
        write_csv(folder / f"{name}.csv", header, rows)
        write_latex(folder / f"{name}.tex", header, rows)
        self._parts.append(f"[CSV]({self._name}/{name}.csv), [LaTeX]({self._name}/{name}.tex)")

    def figure(self, name: str, caption: str, draw: Callable[[Path], None]) -> None:
        """A figure: `draw` gets the path without suffix and leaves ``.svg`` and ``.png`` there."""
        draw(self._directory / self._name / name)
        self._parts.append(f"![{caption}]({self._name}/{name}.svg)")
        self._parts.append(f"*{caption}*")

    def append(self, other: Page) -> None:
        """All parts of another page for the same files."""
        self._parts.extend(other._parts)

    def write(self) -> tuple[Path, Path]:
        """The Markdown and the HTML file."""
        make_folder(self._directory)
        markdown = self._directory / f"{self._name}.md"
        source = "\n\n".join(self._parts) + "\n"
        markdown.write_text(source, encoding="utf-8")
        page = markdown.with_suffix(".html")
        page.write_text(self._html(source), encoding="utf-8")
        return markdown, page

    def _html(self, source: str) -> str:
        body = str(MarkdownIt("commonmark", {"html": False}).enable("table").render(source))
        for figure in sorted((self._directory / self._name).glob("*.svg")):
            data = base64.b64encode(figure.read_bytes()).decode()
            body = body.replace(f'src="{self._name}/{figure.name}"', f'src="data:image/svg+xml;base64,{data}"')
        return (
            f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
            f'<meta name="viewport" content="width=device-width"><title>{html.escape(self._title)}</title>'
            f"<style>{_CSS}</style></head>\n<body>\n{body}</body></html>\n"
        )


def file_name(text: str) -> str:
    """A name for files: letters, digits, dashes and underscores of a text; a dot would begin a suffix."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", text).strip("-") or "study"


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"
