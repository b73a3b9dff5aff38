"""The rig of a virtual robot that is switched off and on again."""

from __future__ import annotations

import json
import socket

import pytest

from backends.cartpole import CartPole
from backends.virtual.body import VirtualBody
from backends.virtual.rig_server import RigServer
from sceann_hil.errors import ConfigError


def asked(server: RigServer) -> str:
    host, port = server.address.split(":")
    start = dict.fromkeys(CartPole().spec.start_fields, 0.0)
    with socket.create_connection((host, int(port))) as line:
        line.sendall(json.dumps({"place": start}).encode() + b"\n")
        answer = line.makefile().readline().strip()
        line.settimeout(5)
        # the rig hangs up first, so its end of the connection lingers
        assert line.recv(1) == b""
    return answer


def test_it_gets_its_address_back_at_once() -> None:
    """Regression: for a minute after it was switched off its address was in use."""
    body = VirtualBody(CartPole())
    server = RigServer(body)
    port = int(server.address.split(":")[1])
    for _ in range(3):
        assert asked(server) == "ok"
        server.close()
        server = RigServer(body, port)
    with pytest.raises(ConfigError, match=f"--rig-port {port}"):
        RigServer(body, port)
    server.close()
