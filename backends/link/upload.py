"""A connection matrix into the robot: the shortest coding that can express it, chunk by chunk, checked twice."""

from __future__ import annotations

import struct
import zlib

import numpy as np

from backends.link.messages import (
    CHUNK_BYTES,
    Function,
    Op,
    Status,
    commit_arguments,
    load_arguments,
    pack_chunk,
)
from backends.link.session import NoAnswer, Refused, RobotLink
from sceann_hil.coding import Bits, Coding, NetworkSize, Weights
from sceann_hil.controller import Dynamics, Neuron
from sceann_hil.robot import RobotFault

CODING_NUMBER = {Coding.SCEANN1: 1, Coding.SCEANN2: 2, Coding.SCEANN3: 3}
NEURON_NUMBER = {Neuron.ACCUMULATING: 0, Neuron.MEMORYLESS: 1}


def shortest_genome(weights: Weights, size: NetworkSize) -> tuple[Coding, Bits]:
    """The coding with the fewest bits that expresses these weights (SCEANN2 expresses all)."""
    for coding in sorted(Coding, key=lambda c: c.block_length(size)):
        try:
            return coding, coding.encode(weights, size)
        except ValueError:
            continue
    raise ValueError("weights: expected -1, 0 or +1 everywhere")


def upload(link: RobotLink, weights: Weights, size: NetworkSize, dynamics: Dynamics) -> None:
    """Load a network and make it the one in use; the old one stays until the robot has all of it.

    Raises:
        RobotFault: what the robot decoded is not what was sent.
        NoAnswer, Refused, LinkDown: see `RobotLink.request`.
    """
    coding, bits = shortest_genome(weights, size)
    load = load_arguments(
        CODING_NUMBER[coding],
        NEURON_NUMBER[dynamics.neuron],
        size.n_sensors,
        size.n_hidden,
        size.n_motors,
        len(bits),
    )
    genome = np.packbits(bits).tobytes()
    record = load + struct.pack("<H", dynamics.initial_output) + genome
    chunks = [genome[k : k + CHUNK_BYTES] for k in range(0, len(genome), CHUNK_BYTES)]
    with link.exclusive():
        link.request(Op.LOAD, load)
        for index, chunk in enumerate(chunks):
            link.send(Function.GENOME, pack_chunk(index, chunk))
        for _ in range(3 * len(chunks) + 3):
            try:
                reply = link.request(Op.COMMIT, commit_arguments(zlib.crc32(record), dynamics.initial_output))
            except Refused as refused:
                if refused.status is not Status.MISSING_CHUNK:
                    raise
                link.statistics.retries += 1
                missing = refused.reply.missing_chunk
                link.send(Function.GENOME, pack_chunk(missing, chunks[missing]))
                continue
            expected = zlib.crc32(np.ascontiguousarray(weights, np.int8).tobytes())
            if reply.u32() != expected:
                raise RobotFault(f"weights: expected CRC-32 {expected:08x}, the robot decoded {reply.u32():08x}")
            return
    raise NoAnswer("GENOME: the line loses nearly every chunk")
