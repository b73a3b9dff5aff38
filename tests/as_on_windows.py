"""`python -m tests.as_on_windows ARGUMENTS...` is `sceann ARGUMENTS...` as if only Windows' modules were there.

The modules of this product, and they alone, find no POSIX module and no POSIX name in `os`, `signal`, `select` and
`socket`; `sys.platform` is ``win32``, and `msvcrt` locks as Windows does. That shows that nothing of POSIX stands in
the way. It does not show that Windows does what its documentation says.
"""

from __future__ import annotations

import builtins
import errno
import fcntl
import importlib
import os
import pkgutil
import runpy
import select
import stat
import struct
import subprocess
import sys
import types
from typing import Any

OURS = ("sceann_hil", "backends")
WITHOUT = frozenset(
    {"fcntl", "termios", "tty", "pty", "pwd", "grp", "resource", "syslog", "posix", "crypt", "nis", "readline"}
)
HIDDEN = {
    "os": """
        fork forkpty openpty killpg getpgid setpgid setsid getsid getuid geteuid getgid getegid setuid pread pwrite
        preadv pwritev O_CLOEXEC O_DIRECTORY O_NOFOLLOW O_NONBLOCK O_NOCTTY O_SYNC major minor makedev mkfifo mknod
        chown fchown fchmod lchown chroot fchdir ttyname ctermid nice setpriority getpriority PRIO_PROCESS
        sched_setscheduler SCHED_IDLE sched_param sched_getaffinity sched_yield statvfs fstatvfs sysconf uname wait
        wait3 wait4 WIFSIGNALED WIFEXITED register_at_fork posix_spawn sendfile sync getloadavg set_blocking
        get_blocking tcgetpgrp tcsetpgrp fdatasync
    """,
    "signal": """
        SIGHUP SIGKILL SIGTSTP SIGSTOP SIGCONT SIGCHLD SIGPIPE SIGUSR1 SIGUSR2 SIGALRM SIGQUIT SIGTTIN SIGTTOU SIGWINCH
        pause alarm setitimer getitimer pthread_kill pthread_sigmask sigwait sigpending siginterrupt
    """,
    "select": "poll epoll POLLIN POLLHUP POLLERR",
    "socket": "AF_UNIX send_fds recv_fds",
    "time": "tzset clock_gettime CLOCK_MONOTONIC",
}


class Without(types.ModuleType):
    """A module of which some names are gone; the rest, and whatever is set, are the real one's."""

    def __init__(self, real: types.ModuleType, gone: object, instead: dict[str, Any]) -> None:
        super().__init__(real.__name__)
        self.__dict__.update(_real=real, _gone=frozenset(gone), _instead=instead)  # type: ignore[call-overload]

    def __getattr__(self, name: str) -> Any:
        if name in self._gone:
            raise AttributeError(f"module '{self.__name__}' has no attribute '{name}' on Windows")
        return self._instead[name] if name in self._instead else getattr(self._real, name)

    def __setattr__(self, name: str, value: object) -> None:
        setattr(self._real, name, value)


def _locking(descriptor: int, mode: int, n_bytes: int) -> None:
    """As Windows: bytes from the current place on belong to this open file alone, until it is closed."""
    kind = fcntl.F_UNLCK if mode == 0 else fcntl.F_WRLCK
    writable = fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE != os.O_RDONLY
    if kind == fcntl.F_WRLCK and not writable:
        # Windows locks for readers, too
        kind = fcntl.F_RDLCK
    place = os.lseek(descriptor, 0, os.SEEK_CUR)
    try:
        fcntl.fcntl(descriptor, fcntl.F_OFD_SETLK, struct.pack("hhqqi4x", kind, os.SEEK_SET, place, n_bytes, 0))
    except OSError as error:
        raise OSError(errno.EACCES, "Permission denied") from error


def _alone(arguments: Any, options: dict[str, Any]) -> None:
    """What `subprocess.Popen` refuses on Windows."""
    for name in ("preexec_fn", "pass_fds", "start_new_session", "user", "group", "umask", "process_group"):
        if options.get(name):
            raise ValueError(f"{name} is not supported on Windows")


class WindowsPopen(subprocess.Popen):  # type: ignore[type-arg]
    """Knows what Windows knows."""

    def __init__(self, *arguments: Any, creationflags: int = 0, **options: Any) -> None:
        _alone(arguments, options)
        # our own programs see no POSIX either
        command = list(arguments[0])
        if command[:2] == [sys.executable, "-m"] and command[2].startswith(OURS):
            arguments = ([sys.executable, "-m", "tests.as_on_windows", "--module", *command[2:]], *arguments[1:])
        super().__init__(*arguments, **options)


MSVCRT = types.ModuleType("msvcrt")
MSVCRT.__dict__.update(locking=_locking, LK_UNLCK=0, LK_LOCK=1, LK_NBLCK=2, kbhit=lambda: False, getwch=lambda: "\x1a")


def _select(*waiting: Any) -> Any:
    """Windows can wait for sockets only."""
    for one in (one for some in waiting[:3] for one in some):
        if not stat.S_ISSOCK(os.fstat(one if isinstance(one, int) else one.fileno()).st_mode):
            raise OSError(errno.ENOTSOCK, "An operation was attempted on something that is not a socket")
    return select.select(*waiting)


INSTEAD: dict[str, dict[str, Any]] = {
    "os": {"O_BINARY": 0, "O_NOINHERIT": os.O_CLOEXEC},
    "select": {"select": _select},
    "sys": {"platform": "win32"},
    "subprocess": {"Popen": WindowsPopen, "CREATE_NEW_PROCESS_GROUP": 0x200},
}
_import = builtins.__import__
_shown: dict[str, types.ModuleType] = {}


def _shown_to_us(name: str) -> types.ModuleType:
    if name not in _shown:
        _shown[name] = Without(_import(name), HIDDEN.get(name, "").split(), INSTEAD.get(name, {}))
    return _shown[name]


def _windows_import(
    name: str, globals: Any = None, locals: Any = None, fromlist: Any = (), level: int = 0
) -> types.ModuleType:
    by = (globals or {}).get("__name__", "")
    if level == 0 and str(by).split(".")[0] in OURS:
        top = name.split(".")[0]
        if top in WITHOUT:
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)
        if name == "msvcrt":
            return MSVCRT
        if name in HIDDEN or name in INSTEAD:
            return _shown_to_us(name)
    return _import(name, globals, locals, fromlist, level)


def hide_posix() -> None:
    """From now on; modules of ours that are imported already keep what they have."""
    assert not [name for name in sys.modules if name.split(".")[0] in OURS]
    builtins.__import__ = _windows_import


def main() -> None:
    """Run what the command line names."""
    hide_posix()
    if sys.argv[1:2] == ["--module"]:
        module = sys.argv[2]
        sys.argv = [module, *sys.argv[3:]]
        runpy.run_module(module, run_name="__main__", alter_sys=True)
        return
    if sys.argv[1:2] == ["--import-all"]:
        for top in OURS:
            package = importlib.import_module(top)
            for found in pkgutil.walk_packages(package.__path__, f"{top}."):
                if not found.name.endswith(("__main__", *sys.argv[2:])):
                    importlib.import_module(found.name)
        return
    command = importlib.import_module("sceann_hil.cli").main
    if sys.argv[1:2] != ["--each"]:
        command()
    for line in sys.argv[2:]:
        sys.argv = ["sceann", *line.split()]
        try:
            command()
        except SystemExit as end:
            if end.code:
                raise
        sys.stderr.write(f"\nended well: {line}\n")


if __name__ == "__main__":
    main()
