"""Imitate Windows or macOS for the code of iccm and its tests, in each Python process whose path has this folder.

Python imports `sitecustomize` before anything else. From then on, modules of this repository see stand-ins: `os`,
`signal`, `select`, `socket` and `sys` without what only POSIX (or Linux) has, and with the names and behaviour of the
other system. Libraries see the real system, because they have been ported by their authors.

On Windows, modules such as `fcntl` are missing, and text files are opened as cp1252 with line ends of two characters
where no encoding and no line end is given. For all code of the process, operations on files fail that fail on Windows:
names with characters that Windows does not allow, replacing or removing an open file, and forking. Text streams of
subprocesses are cp1252, too.

On macOS, C has no functions that only Linux has. On both, code of this repository cannot open files in /proc and /sys.
"""

import builtins
import ctypes
import errno
import importlib
import os
import pathlib
import re
import resource
import select
import signal
import subprocess
import sys
import types
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
OURS = tuple(
    str(ROOT / name) + os.sep for name in ("iccm", "io", "cli", "extensions", "plugins", "tests", "docs")
)
ENCODING = "cp1252"
SYSTEM = os.environ.get("ICCM_IMITATE", "")

MISSING_MODULES = """
    crypt curses fcntl grp nis posix pty pwd readline resource spwd syslog termios tty
"""
PRESENT_SIGNALS = """
    SIGABRT SIGFPE SIGILL SIGINT SIGSEGV SIGTERM SIG_DFL SIG_IGN Signals
"""
MISSING_IN_SIGNAL = """
    alarm getitimer pause pidfd_send_signal pthread_kill pthread_sigmask setitimer siginterrupt sigpending sigtimedwait
    sigwait sigwaitinfo
"""
MISSING_IN_SELECT = """
    epoll kqueue poll EPOLLIN POLLERR POLLHUP POLLIN POLLOUT
"""
MISSING_IN_SOCKET = """
    AF_UNIX AF_NETLINK recv_fds send_fds
"""
MISSING_IN_OS = """
    chown chroot confstr copy_file_range ctermid eventfd fchdir fchmod fchown fork forkpty fpathconf fstatvfs
    get_blocking getegid geteuid getgid getgrouplist getgroups getloadavg getpgid getpgrp getpriority getresgid
    getresuid getsid getuid getxattr initgroups killpg lchown listxattr lockf major makedev memfd_create minor mkfifo
    mknod nice openpty pathconf pidfd_open pipe2 posix_fadvise posix_fallocate posix_openpt posix_spawn posix_spawnp
    pread preadv pwrite pwritev readv register_at_fork removexattr sendfile set_blocking setegid seteuid setgid
    setgroups setpgid setpriority setregid setresgid setresuid setreuid setsid setuid setxattr splice statvfs sync
    sysconf sysconf_names tcgetpgrp tcsetpgrp ttyname uname wait wait3 wait4 waitid writev
    O_ACCMODE O_ASYNC O_CLOEXEC O_DIRECT O_DIRECTORY O_DSYNC O_LARGEFILE O_NDELAY O_NOATIME O_NOCTTY O_NOFOLLOW
    O_NONBLOCK O_PATH O_RSYNC O_SYNC O_TMPFILE
"""


def names_of(module: types.ModuleType, *beginnings: str) -> set[str]:
    """Return the names of a module that begin so."""
    return {name for name in dir(module) if name.startswith(beginnings)}


MISSING_IN = {
    "os": {*MISSING_IN_OS.split(), *names_of(os, "sched_", "SCHED_", "RTLD_", "WIF", "WEXIT", "WSTOP")},
    "select": set(MISSING_IN_SELECT.split()),
    "signal": {*MISSING_IN_SIGNAL.split(), *names_of(signal, "SIG", "Sig", "ITIMER")}
    - set(PRESENT_SIGNALS.split()),
    "socket": set(MISSING_IN_SOCKET.split()),
    "sys": {"abiflags"},
}
MISSING_IN_OS_OF_MACOS = """
    copy_file_range eventfd eventfd_read eventfd_write fexecve getrandom getresgid getresuid getxattr listxattr
    memfd_create pidfd_open pipe2 plock posix_fadvise posix_fallocate removexattr setns setresgid setresuid setxattr
    sched_getaffinity sched_getparam sched_getscheduler sched_rr_get_interval sched_setaffinity sched_setparam
    sched_setscheduler splice unshare
    O_DIRECT O_LARGEFILE O_NOATIME O_PATH O_RSYNC O_TMPFILE
"""
MISSING_IN_SIGNAL_OF_MACOS = """
    SIGCLD SIGPOLL SIGPWR SIGRTMAX SIGRTMIN SIGSTKFLT pidfd_send_signal sigtimedwait sigwaitinfo
"""
MISSING_ON_MACOS = {
    "os": {*MISSING_IN_OS_OF_MACOS.split(), *names_of(os, "EFD_", "MFD_", "CLONE_", "SPLICE_", "XATTR_")},
    "select": names_of(select, "epoll", "EPOLL"),
    "signal": set(MISSING_IN_SIGNAL_OF_MACOS.split()),
    "socket": {"AF_NETLINK", "AF_PACKET", "AF_VSOCK"},
    "sys": set(),
}
MISSING_IN_C_OF_MACOS = {
    "prctl",
    "malloc_trim",
    "mallopt",
    "sched_getaffinity",
    "gettid",
    "mremap",
    "fallocate",
}
RESERVED = re.compile(r"(con|prn|aux|nul|com[1-9]|lpt[1-9])(\.|$)", re.IGNORECASE)
FORBIDDEN = re.compile(r'[<>:"|?*\x00-\x1f]|[ .]$')
LONGEST_NAME = 255  # characters of one component of a path, on NTFS


