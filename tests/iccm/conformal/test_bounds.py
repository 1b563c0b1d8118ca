"""Outlines that used to exhaust memory: very narrow slits, countries with ten thousand vertices."""

import subprocess
import sys

import numpy as np
import pytest

import iccm
from iccm import InputError
from iccm.conformal import method, panels, triangulation
from iccm.conformal.harmonic_measure import HarmonicMeasure
from iccm.curve import Curve

SQUARE = np.array([0, 1, 1 + 1j, 1j])


def slit(width):
    """The unit square, cut from the middle of its top to its centre."""
    return np.array([0, 1, 1 + 1j, 0.5 + width + 1j, 0.5 + 0.5j, 0.5 - width + 1j, 1j])


def coast(vertices, seed=0):
    """A closed fractal coast: midpoints are moved at random, less on every level, so that it remains simple."""
    rng = np.random.default_rng(seed)
    z = np.exp(2j * np.pi * np.arange(6) / 6)
    while z.size < vertices:
        step = np.roll(z, -1) - z
        middle = z + step * (0.5 + 0.22j * rng.uniform(-1, 1, z.size))
        z = np.column_stack([z, middle]).ravel()
    return z


def test_a_slit_as_wide_as_nothing_divides_no_panel_without_end():
    centre, seen, sizes = np.array([0.25 + 0.5j]), [], []
    for width in (1e-4, 1e-7):
        curve = Curve(slit(width))
        measure = HarmonicMeasure(
            curve, panels.graded(curve, 0.05, np.full(panels.corners(curve).size, 1e-3))
        )
        sizes.append(measure.ends.size)
        middle = measure.ends + 0.5 * measure.lengths
        mass, edge = measure.masses(centre)[0], curve.locate(middle)[0]
        seen.append([mass[edge == k].sum() for k in range(7)])
    assert max(sizes) < 500
    wide, narrow = seen
    assert narrow == pytest.approx(wide, abs=1e-3)
    assert narrow[4] > 0.1 > narrow[3] > 0  # the side of the slit that the centre sees, and the other


def test_every_panel_is_an_edge_and_the_rest_is_delaunay():
    curve = Curve(slit(1e-7))
    nodes = curve.at(panels.graded(curve, 0.05, np.full(panels.corners(curve).size, 1e-2)))
    inner = np.random.default_rng(0).uniform(size=(300, 2)) @ np.array([1, 1j])
    count, nodes = nodes.size, np.concatenate([nodes, inner[np.abs(inner.real - 0.5) > 0.01]])
    mesh = triangulation.delaunay(nodes)
    lacking = triangulation.missing(mesh, count, nodes.size)
    assert lacking.any()
    constrained = triangulation.constrained(nodes, mesh, lacking)
    assert not triangulation.missing(constrained, count, nodes.size).any()
    faces = triangulation.inside(curve, nodes, constrained)
    a, b, c = nodes[faces].T
    doubled = ((b - a).conj() * (c - a)).imag
    assert doubled.min() > 0
    assert doubled.sum() / 2 == pytest.approx(abs(Curve(nodes[:count]).area), rel=1e-9)
    assert cotangents(nodes, faces, count).min() > -1e-6


def cotangents(nodes, faces, panels):
    """Sums of the cotangents opposite to the edges that are not panels; negative for edges that are not Delaunay."""
    keys, values = [], []
    for k in range(3):
        apex, b, c = (faces[:, (k + j) % 3] for j in range(3))
        corner = (nodes[b] - nodes[apex]).conj() * (nodes[c] - nodes[apex])
        keys.append(triangulation.keys(b, c, nodes.size))
        values.append(corner.real / corner.imag)
    panel_keys = triangulation.keys(np.arange(panels), (np.arange(panels) + 1) % panels, nodes.size)
    unique, indices = np.unique(np.concatenate(keys), return_inverse=True)
    return np.bincount(indices, np.concatenate(values))[~np.isin(unique, panel_keys)]


