"""Figures of a written mesh, compared with the numbers in its file."""

import json

import numpy as np
import pytest
import shapely

pytestmark = pytest.mark.usefixtures("solve_once")

N = 4


def hill(path):
    """An OBJ of triangles over the unit square, with four edges on each side of its boundary."""
    x, y = (
        coordinates.ravel() for coordinates in np.meshgrid(np.linspace(0, 1, N + 1), np.linspace(0, 1, N + 1))
    )
    k = np.arange(1, (N + 1) ** 2 + 1).reshape(N + 1, N + 1)
    a, b, c, d = (coordinates.ravel() for coordinates in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
    rows = [f"v {p} {q} {0.4 * np.sin(3 * p) * q}" for p, q in zip(x, y)]
    path.write_text(
        "\n".join([*rows, *(f"f {p} {q} {r}\nf {p} {r} {s}" for p, q, r, s in zip(a, b, c, d)), ""])
    )


def written(path):
    """Corners (m, 3, 3) of triangles in space, texture coordinates (m, 3, 2), and their boundary in order."""
    lines = [line.split() for line in path.read_text().splitlines()]
    v, vt = (np.array([line[1:] for line in lines if line[:1] == [word]], float) for word in ("v", "vt"))
    corners = np.array([[c.split("/")[:2] for c in line[1:]] for line in lines if line[:1] == ["f"]], int) - 1
    half = {tuple(edge) for t in corners[..., 1] for edge in zip(t, np.roll(t, -1))}
    after = {a: b for a, b in half if (b, a) not in half}
    rim = [min(after)]
    while (step := after[rim[-1]]) != rim[0]:
        rim.append(step)
    return v[corners[..., 0]], vt[corners[..., 1]], vt[rim]


def quantile(values, weights, share):
    order = np.argsort(values)
    summed = np.cumsum(weights[order])
    return values[order][np.searchsorted(summed, share * summed[-1])]


MAP = ("map", "disk.svg", "hill.obj", "-o", "o.obj")
FLATTEN = ("flatten", "hill.obj", "--onto", "disk.svg", "--uv", "o.obj")


@pytest.mark.parametrize("words", [MAP, FLATTEN])
def test_figures_are_those_of_the_file(shapes, iccm, words):
    hill(shapes / "hill.obj")
    result = iccm(*words, "--report", "r.json")
    report = json.loads((shapes / "r.json").read_text())
    space, uv, rim = written(shapes / "o.obj")
    if words is FLATTEN:  # coordinates fill 0 to 1
        low, high = np.array(report["box"])
        uv, rim = ((coordinates * (high - low).max() + low + (0, 100)) / 100 for coordinates in (uv, rim))
    e, d = (
        np.stack([coordinates[:, 1] - coordinates[:, 0], coordinates[:, 2] - coordinates[:, 0]], axis=-1)
        for coordinates in (space, 100 * uv)
    )
    area = np.linalg.norm(np.cross(e[..., 0], e[..., 1]), axis=1) / 2
    major, minor = np.linalg.svd(e @ np.linalg.inv(d), compute_uv=False).T
    scale = np.sqrt(area.sum() / (np.abs(np.linalg.det(d)).sum() / 2))
    dilatation, stretch = major / minor, np.maximum(major / scale, scale / minor)
    for name, share in (("median", 0.5), ("p95", 0.95), ("max", 1.0)):
        assert report["dilatation"][name] == pytest.approx(quantile(dilatation, area, share), rel=1e-6)
    assert report["stretch"]["p95"] == pytest.approx(quantile(stretch, area, 0.95), rel=1e-6)
    triangle_scale = np.sqrt(major * minor) / scale
    assert report["scale"]["within2"] == pytest.approx(
        area[(triangle_scale < 2) & (triangle_scale > 0.5)].sum() / area.sum()
    )
    scales = np.log10(area / (np.abs(np.linalg.det(d)) / 2))
    weights, sign = np.abs(np.linalg.det(d)), 1
    # the plane's area relative to the surface's, normalised by the mean, over the surface
    if words is FLATTEN:
        scales, weights, sign = scales - np.log10(scale**2), area, -1
    for name, share in (("p05", 0.05), ("median", 0.5), ("p95", 0.95)):
        expected = quantile(sign * scales, weights, share)
        assert report["log10_area"][name] == pytest.approx(expected, abs=1e-6)
    circle = shapely.Point(50, 50).buffer(40, quad_segs=256).exterior
    chords = shapely.LinearRing(100 * rim)
    gap = max(
        shapely.distance(shapely.points(np.array(a.segmentize(0.1).coords)), b).max()
        for a, b in ((chords, circle), (circle, chords))
    ) / np.hypot(80, 80)
    assert report["boundary"]["hausdorff"] == pytest.approx(gap, rel=0.02)
    assert gap > 0.01
    assert "the mesh is too coarse (boundary)" in result.err
    assert result.code == 0
    if words is MAP:
        assert report["message"] in result.err
        note = "The mesh's vertices are on the outline; the edges between them are at most"
        assert report["message"].startswith(note)


@pytest.mark.slow
def test_one_quad_is_a_mesh_where_its_coordinates_are_requested(shapes, iccm):
    """Otherwise an OBJ with a single flat face is an outline."""
    (shapes / "quad.obj").write_text("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n")
    assert iccm("map", "square.svg", "quad.obj", "-o", "o.obj", "--report", "r.json").code == 0
    assert (shapes / "o.obj").read_text().count("vt ") == 4
    assert json.loads((shapes / "r.json").read_text())["mapped"] == 1
    assert iccm("map", "square.svg", "quad.obj", "-o", "o.png", "--report", "r.json", "--force").code == 0
    assert "mapped" not in json.loads((shapes / "r.json").read_text())


@pytest.mark.slow
@pytest.mark.parametrize(("source", "holes"), [("disk.svg", 0), ("ring.svg", 1)])
def test_a_cut_runs_into_the_holes_of_a_tube_that_the_source_has_none_for(shapes, iccm, source, holes):
    (shapes / "ring.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">'
        '<path fill-rule="evenodd" d="M1 1h7v7h-7zM3 3h3v3h-3z"/></svg>'
    )
    t = 2 * np.pi * np.arange(8) / 8
    rows = [f"v {np.cos(a)} {np.sin(a)} {z}" for z in range(5) for a in t]
    k = np.arange(40).reshape(5, 8) + 1
    quads = np.stack([k[:-1], np.roll(k[:-1], -1, 1), np.roll(k[1:], -1, 1), k[1:]], -1).reshape(-1, 4)
    (shapes / "tube.obj").write_text("\n".join([*rows, *("f {} {} {} {}".format(*q) for q in quads), ""]))
    iccm("map", source, "tube.obj", "--cut", "-o", "o.obj", "--report", "r.json")
    assert json.loads((shapes / "r.json").read_text())["flattening"]["holes"] == holes