class Module(types.ModuleType):
    """A module of the standard library as it is on Windows: some names are missing, and some differ."""

    def __init__(self, real: types.ModuleType, missing: set[str], **different: object) -> None:
        super().__init__(real.__name__, real.__doc__)
        self.__dict__.update(_real=real, _missing=missing, _different=different)

    def __getattr__(self, name: str) -> object:
        if name in self._different:
            return self._different[name]
        if name in self._missing:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r} on Windows", name=name)
        return getattr(self._real, name)

    def __setattr__(self, name: str, value: object) -> None:
        if name in self._different or name in self._missing:
            self._different[name] = value
        else:
            setattr(self._real, name, value)

    def __delattr__(self, name: str) -> None:
        if name in self._different:
            del self._different[name]
            self._missing.add(name)
        else:
            delattr(self._real, name)

    def __dir__(self) -> list[str]:
        return sorted({*dir(self._real), *self._different} - self._missing)


class Library(ctypes.CDLL):
    """A library of C as it is on macOS, without functions that only Linux has."""

    def __getattr__(self, name: str) -> object:
        if self._name is None and name in MISSING_IN_C_OF_MACOS:
            raise AttributeError(f"dlsym(RTLD_DEFAULT, {name}): symbol not found on macOS")
        return super().__getattr__(name)


def kill(pid: int, number: int) -> None:
    """End a process without asking it, as TerminateProcess does, whatever the signal is."""
    if number not in (CTRL_C_EVENT, CTRL_BREAK_EVENT):
        os.kill(pid, KILL)


def open_descriptor(path: object, flags: int, *args: object, **kwargs: object) -> int:
    """Open a file, but not a folder."""
    if os.path.isdir(path):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), path)
    return os.open(path, flags, *args, **kwargs)


def usage_in_bytes(who: int) -> object:
    """Return the resources that a process has used, with memory in bytes, not in KiB."""
    real = resource.getrusage(who)
    fields = {name: getattr(real, name) for name in dir(real) if name.startswith("ru_")}
    return types.SimpleNamespace(**{**fields, "ru_maxrss": real.ru_maxrss << 10})


KILL = signal.SIGKILL
CTRL_C_EVENT, CTRL_BREAK_EVENT = -2, -1  # numbers that no signal of this system has
SIGBREAK = signal.SIGQUIT  # ends a process, unless it is handled
STAND_INS_OF_WINDOWS = {
    "os": Module(
        os,
        MISSING_IN["os"],
        name="nt",
        kill=kill,
        open=open_descriptor,
        O_BINARY=0,
        supports_dir_fd=set(),
        supports_fd=set(),
    ),
    "signal": Module(
        signal,
        MISSING_IN["signal"],
        SIGBREAK=SIGBREAK,
        CTRL_C_EVENT=CTRL_C_EVENT,
        CTRL_BREAK_EVENT=CTRL_BREAK_EVENT,
    ),
    "sys": Module(sys, MISSING_IN["sys"], platform="win32"),
}
STAND_INS_OF_MACOS = {
    "os": Module(os, MISSING_ON_MACOS["os"]),
    "signal": Module(signal, MISSING_ON_MACOS["signal"]),
    "sys": Module(sys, MISSING_ON_MACOS["sys"], platform="darwin"),
    "ctypes": Module(ctypes, set(), CDLL=Library),
    "resource": Module(resource, set(), getrusage=usage_in_bytes),
}
STAND_INS = STAND_INS_OF_MACOS if SYSTEM == "macos" else STAND_INS_OF_WINDOWS
MISSING = MISSING_ON_MACOS if SYSTEM == "macos" else MISSING_IN


def import_as_there(name, globals=None, locals=None, fromlist=(), level=0):
    """Import a module for code of this repository."""
    if SYSTEM == "windows" and level == 0 and name.partition(".")[0] in MISSING_MODULES.split():
        raise ModuleNotFoundError(f"No module named {name!r} on Windows", name=name)
    module = builtins.__import__(name, globals, locals, fromlist, level)
    if level:
        return module
    if name in ("select", "socket") and name not in STAND_INS:
        STAND_INS[name] = Module(module, MISSING[name])
    return STAND_INS.get(name.partition(".")[0] if not fromlist else name, module)


