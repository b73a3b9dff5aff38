"""A serial cable that can be as bad as one likes: frames lost, doubled, spoilt or swapped, plugs pulled."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import threading
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sceann_hil.firmware.emulated.pseudo_terminal import open_pseudo_terminal

DELIMITER = b"\0"


@dataclass(frozen=True, slots=True)
class LineFaults:
    """Probability, per frame and direction, of each thing that can happen to it; the rest arrives as it was sent."""

    lost: float = 0.0
    doubled: float = 0.0
    spoilt: float = 0.0
    swapped: float = 0.0

    def __post_init__(self) -> None:
        if min(self.lost, self.doubled, self.spoilt, self.swapped) < 0.0 or self.total > 1.0:
            raise ValueError(f"probabilities: expected 0..1 in all, got {self}")

    @property
    def total(self) -> float:
        """Probability that anything happens."""
        return self.lost + self.doubled + self.spoilt + self.swapped


class _Direction:
    """Frames on their way one way."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._part = b""
        self._held = b""

    def pass_on(self, data: bytes, faults: LineFaults) -> bytes:
        """What comes out at the other end."""
        *frames, self._part = (self._part + data).split(DELIMITER)
        return b"".join(self._one(frame + DELIMITER, faults) for frame in frames)

    def _one(self, frame: bytes, faults: LineFaults) -> bytes:
        held, self._held = self._held, b""
        draw = self._rng.random()
        if draw < faults.lost:
            return held
        if draw < faults.lost + faults.doubled:
            return frame + held + frame
        if draw < faults.lost + faults.doubled + faults.spoilt:
            place = int(self._rng.integers(len(frame)))
            flipped = frame[place] ^ (1 << int(self._rng.integers(8)))
            return frame[:place] + bytes((flipped,)) + frame[place + 1 :] + held
        if draw < faults.total:
            self._held = frame
            return held
        return frame + held


class Cable:
    """A cable from a board's socket to a pseudo-terminal whose path stays the same when it is plugged in again.

    Attributes:
        faults: what happens to frames from now on; may be changed at any time.

    Args:
        board: the host's end of the board's line.
        port: where the port appears (a symbolic link).
        seed: of the faults.
    """

    def __init__(self, board: socket.socket, port: Path, seed: int = 1) -> None:
        self.faults = LineFaults()
        self.port = port
        self._board = board
        rngs = np.random.default_rng(seed).spawn(2)
        self._to_host, self._to_board = _Direction(rngs[0]), _Direction(rngs[1])
        self._lock = threading.Lock()
        self._terminal: tuple[int, int] | None = None
        self._closing = threading.Event()
        self.plug()
        self._thread = threading.Thread(target=self._carry, name="cable", daemon=True)
        self._thread.start()

    @property
    def plugged(self) -> bool:
        """The cable is in."""
        return self._terminal is not None

    def pull(self) -> None:
        """The port is gone, for both sides."""
        with self._lock:
            if self._terminal is not None:
                for descriptor in self._terminal:
                    os.close(descriptor)
                self._terminal = None
            self.port.unlink(missing_ok=True)

    def plug(self) -> None:
        """The port is there again, perhaps under another number: the link leads to it."""
        with self._lock:
            if self._terminal is not None:
                return
            near, far, path = open_pseudo_terminal(waits=False)
            self.port.unlink(missing_ok=True)
            self.port.symlink_to(path)
            self._terminal = (near, far)

    def _carry(self) -> None:
        while not self._closing.is_set():
            with self._lock:
                near = self._terminal[0] if self._terminal is not None else None
            wanted = [self._board.fileno()] if near is None else [self._board.fileno(), near]
            try:
                ready = select.select(wanted, [], [], 0.01)[0]
            except (OSError, ValueError):
                continue
            with self._lock:
                still = self._terminal is not None and self._terminal[0] == near
                if self._board.fileno() in ready:
                    data = self._board.recv(65536)
                    if not data:
                        return
                    if near is not None and still:
                        # what a port that nobody reads cannot take is lost
                        with contextlib.suppress(BlockingIOError):
                            os.write(near, self._to_host.pass_on(data, self.faults))
                if near is not None and still and near in ready:
                    with contextlib.suppress(OSError):
                        self._board.sendall(self._to_board.pass_on(os.read(near, 65536), self.faults))

    def close(self) -> None:
        """Take it away."""
        self._closing.set()
        self._thread.join()
        self.pull()
