"""Partial maps onto meshes: a flat mesh shows what the planar shape would."""

import json
from pathlib import Path

import numpy as np
import pytest

from iccm.io.pictures import image_files

N = 12
U = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 300"><path d="M0 300H300V0H260V260H40V0H0Z"/></svg>'


@pytest.fixture
def shapes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("u.svg").write_text(U)
    Path("square.svg").write_text(U.replace("H260V260H40V0", ""))
    rows = [(x / N, y / N) for y in range(N + 1) for x in range(N + 1)]
    corners = [y * (N + 1) + x + 1 for y in range(N) for x in range(N)]
    lines = [f"v {3 * x} {3 * y} 0\nvt {x} {y}" for x, y in rows]
    lines += ["f " + " ".join(f"{j}/{j}" for j in (k, k + 1, k + N + 2, k + N + 1)) for k in corners]
    Path("plane.obj").write_text("\n".join(lines))


@pytest.mark.slow
def test_a_mesh_is_uncovered_where_the_plain_shape_is(shapes, iccm):
    pixels = []
    for target, more in (("square.svg", ("--size", "200x200")), ("plane.obj", ("--bake", "--size", "200"))):
        contained = ("--fit", "contain", *more, "-o", "o.png", "--report", "r.json", "--force")
        result = iccm("map", "u.svg", target, *contained)
        report = json.loads(Path("r.json").read_text())
        assert result.code == 0 and 0.9 < report.get("covered", 1 - report.get("uncovered", 0)) < 0.98
        pixels.append(image_files.read(Path("o.png")).pixels.astype(float))
    plain, baked = pixels
    opaque = [picture[..., 3] > 127 for picture in pixels]
    assert 0.9 < opaque[0].mean() < 0.98
    assert (opaque[0] != opaque[1]).mean() < 0.01
    certain = (plain[..., 3] == 255) & (baked[..., 3] == 255)
    assert np.abs(plain - baked)[certain].mean() < 1


def test_a_mesh_with_coordinates_is_refused_for_partial_fits(shapes, iccm):
    result = iccm("map", "u.svg", "plane.obj", "--fit", "contain", "-o", "o.obj")
    assert result.code == 2 and "use --bake" in result.err and not Path("o.obj").exists()
