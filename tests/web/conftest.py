"""What the tests of the demo share."""

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def core(tmp_path_factory):
    """The core as a WebAssembly module."""
    folder = tmp_path_factory.mktemp("core")
    command = [
        sys.executable,
        Path(__file__).parents[2] / "core" / "compile.py",
        *("--target", "wasm32-wasi", folder),
    ]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder / "core.wasm"
