"""What people type, made fit to be kept and shown: one place, on the way in, for every operator.

Keyboards, browsers and scripts deliver more than words: halves of characters (lone surrogates, which no file and no
database takes), escape sequences that would move a terminal's cursor, and marks that turn the order of a line round.
"""

from __future__ import annotations

LONGEST = 1000
"""Characters that are kept of one remark."""

_TURNS_TEXT_ROUND = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\ufeff")


def clean(text: str) -> str:
    """The words in one line of whole, printable characters.

    Args:
        text: as it arrived, lone surrogates and control characters included.

    Returns:
        At most `LONGEST` characters. What was half a character is U+FFFD, line breaks and tabs are spaces, other
        control characters are gone.
    """
    whole = text.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "replace")
    one_line = " ".join(whole.split())
    return "".join(filter(_is_shown, one_line))[:LONGEST].strip()


def _is_shown(character: str) -> bool:
    is_control = character < " " or "\x7f" <= character <= "\x9f"
    return not is_control and character not in _TURNS_TEXT_ROUND
