"""The text of a configuration file, or one message that says why there is none."""

from __future__ import annotations

import codecs
from pathlib import Path

from sceann_hil.config.problems import Place, fail, nearest

MAX_BYTES = 1 << 20
"""Largest configuration file: a hundred times what anybody writes by hand."""


def read_text(path: Path | str) -> str:
    """The text of a configuration file.

    Raises:
        ConfigError: it is missing, a directory, empty, too large, or not UTF-8 text.
    """
    path = Path(path)
    whole_file = Place(0, 0, 0, str(path))
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        fail(whole_file, "no such file" + _did_you_mean(path))
    except IsADirectoryError:
        inside = _yaml_files(path)
        fail(
            whole_file,
            "expected a YAML file, got a directory" + (f" (it holds {', '.join(inside)})" if inside else ""),
        )
    except (OSError, ValueError) as error:
        fail(whole_file, f"cannot be read: {getattr(error, 'strerror', None) or error}")
    if len(raw) > MAX_BYTES:
        fail(whole_file, f"expected at most {MAX_BYTES // 1024} KiB of YAML, got a larger file")
    if not raw.strip():
        fail(whole_file, "expected a configuration, got an empty file")
    raw = raw.removeprefix(codecs.BOM_UTF8)
    if b"\0" in raw:
        fail(whole_file, "expected UTF-8 text, got a binary file (or UTF-16: save it as UTF-8)")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        column = error.start - raw.rfind(b"\n", 0, error.start)
        fail(Place(0, line, column, str(path)), f"expected UTF-8 text, got the byte 0x{raw[error.start]:02x}")


def _did_you_mean(path: Path) -> str:
    near = nearest(path.name, _yaml_files(path.parent))
    return f", did you mean {path.with_name(near)}?" if near else ""


def _yaml_files(folder: Path) -> list[str]:
    try:
        return sorted(other.name for other in folder.iterdir() if other.suffix in (".yaml", ".yml"))
    except OSError:
        return []
