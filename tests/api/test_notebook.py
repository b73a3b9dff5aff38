"""examples/notebook.ipynb runs in a real kernel, and shows progress, tables and pictures."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parents[2] / "examples" / "notebook.ipynb"


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> list[Any]:
    """The outputs of its code cells, in order."""
    folder = tmp_path_factory.mktemp("notebook")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    os.environ.setdefault("JUPYTER_PLATFORM_DIRS", "1")
    client = NotebookClient(notebook, timeout=240, kernel_name="python3", resources={"metadata": {"path": str(folder)}})
    client.execute()
    return [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]


def test_the_progress_of_the_evolution_is_a_bar(executed: list[Any]) -> None:
    shown = [output.data["text/html"] for output in executed if "text/html" in output.get("data", {})]
    (bar,) = [html for html in shown if html.startswith("<progress")]
    assert 'value="15" max="15"' in bar
    assert "generation 15 of 15: best" in bar


def test_tables_and_paths_are_shown(executed: list[Any]) -> None:
    shown = [output.get("data", {}) for output in executed]
    assert sum("<table" in data.get("text/html", "") for data in shown) >= 3
    assert sum("image/png" in data for data in shown) >= 2


def test_the_shipped_notebook_has_no_outputs() -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.outputs for cell in notebook.cells if cell.cell_type == "code")
