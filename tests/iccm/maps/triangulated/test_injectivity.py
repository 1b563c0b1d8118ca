"""The certificate holds exactly for maps that are one-to-one, however small the fold."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iccm.maps.triangulated.injectivity import positive
from iccm.maps.triangulated.map import TriangulatedMap
from iccm.maps.triangulated.patches import bernstein
from iccm.maps.triangulated.simple import fault
from tests.shapes import arrow, circle, ell, radial, star
from tests.triangulations import exact_turn, irregular, lattice, map_of, ring, wavy

SQUARE = np.array([0, 1, 1 + 1j, 1j])


def test_maps_that_are_one_to_one_are_certified():
    for map in (map_of(irregular(SQUARE, 0.1), wavy), map_of(ring(30, 4), lambda w: w + 0.1 * w**2)):
        certificate = map.injectivity
        assert certificate.certified
        assert certificate.report()["depth"] == 0
        assert certificate.zeros == 0
        assert certificate.obstacle == ""
        assert 0 < certificate.beltrami < 1


@settings(max_examples=60, deadline=None)
@given(st.data(), st.sampled_from(["source", "image"]), st.floats(-16, 0).map(lambda e: 10**e))
def test_no_fold_is_too_small(data, plane, depth):
    """An inner vertex is moved beyond the far side of one of its triangles, or exactly onto it."""
    map = map_of(irregular(SQUARE, 0.25), wavy)
    face = data.draw(st.integers(0, len(map.faces) - 1))
    inner = [k for k in range(3) if map.faces[face, k] not in map.loops[0]]
    if not inner:
        return
    k = inner[0]
    points = getattr(map, plane).copy()
    a, b = (points[map.faces[face, (k + n) % 3]] for n in (1, 2))
    points[map.faces[face, k]] = 0.5 * (a + b) - depth * 1j * (b - a)
    certificate = replace(map, **{plane: points}).injectivity
    turns = [exact_turn(*points[corners]) for corners in map.faces]
    assert certificate.certified == (min(turns) > 0)
    assert certificate.zeros >= sum(turn <= 0 for turn in turns)
    if min(turns) <= 0:
        assert "folded" in certificate.obstacle


def test_a_triangle_without_area_is_a_fold():
    z, faces, loops = lattice(4)
    w = z.copy()
    w[6] = 0.125 + 0.375j  # an inner vertex onto the opposite side, which is exact in binary
    assert sum(exact_turn(*w[face]) == 0 for face in faces) > 0
    for source, image in ((z, w), (w, z)):
        certificate = TriangulatedMap(source, image, faces, loops).injectivity
        assert not certificate.certified
        assert certificate.zeros == sum(exact_turn(*w[face]) <= 0 for face in faces)


def wound(n, turns):
    """Triangles of a disc around a vertex that they surround several times: all are positive."""
    w = np.concatenate([[0], np.exp(2j * np.pi * turns * np.arange(n) / n)])
    faces = np.stack([np.zeros(n, int), 1 + np.arange(n), 1 + (np.arange(n) + 1) % n], axis=1)
    return w, faces, (1 + np.arange(n),)


def test_two_sheets_are_rejected_though_all_triangles_are_positive():
    z, faces, loops = wound(13, 1)
    for turns in (2, 3):
        for source, image in ((z, wound(13, turns)[0]), (wound(13, turns)[0], z)):
            certificate = TriangulatedMap(source, image, faces, loops).injectivity
            assert not certificate.certified
            assert certificate.zeros == 0
            assert "crosses" in certificate.obstacle


def test_a_crossing_outline_is_rejected():
    """A strip bent beyond a full ring: its ends overlap."""
    w, faces, loops = irregular(np.array([0, 8, 8 + 1j, 1j]), 0.25)
    for angle, certified in ((6.2, True), (6.5, False)):
        bent = (2 - w.imag) * np.exp(1j * w.real / 8 * angle)
        assert TriangulatedMap(w, bent, faces, loops).injectivity.certified == certified
        assert TriangulatedMap(bent, w, faces, loops).injectivity.certified == certified


def test_a_mirrored_map_is_rejected():
    z, faces, loops = irregular(ell(), 0.3)
    assert not TriangulatedMap(z, z.conj(), faces, loops).injectivity.certified
    assert not TriangulatedMap(z.conj(), z.conj(), faces, loops).injectivity.certified


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1j * np.inf])
def test_vertices_that_are_not_finite_are_rejected(bad):
    z, faces, loops = irregular(ell(), 0.3)
    w = z.copy()
    w[5] = bad
    bulge = np.zeros(len(TriangulatedMap(z, z, faces, loops).edges.ends), complex)
    assert not TriangulatedMap(z, w, faces, loops, bulge=bulge).injectivity.certified


def test_loops_must_be_the_boundary_and_edges_have_two_triangles():
    z, faces, loops = ring(20, 3)
    assert not TriangulatedMap(z, z, faces, loops[:1]).injectivity.certified
    assert not TriangulatedMap(z, z, faces, (loops[0], loops[1][::-1])).injectivity.certified
    for face in faces[[0, len(faces) // 2 + 1]]:  # at the boundary and inside
        assert not TriangulatedMap(z, z, np.concatenate([faces, [face]]), loops).injectivity.certified


def test_outlines_by_exact_signs():
    assert not fault([star(60)])
    assert not fault([3 * circle(20), circle(7)[::-1] / 2, 2 + circle(9)[::-1] / 3])
    assert fault([star(60)[::-1]])
    assert fault([3 * circle(20), circle(7)])
    assert "outside" in fault([circle(20), 5 + circle(7)[::-1]])
    assert "another hole" in fault([3 * circle(20), circle(9)[::-1], circle(7)[::-1] / 2])
    assert "touches" in fault([np.array([0, 2, 2 + 2j, 1, 2j])])  # a vertex on an edge
    assert "touches" in fault(
        [np.array([0, 2, 2 + 2j, 1 + 1e-16j, 2j]) - 1e-17j * np.array([0, 0, 0, 10, 0])]
    )
    assert "touches" in fault([np.array([0, 2, 1, 2 + 2j, 2j])])  # back on itself
    assert "touches" in fault([np.array([0, 0, 1, 1j])])


@given(
    st.lists(st.floats(0.3, 1), min_size=5, max_size=12),
    st.floats(-16, -1).map(lambda e: 10**e),
    st.integers(0, 4),
    st.booleans(),
)
def test_a_vertex_moved_through_an_edge_is_detected(radii, depth, k, crosses):
    """A spike from a far vertex to an opposite edge, short of it or through it by any depth."""
    loop = radial(radii, np.zeros(len(radii)))
    a, b = loop[k], loop[(k + 1) % loop.size]
    tip = 0.5 * (a + b) + (-1 if crosses else 1) * depth * 1j * (b - a)
    opposite = (k + 1 + loop.size // 2) % loop.size
    spiked = np.insert(loop, opposite + 1, [tip])
    spiked = np.insert(
        spiked, opposite + 2, [0.999 * loop[opposite] + 0.001 * loop[(opposite + 1) % loop.size]]
    )
    if opposite == loop.size - 1 or exact_turn(a, b, tip) > 0:
        return
    assert fault([spiked])


@settings(deadline=None)
@given(st.integers(0, 10_000), st.floats(0.01, 1))
def test_patches_certified_as_positive_are_positive(seed, size):
    rng = np.random.default_rng(seed)
    corners = np.tile([0, 1, 0.3 + 0.8j], (40, 1)) + 0.2 * (
        rng.normal(size=(40, 3)) + 1j * rng.normal(size=(40, 3))
    )
    bulge = size * 0.3 * (rng.normal(size=(40, 3)) + 1j * rng.normal(size=(40, 3)))
    sure = positive(corners, bulge)
    l1, l2 = rng.dirichlet([0.5] * 3, 400).T[:2]
    l0 = 1 - l1 - l2
    (x, y, z), (d0, d1, d2) = (part[sure].T[..., None] for part in (corners, bulge))
    a = y - x + 2 * ((l0 - l1) * d2 + l2 * (d0 - d1))
    b = z - x + 2 * ((l0 - l2) * d1 + l1 * (d0 - d2))
    assert np.all((a.conj() * b).imag > 0)
    assert np.array_equal(
        sure, bernstein(corners, bulge).min(axis=0) > 0
    )  # nothing is near enough to be uncertain


def test_a_bulge_too_large_is_rejected():
    map = map_of(irregular(arrow(), 0.3), lambda w: w + 0.02 * w**2)
    inner = np.setdiff1d(np.arange(len(map.edges.ends)), map.edges.rim)
    for edge in inner[:5]:
        bulge = map.bulges.copy()
        bulge[edge] += 0.5
        certificate = replace(map, bulge=bulge).injectivity
        assert not certificate.certified
        assert "patches may be folded" in certificate.obstacle


def test_an_outline_that_turns_back_is_rejected():
    map = map_of(irregular(arrow(), 0.3), lambda w: w)
    i, j = map.edges.ends[map.edges.rim[0]]
    bulge = map.bulges.copy()
    bulge[map.edges.rim[0]] = 0.6 * (map.source[j] - map.source[i])
    assert "edges of the outline" in replace(map, bulge=bulge).injectivity.obstacle
