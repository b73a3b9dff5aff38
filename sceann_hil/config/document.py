"""Strict YAML: plain data, and for every key and value the place where it was written.

The dialect is the core schema of YAML 1.2, which editors use as well: ``yes``, ``on``, ``1:30`` and dates are
text, and ``1e-3`` is a number. What makes a file hard to trust is refused: duplicate keys, aliases, tags,
several documents. Scanner and parser are PyYAML's.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import Any, Final

import yaml
from yaml.composer import Composer
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from yaml.parser import Parser
from yaml.reader import Reader, ReaderError
from yaml.resolver import BaseResolver
from yaml.scanner import Scanner

from sceann_hil.config.problems import Path, Place, Problem, dotted, fail

MAX_DEPTH: Final = 20
"""Deepest nesting of mappings and lists."""
MAX_DIGITS: Final = 400
"""Longest whole number: longer than any double, shorter than what Python refuses to read."""

FLOAT_TAG: Final = "tag:yaml.org,2002:float"
FLOAT_PATTERN: Final = re.compile(
    r"(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))\Z"
)
INT_TAG: Final = "tag:yaml.org,2002:int"
INT_PATTERN: Final = re.compile(r"(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)\Z")
NUMBER_STARTS: Final = list("-+.0123456789")


@dataclass(frozen=True, slots=True)
class Document:
    """A configuration as it was written.

    Attributes:
        source: the file, as it is named in messages.
        data: the plain data: dicts with text keys, lists, text, numbers, booleans and None.
        keys: where each key of a mapping stands.
        values: where each value begins.
        problems: what is wrong with the writing itself, such as a duplicate key.
    """

    source: str
    data: Any
    keys: dict[Path, Place] = field(default_factory=dict)
    values: dict[Path, Place] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def place_of_key(self, path: Path) -> Place:
        """Where a key stands, or else the nearest section around it."""
        while path and path not in self.keys:
            path = path[:-1]
        return self.keys.get(path) or self.values.get((), Place(0, 1, 1, self.source))

    def place_of_value(self, path: Path) -> Place:
        """Where a value begins, or else the nearest section around it."""
        return self.values.get(path) or self.place_of_key(path)

    def below(self, path: Path) -> Document:
        """One value as a document of its own, with its places and problems; it shares the data."""
        data, n = self.data, len(path)
        for part in path:
            data = data[part]
        keys = {inner[n:]: place for inner, place in self.keys.items() if len(inner) > n and inner[:n] == path}
        values = {inner[n:]: place for inner, place in self.values.items() if inner[:n] == path}
        here = dotted(path)
        problems = [problem for problem in self.problems if f"{problem.key}.".startswith((f"{here}.", f"{here}["))]
        return Document(self.source, data, keys, values, problems)


def parse(text: str, source: str, override: int = 0) -> Document:
    """Plain data from YAML text.

    Args:
        text: one YAML document.
        source: the file's name, or the ``--set`` option, for messages.
        override: number of the ``--set`` option, 0 for a file.

    Raises:
        ConfigError: the text is not YAML.
    """
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(override, mark.line + 1, mark.column + 1, source) if mark else Place(override, 1, 1, source)
        fail(place, _syntax(error))
    except ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        column = error.position - text.rfind("\n", 0, error.position)
        what = f"U+{error.character:04X}"
        fail(Place(override, line, column, source), f"expected text, got the control character {what}")
    document = Document(source, None)
    if node is None:
        return document
    return replace(document, data=_Builder(document, override, loader.tags).build(node, ()))


def _syntax(error: yaml.MarkedYAMLError) -> str:
    if isinstance(error, _Refused):
        return str(error.problem)
    problem = (error.problem or "not YAML").removeprefix("but ")
    if "'\\t'" in problem:
        return "a tab cannot indent; use spaces"
    if problem == "mapping values are not allowed here":
        problem = "unexpected ':' (is the line indented too far, or a text with ':' not in quotes?)"
    if problem == "found another document":
        return "expected one document, found a second one after ---"
    began = error.context_mark
    if error.context and began and error.problem_mark and began.line != error.problem_mark.line:
        problem += f" ({error.context} that began in line {began.line + 1})"
    return f"not valid YAML: {problem}"


class _Resolver(BaseResolver):
    """Which plain scalars are not text: the core schema of YAML 1.2."""


_Resolver.add_implicit_resolver("tag:yaml.org,2002:null", re.compile(r"(?:~|null|Null|NULL|)\Z"), ["~", "n", "N", ""])
_Resolver.add_implicit_resolver(
    "tag:yaml.org,2002:bool", re.compile(r"(?:true|True|TRUE|false|False|FALSE)\Z"), list("tTfF")
)
_Resolver.add_implicit_resolver(INT_TAG, INT_PATTERN, NUMBER_STARTS)
_Resolver.add_implicit_resolver(FLOAT_TAG, FLOAT_PATTERN, NUMBER_STARTS)


class _Refused(yaml.MarkedYAMLError):
    """YAML that this dialect leaves out."""

    def __init__(self, problem: str, event: yaml.Event) -> None:
        super().__init__(problem=problem, problem_mark=event.start_mark)  # type: ignore[arg-type]


class _Loader(Reader, Scanner, Parser, Composer, _Resolver):
    """PyYAML up to the node graph, without aliases and with bounded depth."""

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        Parser.__init__(self)
        Composer.__init__(self)
        _Resolver.__init__(self)
        self._depth = 0
        self.tags: dict[Node, str] = {}
        """As they were written, of the nodes that have one."""

    def compose_node(self, parent: Node | None, index: Any) -> Node | None:
        event: yaml.Event = self.peek_event()  # type: ignore[no-untyped-call]
        if isinstance(event, yaml.AliasEvent):
            problem = f"the alias *{event.anchor} is not supported here, write the value out"
            raise _Refused(problem, event)
        if self._depth == MAX_DEPTH:
            problem = f"nested more than {MAX_DEPTH} levels deep"
            raise _Refused(problem, event)
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        if node is not None and (tag := getattr(event, "tag", None)) is not None:
            self.tags[node] = tag.replace("tag:yaml.org,2002:", "!!")
        return node


class _Builder:
    """Plain data from nodes; places and problems are noted in the document."""

    def __init__(self, document: Document, override: int, tags: dict[Node, str]) -> None:
        self._document = document
        self._override = override
        self._tags = tags

    def build(self, node: Node, path: Path) -> Any:
        self._document.values[path] = self._place(node)
        if self._is_tagged(node, path):
            return None
        match node:
            case MappingNode():
                return self._mapping(node, path)
            case SequenceNode():
                return [self.build(item, (*path, index)) for index, item in enumerate(node.value)]
            case ScalarNode():
                return self._scalar(node, path)
        raise TypeError(f"expected a mapping, a sequence or a scalar, got {node!r}")

    def _is_tagged(self, node: Node, path: Path) -> bool:
        if node not in self._tags:
            return False
        self._problem(node, path, f"the tag {self._tags[node]} is not supported, remove it")
        return True

    def _mapping(self, node: MappingNode, path: Path) -> Any:
        data: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, ScalarNode):
                self._problem(key_node, path, "expected a word as key")
                continue
            if self._is_tagged(key_node, (*path, key_node.value)):
                continue
            key = key_node.value
            here = (*path, key)
            if key in data:
                first = self._document.keys[here].line
                self._problem(key_node, here, f"this key is given twice, first in line {first}")
                continue
            self._document.keys[here] = self._place(key_node)
            data[key] = self.build(value_node, here)
        return data

    def _scalar(self, node: ScalarNode, path: Path) -> Any:
        text: str = node.value
        match node.tag.removeprefix("tag:yaml.org,2002:"):
            case "null":
                return None
            case "bool":
                return text.lower() == "true"
            case "int" if INT_PATTERN.match(text):
                if len(text) > MAX_DIGITS:
                    return self._problem(node, path, f"expected a number of at most {MAX_DIGITS} digits")
                return int(text, 0) if text[1:2] in ("x", "o") else int(text)
            case "float" if FLOAT_PATTERN.match(text):
                # YAML writes .inf and .nan, Python inf and nan.
                return float(text.lower().replace(".i", "i").replace(".n", "n"))
            case "str":
                if any("\ud800" <= character <= "\udfff" for character in text):
                    return self._problem(node, path, "expected text, got half a surrogate pair")
                return text
        return self._problem(node, path, f"the tag {node.tag} is not supported here")

    def _place(self, node: Node) -> Place:
        mark = node.start_mark
        return Place(self._override, mark.line + 1, mark.column + 1, self._document.source)

    def _problem(self, node: Node, path: Path, message: str) -> None:
        self._document.problems.append(Problem(self._place(node), dotted(path), message))