@pytest.mark.parametrize(
    "shape", [slit(1e-13), np.append(slit(0.2)[:3], [0.5 + 1e-13 + 1j, 0.5 + 1.5j, 0.5 - 1e-13 + 1j, 1j])]
)
def test_hairs_are_removed_and_reported(shape):
    fit = iccm.fit(shape, 2 * SQUARE, method="conformal")
    assert any("slits and spikes" in note for note in fit.notes)
    centre = np.array([0.25 + 0.25j])
    assert fit.map(centre) == pytest.approx(2 * centre, abs=5e-3)


def test_crossings_larger_than_hairs_are_refused():
    bells = np.array(
        [0, 1, 1 + 1j, 0.5 + 1e-12 + 1j, 0.5 + 1e-12 + 2j, 1 + 2j, 1 + 3j, 3j, 2j, 0.5 - 1e-12 + 2j]
    )
    shape = np.concatenate([bells, [0.5 - 1e-12 + 1j, 1j]])
    with pytest.raises(InputError, match="too thin"):
        method.without_hairs(Curve(shape), "source")


def test_thickness_in_parts_is_thickness(monkeypatch):
    curve = Curve(coast(300))
    whole = panels.thickness(curve, 0.02)
    monkeypatch.setattr(panels, "PAIRS_AT_ONCE", 5000)
    for a, b in zip(whole, panels.thickness(curve, 0.02)):
        assert np.array_equal(a, b)


@pytest.mark.slow
def test_the_number_of_panels_is_bounded(monkeypatch):
    monkeypatch.setattr(method, "MOST_PANELS", 600)
    curve = Curve(coast(100))
    sharp = np.full(panels.corners(curve).size, 1e-4)
    assert panels.graded(curve, 0.002, sharp).size > 1200
    assert method.measure(curve, sharp, 0.002).ends.size <= 700


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_long_outlines_are_simplified_whatever_the_tolerance(tolerance):
    curve = Curve.domain(coast(10_000))
    simple, notes = method.simplify(curve, tolerance, "source")
    assert simple.z.size <= method.MOST_VERTICES // 2
    assert notes[0].startswith(f"source: simplified from {curve.z.size} to {simple.z.size} vertices")


def test_too_many_vertices_of_ones_own_are_refused():
    with pytest.raises(InputError, match="more than 4000"):
        iccm.fit(coast(5000), SQUARE, method="conformal", vertices="source")


COUNTRY = """
import resource, sys
import numpy as np
import iccm
from tests.iccm.conformal.test_bounds import SQUARE, coast
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
pair = (coast(10_000), SQUARE)
fit = iccm.fit(*(pair if sys.argv[2] == "source" else pair[::-1]), method=sys.argv[1])
print(fit.report()["boundary"]["hausdorff"])
"""


@pytest.mark.slow
@pytest.mark.parametrize("role", ["source", "target"])
@pytest.mark.parametrize("name", ["balanced", "conformal"])
def test_a_country_of_ten_thousand_vertices_takes_no_more_than_four_gigabytes(name, role):
    pytest.importorskip("resource")
    result = subprocess.run(
        [sys.executable, "-c", COUNTRY, name, role], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    assert float(result.stdout) < (1e-3 if name == "balanced" else 2e-2)


def test_nodes_on_an_edge_make_no_triangle():
    """Rounding put the nodes of a vertical edge into a triangle without area, which made the stiffness matrix
    singular.
    """
    circle = np.exp(2j * np.pi * (np.arange(120) + 0.5) / 120)
    curve = Curve(circle / abs(circle[0]))
    measure = HarmonicMeasure(curve, panels.graded(curve, 0.05, np.empty(0)))
    ends = np.linspace(0, curve.length, 720, endpoint=False)
    for divided in (measure, HarmonicMeasure(curve, ends)):
        assert np.isfinite(divided.masses(np.array([0.2 + 0.1j]))).all()
