"""Repair flipped triangles and non-convex polygons of a layout by moving single vertices."""

import numpy as np

from ..arrays import Complex, Flags, Index, Real, complex_of
from ..meshes.patch import Patch
from ..meshes.topology import Triangles, labels
from ..plane import cross, orientation, triangle_areas, triangle_heights
from ..sorting import grouped
from .tutte import settled

HEIGHT_SHARES = (0.1, 0.01, 1e-4)
"""Heights of triangles relative to their bases, tried in this order: the largest for which there is room keeps the
most digits."""
ROOM_STEPS = 1000  # most projections to find a place of that height: acute regions converge slowly


def open_up(flat: Complex, patch: Patch, fixed: Index) -> Complex:
    """Flip triangles that face down, where moving one vertex is enough.

    All triangles into which a polygon can be cut count, so that polygons become convex. Where an outline bends between
    two neighbouring vertices of the boundary, the chord between them cuts its corner off, together with the surface
    there. Of a triangle's corners, the one with the shortest move goes to a point from which all triangles around it
    face up. The point is found by projecting onto half-planes, the most violated one first. Triangles without such a
    point stay as they are.

    Args:
        flat: (n,) positions, most triangles counter-clockwise.
        patch: the surface.
        fixed: vertices that must not move.

    Returns:
        (n,) new positions.
    """
    faces = np.concatenate([patch.faces, patch.fans[0]])
    down = np.flatnonzero(triangle_areas(flat[faces]) <= 0)
    if not down.size:
        return flat
    opened, free = flat.copy(), np.ones(flat.size, bool)
    free[fixed] = False
    order, starts = grouped(faces.ravel(), flat.size)
    for corners in faces[down]:
        if triangle_areas(opened[corners]) > 0:  # an earlier move flipped it
            continue
        rooms = []
        for vertex in corners[free[corners]]:
            face, first = np.divmod(order[starts[vertex] : starts[vertex + 1]], 3)
            heads, tails = (opened[faces[face, (first + k) % 3]] for k in (1, 2))
            places = (_room(opened[vertex], heads, tails, height) for height in HEIGHT_SHARES)
            rooms += [(abs(z - opened[vertex]), vertex, z) for z in places if z is not None][:1]
        if rooms:
            _, vertex, opened[vertex] = min(rooms)
    return opened


def tuck_in(flat: Complex, patch: Patch, room: float, least: float = 0.0) -> Complex:
    """Move the parts that chords between boundary vertices cut off beyond these chords.

    Where triangles in such a part face down, the boundary vertices between the ends of the chord are moved out into an
    arc, just high enough to make room, and inner vertices go to the mean of their neighbours, which folds nothing in a
    convex region. Other parts stay as they are.

    Args:
        flat: (n,) positions, most triangles counter-clockwise.
        patch: the surface.
        room: most that a vertex of the boundary may move.
        least: height that triangles should have; where not all can have it, they only face up.

    Returns:
        (n,) new positions.
    """
    faces, shape = patch.faces, patch.triangles
    if not (triangle_heights(flat[faces]) <= least).any():
        return flat
    rim = np.zeros(flat.size, bool)
    rim[np.concatenate(patch.loops)] = True
    chord = (shape.twin >= 0) & rim[shape.tail] & rim[shape.head]
    on = np.flatnonzero((shape.twin >= 0) & ~chord)
    label = labels(on // 3, shape.twin[on] // 3, len(faces))
    opened, tucked, largest = flat.copy(), {int(np.bincount(label).argmax())}, -1
    while largest != len(tucked):  # a part behind another one is treated after it
        largest = len(tucked)
        sides = np.flatnonzero(chord)
        inward = label[shape.twin[sides] // 3]
        for side in sides[np.isin(inward, list(tucked)) & ~np.isin(label[sides // 3], list(tucked))]:
            part = faces[label == label[side // 3]]
            tucked.add(int(label[side // 3]))
            if (triangle_heights(opened[part]) <= least).any():
                _tuck(opened, flat, part, int(shape.tail[side]), int(shape.head[side]), rim, room, least)
    return opened


def _tuck(
    opened: Complex, flat: Complex, part: Index, tail: int, head: int, rim: Flags, room: float, least: float
) -> None:
    """Move the vertices of triangles (m, 3) to the left of an edge from tail to head; changes `opened`."""
    vertices, local = np.unique(part, return_inverse=True)
    local, z = local.reshape(-1, 3), opened[vertices]
    base = opened[head] - opened[tail]
    place = (z - opened[tail]) / base
    arc = rim[vertices] & (vertices != tail) & (vertices != head)
    inner = np.flatnonzero(~rim[vertices])
    for height in (0.0, *reversed(HEIGHT_SHARES)):
        new = z.copy()
        if height:
            above = 4 * height * place.real * (1 - place.real)
            new[arc] += 1j * base * np.maximum(above - place.imag, 0)[arc]
        if np.abs(new - flat[vertices])[arc].max(initial=0) > room:
            return
        placed = settled(Triangles(local, vertices.size), new, inner) if inner.size else new
        lowest = triangle_heights(placed[local]).min()
        if lowest > max(0, triangle_heights(opened[part]).min()):
            opened[vertices] = placed
        if lowest > least:
            return


def concave(uv: Real, patch: Patch) -> int:
    """Count polygons that are not convex with vertices at texture coordinates (n, 2), by exact predicates."""
    triangles, face = patch.fans
    return np.unique(face[orientation(*complex_of(uv)[triangles].T) <= 0]).size


def not_convex(count: int) -> str:
    """Return a note for users that `count` polygons are not convex."""
    polygons = "polygon is" if count == 1 else "polygons are"
    return (
        f"{count} {polygons} not convex in the new coordinates; programs that triangulate differently "
        "may show folds"
    )


def _room(z: complex, heads: Complex, tails: Complex, height: float) -> complex | None:
    """Return a point to the left of all edges from heads to tails, at least `height` times their lengths from each.

    None if none is found.
    """
    base = tails - heads
    length = np.maximum(np.abs(base), 1e-300)
    for _ in range(ROOM_STEPS):
        short = height * length - cross(base, z - heads) / length
        most = int(np.argmax(short))
        if short[most] <= 0:
            return z
        z += 1j * base[most] / length[most] * (short[most] + height * length[most])
    return None
