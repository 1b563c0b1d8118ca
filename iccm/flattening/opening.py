"""Triangles of a layout that face down, and polygons that are not convex there, set right by moving single vertices."""

import numpy as np

from ..arrays import Complex, Index, Real, complex_of
from ..meshes.patch import Patch
from ..meshes.topology import Triangles, labels
from ..plane import cross, orientation, triangle_areas
from .tutte import settled

HEIGHTS = (0.1, 0.01, 1e-4)  # of triangles, of their bases, as high as there is room for (by hand)
STEPS = 1000  # of looking for that room: acute rooms are approached slowly


def open_up(flat: Complex, patch: Patch, held: Index) -> Complex:
    """Positions (n,) in which triangles face up that faced down, where moving one vertex is enough.

    Polygons count by all their fans, so that they become convex. Where an outline turns between two vertices of the
    boundary, the straight edge between them cuts its corner off, and with it what lies there. The vertex that has the
    shortest way goes to a point from which all around it face up: half-planes are projected into in turn, the one
    missed most first. Others stay as they are.

    Args:
        flat: positions, most triangles counter-clockwise.
        patch: the surface.
        held: vertices that stay.
    """
    faces = np.concatenate([patch.faces, patch.fans[0]])
    down = np.flatnonzero(triangle_areas(flat[faces]) <= 0)
    if not down.size:
        return flat
    moved, free = flat.copy(), np.ones(flat.size, bool)
    free[held] = False
    order = np.argsort(faces.ravel(), kind="stable")
    starts = np.searchsorted(faces.ravel()[order], np.arange(flat.size + 1))
    for corners in faces[down]:
        if triangle_areas(moved[corners]) > 0:  # by what moved before
            continue
        rooms = []
        for vertex in corners[free[corners]]:
            face, first = np.divmod(order[starts[vertex] : starts[vertex + 1]], 3)
            heads, tails = (moved[faces[face, (first + k) % 3]] for k in (1, 2))
            places = (_room(moved[vertex], heads, tails, height) for height in HEIGHTS)
            rooms += [(abs(z - moved[vertex]), vertex, z) for z in places if z is not None][:1]
        if rooms:
            _, vertex, moved[vertex] = min(rooms)
    return moved


def tuck_in(flat: Complex, patch: Patch) -> Complex:
    """Positions (n,) in which what an edge between two vertices of the boundary cuts off lies beyond that edge.

    Where triangles there face down, the inner vertices go to the means of their neighbours, which folds nothing where
    the outline is convex; others stay as they are.
    """
    faces, shape = patch.faces, patch.triangles
    down = triangle_areas(flat[faces]) <= 0
    if not down.any():
        return flat
    rim = np.zeros(flat.size, bool)
    rim[np.concatenate(patch.loops)] = True
    on = np.flatnonzero((shape.twin >= 0) & ~(rim[shape.tail] & rim[shape.head]))
    label = labels(on // 3, shape.twin[on] // 3, len(faces))
    moved = flat.copy()
    for k in np.setdiff1d(label[down], np.bincount(label).argmax()):
        vertices, local = np.unique(faces[label == k], return_inverse=True)
        local = local.reshape(-1, 3)
        found = settled(Triangles(local, vertices.size), flat[vertices], np.flatnonzero(~rim[vertices]))
        if (triangle_areas(found[local]) > 0).all():
            moved[vertices] = found
    return moved


def concave(uv: Real, patch: Patch) -> int:
    """How many of these polygons are not convex with texture coordinates (n, 2) of the vertices, exactly."""
    triangles, face = patch.fans
    return np.unique(face[orientation(*complex_of(uv)[triangles].T) <= 0]).size


def not_convex(count: int) -> str:
    """What that means, for people."""
    polygons = "polygon is" if count == 1 else "polygons are"
    return f"{count} {polygons} not convex in the new coordinates: programs that cut them otherwise see folds"


def _room(z: complex, heads: Complex, tails: Complex, height: float) -> complex | None:
    """A point height times their length or more to the left of all edges from heads to tails; None if none is found."""
    base = tails - heads
    length = np.maximum(np.abs(base), 1e-300)
    for _ in range(STEPS):
        short = height * length - cross(base, z - heads) / length
        most = int(np.argmax(short))
        if short[most] <= 0:
            return z
        z += 1j * base[most] / length[most] * (short[most] + height * length[most])
    return None
