"""One step of an exported header in AVR assembler: a network's own instructions, and as few of them as we know how.

The compiler would save, move and load again what this code keeps in place. What it rests on:

* Sums are made in register pairs, four at a time; sources pass through r17:r16; Y, Z and X point to the controller, the
  sensors and the motors. Y is saved here, because the compiler may use it as its frame pointer.
* A sensor's r + (r >> 9) is made while it is added: r0 holds 1, and comparing it with the high byte sets the carry for
  r >= 512.
* 8192 is a multiple of 128, so u = 128 k' + f needs no offset: k' = k - 64 counts from the middle of the table.
* Two neurons that share sources are summed up together (a + b and a - b). Of all ways of pairing four neurons the one
  with the fewest cycles is taken.

It takes the same time whatever the sensors say.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Weights
from sceann_hil.network.controller import Neuron
from sceann_hil.network.image import ControllerImage

_Q = 16
"""Low register of the pair that a source passes through."""
_PAIRS = (18, 20, 22, 24, 14, 12, 10, 8)
"""Low registers of the pairs that hold sums: any function may use the first four, and must save the others."""
_FREE_PAIRS = 4
_CYCLES_TO_SAVE_A_PAIR = 8
_AT_ONCE = 4
"""Neurons that are summed up together."""
_FARTHEST = 62
"""The largest displacement of a word behind Y or Z."""
_CYCLES = dict.fromkeys(("ldd", "std", "st", "push", "pop", "mul", "adiw", "sbiw", "rjmp"), 2) | {"rcall": 3}

Matching = tuple[tuple[int, ...], ...]
"""Neurons, alone or two together."""


def avr_step(image: ControllerImage) -> str:
    """The C function ``@name_step``, its body one block of assembler."""
    code = _Code(image)
    code.step()
    lines = "\n".join(f"        {line}" for line in code.text)
    clobbered = ", ".join(f'"r{k}"' for k in sorted(code.clobbered - {24, 25}))
    return f"""
