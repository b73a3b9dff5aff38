"""Progress where Python runs: a bar in a terminal, a bar in a notebook, lines elsewhere."""

from __future__ import annotations

import html
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sceann_hil.run.experiment import Progress


def in_notebook() -> bool:
    """This process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and shell.has_trait("kernel")


@contextmanager
def shown_progress(last_generation: int) -> Iterator[Callable[[Progress], None]]:
    """A function for `Experiment.evolve` to report to."""
    if in_notebook():
        yield _in_a_cell()
        return
    from rich.console import Console

    from sceann_hil.commands.progress import show_progress

    with show_progress(Console(stderr=True, highlight=False), last_generation) as report:
        yield report


@contextmanager
def shown_preparation() -> Iterator[Callable[[str, int, int], None]]:
    """A function to report to of what is prepared before a run: what, how much is done, how much there is."""
    if in_notebook():
        yield _prepared_in_a_cell()
        return
    from rich.console import Console

    from sceann_hil.commands.progress import show_preparation

    with show_preparation(Console(stderr=True, highlight=False)) as report:
        yield report


def _prepared_in_a_cell() -> Callable[[str, int, int], None]:
    from IPython.display import display

    cells: list[Any] = []

    def report(what: str, done: int, total: int) -> None:
        bar = _Bar(done, max(total, 1), f"{what}: {done} of {total}")
        if cells:
            cells[0].update(bar)
        else:
            # most algorithms prepare nothing, and show nothing
            cells.append(display(bar, display_id=True))  # type: ignore[no-untyped-call]

    return report


def _in_a_cell() -> Callable[[Progress], None]:
    from IPython.display import display

    cell = display(_Bar(0, 1, "starting"), display_id=True)  # type: ignore[no-untyped-call]

    def report(progress: Progress) -> None:
        row = progress.generation
        text = (
            f"generation {row.number} of {progress.last_generation}: best {row.best_fitness:.4g}, "
            f"mean {row.mean_fitness:.4g}, success {row.success_rate:.0%}"
        )
        cell.update(_Bar(row.number, max(progress.last_generation, 1), text))

    return report


class _Bar:
    """A bar with a text, as a notebook shows it, and as a terminal does."""

    def __init__(self, done: int, whole: int, text: str) -> None:
        self._done, self._whole, self._text = done, whole, text

    def _repr_html_(self) -> str:
        return f'<progress value="{self._done}" max="{self._whole}"></progress> {html.escape(self._text)}'

    def __repr__(self) -> str:
        return self._text
