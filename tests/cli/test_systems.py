"""Differences between systems and shells: modules that only POSIX has, little memory, pipes, completion."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

WITHOUT_POSIX = """
import mmap, os, signal, sys
for name in ("resource", "fcntl", "pwd", "grp", "termios", "tty", "pty", "syslog"):
    sys.modules[name] = None
for name in ("fork", "posix_fallocate", "statvfs", "getuid", "geteuid", "killpg", "getpgid", "setsid"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGHUP", "SIGALRM", "SIGKILL", "alarm", "setitimer"):
    if hasattr(signal, name):
        delattr(signal, name)
from iccm import cli
sys.exit(cli.run(sys.argv[1:]))
"""
QUICK = ("--method", "paper", "--vertices", "40")
COMMON = [
    (
        "map",
        "square.svg",
        "blob.svg",
        *QUICK,
        "--size",
        "24",
        "-o",
        "a.png",
        "--report",
        "a.json",
        "--memory",
        "1G",
    ),
    ("map", "square.svg", "blob.svg", *QUICK, "-o", "a.svg"),
    ("batch", "j.jsonl", "-j", "1"),
    ("info", "square.svg"),
    ("doctor",),
]


@pytest.mark.slow
@pytest.mark.parametrize("arguments", COMMON)
def test_the_common_path_needs_no_posix(shapes, arguments):
    job = {"source": "square.svg", "target": "blob.svg", "size": 16, "method": "paper", "vertices": 40}
    (shapes / "j.jsonl").write_text(json.dumps(job) + "\n")
    command = [sys.executable, "-c", WITHOUT_POSIX, *arguments]
    result = subprocess.run(command, capture_output=True, text=True, timeout=110)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize(
    "typed",
    ["iccm map sq", "iccm map --texture sq", "iccm batch sq", "iccm info sq", "iccm map a.svg b.svg -o sq"],
)
def test_names_of_files_are_completed(shapes, typed):
    variables = {
        "COMP_WORDS": typed,
        "COMP_CWORD": str(len(typed.split()) - 1),
        "_ICCM_COMPLETE": "bash_complete",
    }
    command = [sys.executable, "-c", "from iccm.cli import main; main()"]
    result = subprocess.run(command, capture_output=True, text=True, env=os.environ | variables)
    assert result.stdout == "file,sq\n"


def typed_in_bash(line, expected):
    """What an interactive bash with iccm's completion shows after a line that ends with a tab."""
    import pty
    import select

    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    process, screen = pty.fork()
    if not process:
        os.execvpe("bash", ["bash", "--norc", "--noprofile", "-i"], os.environ | {"PATH": path, "PS1": "$ "})
    seen, end = b"", time.monotonic() + 60
    begin = 'eval "$(_ICCM_COMPLETE=bash_source iccm)"; bind "set bell-style none"; echo rea"dy"\n'
    try:
        for text, until in ((begin, b"ready"), (line, expected.encode())):
            os.write(screen, text.encode())
            seen = b""
            while until not in seen and time.monotonic() < end:
                if select.select([screen], [], [], 0.2)[0]:
                    seen += os.read(screen, 4096)
    finally:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        os.close(screen)
    return seen.decode(errors="replace")


@pytest.mark.skipif(sys.platform == "win32" or not shutil.which("bash"), reason="a shell in a terminal")
@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("iccm map --texture astro\t", "--texture astronaut.png"),
        ("iccm batch jo\t", "batch jobs.toml"),
        ("iccm map a.svg b.svg -o fol\t", "-o folder/"),
        ("iccm map --max-fa\t", "--max-faces"),
    ],
)
def test_bash_completes(shapes, typed, expected):
    for name in ("astronaut.png", "jobs.toml"):
        (shapes / name).touch()
    (shapes / "folder").mkdir()
    assert expected in typed_in_bash(typed, expected)


@pytest.mark.slow
def test_a_batch_ends_as_a_pipe_does(shapes, shell):
    job = {"source": "square.svg", "target": "blob.svg", "size": 16, "method": "paper", "vertices": 40}
    lines = "".join(json.dumps({**job, "output": f"o{k}.png"}) + "\n" for k in range(8))
    (shapes / "j.jsonl").write_text(lines)
    result = shell("iccm batch j.jsonl -j 1 | head -1 > first; echo ${PIPESTATUS[0]}")
    assert result.stdout == "141\n" and "Traceback" not in result.stderr and "error" not in result.stderr
    assert json.loads((shapes / "first").read_text())["job"] == 1
    assert not [path.name for path in shapes.iterdir() if path.name.startswith(".o")]


@pytest.mark.skipif(sys.platform != "linux", reason="ulimit -v")
def test_lack_of_memory_is_reported_in_a_sentence(shapes, shell):
    result = shell("ulimit -v 600000; iccm map square.svg blob.svg -q -o o.png")
    assert result.returncode == 70 and result.stderr.count("\n") == 1
    assert result.stderr.startswith("error: out of memory") and not (shapes / "o.png").exists()
