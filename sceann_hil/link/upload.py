"""A connection matrix into the robot: the shortest coding that can express it, chunk by chunk, checked twice."""

from __future__ import annotations

from sceann_hil.link.messages import commit_arguments, load_arguments, pack_chunk
from sceann_hil.link.numbers import CHUNK_BYTES
from sceann_hil.link.session import NoAnswer, Refused, RobotLink
from sceann_hil.link.vocabulary import Function, Op, Status
from sceann_hil.network.coding import Bits, Coding, NetworkSize, Weights
from sceann_hil.network.controller import Dynamics
from sceann_hil.network.image import ControllerImage
from sceann_hil.robot import LinkError, RobotFault


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
    upload_image(link, ControllerImage(bits, coding, size, dynamics))


def upload_image(link: RobotLink, image: ControllerImage) -> None:
    """The same for a genome as it is.

    Raises:
        RobotFault, NoAnswer, Refused, LinkDown: see `upload`.
    """
    genome = image.packed_genome
    chunks = [genome[k : k + CHUNK_BYTES] for k in range(0, len(genome), CHUNK_BYTES)]
    with link.exclusive():
        link.request(Op.LOAD, load_arguments(image))
        for index, chunk in enumerate(chunks):
            link.send(Function.GENOME, pack_chunk(index, chunk))
        contradicted = False
        for _ in range(3 * len(chunks) + 3):
            try:
                reply = link.request(Op.COMMIT, commit_arguments(image.record_crc))
            except Refused as refused:
                if refused.status is not Status.MISSING_CHUNK:
                    raise
                link.statistics.retries += 1
                missing = refused.reply.missing_chunk
                if missing >= len(chunks):
                    raise LinkError(f"GENOME: the robot misses chunk {missing}, and there are {len(chunks)}") from None
                link.send(Function.GENOME, pack_chunk(missing, chunks[missing]))
                continue
            if reply.u32() != image.weights_crc and not contradicted:
                # asked once more: one odd frame is no fault of the robot
                contradicted = True
                continue
            if reply.u32() != image.weights_crc:
                raise RobotFault(
                    f"weights: expected CRC-32 {image.weights_crc:08x}, the robot decoded {reply.u32():08x}"
                )
            return
    raise NoAnswer("GENOME: the line loses nearly every chunk")
