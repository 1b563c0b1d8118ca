"""The charts of a mesh's own texture coordinates, each as a flattening in the plane of the texture layout."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely

from ..arrays import Complex, Flags, Index, Real, complex_of, distinct_rows, xy_of
from ..errors import InputError
from ..meshes.disk_patch import split_non_manifold
from ..meshes.flatten import Flattening, overlap
from ..meshes.layout import doubled_areas
from ..meshes.mesh import Mesh, check, proper, triangulate
from ..meshes.patch import Patch
from ..meshes.rasterise import rasterise
from ..meshes.topology import Triangles, labels
from ..plane import cross, diagonal, polygon_area, triangle_areas
from ..sorting import grouped

OVERLAP_GRID_CELLS = 512
"""Cells per side of the grid on which overlaps are measured: finer than the shares that are reported."""
UNREPORTED_SHARE = 0.01
"""Of a chart's area: smaller overlaps with other charts are hardly visible, and not reported."""
SLIP_AREA_SHARE = 1e-5
"""Share of a chart's area; a smaller part that folds back is a slip of an unwrapping program, and is flipped."""
MOST_SLIPS, SLIP_ROUNDS = 1000, 100  # most triangles that are flipped, and most sweeps, which bound the time
SLIP_HEIGHT_SHARE = 1e-5  # of the layout's diagonal: height that flipped triangles get
MOST_MOVED_SHARE = 1e-3
"""Share of the layout's diagonal that a vertex may move for it; a texel of a 1024 texture, which is not visible."""
DRAWN_IN_SHARE = 1e-5
"""Of a chart's diagonal: how far vertices that the outline passes twice are moved inwards: far above rounding, and
invisible."""
TOUCHING_SHARE = 1e-7
"""Of a chart's diagonal: distance of two parts of its boundary that touch, except for rounding."""


@dataclass(frozen=True, eq=False)
class LaidOut:
    """One chart.

    Attributes:
        flattening: its place in the plane; for a mirrored chart, the layout's mirror image.
        tile: lower left corner of its UDIM tile; 0 for the tile from 0,0 to 1,1.
        mirror: u of the vertical line about which the plane mirrors the layout, or None.
    """

    flattening: Flattening
    tile: complex
    mirror: float | None