/* registers: r17:r16 a source, r0 1, Y the controller, Z sensors, X motors; sums in the others */
static inline void @name_step(@name_t *c, const uint16_t *sensors, int16_t *motors)
{{
    register @name_t *at __asm__("r24") = c;
    __asm__ __volatile__(
{lines}
        : [at] "+r"(at), "+z"(sensors), "+x"(motors)
        : [middle] "i"(@name_nodes + 64)
        : {clobbered}, "memory");
}}
"""


def _matchings(rows: tuple[int, ...], weights: Weights) -> Iterator[Matching]:
    """All ways of taking some of these neurons in pairs, of those that share a source."""
    if not rows:
        yield ()
        return
    first, others = rows[0], rows[1:]
    for rest in _matchings(others, weights):
        yield ((first,), *rest)
    for partner in others:
        if (weights[first] * weights[partner]).any():
            for rest in _matchings(tuple(row for row in others if row != partner), weights):
                yield ((first, partner), *rest)


@dataclass(slots=True)
class _Variable:
    """A register pair that collects sources.

    Attributes:
        register: its low register.
        sign: 1, or -1 if it collects the negative of what it stands for; 0 while it holds nothing.
    """

    register: int = -1
    sign: int = 0


@dataclass(slots=True)
class _Unit:
    """One neuron, or two whose shared sources are collected once.

    Attributes:
        rows: the neurons.
        own: per neuron what it has alone: all of its sources, or those that the other one lacks.
        equal: shared sources with equal signs: in both sums.
        opposite: shared sources with opposite signs: in the first sum, and their negative in the second one.
        terms: per source, the variables that collect it and its signs there.
    """

    rows: tuple[int, ...]
    own: dict[int, _Variable] = field(default_factory=dict)
    equal: _Variable = field(default_factory=_Variable)
    opposite: _Variable = field(default_factory=_Variable)
    terms: dict[int, list[tuple[_Variable, int]]] = field(default_factory=dict)

    @classmethod
    def of(cls, rows: tuple[int, ...], weights: Weights, new: Callable[[], _Variable]) -> _Unit:
        """The unit of these neurons. `new` gives it variables."""
        product = weights[rows[0]] * weights[rows[1]] if len(rows) == 2 else np.zeros_like(weights[0])
        unit = cls(rows)
        for row in rows:
            alone = np.flatnonzero(weights[row] * (product == 0))
            if len(alone) or len(rows) == 1:
                unit.own[row] = new()
                unit.collect(unit.own[row], alone, weights[row])
        one_is_made_of_both = len(unit.own) < len(rows)
        if (product < 0).any() or one_is_made_of_both:
            unit.opposite = new()
            unit.collect(unit.opposite, np.flatnonzero(product < 0), weights[rows[0]])
        if (product > 0).any() or one_is_made_of_both:
            unit.equal = new()
            unit.collect(unit.equal, np.flatnonzero(product > 0), weights[rows[0]])
        return unit

    def collect(self, variable: _Variable, sources: NDArray[np.intp], signs: NDArray[np.int8]) -> None:
        """Notes that a variable collects these sources."""
        for j in sources.tolist():
            self.terms.setdefault(j, []).append((variable, int(signs[j])))

    def sign_of(self, row: int) -> int:
        """How `opposite` counts for a neuron."""
        return 1 if row == self.rows[0] else -1


@dataclass(slots=True)
class _Code:
    """Assembler of one network, instruction by instruction.

    Attributes:
        image: the network.
        text: lines of the header.
        cycles: what they take, the neurons' subroutine apart.
        clobbered: registers that they change.
        behind: what has been added to Y.
    """

    image: ControllerImage
    text: list[str] = field(default_factory=list)
    cycles: int = 0
    clobbered: set[int] = field(default_factory=lambda: {0, _Q, _Q + 1})
    behind: int = 0

    @property
    def accumulating(self) -> bool:
        """Whether a sum begins with the neuron's state."""
        return self.image.dynamics.neuron is Neuron.ACCUMULATING

    def emit(self, *instructions: str, note: str = "") -> None:
        """Instructions that belong together: one line of the header."""
        self.cycles += sum(_CYCLES.get(instruction.split()[0], 1) for instruction in instructions)
        line = '"' + "".join(f"{instruction} \\n\\t" for instruction in instructions) + '"'
        self.text.append(f"{line:<50} /* {note} */" if note else line)

    def word(self, sign: int, register: int, other: int) -> None:
        """Adds a register pair to another one (1), subtracts it (-1), or does neither (0)."""
        if sign:
            operation, carried = ("add", "adc") if sign > 0 else ("sub", "sbc")
            self.emit(f"{operation} r{register},r{other}", f"{carried} r{register + 1},r{other + 1}")

    def state(self, register: int, offset: int, store: bool = False, note: str = "") -> None:
        """Loads or stores a word of the controller."""
        while not self.behind <= offset <= self.behind + _FARTHEST:
            move = max(-_FARTHEST, min(offset - self.behind, _FARTHEST))
            self.emit(f"{'adiw' if move > 0 else 'sbiw'} r28,{abs(move)}")
            self.behind += move
        place = offset - self.behind
        if store:
            self.emit(f"std Y+{place},r{register}", f"std Y+{place + 1},r{register + 1}", note=note)
        else:
            self.emit(f"ldd r{register},Y+{place}", f"ldd r{register + 1},Y+{place + 1}", note=note)

    def step(self) -> None:
        """The whole step."""
        n, n_hidden = self.image.size.n_neurons, self.image.size.n_hidden
        self.emit("push r28", "push r29", "movw r28,%[at]", f"ldi r{_Q},1", f"mov r0,r{_Q}")
        places: dict[int, int] = {}
        for first in range(0, n, _AT_ONCE):
            places = self.cheapest(tuple(range(first, min(first + _AT_ONCE, n))))
            if n > _AT_ONCE:
                for row, place in places.items():
                    self.state(place, 2 * row, store=True, note=f"sum of neuron {row}")
        x = _PAIRS[0] if n > _AT_ONCE else places[0]
        for row in range(n):
            if n > _AT_ONCE:
                self.state(_Q, 2 * row)
                self.emit("rcall 1f")
            else:
                self.emit(f"movw r{_Q},r{places[row]}", "rcall 1f")
            self.state(_Q, 2 * row, store=True, note=f"neuron {row}")
            self.state(x, 2 * (n + row), store=True)
            if row >= n_hidden:
                self.emit(f"st X+,r{x}", f"st X+,r{x + 1}", note=f"motor {row - n_hidden}")
        self.emit("rjmp 2f")
        self.neuron(x)
        self.emit("2:", "pop r29", "pop r28")

    def cheapest(self, rows: tuple[int, ...]) -> dict[int, int]:
        """Sums up these neurons. Returns the low register of each one's sum."""
        best: tuple[int, _Code, dict[int, int]] | None = None
        for matching in _matchings(rows, self.image.weights):
            trial = replace(self, text=[], cycles=0, clobbered=set())
            places = trial.sums(matching)
            saved = sum(_CYCLES_TO_SAVE_A_PAIR for pair in _PAIRS[_FREE_PAIRS:] if pair in trial.clobbered)
            if best is None or trial.cycles + saved < best[0]:
                best = trial.cycles + saved, trial, places
        assert best is not None  # every neuron alone is a way
        _, chosen, places = best
        self.text += chosen.text
        self.cycles += chosen.cycles
        self.clobbered |= chosen.clobbered
        self.behind = chosen.behind
        return places

    def variable(self) -> _Variable:
        """The next pair of registers."""
        pair = next(pair for pair in _PAIRS if pair not in self.clobbered)
        self.clobbered |= {pair, pair + 1}
        return _Variable(pair)

    def sums(self, matching: Matching) -> dict[int, int]:
        """Sums up these neurons in this way. Returns the low register of each one's sum."""
        weights, n_sensors = self.image.weights, self.image.size.n_sensors
        units = [_Unit.of(rows, weights, self.variable) for rows in matching]
        for unit in units if self.accumulating else []:
            for row, own in unit.own.items():
                self.begin(own.register, row)
                own.sign = 1
        for j in [*range(n_sensors, weights.shape[1]), *range(n_sensors)]:
            terms = [term for unit in units for term in unit.terms.get(j, [])]
            if terms:
                self.source(j)
            for variable, sign in terms:
                self.collect(variable, sign, sensor=j < n_sensors)
        places: dict[int, int] = {}
        for unit in units:
            places |= self.finished(unit)
        return places

    def begin(self, register: int, row: int) -> None:
        """What a sum begins with: the neuron's state, or 0."""
        if self.accumulating:
            self.state(register, 2 * row, note=f"state of neuron {row}")
        else:
            self.emit(f"clr r{register}", f"clr r{register + 1}")

    def source(self, j: int) -> None:
        """Loads a sensor or an output."""
        n_sensors, n_neurons = self.image.size.n_sensors, self.image.size.n_neurons
        if j < n_sensors:
            self.emit(f"ldd r{_Q},Z+{2 * j}", f"ldd r{_Q + 1},Z+{2 * j + 1}", note=f"sensor {j}")
        else:
            self.state(_Q, 2 * (n_neurons + j - n_sensors), note=f"output of neuron {j - n_sensors}")

    def collect(self, variable: _Variable, sign: int, sensor: bool) -> None:
        """Adds the source to a variable, or begins it with that."""
        low, high = variable.register, variable.register + 1
        if variable.sign == 0:
            variable.sign = sign
            rounded = (f"cp r0,r{_Q + 1}", f"adc r{low},r1", f"adc r{high},r1") if sensor else ()
            self.emit(f"movw r{low},r{_Q}", *rounded)
        elif sensor:
            operation = "adc" if sign * variable.sign > 0 else "sbc"
            self.emit(f"cp r0,r{_Q + 1}", f"{operation} r{low},r{_Q}", f"{operation} r{high},r{_Q + 1}")
        else:
            self.word(sign * variable.sign, low, _Q)

    def finished(self, unit: _Unit) -> dict[int, int]:
        """The sums of a unit from its variables."""
        equal, opposite = unit.equal, unit.opposite
        places = {}
        for row, own in unit.own.items():
            self.positive(own)
            self.word(equal.sign, own.register, equal.register)
            self.word(opposite.sign * unit.sign_of(row), own.register, opposite.register)
            places[row] = own.register
        for row in unit.rows:
            if row not in places:
                places[row] = self.from_shared(unit, row, last=len(places) == 1)
        return places

    def positive(self, own: _Variable) -> None:
        """Makes a variable hold what it stands for."""
        low, high = own.register, own.register + 1
        if own.sign < 0:
            self.emit(f"neg r{high}", f"neg r{low}", f"sbc r{high},r1")
        elif own.sign == 0:
            self.emit(f"clr r{low}", f"clr r{high}")

    def from_shared(self, unit: _Unit, row: int, last: bool) -> int:
        """The sum of a neuron that has no source of its own. Returns its register.

        Unless it is the last one of its pair, the other one can still be made.
        """
        equal, opposite = unit.equal, unit.opposite
        self.begin(_Q, row)
        if last and equal.sign > 0:
            self.word(1, equal.register, _Q)
            self.word(opposite.sign * unit.sign_of(row), equal.register, opposite.register)
            return equal.register
        self.word(equal.sign, _Q, equal.register)
        self.word(opposite.sign * unit.sign_of(row), _Q, opposite.register)
        if last:
            self.emit(f"movw r{equal.register},r{_Q}")
            return equal.register
        if equal.sign == 0:
            self.emit(f"movw r{equal.register},r{opposite.register}")
            equal.sign = -opposite.sign
        else:
            self.word(-equal.sign * opposite.sign, equal.register, opposite.register)
        opposite.sign = 0
        self.emit(f"movw r{opposite.register},r{_Q}")
        return opposite.register

    def neuron(self, x: int) -> None:
        """The subroutine: from the sum in r17:r16 the new state there, and the output."""
        memoryless = not self.accumulating
        self.emit("1:", "ldi r30,0x20", "add r30,r17", note="beyond +-8192 the state becomes 0")
        self.emit("cpi r16,1", "sbci r30,0x40", note="carry: 0 <= sum + 8192 <= 16384")
        self.emit("sbc r30,r30", "and r16,r30", "and r17,r30", *(["bst r30,0"] if memoryless else []))
        self.emit("mov r0,r16", "lsl r0", "mov r30,r17", "rol r30", note="twice the state: k - 64 and 2 f")
        self.emit("lsl r30", "sbc r31,r31", "subi r30,lo8(-(%[middle]))", "sbci r31,hi8(-(%[middle]))")
        self.emit(f"lpm r{x},Z+", f"lpm r{x + 1},Z+", "lpm r30,Z", f"sub r30,r{x}", note="T[k], T[k + 1] - T[k]")
        self.emit("mul r30,r0", "lsl r0", f"adc r{x},r1", "clr r1", f"adc r{x + 1},r1")
        if memoryless:
            self.emit("brts .+2", f"clr r{x}", "brts .+2", f"clr r{x + 1}", note="two cycles each, skipping or not")
        self.emit("ret")
