"""Home folders that are new or read-only: commands do not depend on caches."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ICCM = str(Path(sys.executable).parent / "iccm")
MAP = ("map", "square.svg", "blob.svg", "--method", "paper", "--vertices", "40", "--size", "32", "-o")


def environment(home):
    """The environment of a user with this home."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("XDG_", "MPL"))}
    return kept | {"HOME": str(home), "USERPROFILE": str(home)}


@pytest.mark.slow
def test_two_processes_in_a_new_home_at_once(shapes):
    """Both fill the caches of libraries, such as the list of fonts for plots."""
    (shapes / "home").mkdir()
    processes = [
        subprocess.Popen(
            [ICCM, *MAP, f"{name}.png", "--plot", f"{name}-plot.png"],
            env=environment(shapes / "home"),
            stderr=subprocess.PIPE,
            text=True,
        )
        for name in "ab"
    ]
    for process in processes:
        _, err = process.communicate(timeout=90)
        assert process.returncode in (0, 1) and "Traceback" not in err and "error" not in err, err
    for suffix in (".png", "-plot.png"):
        first, second = (shapes / f"{name}{suffix}" for name in "ab")
        assert first.read_bytes().startswith(b"\x89PNG")
        assert suffix != ".png" or first.read_bytes() == second.read_bytes()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="a folder that even root cannot make")
def test_a_home_that_cannot_be_written(shapes):
    """Commands work; those that install something there fail with one line."""
    home = environment("/proc/nobody")
    result = subprocess.run(
        [ICCM, *MAP, "o.png", "--plot", "p.png"], env=home, capture_output=True, text=True, timeout=90
    )
    assert result.returncode in (0, 1) and (shapes / "o.png").exists() and (shapes / "p.png").exists(), (
        result.stderr
    )
    assert "Traceback" not in result.stderr
    folder = "/proc/nobody/extensions"
    for line in (
        ("plugins", "install", "inkscape", "--to", folder),
        ("completion", "install", "--shell", "bash"),
    ):
        result = subprocess.run([ICCM, *line], env=home, capture_output=True, text=True, timeout=90)
        assert result.returncode == 2 and len(result.stderr.splitlines()) == 1
        assert result.stderr.startswith("error: /proc/nobody")