@dataclass(frozen=True, eq=False)
class Atlas:
    """The charts of a mesh, numbered from 1, the largest in the layout first.

    A chart ends at the boundary of the surface, where coordinates differ across an edge, and where the layout folds
    back: two mirrored halves that share an edge are two charts.

    Attributes:
        mesh: the mesh.
        shape: triangles over pairs of a position and a texture coordinate, wound as in the file.
        vertex: (p,) vertex of the mesh behind each pair.
        uv: (p, 2) texture coordinate of each pair, v up.
        corner: (m, 3) corner of the mesh behind each triangle's corner.
        notes: on triangles that are in no chart.
    """

    mesh: Mesh
    shape: Triangles
    vertex: Index
    uv: Real
    corner: Index
    notes: tuple[str, ...] = field(default=())

    @classmethod
    def of(cls, mesh: Mesh) -> "Atlas":
        """Create the atlas of a mesh.

        Raises:
            InputError: an invalid element (see `meshes.mesh.check`), or no face has texture coordinates.
        """
        corner = triangulate(check(mesh))
        if mesh.uv is None or mesh.uv_corners is None:
            raise InputError(f"{mesh.name}: has no texture coordinates; create them with iccm flatten --uv")
        has_uv = _has_coordinates(mesh, mesh.uv, mesh.uv_corners, corner)
        notes = _left_out(int((~has_uv).sum()), "texture coordinates")
        corner = corner[has_uv]
        area = doubled_areas(mesh.uv[mesh.uv_corners[corner]])
        notes += _left_out(int((area == 0).sum()), "an area in the layout")
        corner = corner[area != 0]
        # pairs of indices first: there are few of them, and sorting whole numbers is fast
        vertex, uv_index = mesh.corners[corner].ravel(), mesh.uv_corners[corner].ravel()
        _, first, pair = np.unique(vertex * len(mesh.uv) + uv_index, return_index=True, return_inverse=True)
        rows = np.column_stack([mesh.points[vertex[first]], mesh.uv[uv_index[first]]])
        distinct, joined = distinct_rows(rows)
        faces = joined[pair.ravel()].reshape(-1, 3)
        whole = proper(faces)
        if not whole.any():
            raise InputError(
                f"{mesh.name}: no face has an area in texture coordinates; create new ones "
                "with iccm flatten --uv"
            )
        shape = Triangles(faces[whole], distinct.size)
        uv, flipped = _flip_slips(shape, rows[distinct, 3:])
        notes += (
            [f"{flipped} triangles that fold over by less than rounding in the layout are flipped"]
            if flipped
            else []
        )
        return cls(mesh, shape, vertex[first][distinct], uv, corner[whole], tuple(notes))

    @cached_property
    def doubled_areas(self) -> Real:
        """Twice the signed areas of the triangles in the layout, negative where it shows their backs; shape (m,)."""
        return doubled_areas(self.uv[self.shape.faces])

    @cached_property
    def _label(self) -> Index:
        """The chart of each triangle, in arbitrary order; shape (m,)."""
        return _unfolded(self.shape, self.doubled_areas)

    @cached_property
    def areas(self) -> Real:
        """Areas of the charts in the layout; shape (k,)."""
        return np.bincount(self._label, np.abs(self.doubled_areas))[self._order] / 2

    @cached_property
    def _order(self) -> Index:
        return np.argsort(-np.bincount(self._label, np.abs(self.doubled_areas)), kind="stable")

    @cached_property
    def _sorted(self) -> tuple[Index, Index]:
        """Triangles sorted by chart, and where each chart begins."""
        rank = np.empty(self._order.size, np.int64)
        rank[self._order] = np.arange(rank.size)
        chart = rank[self._label]
        return grouped(chart, self.count)

    @property
    def count(self) -> int:
        """Number of charts."""
        return self._order.size

    def triangles(self, number: int) -> Index:
        """Return the triangles of a chart.

        Raises:
            InputError: there is no such chart.
        """
        if not 1 <= number <= self.count:
            raise InputError(
                f"{self.mesh.name}: there is no chart {number}; choose 1 (the largest) to {self.count}"
            )
        order, starts = self._sorted
        return order[starts[number - 1] : starts[number]]

    def tile(self, number: int) -> complex:
        """Return the lower left corner of the tile that contains the middle of a chart's bounding box."""
        u, v = self.uv[np.unique(self.shape.faces[self.triangles(number)])].T
        return complex(np.floor((u.min() + u.max()) / 2), np.floor((v.min() + v.max()) / 2))

    def mirrored(self, number: int) -> bool:
        """Return whether the layout shows the backs of a chart's faces, weighted by area."""
        return float(self.doubled_areas[self.triangles(number)].sum()) < 0

    def shared(self, number: int) -> float:
        """Return the share of a chart that other charts overlap, measured on a coarse grid; 0 below a hundredth."""
        in_chart = np.zeros(len(self.shape.faces), bool)
        in_chart[self.triangles(number)] = True
        corners = self.uv[self.shape.faces]
        low = corners[in_chart].min(axis=(0, 1))
        cells = (corners - low) * OVERLAP_GRID_CELLS / max(np.ptp(corners[in_chart].reshape(-1, 2), axis=0))
        covered = rasterise(cells[in_chart], OVERLAP_GRID_CELLS, OVERLAP_GRID_CELLS).centre
        shared = covered & rasterise(cells[~in_chart], OVERLAP_GRID_CELLS, OVERLAP_GRID_CELLS).centre
        share = float(shared.sum() / max(covered.sum(), 1))
        return share if share >= UNREPORTED_SHARE else 0.0

    def chart(self, number: int, aspect: float = 1.0) -> LaidOut:
        """Return a chart as a flattening, seen from the front of its faces.

        Args:
            number: of the chart, 1 for the largest.
            aspect: width / height of the textures on it; u is scaled by it.

        Raises:
            InputError: there is no such chart, or it overlaps itself.
        """
        triangles, tile, mirrored = self.triangles(number), self.tile(number), self.mirrored(number)
        mirror = (tile.real + 0.5) * aspect if mirrored else None
        front = (self.doubled_areas[triangles] < 0) == mirrored
        is_reversed = ~front[:, None]
        faces = np.where(is_reversed, self.shape.faces[triangles][:, ::-1], self.shape.faces[triangles])
        corner = np.where(is_reversed, self.corner[triangles][:, ::-1], self.corner[triangles])
        used, local = np.unique(faces, return_inverse=True)
        shape, pair = split_non_manifold(Triangles(local.reshape(-1, 3), used.size), used, [])
        vertex = self.vertex[pair]
        z = self.uv[pair, 0] * aspect + 1j * self.uv[pair, 1]
        flat = separate_boundaries(shape, z if mirror is None else 2 * mirror - z.conj())
        name = self.mesh.name
        patch = Patch(self.mesh, self.mesh.points[vertex], shape, vertex, corner, notes=self.notes)
        if not patch.loops:
            raise InputError(
                f"{name}: chart {number} of its texture coordinates overlaps itself, since the surface is "
                "closed; unwrap it again, or leave out uv to flatten it"
            )
        outline = max(patch.loops, key=lambda loop: polygon_area(flat[loop]))
        flattening = Flattening(patch, flat, outline, "uv")
        if fault := overlap(flattening):
            raise InputError(
                f"{name}: chart {number} of its texture coordinates overlaps itself ({fault}); repair the "
                "layout, or leave out uv to flatten it"
            )
        return LaidOut(flattening, tile, mirror)


