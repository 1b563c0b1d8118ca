"""Composing maps takes bounded work, whatever the maps are."""

import numpy as np
import pytest

from iccm import InputError
from iccm.maps import composition
from iccm.maps.refinement import Triangulation
from iccm.maps.triangulated.adjacency import neighbours
from tests.triangulations import irregular

BOX = np.array([0, 5, 5 + 3j, 3j])


def mesh_of(z, faces):
    return Triangulation(z, faces, neighbours(faces, z.size))


def unfolded(images, mesh, folded):
    """What `flip_folded` returns, one triangle after the other."""
    faces, folded, changed = mesh.faces.copy(), folded.copy(), set()
    for t in np.flatnonzero(folded).tolist():
        for k in range(3):
            neighbour = int(mesh.across[t, k])
            if neighbour < 0 or changed & {t, neighbour}:
                continue
            a, b, c = np.roll(mesh.faces[t], -k)
            (d,) = set(mesh.faces[neighbour].tolist()) - {b, c}
            pair = np.array([[a, b, d], [a, d, c]])
            areas = [composition.triangle_areas(w[pair]) for w in (*images, mesh.z)]
            if np.min(areas) > 0:
                faces[[t, neighbour]], changed = pair, changed | {t, neighbour}
                folded[[t, neighbour]] = False
    return faces, folded


def test_edges_of_folded_triangles_are_flipped_in_one_step(monkeypatch):
    z, faces, _ = irregular(BOX, 0.3)
    mesh, rng = mesh_of(z, faces), np.random.default_rng(5)
    bent = z + 0.12 * (rng.normal(size=z.size) + 1j * rng.normal(size=z.size))
    images = np.stack([z, bent])
    folded = composition._folded(images, faces)
    assert folded.sum() > 20
    calls = []
    monkeypatch.setattr(
        composition, "_folded", lambda w, f, folded=composition._folded: calls.append(len(f)) or folded(w, f)
    )
    flipped, left = composition.flip_folded(images, mesh, folded)
    assert len(calls) == 1
    expected, expected_left = unfolded(images, mesh, folded)
    assert np.array_equal(flipped, expected) and np.array_equal(left, expected_left)
    assert 0 < left.sum() < folded.sum()


def test_an_irregular_map_is_refused_after_a_bounded_number_of_triangles(monkeypatch):
    z, faces, _ = irregular(BOX, 0.3)
    counts = []
    monkeypatch.setattr(composition, "neighbours", lambda f, n: counts.append(len(f)) or neighbours(f, n))

    def noise(points):  # another one at each scale
        return points + 0.3 * np.sin(1e5 * points.real) + 0.3j * np.cos(1e5 * points.imag)

    with pytest.raises(InputError, match="too irregular"):
        composition.composed(z, faces, lambda points: points, noise)
    most = composition.MOST_TRIANGLES + composition.MOST_REFINED * len(faces)
    assert len(faces) < sum(counts) < 2 * most + max(counts)  # twice where edges are flipped
