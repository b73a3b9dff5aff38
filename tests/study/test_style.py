"""Pictures say what drew them, and are the same bytes each time."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from sceann_hil.study.style import drawing, save
from sceann_hil.versions import maker


def test_a_picture_names_its_program_and_no_moment(tmp_path: Path) -> None:
    for name in ("one", "two"):
        with drawing(8.0, 6.0) as figure:
            figure.subplots().plot([0, 1], [1, 0])
        save(figure, tmp_path / name)
    with Image.open(tmp_path / "one.png") as picture:
        assert picture.info["Software"] == maker()
    assert maker() in (tmp_path / "one.svg").read_text(encoding="utf-8")
    for suffix in (".png", ".svg"):
        assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()