def _unfolded(shape: Triangles, areas: Real) -> Index:
    """Label the pieces (m,) of a layout: triangles on both sides of an edge where it does not fold belong together."""
    first, second = _across(shape, areas)[0].T
    return labels(first, second, len(shape.faces))


def _across(shape: Triangles, areas: Real) -> tuple[Index, Index]:
    """Return pairs of triangles that share an edge: (e, 2) where the layout does not fold, and (f, 2) where it does."""
    half = np.flatnonzero(shape.twin > np.arange(shape.twin.size))
    opposite = shape.twin[half]
    alike = (areas[half // 3] > 0) == (areas[opposite // 3] > 0)
    against = shape.tail[half] == shape.tail[opposite]  # wound in opposite directions
    joined = alike != against
    ends = np.column_stack([half // 3, opposite // 3])
    return ends[joined], ends[~joined & ~against]


def _flip_slips(shape: Triangles, uv: Real) -> tuple[Real, int]:
    """Flip slips by small moves; return coordinates (p, 2) and the number of flipped triangles.

    A slip is a tiny part of a chart that folds back, by rounding. If it cannot be flipped by moving vertices by less
    than MOST_MOVED_SHARE, or there are too many, nothing is changed.
    """
    areas = doubled_areas(uv[shape.faces])
    joined, folds = _across(shape, areas)
    if not folds.size:
        return uv, 0
    first, second = joined.T
    piece = labels(first, second, len(shape.faces))
    area = np.bincount(piece, np.abs(areas))
    directed = np.concatenate([folds, folds[:, ::-1]])
    small = directed[area[piece[directed[:, 0]]] < SLIP_AREA_SHARE * area[piece[directed[:, 1]]]]
    signs = np.sign(areas)
    for slip, neighbour in small:
        signs[piece == piece[slip]] = np.sign(areas[neighbour])
    slips = np.flatnonzero(signs != np.sign(areas))
    if not 0 < slips.size <= MOST_SLIPS:
        return uv, 0
    nearby = np.flatnonzero(np.isin(shape.faces, shape.faces[slips]).any(axis=1))
    new_uv = _kaczmarz(shape.faces[nearby], signs[nearby], uv)
    size = np.linalg.norm(np.ptp(uv, axis=0))
    good = (np.sign(doubled_areas(new_uv[shape.faces])) == signs).all() and np.abs(
        new_uv - uv
    ).max() < MOST_MOVED_SHARE * size
    return (new_uv, int(slips.size)) if good else (uv, 0)


def _kaczmarz(faces: Index, signs: Real, uv: Real) -> Real:
    """Move vertices, one triangle at a time, until each triangle has the wanted sign and a height (Kaczmarz)."""
    z, size = complex_of(uv), np.linalg.norm(np.ptp(uv, axis=0))
    corner = z[faces]
    longest = np.abs(corner - np.roll(corner, 1, axis=1)).max(axis=1)
    least = SLIP_HEIGHT_SHARE * size * longest
    areas = signs * doubled_areas(uv[faces])
    least = np.where(areas > 0, np.minimum(least, areas / 2), least)
    for _ in range(SLIP_ROUNDS):
        short = False
        for face, sign, goal in zip(faces, signs, least):
            a, b, c = z[face]
            lack = goal - sign * cross(b - a, c - a)
            if lack > 0:
                short = True
                slope = 1j * np.array([c - b, a - c, b - a])  # of twice the area
                z[face] += 1.01 * sign * lack * slope / (np.abs(slope) ** 2).sum()
        if not short:
            break
    return xy_of(z)


def separate_boundaries(shape: Triangles, flat: Complex) -> Complex:
    """Move vertices where a boundary touches itself a little inwards; return the new positions (n,)."""
    rim = np.unique(shape.tail[shape.twin < 0])
    twice = rim[_touch(shape, flat, rim)]
    if not twice.size:
        return flat
    touching = np.isin(shape.faces, twice).any(axis=1)
    corner = flat[shape.faces[touching]]
    middle = np.repeat(corner.mean(axis=1), 3)
    longest = np.abs(corner - np.roll(corner, 1, axis=1)).max(axis=1)
    height = 2 * np.abs(triangle_areas(corner)) / np.maximum(longest, 1e-300)
    into, room = np.zeros(flat.size, complex), np.full(flat.size, np.inf)
    outward = middle - corner.ravel()
    np.add.at(into, shape.faces[touching].ravel(), outward / np.maximum(np.abs(outward), 1e-300))
    np.minimum.at(room, shape.faces[touching].ravel(), np.repeat(height, 3))
    separated = flat.copy()
    length = np.minimum(DRAWN_IN_SHARE * diagonal(flat), room[twice] / 10)
    separated[twice] += length * into[twice] / np.maximum(np.abs(into[twice]), 1e-300)
    return separated


def _touch(shape: Triangles, flat: Complex, rim: Index) -> Flags:
    """Mark (r,) vertices of the boundary that lie on an edge of it that does not end there, or at another vertex."""
    border = np.flatnonzero(shape.twin < 0)
    ends = np.column_stack([shape.tail[border], shape.head[border]])
    edges = shapely.linestrings(xy_of(flat[ends].ravel()).reshape(-1, 2, 2))
    near = TOUCHING_SHARE * diagonal(flat)
    vertex, edge = shapely.STRtree(edges).query(shapely.points(xy_of(flat[rim])), "dwithin", near)
    apart = (ends[edge] != rim[vertex][:, None]).all(axis=1)
    touches = np.zeros(rim.size, bool)
    touches[vertex[apart]] = True
    return touches


def _has_coordinates(mesh: Mesh, uv: Real, uv_corners: Index, corner: Index) -> Flags:
    """Mark (m,) the triangles with finite texture coordinates at all corners."""
    faces = uv_corners[corner]
    good = np.logical_and.reduce(np.isfinite(uv), axis=1)
    if (uv_corners >= len(uv)).any():
        raise InputError(f"{mesh.name}: a face uses a texture coordinate that is not in the file")
    return np.logical_and.reduce((faces >= 0) & good[faces], axis=1)


def _left_out(count: int, lacking: str) -> list[str]:
    return [f"ignored {count} triangles without {lacking}"] if count else []
