"""Soft pins on surfaces: their patches are those of the surface, for any layout and mesh."""

import numpy as np
import pytest
from trimesh.remesh import subdivide

import iccm
from iccm.errors import InputError
from iccm.flattening import flatten
from iccm.meshes.disk_patch import disk_patch
from iccm.meshes.locate import Locator
from iccm.meshes.mesh import Mesh
from iccm.meshes.stretch import laid_flat, linear
from tests.iccm.surfaces.test_surfaces import circle, grid, hill, warped

PLACES = np.array([[0.25, 0.3], [0.55, 0.62]])
"""Parameters of two points of the hill."""
GOALS = np.array([-0.1 + 0.25j, 0.45 + 0.1j])


def layout_of(count, places=PLACES, halvings=0):
    """Return a layout of the hill with `count` points a side, with its edges halved several times, and the positions of
    places in it.
    """
    mesh = grid(count, count + 4, hill)
    points, faces = mesh.points, mesh.corners.reshape(-1, 3)
    for _ in range(halvings):
        points, faces = subdivide(points, faces)
    layout = flatten(disk_patch(Mesh.triangles("hill", points, faces)))
    patch = layout.patch
    foot = patch.points[:, :2][patch.faces]
    matrix = np.stack([foot[:, 1] - foot[:, 0], foot[:, 2] - foot[:, 0]], axis=-1)
    positions = []
    for place in places:
        shares = np.linalg.solve(matrix, (place - foot[:, 0])[..., None])[..., 0]
        weights = np.column_stack([1 - shares.sum(axis=1), shares])
        triangle = int(np.argmax(weights.min(axis=1)))
        positions.append(weights[triangle] @ layout.flat[patch.faces[triangle]])
    return layout, np.array(positions)


@pytest.mark.slow
def test_a_surface_has_soft_pins_that_come_close_to_their_places():
    layout, pinned = layout_of(13)
    fit = iccm.fit(layout, circle(), pins=list(zip(pinned, GOALS)))
    missed = np.abs(fit.map(pinned) - GOALS)
    assert fit.status.ok and (missed > 1e-4).all() and (missed < fit.details.softness.limits).all()
    back = iccm.fit(circle(), layout, pins=list(zip(GOALS, pinned)))
    assert back.status.ok and (np.abs(back.map(GOALS) - pinned) < back.details.softness.limits).all()
    exact = iccm.fit(layout, circle(), pins=list(zip(pinned, GOALS)), exact_pins=True)
    assert np.abs(exact.map(pinned) - GOALS).max() < 1e-9
    strain = [result.distortion.quantile(result.distortion.stretches, 0.95) for result in (fit, exact)]
    assert strain[0] < strain[1]


@pytest.mark.slow
def test_a_patch_of_a_surface_does_not_depend_on_its_layout():
    layout, pinned = layout_of(25)
    scale = np.abs(layout.flat).max()
    bent, warped_pinned = warped(layout), pinned / scale + 0.3 * (pinned / scale) ** 2
    derivative = np.abs(1 + 0.6 * pinned / scale) / scale
    radius, tolerance = 0.15, 0.03
    fits = [
        iccm.fit(
            surface,
            circle(),
            pins=[
                iccm.Pin(z, w, radius=radius * factor, tolerance=tolerance)
                for z, w, factor in zip(places, GOALS, factors)
            ],
        )
        for surface, places, factors in ((layout, pinned, [1, 1]), (bent, warped_pinned, derivative))
    ]
    images = [fit.map(surface.flat) for fit, surface in zip(fits, (layout, bent))]
    away = np.abs(images[0] - images[1])
    assert np.median(away) < 2e-3 and away.max() < 0.02  # the outline's edges are 0.065 long
    assert fits[1].details.softness.radii == pytest.approx(
        radius * derivative, rel=0.05
    )  # of a triangle, not of a point


@pytest.mark.slow
def test_maps_with_soft_pins_converge_as_a_surface_is_refined():
    sample = np.array([[0.3, 0.35], [0.5, 0.55], [0.62, 0.7], [0.2, 0.2]])

    def images(halvings, exact):
        layout, pinned = layout_of(7, halvings=halvings)
        fit = iccm.fit(layout, circle(), pins=list(zip(pinned, GOALS)), exact_pins=exact)
        return fit.map(layout_of(7, sample, halvings)[1])

    steps = {}
    for exact in (False, True):
        coarse, middle, fine = (images(halvings, exact) for halvings in (1, 2, 3))
        steps[exact] = np.abs(middle - coarse).max(), np.abs(fine - middle).max()
    assert steps[False][1] < 0.5 * steps[False][0]
    assert steps[False][1] < steps[True][1]


@pytest.mark.slow
def test_pins_between_surfaces_are_landmarks_unless_a_radius_is_given():
    source, source_points = layout_of(13)
    target, target_points = layout_of(17, PLACES + np.array([[0.04, 0.02], [-0.03, 0.03]]))
    exact = iccm.fit(source, target, pins=list(zip(source_points, target_points)))
    assert (
        np.abs(exact.map(source_points) - target_points).max() < 1e-9
        and not exact.details.softness.is_soft.any()
    )
    pins = [iccm.Pin(source_points[0], target_points[0], radius=0.2), (source_points[1], target_points[1])]
    soft = iccm.fit(source, target, pins=pins)
    missed = np.abs(soft.map(source_points) - target_points)
    assert soft.status.ok and soft.details.softness.is_soft.tolist() == [True, False]
    assert missed[1] < 1e-9 < missed[0] <= soft.details.softness.limits[0]


@pytest.mark.slow
def test_a_band_around_a_stroke_of_a_surface_keeps_its_form():
    layout, line = layout_of(13, np.array([[0.3, 0.3], [0.45, 0.42], [0.6, 0.3]]))
    goal = np.array([-0.4 - 0.3j, -0.05 + 0.15j, 0.4 - 0.35j])
    along = np.concatenate([line[:-1] + (line[1:] - line[:-1]) * t for t in np.linspace(0.1, 0.9, 9)])
    dilatations = []
    for width in (0.0, 0.25):
        fit = iccm.fit(layout, circle(), strokes=[iccm.Stroke(line, goal, width=width)])
        assert fit.status.ok
        dilatations.append(float(np.mean(np.abs(_dilatation(fit, layout, along)))))
    assert dilatations[1] < 0.9 * dilatations[0]


def _dilatation(fit, layout, z, step=1e-3):
    """Return log K at points, from the surface to the plane, by finite differences."""
    face, _ = Locator(layout)(z, 1)
    corners = layout.patch.faces[face]
    to_surface = linear(layout.flat[corners], laid_flat(layout.patch.points[corners]))
    images = fit.map(np.stack([z, z + step, z + 1j * step]))
    dx, dy = (images[1] - images[0]) / step, (images[2] - images[0]) / step
    a, b = (dx - 1j * dy) / 2, (dx + 1j * dy) / 2
    # (a dz + b dz̄) after the inverse of (p dz + q dz̄)
    p, q = to_surface.a, to_surface.b
    first, second = a * p.conj() - b * q.conj(), b * p - a * q
    ratio = np.abs(second) / np.abs(first)
    return np.log((1 + ratio) / (1 - ratio))


def test_a_rotation_of_a_patch_is_refused_on_a_surface():
    layout, pinned = layout_of(9)
    with pytest.raises(InputError, match="turn"):
        iccm.fit(layout, circle(), pins=[iccm.Pin(pinned[0], GOALS[0], turn=20)])
