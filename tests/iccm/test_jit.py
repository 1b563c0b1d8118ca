"""Kernels without an entry for Python are called by other kernels alone: from Python that ends the process."""

import ast
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
DECORATORS = ("inner", "inlined", "kernel", "kept", "compiled", "njit")


def decorator(node: ast.AST) -> str:
    """The name of what compiles a function; empty if nothing does."""
    if not isinstance(node, ast.FunctionDef):
        return ""
    names = [ast.unparse(each).partition("(")[0] for each in node.decorator_list]
    return next((name for name in names if name in DECORATORS), "")


def outside(tree: ast.AST):
    """The nodes of a module outside its kernels."""
    for node in ast.iter_child_nodes(tree):
        if not decorator(node):
            yield node
            yield from outside(node)


def named(node: ast.AST) -> str:
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


def misused(sources: dict[str, str]) -> set[str]:
    """Inner kernels that something other than a kernel names in their own module, or where they are imported."""
    trees = {name: ast.parse(source) for name, source in sources.items()}
    inner = {
        node.name
        for tree in trees.values()
        for node in ast.walk(tree)
        if decorator(node) in ("inner", "inlined")
    }
    found = set()
    for tree in trees.values():
        imported = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        here = {alias.asname or alias.name for node in imported for alias in node.names}
        here |= {node.name for node in ast.walk(tree) if decorator(node)}
        loose = {named(node) for node in outside(tree) if isinstance(node, ast.Name)} & here
        loose |= {named(node) for node in outside(tree) if isinstance(node, ast.Attribute)}
        found |= loose & inner
    return found


def test_inner_kernels_are_called_by_kernels_alone():
    files = [path for part in ("iccm", "io", "tests") for path in (ROOT / part).rglob("*.py")]
    assert not misused({str(path): path.read_text(encoding="utf-8") for path in files})


def test_the_scan_sees_a_call_from_python():
    kernels = "@inner\ndef f(x):\n    return x\n\n@kernel\ndef g(x):\n    return f(x)\n"
    assert not misused({"a": kernels})
    assert misused({"a": kernels + "\ndef h(x):\n    return f(x)\n"}) == {"f"}
    assert misused({"a": kernels, "b": "from a import f\nf(1)\n"}) == {"f"}
    assert misused({"a": kernels, "b": "import a\na.f(1)\n"}) == {"f"}


def test_a_kernel_follows_the_kernels_that_it_calls(tmp_path):
    """Numba's own stamp is that of one file: what another file changes would not be seen. What is kept under a class
    that is gone is no longer readable."""
    (tmp_path / "caller.py").write_text(
        "from jit import kernel\nimport called\nf = called.f\n@kernel\ndef g(x):\n    return f(x)\n"
    )
    (tmp_path / "jit.py").write_text((ROOT / "iccm" / "jit.py").read_text(encoding="utf-8"))
    said = []
    for number in (1, 2):
        (tmp_path / "called.py").write_text(
            "from typing import NamedTuple\nfrom jit import inner\n"
            f"class Kind{number}(NamedTuple):\n    x: int\nKind = Kind{number}\n"
            f"@inner\ndef f(kind):\n    return kind.x + {number}\n"
        )
        os.utime(tmp_path / "called.py", (10**9 + number, 10**9 + number))
        done = subprocess.run(
            [sys.executable, "-c", "import caller; print(caller.g(caller.called.Kind(0)))"],
            cwd=tmp_path, env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        said.append(done.stdout.strip())
    assert said == ["1", "2"]


def test_all_kernels_are_compiled_here():
    """What another decorator keeps would go on with old code of what it calls."""
    files = [path for part in ("iccm", "io") for path in (ROOT / part).rglob("*.py")]
    assert [path.name for path in files if "njit" in path.read_text(encoding="utf-8")] == ["jit.py"]
