"""Unit tests of the page's JavaScript modules that need no browser: `page/*.test.js`, run by `node --test`.

Skipped where there is no Node.js, or an old one.
"""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
TESTS = sorted((Path(__file__).parent / "page").glob("*.test.js"))
OLDEST = 20
"""The major version of Node.js needed by the tests: it has mock timers."""


@pytest.fixture(scope="module")
def node():
    """The command of Node.js."""
    command = shutil.which("node")
    if command is None:
        pytest.skip("NO TESTS OF THE PAGE'S MODULES: install Node.js")
    version = subprocess.run([command, "--version"], capture_output=True, text=True, check=True).stdout
    found = re.match(r"v(\d+)", version)
    if not found or int(found[1]) < OLDEST:
        pytest.skip(
            f"NO TESTS OF THE PAGE'S MODULES: Node.js {OLDEST} or later, and this is {version.strip()}"
        )
    return command


def test_there_are_tests():
    assert len(TESTS) >= 6


@pytest.mark.parametrize("path", TESTS, ids=lambda path: path.name.partition(".")[0])
def test_a_module_of_the_page(node, path):
    done = subprocess.run(
        [node, "--test", str(path)], cwd=ROOT, capture_output=True, text=True, encoding="utf-8"
    )
    passed = re.search(r"^# pass (\d+)$", done.stdout, re.MULTILINE) or re.search(r"pass (\d+)", done.stdout)
    assert done.returncode == 0 and passed and int(passed[1]) > 0, done.stdout + done.stderr


def test_the_page_loads_only_modules_that_are_there():
    """Each import of a module is a file beside it that exports the imported names."""
    folder = ROOT / "io" / "edit" / "page"
    texts = {path.name: path.read_text(encoding="utf-8") for path in folder.glob("*.js")}
    for name, text in texts.items():
        for names, module in re.findall(r"^import \{([^}]*)\} from '\./([^']+)';", text, re.MULTILINE):
            for word in names.split(","):
                exported = rf"^export (?:async )?(?:const|function|class) {word.strip()}\b"
                assert re.search(exported, texts[module], re.MULTILINE), (name, module, word)