def with_windows_text(mode, encoding, newline):
    """Return the encoding and the line ends of a text file for which they are not given."""
    if "b" in mode:
        return encoding, newline
    encoding = ENCODING if encoding in (None, "locale") else encoding
    writes = any(letter in mode for letter in "wax+")
    return encoding, "\r\n" if newline is None and writes and "r" not in mode else newline


def open_as_on_windows(
    file, mode="r", buffering=-1, encoding=None, errors=None, newline=None, *args, **kwargs
):
    """Open a file for code of this repository."""
    encoding, newline = with_windows_text(mode, encoding, newline)
    return open(file, mode, buffering, encoding, errors, newline, *args, **kwargs)


def open_path(self, mode="r", buffering=-1, encoding=None, errors=None, newline=None):
    """Open the file of a `pathlib.Path`."""
    encoding, newline = with_windows_text(mode, encoding, newline)
    return open(self, mode, buffering, encoding, errors, newline)


OUR_BUILTINS = {**vars(builtins), "__import__": import_as_there}
if SYSTEM == "windows":
    OUR_BUILTINS["open"] = open_as_on_windows


def with_our_builtins(execute):
    """Return `exec_module` of a loader, by which modules of this repository see the imitated system."""

    def exec_module(self, module):
        file = getattr(module, "__file__", None) or ""
        if os.path.realpath(file).startswith(OURS):
            module.__dict__["__builtins__"] = OUR_BUILTINS
        return execute(self, module)

    return exec_module


def caller() -> str:
    """Return the name of the module whose code called an audited function."""
    frame = sys._getframe(2)
    return frame.f_globals.get("__name__", "")


def check_name(path: object) -> None:
    """Refuse the name of a file that Windows refuses.

    Raises:
        OSError: it has forbidden characters, is reserved, or is too long.
    """
    if not isinstance(path, str) or not path or path.startswith(("/dev/", "/proc/", "/sys/")):
        return
    for part in path.split("/"):
        if part in ("", ".", ".."):
            continue
        if FORBIDDEN.search(part) or RESERVED.match(part) or len(part) > LONGEST_NAME:
            raise OSError(
                errno.EINVAL, "The filename, directory name, or volume label syntax is incorrect", path
            )


def check_closed(path: object) -> None:
    """Refuse to replace or remove a file that this process has open.

    Raises:
        PermissionError: it is open.
    """
    if not isinstance(path, (str, os.PathLike)):
        return
    real = os.path.realpath(path)
    if not os.path.isfile(real):
        return
    for number in os.listdir("/proc/self/fd"):
        try:
            target = os.readlink(f"/proc/self/fd/{number}")
        except OSError:
            continue
        if target == real:
            raise PermissionError(
                errno.EACCES,
                "The process cannot access the file because it is being used by another process",
                path,
            )


def audit(event: str, arguments: tuple) -> None:
    """Let operations fail that fail on Windows."""
    if event in ("open", "os.mkdir"):
        check_name(arguments[0])
    elif event == "os.rename":
        check_name(arguments[1])
        check_closed(arguments[0])
        check_closed(arguments[1])
    elif event == "os.remove":
        if caller() != "tempfile":  # which removes open files where the system lets it
            check_closed(arguments[0])
    elif event in ("os.fork", "os.forkpty"):
        raise OSError(errno.ENOSYS, "Windows cannot fork")


def audit_files_of_linux(event: str, arguments: tuple) -> None:
    """Refuse to let code of this repository open files that only Linux has."""
    if event == "open" and isinstance(arguments[0], str) and arguments[0].startswith(("/proc/", "/sys/")):
        frame = sys._getframe(1)
        while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] == "pathlib":
            frame = frame.f_back
        if os.path.realpath(frame.f_code.co_filename).startswith(OURS):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), arguments[0])


def install() -> None:
    """Imitate the system in this process."""
    loaders = importlib._bootstrap_external._LoaderBasics
    loaders.exec_module = with_our_builtins(loaders.exec_module)
    sys.addaudithook(audit_files_of_linux)
    if SYSTEM == "macos":
        return
    pathlib.Path.open = open_path
    start = subprocess.Popen.__init__

    def start_with_encoding(self, *args, **kwargs):
        if (kwargs.get("text") or kwargs.get("universal_newlines")) and kwargs.get("encoding") is None:
            kwargs["encoding"] = ENCODING
        start(self, *args, **kwargs)

    subprocess.Popen.__init__ = start_with_encoding
    sys.addaudithook(audit)


if SYSTEM in ("windows", "macos") and hasattr(os, "fork"):
    install()
