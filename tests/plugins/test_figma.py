"""The plug-in for Figma: its code by tests in JavaScript, with a mock of Figma's API (figma.test.js).

Its window is tested in tests/web, in a browser.
"""

import shutil
import subprocess
from pathlib import Path

import pytest


@pytest.mark.skipif(not shutil.which("node"), reason="NO TESTS OF THE FIGMA PLUG-IN: install Node.js")
def test_code_with_a_mock_of_figma():
    tests = Path(__file__).with_name("figma.test.js")
    result = subprocess.run(["node", "--test", tests], capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
