"""The `operator` section of a configuration."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from pydantic import Field, field_validator

from sceann_hil.plugins import Section
from sceann_hil.supervision.operators.keymap import KeyMap, checked_key
from sceann_hil.supervision.operators.script import Step
from sceann_hil.supervision.operators.verbs import Verb


class Who(StrEnum):
    """How a person, or nobody, stands beside the robot."""

    NONE = "none"
    CONSOLE = "console"
    WEB = "web"
    SCRIPT = "script"


class Prompt(StrEnum):
    """How a question makes itself heard."""

    NONE = "none"
    BELL = "bell"
    SPEECH = "speech"


class OwnKey(Section):
    """A key, and what it says."""

    key: str
    """One character, space, or a name: F1 to F12 without F8 and F9, Enter, Tab, PageDown, ArrowLeft, Home, ..."""
    says: Annotated[tuple[Verb, ...], Field(min_length=1)]
    """Of several the first that is possible now: [ready, stop, accept, resume] for a pedal that has only one key."""

    @field_validator("key")
    @classmethod
    def _can_be_hit(cls, key: str) -> str:
        checked_key(key)
        return key


class OperatorConfig(Section):
    """Who stands beside the robot."""

    who: tuple[Who, ...] | None = None
    """console, web, script, several of them, or none; default: console if the robot needs somebody, else none."""
    confirm: bool = True
    """Ask after every trial whether it counts; otherwise it does, unless somebody stopped it."""
    prompt: Prompt = Prompt.NONE
    """A sound with every question: none, bell, or speech (at the console where a speech program is installed)."""
    host: str = "127.0.0.1"
    """Address of the web panel; anything but this machine's own needs the token in the link that is printed."""
    port: Annotated[int, Field(ge=0, le=65_535)] = 8075
    """Port of the web panel; 0 for any that is free."""
    script: tuple[str, ...] = ()
    """What the script says, one line each: [PHASE:] VERB [after SECONDS s] [WORDS]."""
    keys: tuple[OwnKey, ...] = ()
    """Keys of your own (a foot pedal, a presenter) besides the built-in ones."""
    repeat_script: bool = False
    """Start the script again after its last line."""

    @field_validator("who")
    @classmethod
    def _nobody_is_alone(cls, who: tuple[Who, ...] | None) -> tuple[Who, ...] | None:
        if who is not None and (len(set(who)) != len(who) or (Who.NONE in who and len(who) > 1) or not who):
            got = ", ".join(who) or "nobody"
            raise ValueError(f"expected none, or each of console, web and script at most once, got {got}")
        return who

    @field_validator("script")
    @classmethod
    def _lines_are_steps(cls, lines: tuple[str, ...]) -> tuple[str, ...]:
        for line in lines:
            Step.parse(line)
        return lines

    def resolved(self, *, attended: bool) -> tuple[Who, ...]:
        """Who it is, for a robot that needs somebody or not."""
        if self.who is not None:
            return tuple(who for who in self.who if who is not Who.NONE)
        return (Who.CONSOLE,) if attended else ()

    @property
    def keymap(self) -> KeyMap:
        """The built-in keys and the person's own."""
        return KeyMap({own.key: own.says for own in self.keys})

    @property
    def steps(self) -> tuple[Step, ...]:
        """The script, parsed."""
        return tuple(Step.parse(line) for line in self.script)
