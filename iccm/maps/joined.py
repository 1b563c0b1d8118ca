"""Maps of several parts as one triangulation that is not connected, to be saved as one map."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Complex
from .triangulated.map import TriangulatedMap


def joined(maps: Sequence[TriangulatedMap]) -> TriangulatedMap:
    """Return the maps of several parts as one."""
    if len(maps) == 1:
        return maps[0]
    first_vertices = np.cumsum([0, *(map.source.size for map in maps)])
    faces = [map.faces + first for map, first in zip(maps, first_vertices)]
    loops = [loop + first for map, first in zip(maps, first_vertices) for loop in map.loops]
    source, image = (np.concatenate([getattr(map, side) for map in maps]) for side in ("source", "image"))
    whole = TriangulatedMap(source, image, np.concatenate(faces), tuple(loops))
    if all(map.bulge is None for map in maps):
        return whole
    bulge = np.zeros(len(whole.edges.ends), complex)
    bulge[whole.edges.sides] = np.concatenate([map.bulges[map.edges.sides] for map in maps])
    return replace(whole, bulge=bulge)


def split(map: TriangulatedMap) -> list[TriangulatedMap]:
    """Return the maps of the connected parts of a map.

    Examples
    --------
    >>> triangle = TriangulatedMap(*2 * (np.array([0, 1, 1j]),), np.array([[0, 1, 2]]), (np.arange(3),))
    >>> [part.image.tolist() for part in split(joined([triangle, triangle.moved(image=(2, 0, 5))]))]
    [[0j, (1+0j), 1j], [(5+0j), (7+0j), (5+2j)]]
    """
    from scipy.sparse import coo_array  # slow to import, and few maps start from an earlier one
    from scipy.sparse.csgraph import connected_components

    ends = np.concatenate([map.faces[:, :2], map.faces[:, 1:]])
    graph = coo_array((np.ones(len(ends)), ends.T), shape=2 * (map.source.size,))
    count, numbers = connected_components(graph, directed=False)
    if count == 1:
        return [map]
    parts = []
    for part in range(count):
        vertices, is_own = np.flatnonzero(numbers == part), numbers[map.faces[:, 0]] == part
        new_numbers = np.cumsum(numbers == part) - 1
        faces = new_numbers[map.faces[is_own]]
        loops = tuple(new_numbers[loop] for loop in map.loops if numbers[loop[0]] == part)
        own = replace(
            map, source=map.source[vertices], image=map.image[vertices], faces=faces, loops=loops, bulge=None
        )
        if map.bulge is not None:
            bulge = np.zeros(len(own.edges.ends), complex)
            bulge[own.edges.sides] = map.bulge[map.edges.sides[is_own]]
            own = replace(own, bulge=bulge)
        parts.append(own)
    return parts


def images(maps: Sequence[Callable[[Complex], Complex]], z: Complex) -> Complex:
    """Return the images of points (of any shape) by the maps of several parts, or by their inverses; later parts cover
    earlier ones. They are not finite where no part is.
    """
    w = maps[0](z)
    for map in maps[1:]:
        own_images = map(z)
        w = np.where(np.isfinite(own_images), own_images, w)
    return w
