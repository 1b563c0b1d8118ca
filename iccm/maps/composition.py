"""Compose triangulated maps into one, on a mesh that is refined until it is accurate.

The mesh lives in the plane between the first map and the second: there the first map's patches are straight
triangles, and their edges stay edges of the result. An edge is split where its midpoint is mapped too far from the
middle of its ends' images, on either side. Refinement ends before a triangle would fold, so that the result is
one-to-one; `Composition.error` is the error that remains.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..arrays import Complex, Flags, Index
from ..errors import InputError
from ..plane import diagonal, triangle_areas
from .refinement import Triangulation
from .triangulated.adjacency import loops_along, neighbours
from .triangulated.map import TriangulatedMap

ERROR_SHARE = 1e-4
"""Of the diagonal of either side, at which refinement ends: a tenth of a pixel of 1000."""
REFINEMENT_ROUNDS = 14
"""Each halves edges; so many take an edge that is as long as the shape to ERROR_SHARE."""
MOST_TRIANGLES, MOST_REFINED = 200_000, 8
"""Triangles of all rounds together, besides so many for each one of the first mesh: some CPU-seconds. Regular maps need
about eight for each one; an irregular one could need more than is useful.
"""

Function = Callable[[Complex], Complex]


class Composition(NamedTuple):
    """A composed map.

    Attributes:
        map: the map.
        error: how far it is from the given maps at the middle of edges, 99 % of them, relative to the diagonal.
    """

    map: TriangulatedMap
    error: float


def composed(middle: Complex, faces: Index, backward: Function, forward: Function) -> Composition:
    """Return the map that takes backward(p) to forward(p), for points p of the plane between both.

    Args:
        middle: (n,) vertices of a mesh of that plane, at which the result is exact.
        faces: (m, 3) its triangles, counter-clockwise.
        backward, forward: Take points (p,) of the mesh to the source and to the image of the result.

    Raises:
        InputError: A point has no image on one side, or a triangle of the mesh is folded.
    """

    def both_images(points: Complex) -> Complex:
        images = np.stack([backward(points), forward(points)])
        if not np.isfinite(images).all():
            raise InputError("a point where the maps meet lies outside one of them")
        return images

    faces = np.ascontiguousarray(faces, np.int64)
    images = both_images(middle)
    sizes = np.array([diagonal(w) for w in images])
    composition: Composition | None = None
    triangles_left = MOST_TRIANGLES + MOST_REFINED * len(faces)
    for _ in range(REFINEMENT_ROUNDS):
        mesh = Triangulation(middle, faces, neighbours(faces, middle.size))
        i, j = mesh.edges.ends.T
        folded = _folded(images, faces)
        if folded.any():
            faces, folded = flip_folded(images, mesh, folded)
            mesh = Triangulation(middle, faces, neighbours(faces, middle.size))
            i, j = mesh.edges.ends.T
        away = both_images(0.5 * (middle[i] + middle[j])) - 0.5 * (images[:, i] + images[:, j])
        errors = (np.abs(away) / sizes[:, None]).max(axis=0)
        if not folded.any():
            # the outer loop, which reaches farthest left, is the first
            loops = sorted(
                loops_along(*mesh.edges.ends[mesh.edges.rim].T), key=lambda loop: middle[loop].real.min()
            )
            map = TriangulatedMap(images[0], images[1], faces, tuple(loops))
            composition = Composition(map, float(np.quantile(errors, 0.99)))
        elif composition is not None:
            break  # smaller triangles straddle bends of the maps between them
        marked = errors > ERROR_SHARE
        marked[mesh.edges.sides[folded]] = True
        triangles_left -= len(faces)
        if not marked.any() or len(faces) > triangles_left:
            break
        old_count = middle.size
        middle, faces = bisected(mesh, marked)
        images = np.concatenate([images, both_images(middle[old_count:])], axis=1)
    if composition is None:
        raise InputError("no composition without folds was found; a map between them is too irregular")
    return composition


def _folded(images: Complex, faces: Index) -> Flags:
    """Return (m,) the triangles without a positive area on either side."""
    flags: Flags = ~np.all([triangle_areas(w[faces]) > 0 for w in images], axis=0)
    return flags


def flip_folded(images: Complex, mesh: Triangulation, folded: Flags) -> tuple[Index, Flags]:
    """Flip edges of folded triangles where that unfolds them.

    Returns the triangles (m, 3), and which of them are still folded.

    A triangle that straddles a sharp bend of a map is folded though the map is not; with the other diagonal of the
    quadrilateral, the edge follows the bend.
    """
    faces, folded = mesh.faces.copy(), folded.copy()
    triangle, corner = (
        index.ravel() for index in np.meshgrid(np.flatnonzero(folded), range(3), indexing="ij")
    )
    neighbour = mesh.across[triangle, corner]
    triangle, corner, neighbour = (index[neighbour >= 0] for index in (triangle, corner, neighbour))
    a, b, c = (mesh.faces[triangle, (corner + k) % 3] for k in range(3))
    # the neighbour's corner that is not on the edge
    d = mesh.faces[neighbour].sum(axis=1) - b - c
    pairs = np.array([[a, b, d], [a, d, c]]).transpose(2, 0, 1)
    flipped = pairs.reshape(-1, 3)
    sound = ~_folded(images, flipped) & (triangle_areas(mesh.z[flipped]) > 0)
    useful = np.flatnonzero(sound.reshape(-1, 2).all(axis=1))
    changed = np.zeros(len(faces), bool)
    for t, other, pair in zip(triangle[useful], neighbour[useful], pairs[useful]):
        if not (changed[t] or changed[other]):  # neighbours are known only of triangles that have not changed
            faces[[t, other]] = pair
            folded[[t, other]], changed[[t, other]] = False, True
    return faces, folded


def bisected(mesh: Triangulation, marked: Flags) -> tuple[Complex, Index]:
    """Return vertices and triangles with the marked edges (e,) split.

    The longest sides of their triangles are split, too, so that triangles keep a good shape (Rivara, *Algorithms for
    refining triangular grids*, 1984). No edge is flipped.
    """
    sides = mesh.edges.sides
    longest = sides[np.arange(len(sides)), mesh.lengths[sides].argmax(axis=1)]
    marked, previous_count = marked.copy(), 0
    while previous_count < (count := int(marked.sum())):
        previous_count = count
        marked[longest[marked[sides].any(axis=1)]] = True
    return mesh.split(marked)
