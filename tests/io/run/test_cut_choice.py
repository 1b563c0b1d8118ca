"""The cut of a closed mesh, chosen for the map onto it and not for its flattening."""

import json

import numpy as np
import pytest

from iccm.balanced import fit
from iccm.io.run import cut_choice

SHAPE = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="M10 40C10 10 40 5 60 12S98 40 90 60 60 95 '
    '40 90 10 70 10 40Z"/></svg>'
)
SIDES, HEIGHT, TAPER = 18, 0.5, 0.8


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a shape, and a flat can that is narrower above."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "shape.svg").write_text(SHAPE)
    rings = [
        (0.0, 0.5),
        *((k / 4 * HEIGHT, 1 - (1 - TAPER) * k / 4) for k in range(5)),
        (HEIGHT, 0.5 * TAPER),
    ]
    angles = 2 * np.pi * np.arange(SIDES) / SIDES
    points = [(r * np.cos(a), 1.1 * r * np.sin(a), z) for z, r in rings for a in angles]
    below, above = len(points) + 1, len(points) + 2
    rows = ["v {} {} {}".format(*p) for p in [*points, (0, 0, 0), (0, 0, HEIGHT)]]
    top = SIDES * (len(rings) - 1)
    for k in range(1, SIDES + 1):
        after = k % SIDES + 1
        rows += [
            f"f {first + k} {first + after} {first + SIDES + after} {first + SIDES + k}"
            for first in range(0, top, SIDES)
        ]
        rows += [f"f {below} {after} {k}", f"f {above} {top + k} {top + after}"]
    (tmp_path / "can.obj").write_text("\n".join(rows) + "\n")
    return tmp_path


def mapped(iccm, *words):
    result = iccm("map", "shape.svg", "can.obj", "-o", "o.glb", "--report", "r.json", "--force", *words)
    assert result.code < 2, result.err
    return json.loads(open("r.json").read()), result.err


@pytest.mark.slow
def test_the_cut_that_stretches_the_picture_less_is_used(folder, iccm, monkeypatch):
    with monkeypatch.context() as patched:
        patched.setattr(cut_choice, "SEAM_EXTENSIONS", ())
        for_flattening, _ = mapped(iccm)
    monkeypatch.setattr(fit, "stretch_notes", lambda distortion: [f"stretched by {distortion.stretch_p95}"])
    for_map, notes = mapped(iccm)
    assert "instead" in notes and "can.obj" in notes
    assert notes.count("stretched by") == 1  # the map that was replaced is not noted
    assert for_map["dilatation"]["p95"] < 0.85 * for_flattening["dilatation"]["p95"]
    assert for_map["flattening"] != for_flattening["flattening"]
    assert for_map["uv"] == {"flipped": 0, "degenerate": 0}


@pytest.mark.parametrize("large", [False, True])
def test_only_small_meshes_without_landmarks_have_a_choice(folder, iccm, monkeypatch, large):
    if large:
        monkeypatch.setattr(cut_choice, "MOST_TRIANGLES", 100)
        _, notes = mapped(iccm)
    else:
        _, notes = mapped(iccm, "--pin", "50,50:-0.7,0.3,0.5")
    assert "instead" not in notes
