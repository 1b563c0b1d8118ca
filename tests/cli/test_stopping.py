"""Signals stop a run inside compiled code, and no incomplete file is left."""

import os
import signal
import subprocess
import sys

import pytest

LONG = """
import hashlib
from iccm import cli
from iccm.io import files

def main(*words, **options):
    with files.replacing("out.png") as path, files.scratch() as folder:
        path.write_text("half")
        print(folder, flush=True)
        hashlib.pbkdf2_hmac("sha256", b"", b"", 1 << 30)  # minutes, in which Python sees no signal

cli.iccm.main = main
cli.main(["map"])
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize(
    ("name", "message"), [("SIGTERM", "stopped by signal 15"), ("SIGINT", "interrupted")]
)
def test_a_signal_ends_compiled_code(tmp_path, name, message):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, "-c", LONG], cwd=tmp_path, **pipes) as process:
        folder = process.stdout.readline().strip()
        assert len(os.listdir(tmp_path)) == 1 and os.path.isdir(folder)
        process.send_signal(getattr(signal, name))
        _, output = process.communicate(timeout=60)
    assert process.returncode == 128 + getattr(signal, name)
    assert output == f"error: {message}\n"
    assert not os.listdir(tmp_path) and not os.path.exists(folder)


STARTING = """
import sys
from importlib.abc import MetaPathFinder

class Slow(MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "click":
            print("importing", flush=True)
            sys.stdin.readline()

sys.meta_path.insert(0, Slow())
from iccm.__main__ import main
main()
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
def test_an_interrupt_while_the_command_is_imported_prints_nothing(tmp_path):
    pipes = {stream: subprocess.PIPE for stream in ("stdin", "stdout", "stderr")}
    with subprocess.Popen([sys.executable, "-c", STARTING], cwd=tmp_path, text=True, **pipes) as process:
        assert process.stdout.readline() == "importing\n"
        process.send_signal(signal.SIGINT)
        _, output = process.communicate(timeout=60)
    assert process.returncode == 130 and output == ""


def test_a_caller_of_the_command_line_is_not_ended():
    """Only the entry points end the process: a test that calls `main` must not end silently as if it had passed."""
    result = subprocess.run([sys.executable, "-c", CALLING], capture_output=True, text=True)
    assert (result.returncode, result.stdout) == (3, "left with 2\n"), result.stderr


CALLING = """
import sys
from iccm.cli import main
try:
    main(["map", "missing.svg", "missing.svg"])
except SystemExit as ended:
    print("left with", ended.code)
sys.exit(3)
"""
