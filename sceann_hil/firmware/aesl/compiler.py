"""AESL, as far as our programs use it, to byte code for Aseba's virtual machine.

A program consists of variables, statements for the beginning, events and subroutines; see ``aseba/compiler`` of the
makers, whose compiler gives code that does the same. There are no loops here, so the longest way through a handler is
known when it is compiled.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sceann_hil.firmware.aesl.target import NATIVES, Target
from sceann_hil.firmware.aesl.words import AeslError, Words

_INIT, _FIRST_LOCAL = 0xFFFF, 0xFFFE
_SMALL, _LARGE, _LOAD, _STORE, _LOAD_AT, _STORE_AT = 0x1000, 0x2000, 0x3000, 0x4000, 0x5000, 0x6000
_UNARY, _BINARY, _JUMP, _BRANCH, _EMIT, _NATIVE, _CALL, _RETURN = (code << 12 for code in range(7, 15))
_NEGATE, _ABSOLUTE, _INVERT = 0, 1, 2
_LEVELS: tuple[Mapping[str, int], ...] = (
    {"or": 16},
    {"and": 17},
    {"==": 10, "!=": 11, ">": 12, ">=": 13, "<": 14, "<=": 15},
    {"|": 7},
    {"^": 8},
    {"&": 9},
    {"<<": 0, ">>": 1},
    {"+": 2, "-": 3},
    {"*": 4, "/": 5, "%": 6},
)
"""Operators and their codes, from those that bind least."""
_CONDITION, _VALUE = 0, 3
_END_OF_BLOCK = ("end", "else", "elseif")
_END_OF_PART = ("", "sub", "onevent")


@dataclass(frozen=True, slots=True)
class Code:
    """A compiled program.

    Attributes:
        words: byte code, unsigned 16-bit words.
        addresses: of the program's variables.
        lengths: of the program's variables.
        initial: values that the program's variables have at first, those of more than one element.
        variable_words: memory of all variables, the robot's own ones too.
        longest: instructions of the longest way through each handler, by the event's name (``""``: the beginning).
    """

    words: tuple[int, ...]
    addresses: Mapping[str, int]
    lengths: Mapping[str, int]
    initial: Mapping[str, tuple[int, ...]]
    variable_words: int
    longest: Mapping[str, int]


@dataclass(slots=True)
class _Part:
    """Byte code under way: words, where subroutines are called, and the longest way through it."""

    words: list[int] = field(default_factory=list)
    calls: dict[int, str] = field(default_factory=dict)
    steps: int = 0

    def add(self, *words: int) -> None:
        """One instruction."""
        self.words += [word & 0xFFFF for word in words]
        self.steps += 1

    def join(self, other: _Part, steps: int | None = None) -> None:
        """What another part says, after this one; `steps` if not all of it is run."""
        self.calls |= {at + len(self.words): name for at, name in other.calls.items()}
        self.words += other.words
        self.steps += other.steps if steps is None else steps


def compiled(text: str, target: Target, events: Sequence[str]) -> Code:
    """Byte code of a program.

    Args:
        text: in AESL.
        target: the robot.
        events: names of messages between robot and host; their numbers are their places.

    Raises:
        AeslError: the program is none, or needs something that this robot does not have.
    """
    return _Compiler(Words(text), target, events).program()


class _Compiler:
    def __init__(self, words: Words, target: Target, events: Sequence[str]) -> None:
        self._words, self._target, self._events = words, target, events
        self._addresses = {name: target.address(name) for name in target.variables}
        self._lengths = dict(target.variables)
        self._initial: dict[str, tuple[int, ...]] = {}
        self._free = target.free_from
        self._handlers: dict[str, _Part] = {}
        self._subroutines: dict[str, _Part] = {}

    def program(self) -> Code:
        beginning = _Part()
        while self._words.next == "var":
            self._variable(beginning)
        beginning.join(self._statements(_END_OF_PART))
        self._handlers[""] = beginning
        while self._words.next:
            kind = self._words.take()
            if kind == "onevent":
                name = self._words.name((*self._events, *self._target.local_events))
                self._handlers[name] = self._statements(_END_OF_PART)
            else:
                name = self._words.name()
                self._subroutines[name] = self._statements(_END_OF_PART)
        own = {name: at for name, at in self._addresses.items() if name not in self._target.variables}
        return Code(
            words=self._linked(),
            addresses=own,
            lengths={name: self._lengths[name] for name in own},
            initial=self._initial,
            variable_words=self._free,
            longest={name: part.steps + 1 for name, part in self._handlers.items()},
        )

    def _linked(self) -> tuple[int, ...]:
        numbers = {name: self._number(name) for name in self._handlers}
        whole = _Part([1 + 2 * len(numbers)])
        at = whole.words[0]
        handlers = sorted(self._handlers, key=lambda name: numbers[name])
        for name in handlers:
            whole.words += [numbers[name], at]
            at += len(self._handlers[name].words) + 1
        for name in handlers:
            whole.join(self._handlers[name])
            whole.words.append(0)
        begins = {}
        for name, part in self._subroutines.items():
            begins[name] = len(whole.words)
            whole.join(part)
            whole.words.append(_RETURN)
        for place, name in whole.calls.items():
            whole.words[place] = _CALL | begins[name]
        return tuple(whole.words)

    def _number(self, event: str) -> int:
        if not event:
            return _INIT
        if event in self._events:
            return self._events.index(event)
        return _FIRST_LOCAL - self._target.local_events.index(event)

    # -- variables --------------------------------------------------------------------------------------------------

    def _variable(self, part: _Part) -> None:
        words = self._words
        words.expect("var")
        name = words.name()
        if name in self._addresses:
            raise words.wrong(f"expected a new name instead of {name}")
        length = 1
        if words.took("["):
            length = words.number()
            words.expect("]")
        address = self._free
        self._addresses[name], self._lengths[name] = address, length
        self._free += length
        if not words.took("="):
            return
        values = self._values(length)
        if length > 1:
            self._initial[name] = tuple(values)
        for place, value in enumerate(values):
            _immediate(part, value)
            part.add(_STORE | address + place)

    def _values(self, length: int) -> list[int]:
        words = self._words
        if not words.took("["):
            return [words.number()]
        values = [words.number()]
        while words.took(","):
            values.append(words.number())
        words.expect("]")
        if len(values) != length:
            raise words.wrong(f"expected {length} values instead of {len(values)}")
        return values

    def _place(self) -> tuple[str, int, int | None, _Part]:
        """A variable or a part of it: its name, address, length (None: an element that is computed), and its index."""
        words = self._words
        name = words.name(tuple(self._addresses))
        address, length, index = self._addresses[name], self._lengths[name], _Part()
        if not words.took("["):
            return name, address, length, index
        if not words.next.isdecimal():
            index = self._expression()
            words.expect("]")
            return name, address, None, index
        first = words.number()
        last = words.number() if words.took(":") else first
        words.expect("]")
        if not first <= last < length:
            raise words.wrong(f"expected a part of {name}, which has {length} elements, instead of {first}..{last}")
        return name, address + first, last - first + 1, index

    # -- statements -------------------------------------------------------------------------------------------------

    def _statements(self, until: Sequence[str]) -> _Part:
        part = _Part()
        while self._words.next not in until:
            self._statement(part)
        return part

    def _statement(self, part: _Part) -> None:
        words = self._words
        if words.took("if"):
            self._if(part)
        elif words.took("callsub"):
            name = words.name(tuple(self._subroutines))
            part.calls[len(part.words)] = name
            part.add(_CALL)
            # and the way back
            part.steps += self._subroutines[name].steps + 1
        elif words.took("call"):
            self._call(part)
        elif words.took("emit"):
            number = self._events.index(words.name(tuple(self._events)))
            _, address, length, _ = self._place()
            part.add(_EMIT | number, address, length or 1)
        else:
            self._assignment(part)

    def _assignment(self, part: _Part) -> None:
        name, address, length, index = self._place()
        if length not in (1, None):
            raise self._words.wrong(f"expected one element of {name}")
        if self._words.took("+="):
            if length is None:
                raise self._words.wrong("expected an element with a number before +=")
            part.add(_LOAD | address)
            part.join(self._expression())
            part.add(_BINARY | _LEVELS[7]["+"])
        else:
            self._words.expect("=")
            part.join(self._expression())
        if length is None:
            part.join(index)
            part.add(_STORE_AT | address, self._lengths[name])
        else:
            part.add(_STORE | address)

    def _if(self, part: _Part) -> None:
        operator = self._condition(part)
        self._words.expect("then")
        then, otherwise = self._statements(_END_OF_BLOCK), _Part()
        if self._words.took("elseif"):
            self._if(otherwise)
        else:
            if self._words.took("else"):
                otherwise = self._statements(_END_OF_BLOCK)
            self._words.expect("end")
        if otherwise.words:
            then.add(_JUMP | len(otherwise.words) + 1)
        part.add(_BRANCH | operator, 2 + len(then.words))
        part.join(then, max(then.steps, otherwise.steps))
        part.join(otherwise, 0)

    def _condition(self, part: _Part) -> int:
        """Two values, and the operator that compares them."""
        whole = self._expression(_CONDITION)
        last = whole.words[-1]
        if last & 0xFF00 != _BINARY or last & 0xFF < _LEVELS[2]["=="]:
            raise self._words.wrong("expected a comparison")
        whole.words.pop()
        whole.steps -= 1
        part.join(whole)
        return last & 0xFF

    def _call(self, part: _Part) -> None:
        words = self._words
        name = words.name()
        if name not in NATIVES or name not in self._target.functions:
            raise words.wrong(f"{self._target.name} has no function {name}: expected one that it has")
        words.expect("(")
        places = [self._place()]
        while words.took(","):
            places.append(self._place())
        words.expect(")")
        lengths = [length for _, _, length, _ in places]
        wanted = NATIVES[name]
        common = {length for length, want in zip(lengths, wanted, strict=False) if want < 0}
        fixed = all(want < 0 or length == want for length, want in zip(lengths, wanted, strict=False))
        if len(places) != len(wanted) or not fixed or len(common) != 1 or None in lengths:
            raise words.wrong(f"{name}: expected arguments of lengths {wanted} (-1: all the same), not {lengths}")
        _immediate(part, common.pop() or 0)
        for _, address, _, _ in reversed(places):
            _immediate(part, address)
        part.add(_NATIVE | self._target.functions.index(name))

    # -- expressions ------------------------------------------------------------------------------------------------

    def _expression(self, level: int = _VALUE) -> _Part:
        if level == len(_LEVELS):
            return self._term()
        part = self._expression(level + 1)
        while operator := self._words.took(*_LEVELS[level]):
            part.join(self._expression(level + 1))
            part.add(_BINARY | _LEVELS[level][operator])
        return part

    def _term(self) -> _Part:
        words, part = self._words, _Part()
        if words.took("("):
            part = self._expression(_CONDITION)
            words.expect(")")
        elif words.took("abs"):
            words.expect("(")
            part = self._expression()
            words.expect(")")
            part.add(_UNARY | _ABSOLUTE)
        elif sign := words.took("-", "~"):
            if sign == "-" and words.next.isdecimal():
                _immediate(part, -words.number())
            else:
                part = self._term()
                part.add(_UNARY | (_NEGATE if sign == "-" else _INVERT))
        elif words.next.isdecimal():
            _immediate(part, words.number())
        else:
            name, address, length, index = self._place()
            if length is None:
                part.join(index)
                part.add(_LOAD_AT | address, self._lengths[name])
            elif length == 1:
                part.add(_LOAD | address)
            else:
                raise words.wrong(f"expected one element of {name}")
        return part


def _immediate(part: _Part, value: int) -> None:
    if not -0x8000 <= value < 0x8000:
        raise AeslError(f"expected a number of 16 bits, got {value}")
    if abs(value) >> 11:
        part.add(_LARGE, value)
    else:
        part.add(_SMALL | value & 0x0FFF)
