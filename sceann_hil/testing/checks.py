"""One check of a kit: what is wrong, or nothing."""

from __future__ import annotations


def check(is_right: bool, otherwise: str) -> None:
    """Fail with a message that says what was expected.

    Raises:
        AssertionError: it is not right.
    """
    if not is_right:
        raise AssertionError(otherwise)
