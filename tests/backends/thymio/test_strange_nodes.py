"""What a host says of nodes that are no Thymio, too old, asleep, or several; and of a missing package."""

from __future__ import annotations

import builtins
import socket
import threading
from dataclasses import replace
from typing import Any

import pytest

from sceann_hil.errors import PackageMissing
from sceann_hil.firmware.aesl.node import AsebaNode, NoNode
from sceann_hil.firmware.aesl.target import THYMIO
from sceann_hil.link.aseba_line import AsebaLine
from sceann_hil.robot import LinkError
from tests.backends.thymio.strange import Node, there


def connect(node: Node, number: int | None = None) -> None:
    with there(node):
        AsebaNode(AsebaLine(None, node.host), number).connect(0.6)


@pytest.mark.parametrize(
    ("node", "message"),
    [
        (Node(replace(THYMIO, name="e-puck0")), "expected a Thymio II .node thymio-II., found a e-puck0"),
        (Node(version=4), "firmware is too old: it speaks version 4"),
        (Node(replace(THYMIO, functions=THYMIO.functions[:10])), "firmware is too old: it has no math.dot"),
        (Node(None), "does not answer when it is asked to describe itself"),
        (Node(numbers=(7, 9)), "several robots, nodes 7, 9; expected one, or its number in robot.node"),
        (Node(numbers=()), "no robot answers. It is switched off or asleep"),
    ],
)
def test_a_node_that_is_no_good_is_told(node: Node, message: str) -> None:
    with pytest.raises(LinkError, match=message):
        connect(node)


def test_one_of_several_robots_can_be_chosen() -> None:
    connect(Node(numbers=(7, 9)), 7)
    with pytest.raises(LinkError, match="expected node 8, found 7, 9"):
        connect(Node(numbers=(7, 9)), 8)
    with pytest.raises(NoNode):
        connect(Node(numbers=()))


def test_what_speaks_something_else_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def greet() -> None:
            line, _ = server.accept()
            line.sendall(b"SSH-2.0-OpenSSH_9.2 Debian\r\n")
            line.recv(100)

        threading.Thread(target=greet, daemon=True).start()
        node = AsebaNode(AsebaLine(None, f"127.0.0.1:{server.getsockname()[1]}"))
        with pytest.raises(LinkError, match="does not speak Aseba"):
            node.connect(0.6)


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *arguments: Any, **more: Any) -> Any:
        if name.startswith("thymiodirect"):
            raise ModuleNotFoundError("No module named 'thymiodirect'", name="thymiodirect")
        return real(name, *arguments, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(PackageMissing, match="needs the package thymiodirect") as told:
        AsebaLine(None, "localhost")
    assert "pip install 'sceann-hil[thymio]'" in told.value.hint
