"""Which key says what: the built-in keys, and those of a foot pedal, a presenter or another keyboard."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from sceann_hil.supervision.operators.verbs import Verb

KEYS: dict[str, Verb] = {
    "r": Verb.READY,
    "s": Verb.SKIP,
    "q": Verb.ABORT,
    " ": Verb.STOP,
    "g": Verb.GOAL,
    "a": Verb.ACCEPT,
    "d": Verb.REDO,
    "x": Verb.DISCARD,
    "n": Verb.NOTE,
    "p": Verb.PAUSE_AFTER,
    "h": Verb.PAUSE_NOW,
    "c": Verb.RESUME,
    "f": Verb.FINISH,
    "!": Verb.EMERGENCY_STOP,
    "b": Verb.BATTERY_SWAPPED,
}
"""A key of its own for every verb, so that a key that was meant for another question is never an answer to this one."""

STOP_KEYS = {"F8": Verb.STOP, "F9": Verb.EMERGENCY_STOP}
"""Keys that stop while words are typed, too: at the console as on the page."""

KEY_NAMES = {verb: "space" if key == " " else key for key, verb in KEYS.items()}

ESCAPE, ENTER, BACKSPACE, DELETE_LINE = "Escape", "Enter", "Backspace", "Ctrl-U"
NAMED_KEYS = frozenset(
    {
        *(f"F{number}" for number in range(1, 13)),
        *("ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "PageUp", "PageDown", "Home", "End", "Insert", "Delete"),
        *(ENTER, "Tab"),
    }
)
"""Keys without a character, by the names that browsers give them."""


def checked_key(name: str) -> str:
    """The key with this name: one character, ``space``, or a name such as F13, Enter, PageDown, ArrowLeft.

    Raises:
        ValueError: there is no such key, or it stops while words are typed and does nothing else.
    """
    if name == "space":
        return " "
    if name in STOP_KEYS:
        raise ValueError(f"{name} is always {STOP_KEYS[name].words}")
    if (len(name) == 1 and name.isprintable()) or name in NAMED_KEYS:
        return name
    raise ValueError(f"expected one character, space, or one of {', '.join(sorted(NAMED_KEYS))}, got {name!r}")


class KeyMap:
    """Built-in keys, and a person's own.

    Args:
        own: verbs by key. A key with several says the first of them that is possible, as a pedal must that has only
            one: ready before a trial, stop during it, accept afterwards.
    """

    def __init__(self, own: Mapping[str, Collection[Verb]] | None = None) -> None:
        self._verbs: dict[str, tuple[Verb, ...]] = {key: (verb,) for key, verb in {**KEYS, **STOP_KEYS}.items()}
        self._own = {checked_key(key): tuple(verbs) for key, verbs in (own or {}).items()}
        self._verbs |= self._own

    def verb(self, key: str, accepts: Collection[Verb]) -> Verb | None:
        """What a key says now; if nothing that is possible, then what it would say."""
        verbs = self._verbs.get(key, ())
        return next((verb for verb in verbs if verb in accepts), verbs[0] if verbs else None)

    def name(self, verb: Verb) -> str:
        """The keys that say it, for people."""
        own = ["space" if key == " " else key for key, verbs in self._own.items() if verb in verbs]
        built_in = [] if KEY_NAMES[verb].replace("space", " ") in self._own else [KEY_NAMES[verb]]
        return "/".join([*built_in, *own])

    def as_document(self) -> dict[str, list[str]]:
        """Verbs by key, for the page."""
        return {key: [verb.value for verb in verbs] for key, verbs in self._verbs.items() if key not in STOP_KEYS}
