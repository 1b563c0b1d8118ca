"""A patch flattened into the plane with figures about it, and least squares conformal maps.

Lévy, Petitjean, Ray, Maillot, *Least Squares Conformal Maps*, SIGGRAPH 2002. Flat positions are complex, scaled
to the surface's area, and rotated so that up on the surface is up in the plane.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from ..arrays import Complex, Index, Real, complex_of, xy_of
from ..curve import Curve
from ..plane import cross, rotation, triangle_areas
from ..sorting import grouped
from .mesh import up_and_front
from .patch import Patch
from .stretch import laid_flat, stretches

LARGE_VERTEX_COUNT = (
    20_000  # vertices from which libigl is slower: it is at 35,000, and is not at 9,000 (measured)
)

LEAST_STEEP_SHARE = 0.1
"""Mean sine of the slope of a surface below which it counts as horizontal: 6 degrees."""
FRONT_PREFERENCE = 0.1
"""Weight that faces gain that look to the front, relative to others."""
RIGHT_PREFERENCE = 0.1
"""Weight of looking to the right relative to that of looking to the front, which decides between two sides."""
DIRECTION_SHARPNESS = 16
"""Power of the cosine by which a direction counts for others: half at 17 degrees."""
SAME_DIRECTION_DEGREES = 30
"""Angle between directions of which the mean is taken."""
STRAIGHT_SHARE = 0.5
"""Share of the boundary that must be along one direction, or at right angles to it, to count as straight."""


@dataclass(frozen=True, eq=False)
class Flattening:
    """A patch flattened into the plane.

    Attributes:
        patch: the patch, cut further if its seam had to grow.
        flat: (p,) complex position of each of its vertices.
        loop: vertices of the boundary loop that is the domain's outline, counter-clockwise.
        method: "lscm", "conformal" (free of folds and overlaps) or "balanced" (uniform scale).
        notes: messages about repairs.
        even: the layout with uniform scale from which it was computed, if any.
        outlines: the outer boundary of each chart, if there are several; `loop` is then that of the largest.
    """

    patch: Patch
    flat: Complex
    loop: Index
    method: str
    notes: tuple[str, ...] = ()
    even: "Flattening | None" = None
    outlines: tuple[Index, ...] = ()

    def cut_further(self, patch: Patch) -> "Flattening":
        """Return the same layout for the patch cut further: both sides of the cut coincide."""
        flat = np.empty(len(patch.points), complex)
        flat[patch.faces] = self.flat[self.patch.faces]
        return replace(self, patch=patch, flat=flat, loop=patch.loop_of(self.patch, self.loop))

    @property
    def outer_loops(self) -> tuple[Index, ...]:
        """The outer boundary of each chart."""
        return self.outlines or (self.loop,)

    @cached_property
    def boundary(self) -> Curve:
        """The outline as the boundary of a domain."""
        return Curve.domain(self.flat[self.loop], f"{self.patch.mesh.name}: flattened")

    @cached_property
    def stretch(self) -> tuple[Real, Real]:
        """Larger and smaller singular value of the map from each triangle to the plane; shape (m,).

        The smaller one is negative if the triangle is flipped.
        """
        corners = self.patch.points[self.patch.faces]
        return stretches(corners, self.flat[self.patch.faces])

    @property
    def flipped(self) -> Index:
        """Triangles that are flipped in the plane, or have no area there."""
        return np.flatnonzero(self.stretch[1] <= 0)

    @property
    def dilatation(self) -> Real:
        """Dilatation of each triangle, s₁/s₂ of its singular values; infinite if it is flipped; shape (m,)."""
        major, minor = self.stretch
        return np.where(minor > 0, major / np.where(minor > 0, minor, 1.0), np.inf)

    def dilated(self, percent: int) -> float:
        """Return the dilatation that is not exceeded on this percentage of the surface."""
        return self._below(self.dilatation, percent)

    @property
    def strain(self) -> Real:
        """The larger of stretch and shrinkage of each triangle, max(s₁, 1/s₂) of its singular values; shape (m,)."""
        major, minor = self.stretch
        return np.maximum(major, 1 / np.maximum(minor, 1e-300))

    def strained(self, percent: int) -> float:
        """Return the strain that is not exceeded on this percentage of the surface."""
        return self._below(self.strain, percent)

    def _below(self, values: Real, percent: int) -> float:
        return weighted_percentiles(values, self.patch.areas, (percent,))[0]

    def report(self) -> dict:
        """Return the figures of the report.

        They are the dilatation (1 is conformal), area distortion relative to the mean, flipped triangles,
        holes, and the seam.
        """
        major, minor = self.stretch
        weight = self.patch.areas
        area = np.abs(major * minor)
        log_area = np.log10(np.maximum(area * weight.sum() / (weight @ area), 1e-300))
        percentiles = weighted_percentiles(self.dilatation, weight, (50, 95, 100))
        spread = weighted_percentiles(log_area, weight, (5, 50, 95))
        return {
            "method": self.method,
            "vertices": len(self.flat),
            "triangles": len(self.patch.faces),
            "boundary_vertices": sum(loop.size for loop in self.outer_loops),
            **({"charts": len(self.outlines)} if self.outlines else {}),
            "holes": len(self.patch.loops) - len(self.outer_loops),
            "seam_edges": len(self.patch.seam),
            "seam_length": self.patch.seam_length,
            "turned": int(self.flipped.size),
            "dilatation": dict(zip(("median", "p95", "max"), percentiles)),
            "log10_area": dict(zip(("p05", "median", "p95"), spread)),
            "notes": [*self.patch.notes, *self.notes],
        }


def chart_figures(layout: Flattening) -> list[dict]:
    """Return figures of each chart of a layout, the largest first, for reports.

    They are its number of triangles, its share of the surface, its share of the layout's area, its dilatation, its
    texel density relative to that of the whole layout, and its box.
    """
    patch, area = layout.patch, layout.patch.areas
    label = patch.triangles.components()
    major, minor = layout.stretch
    flat_area = np.abs(major * minor) * area
    total, flat_total = max(float(area.sum()), 1e-300), max(float(flat_area.sum()), 1e-300)
    order, starts = grouped(label, int(label.max()) + 1)
    charts = []
    for k in range(starts.size - 1):
        members = order[starts[k] : starts[k + 1]]
        share, flat_share = area[members].sum() / total, flat_area[members].sum() / flat_total
        percentiles = weighted_percentiles(layout.dilatation[members], area[members], (50, 95, 100))
        z = layout.flat[patch.faces[members]]
        charts.append(
            {
                "triangles": int(members.size),
                "area_share": float(share),
                "layout_share": float(flat_share),
                "dilatation": dict(zip(("median", "p95", "max"), percentiles)),
                "density": float(np.sqrt(flat_share / max(share, 1e-300))),
                "box": [complex(z.real.min(), z.imag.min()), complex(z.real.max(), z.imag.max())],
            }
        )
    return sorted(charts, key=lambda chart: -chart["area_share"])


def overlap(result: Flattening) -> str | None:
    """Return the reason why the flattening is not one-to-one, or None."""
    if not np.isfinite(result.flat).all():
        return "no finite positions"
    if result.flipped.size:
        return f"{result.flipped.size} flipped triangles"
    if result.outlines:
        return _overlap_of_charts(result)
    return _overlap_inside(
        result.flat,
        result.loop,
        [loop for loop in result.patch.loops if not np.array_equal(loop, result.loop)],
    )


def _overlap_inside(flat: Complex, outline: Index, holes: Sequence[Index]) -> str | None:
    """Return the reason why the boundary of a chart does not bound a region, or None."""
    xy = xy_of(flat)
    region = shapely.Polygon(xy[outline], [xy[hole] for hole in holes])
    if not (region.is_valid and region.exterior.is_ccw):
        return "an outline that crosses itself"
    return "an inverted hole" if any(ring.is_ccw for ring in region.interiors) else None


def _overlap_of_charts(result: Flattening) -> str | None:
    """Return the reason why charts are not disjoint, or one is not one-to-one, or None."""
    chart = np.empty(result.flat.size, np.int64)
    chart[result.patch.faces] = result.patch.triangles.components()[:, None]
    outer = {int(chart[loop[0]]): loop for loop in result.outlines}
    holes: dict[int, list[Index]] = {k: [] for k in outer}
    first = {int(loop[0]) for loop in result.outlines}
    for loop in result.patch.loops:
        if int(loop[0]) not in first:
            holes[int(chart[loop[0]])].append(loop)
    for k, loop in outer.items():
        if fault := _overlap_inside(result.flat, loop, holes[k]):
            return fault
    xy = xy_of(result.flat)
    regions = np.array(
        [shapely.Polygon(xy[loop], [xy[hole] for hole in holes[k]]) for k, loop in outer.items()]
    )
    i, j = shapely.STRtree(regions).query(regions, "intersects")
    return "charts that overlap" if (i < j).any() else None


def lscm(patch: Patch, outline: Index) -> Complex:
    """Return (p,) the least squares conformal map; NaN if it fails.

    The two farthest vertices of the outline are pinned. It is computed by libigl, and for large patches by a
    solver with nearly linear time. The patch has to be valid: libigl ends the process or returns NaN otherwise.
    """
    a, b = farthest(patch.points[outline])
    pins = np.array([outline[a], outline[b]])
    length = np.linalg.norm(patch.points[pins[1]] - patch.points[pins[0]])
    if len(patch.points) >= LARGE_VERTEX_COUNT:
        flat = _lscm_large(patch, pins, np.array([0.0, length], complex))
        if flat is not None:
            return flat
    import igl

    pinned = np.array([[0.0, 0.0], [length, 0.0]])
    try:
        uv, _ = igl.lscm(patch.points, np.ascontiguousarray(patch.faces), pins, pinned)
    except RuntimeError:  # singular system: the caller uses another method
        return np.full(len(patch.points), complex(np.nan, np.nan))
    return complex_of(uv)


def _lscm_large(patch: Patch, pins: Index, pinned: Complex) -> Complex | None:
    """Return the same as `lscm`, by the Hermitian form |Σ Wⱼ uⱼ|² / 2A of each triangle (Lévy et al., §2.3).

    Returns:
        (p,) flat positions; None if the form is singular.
    """
    from ..linalg import hermitian

    diagonal, ends, values = form = _form(patch)
    if not np.isfinite(diagonal).all():
        return None
    free = np.ones(len(patch.points), bool)
    free[pins] = False
    flat, right = np.zeros((2, free.size), complex)
    flat[pins] = pinned
    fixed = ~free[ends].all(axis=0)
    for (row, column), value in zip(ends.T[fixed].tolist(), values[fixed].tolist()):
        right[row] -= value * flat[column]
        right[column] -= value.conjugate() * flat[row]
    number = np.cumsum(free, dtype=np.int32) - 1
    inner = hermitian.Hermitian(diagonal[free], number[ends[:, ~fixed]], values[~fixed])
    del form, values, ends, number
    try:
        flat[free] = hermitian.solve(inner, patch.points[free], right[free])
    except np.linalg.LinAlgError:
        return None
    return flat if np.isfinite(flat).all() else None


def _form(patch: Patch) -> tuple[Real, NDArray[np.integer], Complex]:
    """Return the form's diagonal, the ends of edges, and the entries for these.

    They are not finite if a triangle has no area.
    """
    triangles = patch.triangles
    flat = laid_flat(patch.points[patch.faces])
    sides = np.roll(flat, -2, axis=1) - np.roll(flat, -1, axis=1)
    area = cross(sides[:, 0], sides[:, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        sides /= np.sqrt(area)[:, None]
    diagonal = np.bincount(triangles.tail, (sides.real**2 + sides.imag**2).ravel()).astype(float, copy=False)
    values = (sides.conj() * np.roll(sides, -1, axis=1)).ravel()
    twin = triangles.twin
    once = np.flatnonzero(twin < np.arange(twin.size))  # one half-edge for each edge
    opposite = twin[once]
    of_edges = values[once] + np.where(opposite < 0, 0, values[opposite].conj())
    return diagonal, np.stack([triangles.tail[once], triangles.head[once]]).astype(np.int32), of_edges


def farthest(points: Real) -> tuple[int, int]:
    """Return two of the (k, 3) points with nearly the largest distance (exact for up to 2000 points)."""
    if len(points) <= 2000:
        centred = points - points.mean(axis=0)
        squares = (centred**2).sum(axis=1)
        pair = int(np.argmax(squares[:, None] + squares - 2 * centred @ centred.T))
        return pair // len(points), pair % len(points)
    a = 0
    for _ in range(4):
        b = a
        a = int(np.argmax(np.linalg.norm(points - points[b], axis=1)))
    return a, b


def upright(patch: Patch, flat: Complex) -> Complex:
    """Return flat positions scaled to the surface's area, centred, and rotated to agree best with a view from outside.

    Up is the model's up axis; for a surface that faces up or down, the model's back (-z, or +y where z is up).
    """
    corners = patch.points[patch.faces]
    across = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = across.sum(axis=0)
    up, front = up_and_front(patch.mesh.up_axis)
    if abs(normal @ up) >= 0.9 * np.linalg.norm(normal):
        up = -front
    right = np.cross(up, normal)
    right = right / max(float(np.linalg.norm(right)), 1e-300)
    up = np.cross(normal, right)
    projected: Complex = patch.points @ right + 1j * (
        patch.points @ (up / max(float(np.linalg.norm(up)), 1e-300))
    )
    area = np.linalg.norm(across, axis=1)
    weight = np.bincount(patch.faces.ravel(), np.repeat(area, 3), minlength=len(flat))
    centred = flat - np.sum(weight * flat) / weight.sum()
    flat_area = np.abs(triangle_areas(flat[patch.faces])).sum()
    scale = np.sqrt(area.sum() / flat_area) if flat_area > 0 else 1.0
    return centred * scale * rotation(centred, weight * projected)


def stand_upright(layout: Flattening) -> Flattening:
    """Return a layout rotated so that the model's up is up on as much of the surface as possible.

    It is the direction of most of the surface, not the mean: the sides of a box that hang on its lid in a net point in
    four directions, and one of them is upright rather than all slanted. On layouts of horizontal surfaces, the model's
    back is up, or a straight edge near that direction.
    """
    patch = layout.patch
    up, front = up_and_front(patch.mesh.up_axis)
    steepest = _gradients(layout, up)
    if np.abs(steepest).sum() >= LEAST_STEEP_SHARE * patch.areas.sum():
        # of directions with equal areas, that of the front wins
        corners = patch.points[patch.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing = (
            normals @ (front + RIGHT_PREFERENCE * np.cross(up, front)) / np.maximum(2 * patch.areas, 1e-300)
        )
        direction = _main_direction(steepest * (1 + FRONT_PREFERENCE * facing))
    else:
        direction = _along_edges(layout, _main_direction(_gradients(layout, -front)))
    factor = 1j * np.conj(direction)
    even = layout.even and replace(layout.even, flat=layout.even.flat * factor)
    return replace(layout, flat=layout.flat * factor, even=even)


def gradient_integrals(z: Complex, values: Real) -> Complex:
    """Return (m,) the gradient on each triangle, times its area, of a linear function.

    Args:
        z: (m, 3) corners of the triangles, counter-clockwise.
        values: (m, 3) of the function at the corners.
    """
    opposite = np.roll(z, -2, axis=1) - np.roll(z, -1, axis=1)
    return 0.5j * (values * opposite).sum(axis=1)


def _gradients(layout: Flattening, direction: Real) -> Complex:
    """Return (m,) gradients in the plane of the coordinate along a direction (3,), times the areas in space."""
    patch = layout.patch
    z, height = layout.flat[patch.faces], (patch.points @ direction)[patch.faces]
    gradient = gradient_integrals(z, height) / np.maximum(triangle_areas(z), 1e-300)
    # slivers have no reliable gradient; on an isometric layout, it is at most one
    return patch.areas * gradient / np.maximum(np.abs(gradient), 1)


def _main_direction(vectors: Complex) -> complex:
    """Return the unit number of the direction in which most of some vectors (k,) point; 1j without any."""
    weight = np.abs(vectors)
    degrees = np.rint(np.degrees(np.angle(vectors))).astype(np.int64) % 360
    share = np.bincount(degrees, weight, 360)
    near = np.maximum(np.cos(np.radians(np.arange(360))), 0) ** DIRECTION_SHARPNESS
    votes = np.fft.ifft(np.fft.fft(share) * np.fft.fft(near)).real
    main = np.exp(1j * np.radians(int(np.argmax(votes))))
    around = (vectors * np.conj(main)).real > np.cos(np.radians(SAME_DIRECTION_DEGREES)) * weight
    mean = complex(vectors[around].sum())
    return mean / abs(mean) if abs(mean) > 0 else 1j


def _along_edges(layout: Flattening, direction: complex) -> complex:
    """Return the direction of straight boundary edges, or at right angles to them, that is the nearest to another.

    It is `direction` itself where the boundary has no main direction.
    """
    shape = layout.patch.triangles
    rim = shape.twin < 0
    edges = layout.flat[shape.head[rim]] - layout.flat[shape.tail[rim]]
    length = np.abs(edges)
    crossed = complex((edges**4 / np.maximum(length, 1e-300) ** 3).sum())  # quarter turns make no difference
    if abs(crossed) < STRAIGHT_SHARE * length.sum():
        return direction
    along = np.exp(1j * np.angle(crossed) / 4)
    return complex(max(along * 1j ** np.arange(4), key=lambda z: (z * np.conj(direction)).real))


def weighted_percentiles(values: Real, weight: Real, percents: tuple[int, ...]) -> list[float]:
    """Return the values below which these percentages of the weight are."""
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    indices = np.searchsorted(share, np.array(percents) / 100 * share[-1])
    return [float(v) for v in values[order][np.minimum(indices, values.size - 1)]]
