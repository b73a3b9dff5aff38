"""The makers' own compiler against ours: a node that only listens takes what ``asebamassloader`` makes of an export."""

from __future__ import annotations

import os
import socket
import struct
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.firmware.aesl.document import aesl_document
from sceann_hil.firmware.aesl.program import Life, Senses, network_code
from sceann_hil.firmware.aesl.target import THYMIO
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics, Neuron
from sceann_hil.network.image import ControllerImage
from tests.backends.thymio.strange import description, words
from tests.firmware.aseba_vm import Machine
from tests.firmware.networks import random_sensors


def _with_a_locale(folder: Path) -> dict[str, str]:
    """An environment in which there is an American locale, without which the makers' tool does not start."""
    (folder / "locale").mkdir()
    (folder / "locale" / "en_US.UTF-8").symlink_to("/usr/lib/locale/C.utf8")
    return {**os.environ, "LOCPATH": str(folder / "locale"), "LC_ALL": "en_US.UTF-8"}


def their_words(path: Path) -> tuple[int, ...]:
    """Byte code that the makers' tools make of a file."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(60.0)
        target = f"tcp:host=127.0.0.1;port={server.getsockname()[1]}"
        loader = subprocess.Popen(
            ["asebamassloader", "--once", str(path), target],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=_with_a_locale(path.parent),
        )
        theirs: dict[int, int] = {}
        try:
            line, _ = server.accept()
            line.settimeout(60.0)
            with line, line.makefile("rb") as heard:
                while len(header := heard.read(6)) == 6:
                    length, _, kind = struct.unpack("<3H", header)
                    content = heard.read(length)
                    if kind == 0xA011:
                        line.sendall(struct.pack("<3H", 2, 1, 0x900C) + words(5))
                    elif kind in (0xA000, 0xA010):
                        for told, payload in description():
                            line.sendall(struct.pack("<3H", len(payload), 1, told) + payload)
                    elif kind == 0xA001:
                        _, at, *part = struct.unpack(f"<{length // 2}H", content)
                        theirs |= {at + k: word for k, word in enumerate(part)}
                    elif kind == 0xA003:
                        break
        finally:
            loader.kill()
            said = loader.communicate()[0].decode(errors="replace")
    assert theirs, said
    return tuple(theirs[at] for at in range(len(theirs)))


@pytest.mark.parametrize("neuron", Neuron)
def test_the_makers_compiler_makes_the_same_controller_of_an_export(neuron: Neuron, tmp_path: Path) -> None:
    size, life = NetworkSize(9, 3, 2), Life(0.1, Senses(True, True), 450)
    genome = np.random.default_rng(6).integers(0, 2, Coding.SCEANN2.genome_length(size)).astype(np.uint8)
    image = ControllerImage(
        genome, Coding.SCEANN2, size, Dynamics(neuron), 0.5, "sceann export runs/any --language aesl"
    )
    path = tmp_path / "champion.aesl"
    path.write_text(aesl_document(image, life), encoding="utf-8")
    ours = network_code(size, image.dynamics, life, weights=image.weights)
    theirs = replace(ours, words=their_words(path))
    assert len(theirs.words) <= THYMIO.bytecode_words
    machines = Machine(ours), Machine(theirs)
    for wire in random_sensors(np.random.default_rng(7), 60, 9).tolist():
        for machine in machines:
            if not machine.emitted:
                machine.event("sceann.start", 1, 50)
            machine.set("prox.horizontal", *(4 * value for value in wire[:7]))
            machine.set("prox.ground.delta", *wire[7:])
            machine.event("sceann.beat", 1)
            machine.event("timer0")
    assert machines[0].emitted == machines[1].emitted
    assert machines[0].emitted[-1][0] == "sceann.done"
    assert machines[0].get("u", 5) == machines[1].get("u", 5)
