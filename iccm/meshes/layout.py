"""The texel grid of a mesh's UV charts: the triangle of each texel, and problems of the layout."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Index, Real, complex_of
from ..errors import InputError
from ..plane import orientation
from .mesh import face_areas
from .rasterise import Ownership, open_edges, rasterise
from .topology import labels

MOST_TILES = 64
"""A triangle that spans more pictures is a mistake in the file: tiled textures repeat a few times."""
SAME_PLACE = 2e-3
"""Difference of texture coordinates below which two triangles show the same place: two texels of 1024,
which is hardly visible.
"""
CONFLICTING_SHARE = 1e-3
"""Share of the covered texels: fewer conflicting ones are at most seams of rounded coordinates."""
ROUNDED_HEIGHT_SHARE = 1e-7
"""Height of a triangle relative to the mesh's diagonal below which its corners are on a line up to rounding to single
precision."""
MOST_COORDINATE = 1e6
"""Largest texture coordinate: beyond, single precision distinguishes fewer than 16 positions across a picture."""


@dataclass(frozen=True, eq=False)
class Layout:
    """The texel grid of a mesh's UV charts.

    Attributes:
        corners: (m, 3, 2) texture coordinates of the triangles in texels, y down.
        owners: the triangle of each texel.
        report: charts, mirrored triangles, overlaps, and triangles outside of 0..1.
    """

    corners: Real
    owners: Ownership
    report: dict

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        height, width = self.owners.owner.shape
        return height, width


def layout(
    name: str,
    uv: Real,
    uv_faces: Index,
    twin: Index,
    width: int,
    height: int,
    tile: complex | None = None,
) -> Layout:
    """Rasterise UV charts; parts outside of 0..1 wrap around, as renderers repeat textures.

    Args:
        name: of the mesh, for messages.
        uv: (t, 2) texture coordinates, v up.
        uv_faces: (m, 3) texture coordinate of each triangle's corner.
        twin: (3m,) opposite half-edges (see `topology.Triangles`), to find the borders of charts.
        width, height: size in texels.
        tile: lower left corner of the unit square to rasterise; parts outside of it are omitted then.

    Raises:
        InputError: a corner has no coordinates, or they are not finite or absurdly large.
    """
    coordinates = check_layout(name, uv, uv_faces)
    if tile is not None:
        coordinates = coordinates - (tile.real, tile.imag)
    corners = np.empty_like(coordinates)
    corners[..., 0], corners[..., 1] = coordinates[..., 0] * width, (1 - coordinates[..., 1]) * height
    beyond = outside(coordinates)
    wrap = tile is None and bool(beyond.any())
    owners = rasterise(corners, width, height, border=open_edges(uv_faces, twin), wrap=wrap)
    signed_areas = doubled_areas(corners)
    report = {
        "charts": np.unique(charts(uv_faces, len(uv))[uv_faces[:, 0]]).size,
        "mirrored_triangles": int((signed_areas > 0).sum()),  # y is down
        "flat_triangles": int((signed_areas == 0).sum()),
        "outside_triangles": int(beyond.sum()),
        "overlapping_texels": owners.overlaps,
        "covered_texels": int(owners.centre.sum()),
    }
    return Layout(corners, owners, report)


def check_layout(name: str, uv: Real, uv_faces: Index, most: float = MOST_TILES) -> Real:
    """Check the texture coordinates of the triangles' corners and return them (m, 3, 2).

    See `layout` for arguments and errors. `most` is the largest number of pictures that a triangle may span;
    for a layout that is only sampled it may be any.
    """
    if (uv_faces < 0).any():
        bad = int(np.flatnonzero((uv_faces < 0).any(axis=1))[0])
        raise InputError(
            f"{name}: triangle {bad} has no texture coordinates; leave out --bake to create new ones"
        )
    coordinates = np.take(uv, uv_faces, axis=0)  # several times faster than uv[uv_faces]
    low, high = _over_corners(np.minimum, coordinates), _over_corners(np.maximum, coordinates)
    span = (high - low).max(initial=0.0)
    if not np.isfinite(span) or span * span > most:
        raise InputError(
            f"{name}: texture coordinates of a triangle are not finite or span {span:.3g} pictures; "
            "repair the layout"
        )
    if max(np.abs(low).max(initial=0.0), np.abs(high).max(initial=0.0)) > MOST_COORDINATE:
        raise InputError(
            f"{name}: texture coordinates of a triangle are larger than {MOST_COORDINATE:g}; move "
            "the layout closer to the unit square"
        )
    return coordinates


def turned_over(corners: Real, space: Real | None = None) -> dict[str, int]:
    """Return how many triangles with texture coordinates (m, 3, 2), v up, are `flipped` or `degenerate`.

    The test is exact. Triangles whose corners in space (m, 3, 3) are on a line do not count: nobody sees them.
    """
    orientations = orientation(*complex_of(corners).T)
    if space is not None:
        sides = np.linalg.norm(space - np.roll(space, 1, axis=1), axis=2)
        size = np.linalg.norm(np.ptp(space.reshape(-1, 3), axis=0))
        heights = 2 * face_areas(space) / np.maximum(sides.max(axis=1), 1e-300)
        orientations = orientations[heights > ROUNDED_HEIGHT_SHARE * size]
    return {"flipped": int((orientations < 0).sum()), "degenerate": int((orientations == 0).sum())}


def outside(corners: Real) -> NDArray[np.bool_]:
    """Return (m,) whether triangles with (m, 3, 2) texture coordinates leave 0..1."""
    low, high = _over_corners(np.minimum, corners), _over_corners(np.maximum, corners)
    return (np.minimum(low[:, 0], low[:, 1]) < -1e-9) | (np.maximum(high[:, 0], high[:, 1]) > 1 + 1e-9)


def is_stacked(figures: Mapping[str, int]) -> bool:
    """Return whether many of a layout's covered texels belong to triangles that show different places of a texture."""
    return figures["conflicting_texels"] > CONFLICTING_SHARE * figures["covered_texels"]


def _over_corners(function: np.ufunc, corners: Real) -> Real:
    """Return (m, 2) least or greatest coordinates of (m, 3, 2) corners; NumPy's own reduction over three is slow."""
    return function(function(corners[:, 0], corners[:, 1]), corners[:, 2])


def doubled_areas(corners: Real) -> Real:
    """Return (m,) twice the signed areas of (m, 3, 2) corners, positive if the orientation is from x to y."""
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]


def charts(corners: Index, count: int, starts: Index | None = None) -> Index:
    """Return (count,) the chart of each texture coordinate, connected by faces; -1 if no face uses it.

    Args:
        corners: (m, 3) texture coordinate of each triangle's corner, or (c,) of each face's; -1 if it has none.
        count: number of texture coordinates.
        starts: (m + 1,) first corner of each face, if they are not triangles.
    """
    corners, starts = corners.ravel(), np.arange(0, corners.size + 1, 3) if starts is None else starts
    after = np.arange(1, corners.size + 1)
    after[starts[1:] - 1] = starts[:-1]
    has_coordinates = (corners >= 0) & (corners[after] >= 0)
    used = np.zeros(count, bool)
    used[corners[corners >= 0]] = True
    return np.where(used, labels(corners[has_coordinates], corners[after][has_coordinates], count), -1)
