"""Many `sceann` commands quickly: one process imports what they need, then becomes each of them in a fork.

Run as a program, it reads a list of calls as JSON and prints what became of each. It is started in the surroundings
(locale, mounts, environment) that the commands are tried in.
"""

from __future__ import annotations

import atexit
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
PATIENCE_S = 60.0


@dataclass(frozen=True, slots=True)
class Call:
    """One command.

    Attributes:
        words: after `sceann`.
        folder: where it is called.
        closed: standard input and output are closed.
        interrupt_after_s: Ctrl-C comes then; 0 if never.
    """

    words: list[str]
    folder: str
    closed: bool = False
    interrupt_after_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Ended:
    """What became of a call; a negative code is a signal, 9 for one that did not end."""

    words: list[str]
    code: int
    output: str
    errors: str


def call_all(
    calls: Sequence[Call], environment: Mapping[str, str], wrapped: Sequence[str] = (), at_once: int = 2
) -> list[Ended]:
    """Call every command in an environment, and wait for all of them.

    Args:
        calls: of commands.
        environment: all of it.
        wrapped: a program that starts another one in other surroundings, such as ``unshare``.
        at_once: so many run side by side.
    """
    done = subprocess.run(
        [*wrapped, sys.executable, str(Path(__file__)), str(at_once)],
        input=json.dumps([asdict(call) for call in calls]).encode(),
        stdout=subprocess.PIPE,
        check=True,
        env={"PYTHONPATH": str(REPOSITORY), **environment},
        timeout=5 * PATIENCE_S,
    )
    return [Ended(**ended) for ended in json.loads(done.stdout)]


def _become(call: Call, output: int, errors: int) -> None:
    """The rest of this process is the command."""
    code = 1
    try:
        os.chdir(call.folder)
        nothing = os.open(os.devnull, os.O_RDONLY)
        for descriptor, opened in ((0, nothing), (1, output), (2, errors)):
            os.dup2(opened, descriptor)
        sys.argv = ["sceann", *call.words]
        sys.stdin = open(0, closefd=False)  # noqa: SIM115 - as the interpreter opens it
        if call.closed:
            os.close(0)
            os.close(1)
            sys.stdin = sys.stdout = None  # type: ignore[assignment] # as the interpreter does
        from sceann_hil.cli import main

        main()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        sys.excepthook(*sys.exc_info())  # type: ignore[arg-type]
    finally:
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
        os._exit(code)


def _call(call: Call) -> Ended:
    output, errors = os.memfd_create("output"), os.memfd_create("errors")
    pid = os.fork()
    if pid == 0:
        os.setpgid(0, 0)
        _become(call, output, errors)
    began_s, interrupted = time.monotonic(), False
    while True:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            break
        passed_s = time.monotonic() - began_s
        if passed_s > PATIENCE_S:
            os.kill(pid, signal.SIGKILL)
        elif call.interrupt_after_s and passed_s > call.interrupt_after_s and not interrupted:
            os.kill(pid, signal.SIGINT)
            interrupted = True
        time.sleep(0.02)
    texts = [os.pread(descriptor, 10_000_000, 0).decode(errors="replace") for descriptor in (output, errors)]
    os.close(output)
    os.close(errors)
    return Ended(call.words, os.waitstatus_to_exitcode(status), *texts)


def _all(calls: Sequence[Call], at_once: int) -> list[Ended]:
    ended: dict[int, Ended] = {}
    left = list(enumerate(calls))
    lock = threading.Lock()

    def work() -> None:
        while True:
            with lock:
                if not left:
                    return
                number, call = left.pop(0)
            ended[number] = _call(call)

    threads = [threading.Thread(target=work) for _ in range(at_once)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return [ended[number] for number in range(len(calls))]


def _import_what_commands_need() -> None:
    import importlib

    from sceann_hil.commands import COMMANDS

    for entry in COMMANDS.values():
        importlib.import_module(f"sceann_hil.commands.{entry.module}")
    for name in ("rich.console", "rich.table", "numba", "sceann_hil.run.experiment", "sceann_hil.journal"):
        importlib.import_module(name)


if __name__ == "__main__":
    asked = [Call(**call) for call in json.load(sys.stdin)]
    _import_what_commands_need()
    print(json.dumps([asdict(ended) for ended in _all(asked, int(sys.argv[1]))]))
