"""Aseba's virtual machine, instruction by instruction as in the makers' ``aseba/vm/vm.c`` and ``natives.c``."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from sceann_hil.firmware.aesl.compiler import Code
from sceann_hil.firmware.aesl.program import EVENTS
from sceann_hil.firmware.aesl.target import THYMIO, Target


def signed(value: int) -> int:
    """The low 16 bits as a number with a sign."""
    return (value + 0x8000) % 0x10000 - 0x8000


_BINARY: dict[int, Callable[[int, int], int]] = {
    0: lambda a, b: a << b,
    1: lambda a, b: a >> b,
    2: lambda a, b: a + b,
    3: lambda a, b: a - b,
    4: lambda a, b: a * b,
    7: lambda a, b: a | b,
    8: lambda a, b: a ^ b,
    9: lambda a, b: a & b,
    10: lambda a, b: int(a == b),
    11: lambda a, b: int(a != b),
    12: lambda a, b: int(a > b),
    13: lambda a, b: int(a >= b),
    14: lambda a, b: int(a < b),
    15: lambda a, b: int(a <= b),
    16: lambda a, b: int(bool(a) or bool(b)),
    17: lambda a, b: int(bool(a) and bool(b)),
}


class Machine:
    """One robot's machine: memory, program, and what it has emitted.

    Attributes:
        memory: all variables.
        emitted: names and arguments of the events that it sent.
        steps: instructions that the last event took.
    """

    def __init__(self, code: Code, target: Target = THYMIO) -> None:
        self.code, self.target = code, target
        # what a program before left there
        self.memory = [12345] * target.variable_words
        self.emitted: list[tuple[str, tuple[int, ...]]] = []
        self.steps = 0
        self._words = list(code.words)
        self.set("timer.period", 0, 0)
        self.event("")

    def address(self, name: str) -> int:
        """Where a variable is."""
        return self.code.addresses[name] if name in self.code.addresses else self.target.address(name)

    def set(self, name: str, *values: int) -> None:
        """Write a variable."""
        at = self.address(name)
        self.memory[at : at + len(values)] = values

    def get(self, name: str, n: int = 1) -> tuple[int, ...]:
        """Read a variable."""
        at = self.address(name)
        return tuple(self.memory[at : at + n])

    def event(self, name: str, *arguments: int) -> None:
        """Something happens; its handler runs to its end."""
        if name == "":
            number = 0xFFFF
        elif name in EVENTS:
            number = EVENTS.index(name)
            self.set("event.args", *map(signed, arguments))
        else:
            number = 0xFFFE - self.target.local_events.index(name)
        for k in range(1, self._words[0], 2):
            if self._words[k] == number:
                self._run(self._words[k + 1])

    def _run(self, pc: int) -> None:
        words, memory, stack = self._words, self.memory, []
        self.steps = 0
        while True:
            assert len(stack) <= 32
            self.steps += 1
            word = words[pc]
            kind, low = word >> 12, word & 0x0FFF
            pc += 1
            if kind == 0:
                return
            if kind == 1:
                stack.append((low + 0x800) % 0x1000 - 0x800)
            elif kind == 2:
                stack.append(signed(words[pc]))
                pc += 1
            elif kind == 3:
                stack.append(memory[low])
            elif kind == 4:
                memory[low] = stack.pop()
            elif kind == 5:
                index = stack.pop()
                assert 0 <= index < words[pc], f"index {index} of {words[pc]}"
                stack.append(memory[low + index])
                pc += 1
            elif kind == 6:
                index = stack.pop()
                assert 0 <= index < words[pc], f"index {index} of {words[pc]}"
                memory[low + index] = stack.pop()
                pc += 1
            elif kind == 7:
                value = stack.pop()
                stack.append(signed(-value if low == 0 or (low == 1 and value < 0) else ~value if low == 2 else value))
            elif kind == 8:
                second, first = stack.pop(), stack.pop()
                stack.append(signed(_BINARY[low](first, second)))
            elif kind == 9:
                pc += (low + 0x800) % 0x1000 - 0x800 - 1
            elif kind == 10:
                second, first = stack.pop(), stack.pop()
                pc += 1 if _BINARY[low & 0xFF](first, second) else signed(words[pc]) - 1
            elif kind == 11:
                at, length = words[pc], words[pc + 1]
                self.emitted.append((EVENTS[low], tuple(memory[at : at + length])))
                pc += 2
            elif kind == 12:
                self._native(self.target.functions[low], stack)
            elif kind == 13:
                stack.append(pc)
                pc = low
            elif kind == 14:
                pc = stack.pop()

    def _native(self, name: str, stack: list[int]) -> None:
        memory = self.memory
        if name == "math.copy":
            dest, src, n = (stack.pop() for _ in range(3))
            memory[dest : dest + n] = memory[src : src + n]
        elif name == "math.fill":
            dest, value, n = (stack.pop() for _ in range(3))
            memory[dest : dest + n] = [memory[value]] * n
        elif name == "math.clamp":
            dest, src, low, high, n = (stack.pop() for _ in range(5))
            for k in range(n):
                value, least, most = memory[src + k], memory[low + k], memory[high + k]
                memory[dest + k] = most if value > most else max(value, least)
        elif name == "math.dot":
            dest, a, b, shift, n = (stack.pop() for _ in range(5))
            total = sum(memory[a + k] * memory[b + k] for k in range(n))
            memory[dest] = signed(total >> memory[shift])
        elif name == "math.muldiv":
            dest, a, b, c, n = (stack.pop() for _ in range(5))
            for k in range(n):
                product, by = memory[a + k] * memory[b + k], memory[c + k]
                quotient = abs(product) // abs(by)
                memory[dest + k] = signed(quotient if (product < 0) == (by < 0) else -quotient)
        else:
            raise AssertionError(f"no function {name}")


def told(machine: Machine, name: str) -> Sequence[tuple[int, ...]]:
    """Arguments of the emitted events of this name."""
    return [arguments for event, arguments in machine.emitted if event == name]
