"""The viewer from Python: a window, or a picture where a notebook is."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from sceann_hil.api.notebook import in_notebook


def show_run(directory: Path, attempt: int | None, picture: Path | None, *, browser: bool) -> Any:
    """Show one attempt of a run, or all of them; see `sceann_hil.api.run.Run.show`."""
    from sceann_hil.recording import view

    screen = view.GALLERY if attempt is None else view.Screen(trial=attempt)
    if picture is not None:
        view.picture(directory, screen, picture)
        return picture
    if in_notebook() and not browser:
        from IPython.display import Image

        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "view.png"
            view.picture(directory, screen, file)
            return Image(data=file.read_bytes())  # type: ignore[no-untyped-call]
    view.view(directory, screen, view.Window.WEB if browser else view.Window.NATIVE)
    return None
