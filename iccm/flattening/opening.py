"""Triangles of a layout that face down, and polygons that are not convex there, set right by moving single vertices."""

import numpy as np

from ..arrays import Complex, Flags, Index, Real, complex_of
from ..meshes.patch import Patch
from ..meshes.topology import Triangles, labels
from ..plane import cross, orientation, triangle_areas, triangle_heights
from .tutte import settled

HEIGHT_SHARES = (0.1, 0.01, 1e-4)  # of triangles, of their bases, as high as there is room for (by hand)
ROOM_STEPS = 1000  # of looking for that room: acute rooms are approached slowly


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
            places = (_room(moved[vertex], heads, tails, height) for height in HEIGHT_SHARES)
            rooms += [(abs(z - moved[vertex]), vertex, z) for z in places if z is not None][:1]
        if rooms:
            _, vertex, moved[vertex] = min(rooms)
    return moved


def tuck_in(flat: Complex, patch: Patch, room: float, least: float = 0.0) -> Complex:
    """Positions (n,) in which what an edge between two vertices of the boundary cuts off lies beyond that edge.

    Where triangles there face down, the vertices of the boundary between its ends are drawn out into an arc, by as
    little as gives room, and the inner vertices go to the means of their neighbours, which folds nothing in a convex
    region; others stay as they are.

    Args:
        flat: positions, most triangles counter-clockwise.
        patch: the surface.
        room: how far vertices of the boundary may be drawn out.
        least: the least height that triangles are to have; where not all can, they only face up.
    """
    faces, shape = patch.faces, patch.triangles
    if not (triangle_heights(flat[faces]) <= least).any():
        return flat
    rim = np.zeros(flat.size, bool)
    rim[np.concatenate(patch.loops)] = True
    chord = (shape.twin >= 0) & rim[shape.tail] & rim[shape.head]
    on = np.flatnonzero((shape.twin >= 0) & ~chord)
    label = labels(on // 3, shape.twin[on] // 3, len(faces))
    moved, tucked, largest = flat.copy(), {int(np.bincount(label).argmax())}, -1
    while largest != len(tucked):  # what lies behind another such region comes after it
        largest = len(tucked)
        sides = np.flatnonzero(chord)
        inward = label[shape.twin[sides] // 3]
        for side in sides[np.isin(inward, list(tucked)) & ~np.isin(label[sides // 3], list(tucked))]:
            part = faces[label == label[side // 3]]
            tucked.add(int(label[side // 3]))
            if (triangle_heights(moved[part]) <= least).any():
                _tuck(moved, flat, part, int(shape.tail[side]), int(shape.head[side]), rim, room, least)
    return moved


def _tuck(
    moved: Complex, flat: Complex, part: Index, tail: int, head: int, rim: Flags, room: float, least: float
) -> None:
    """Move the vertices of triangles (m, 3) beyond an edge from tail to head, to the left of which they belong."""
    vertices, local = np.unique(part, return_inverse=True)
    local, z = local.reshape(-1, 3), moved[vertices]
    base = moved[head] - moved[tail]
    place = (z - moved[tail]) / base
    arc = rim[vertices] & (vertices != tail) & (vertices != head)
    inner = np.flatnonzero(~rim[vertices])
    for height in (0.0, *reversed(HEIGHT_SHARES)):
        new = z.copy()
        if height:
            above = 4 * height * place.real * (1 - place.real)
            new[arc] += 1j * base * np.maximum(above - place.imag, 0)[arc]
        if np.abs(new - flat[vertices])[arc].max(initial=0) > room:
            return
        found = settled(Triangles(local, vertices.size), new, inner) if inner.size else new
        lowest = triangle_heights(found[local]).min()
        if lowest > max(0, triangle_heights(moved[part]).min()):
            moved[vertices] = found
        if lowest > least:
            return


def concave(uv: Real, patch: Patch) -> int:
    """Return how many of these polygons are not convex with texture coordinates (n, 2) of the vertices, exactly."""
    triangles, face = patch.fans
    return np.unique(face[orientation(*complex_of(uv)[triangles].T) <= 0]).size


def not_convex(count: int) -> str:
    """Return what that means, for people."""
    polygons = "polygon is" if count == 1 else "polygons are"
    return (
        f"{count} {polygons} not convex in the new coordinates; programs that triangulate differently "
        "may show folds"
    )


def _room(z: complex, heads: Complex, tails: Complex, height: float) -> complex | None:
    """Return a point height times their length or more to the left of all edges from heads to tails; None if none is
    found.
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
