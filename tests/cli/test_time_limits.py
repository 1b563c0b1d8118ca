"""Time limits for commands on meshes: outputs are complete, or a message names the limit and nothing is written.

The clock advances when it is read, so that no result depends on the machine.
"""

from pathlib import Path

import numpy as np
import pytest

from iccm.io.pictures import image_files
from tests.clock import Clock

LINES = {
    "flatten": ("flatten", "sheet.obj", "--method", "balanced", "-o", "out.svg", "--uv", "out.obj"),
    "flatten-onto": ("flatten", "sheet.obj", "--onto", "blob.svg", "--uv", "out.obj"),
    "relayout": ("relayout", "sheet.obj", "other.obj", "--texture", "t.png", "-o", "out.png"),
    "map-from-a-mesh": ("map", "sheet.obj", "blob.svg", "-o", "out.png", "--size", "32"),
    "map-onto-a-mesh": ("map", "square.svg", "sheet.obj", "--bake", "-o", "out.png", "--size", "32"),
    "map-between-meshes": ("map", "sheet.obj", "other.obj", "-o", "out.obj"),
}


def sheet(path, bend, n=9):
    """An open sheet of n × n points with texture coordinates, bent."""
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    rows = [f"v {a} {b} {bend(a, b)}" for a, b in zip(x.ravel(), y.ravel())]
    rows += [f"vt {0.1 + 0.8 * a} {0.1 + 0.7 * b}" for a, b in zip(x.ravel(), y.ravel())]
    for k in range(n - 1):
        for j in range(n - 1):
            a, b, c, d = (1 + j + n * k, 2 + j + n * k, 2 + j + n * (k + 1), 1 + j + n * (k + 1))
            rows += [f"f {a}/{a} {b}/{b} {c}/{c}", f"f {a}/{a} {c}/{c} {d}/{d}"]
    path.write_text("\n".join(rows) + "\n")


@pytest.fixture
def meshes(shapes):
    """The usual shapes with two meshes and a texture."""
    sheet(shapes / "sheet.obj", lambda a, b: 0.6 * np.exp(-9 * ((a - 0.6) ** 2 + (b - 0.45) ** 2)))
    sheet(shapes / "other.obj", lambda a, b: 0.4 * a * a - 0.2 * b, 11)
    image_files.write(str(shapes / "t.png"), image_files.Image(np.full((16, 16, 3), 90, np.uint8)))
    return shapes


@pytest.mark.slow
@pytest.mark.parametrize("name", LINES)
def test_outputs_are_whole_or_a_line_names_the_limit(meshes, iccm, monkeypatch, name):
    """A tenth, a half and most of the time that the command takes, in steps of the clock."""
    clock, line = Clock(monkeypatch), (*LINES[name], "--threads", "1", "--time-limit", "10", "--force")
    if line[0] != "map":
        line = tuple(word for word in line if word not in ("--threads", "1"))
    result = iccm(*line)
    assert result.code in (0, 1), result.err
    outputs = sorted(path for path in Path.cwd().glob("out*"))
    assert outputs
    checks = clock.checks
    for share in (0.1, 0.5, 0.9):
        for path in outputs:
            path.unlink()
        clock.now, clock.step = 0.0, 10 / (share * checks)
        result = iccm(*line)
        left = sorted(path for path in Path.cwd().glob("out*"))
        if not left:
            (message,) = [printed for printed in result.lines if not printed.startswith("note: ")]
            assert result.code == 1 and message.startswith("error: ") and "--time-limit" in message
        else:
            assert result.code in (0, 1) and left == outputs
        for path in outputs:
            path.touch()


@pytest.mark.parametrize("name", LINES)
def test_no_time_at_all_is_a_line(meshes, iccm, monkeypatch, name):
    clock, line = Clock(monkeypatch), (*LINES[name], "--time-limit", "1")
    clock.step = 1000.0
    result = iccm(*line)
    assert result.code == 1 and "--time-limit" in result.lines[-1]
    assert not list(Path.cwd().glob("out*"))
