"""Remove folds locally: the rest of a map is kept, whereas unfolding it as a whole would move it far away."""

import numpy as np

from ...arrays import Complex, Flags, Index, Real, distinct
from ...linalg.cholesky import system_of
from ...meshes.stretch import laid_flat
from ...meshes.topology import labels
from ...plane import triangle_areas, triangle_heights
from ..errors import Tangled
from .energy import RestShapes, geometry
from .untangle import untangle

# Rings of triangles around folds whose vertices move; more if folds remain, each twice as many.
RINGS = 2, 4, 8, 16
BARE = 1e-9  # ratio of areas, relative to the mean, below which a triangle counts as folded
STEPS, POLISHING = 100, 30  # most steps of `untangle`, and of those after the last fold


def unfold(
    u: Complex,
    faces: Index,
    fixed: Flags,
    folded: Flags,
    gradients: Complex,
    areas: Real,
    weights: Real | float = 1.0,
    most: float = 1.0,
) -> Complex:
    """Move the vertices near some triangles until none is folded.

    If there were no folds and moving would make some, the images are returned unchanged.

    Args:
        u: (n,) images.
        faces: (m, 3) triangles.
        fixed: (n,) vertices that do not move.
        folded: (m,) triangles to unfold.
        gradients, areas: of the rest triangles, as from `energy.geometry`.
        weights: (m,) weights of the triangles, in addition to their areas.
        most: share of the vertices up to which more are moved if folds remain.

    Returns:
        (n,) images.

    Raises:
        Tangled: folds remain.
    """
    fold_count = int(np.count_nonzero(triangle_areas(u[faces]) <= 0))
    for rings in RINGS if folded.any() else ():
        movable = _around(faces, folded, rings, u.size) & ~fixed
        if rings > RINGS[0] and np.count_nonzero(movable) > most * np.count_nonzero(~fixed):
            break
        new = _move(u, faces, movable, gradients, areas, weights)
        remaining = triangle_areas(new[faces]) <= 0
        if not remaining.any():
            return new
        if (count := int(np.count_nonzero(remaining))) < fold_count:
            u, folded, fold_count = new, remaining, count
    if fold_count:
        raise Tangled(u)
    return u


def unfold_in(u: Complex, faces: Index, fixed: Flags, unfolded: Complex) -> Complex:
    """Remove folds in another plane by moving only vertices near them.

    Args:
        u: (n,) positions in that plane.
        faces: (m, 3) triangles.
        fixed: (n,) vertices that do not move.
        unfolded: (n,) positions without folds.

    Returns:
        (n,) positions.

    Raises:
        Tangled: folds remain.
    """
    gradients, areas = geometry(unfolded, faces)
    image = triangle_areas(u[faces])
    return unfold(u, faces, fixed, image * areas.sum() < BARE * areas * image.sum(), gradients, areas)


def unfold_on(u: Complex, faces: Index, fixed: Flags, points: Real, least: float) -> Complex:
    """Remove folds of a surface's vertices in a plane, group by group of folded triangles that are near each other.

    Groups in which folds would remain are left as they are.

    Args:
        u: (n,) positions; most triangles are counter-clockwise.
        faces: (m, 3) triangles.
        fixed: (n,) vertices that do not move.
        points: (n, 3) positions in space; the shapes of triangles are preserved as far as possible.
        least: height up to which triangles count as folded.

    Returns:
        (n,) positions.
    """
    if not (triangle_heights(u[faces]) <= least).any():
        return u
    shapes = laid_flat(points[faces])
    gradients, areas = geometry(shapes.ravel(), np.arange(shapes.size).reshape(-1, 3))
    areas = np.maximum(areas, BARE * areas.mean())
    for rings in RINGS:
        folded = triangle_heights(u[faces]) <= least
        free = _around(faces, folded, rings, u.size) & ~fixed
        hit = free[faces].any(axis=1)
        corner, face = np.nonzero(hit)[0][:, None] + np.zeros(3, int), faces[hit]
        inside = free[face]
        group = labels(face[inside], u.size + corner[inside], u.size + len(faces))
        for k in distinct(group[u.size :][folded & hit]):
            group_faces = faces[hit & (group[u.size :] == k)]
            new = _move(u, faces, free & (group[: u.size] == k), gradients, areas)
            if triangle_heights(new[group_faces]).min() > max(0, triangle_heights(u[group_faces]).min()):
                u = new
    return u


def _around(faces: Index, folded: Flags, rings: int, count: int) -> Flags:
    """Return (n,) which of `count` vertices are within a number of rings around some triangles (m,)."""
    is_near = np.zeros(count, bool)
    is_near[faces[folded]] = True
    for _ in range(rings):
        is_near[faces[is_near[faces].any(axis=1)]] = True
    return is_near


def _move(
    u: Complex, faces: Index, free: Flags, gradients: Complex, areas: Real, weights: Real | float = 1.0
) -> Complex:
    """Return (n,) images with the free vertices (n,) moved.

    Rest shapes are scaled to the total area of their images.
    """
    hit = free[faces].any(axis=1)
    if not hit.any():
        return u
    vertices = distinct(faces[hit])
    vertices = vertices[np.argsort(free[vertices], kind="stable")]
    border = int(np.count_nonzero(~free[vertices]))
    part = _number(faces[hit], vertices, u.size)
    pattern = system_of(part, np.arange(border), vertices.size)
    order = np.argsort(pattern.position[part], axis=1)
    scale = np.sqrt(np.abs(triangle_areas(u[faces[hit]]).sum()) / areas[hit].sum())
    part_gradients = np.ascontiguousarray(np.take_along_axis(gradients[hit], order, axis=1)) / scale
    images, positions = u.copy(), u[vertices]
    measure = (areas * weights)[hit]
    rest = RestShapes.of(pattern, part_gradients, measure / measure.sum())
    untangle(pattern, rest, positions, np.arange(positions.size) < border, False, STEPS, POLISHING)
    images[vertices] = positions
    return images


def _number(faces: Index, vertices: Index, count: int) -> Index:
    number = np.full(count, -1)
    number[vertices] = np.arange(vertices.size)
    return number[faces]
