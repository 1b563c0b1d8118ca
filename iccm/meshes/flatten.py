"""Conformal flattening of a patch: libigl's LSCM, and the unit disk where that overlaps itself.

Lévy, Petitjean, Ray, Maillot, *Least Squares Conformal Maps*, SIGGRAPH 2002. Flat positions are complex, at the scale
of the surface (equal area) and turned so that up on the surface is up in the plane.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ..arrays import Complex, Index, Real
from ..curve import Curve
from ..errors import InputError
from . import disk_map
from .cut import extended
from .mesh import face_areas
from .patch import Patch
from .stretch import stretches

# Chosen by hand, and nobody knows better, where a line does not say how a number was found.
ROUNDS = 8  # of lengthening the seam of a surface that had to be cut
EVEN = 2.0  # spread of log10 area (p05 to p95) at which a seam is long enough


@dataclass(frozen=True, eq=False)
class Flattening:
    """A patch laid out in the plane.

    Attributes:
        patch: the patch, further cut where its seam had to grow.
        flat: (p,) complex position of each of its vertices.
        loop: vertices of the boundary loop that is the domain's outline, counter-clockwise.
        method: "lscm", "disk" (conformal map to the disk) or "tutte" (convex combinations: one to one, not conformal).
        notes: what was repaired.
    """

    patch: Patch
    flat: Complex
    loop: Index
    method: str
    notes: tuple[str, ...] = ()

    @cached_property
    def boundary(self) -> Curve:
        """The outline as the boundary of a domain."""
        return Curve.domain(self.flat[self.loop], f"{self.patch.mesh.name}: flattened")

    @cached_property
    def stretch(self) -> tuple[Real, Real]:
        """(m,) larger and smaller singular value of the map from each triangle to the plane; smaller < 0 if turned."""
        corners = self.patch.points[self.patch.faces]
        return stretches(corners, self.flat[self.patch.faces])

    @property
    def turned(self) -> Index:
        """Triangles that the plane shows from behind, or that have no area there."""
        return np.flatnonzero(self.stretch[1] <= 0)

    def report(self) -> dict:
        """Conformal error (dilatation, 1 is exact), area distortion, turned triangles, holes, seam."""
        major, minor = self.stretch
        good = minor > 0
        weight = face_areas(self.patch.points[self.patch.faces])
        dilatation = np.where(good, major / np.where(good, minor, 1.0), np.inf)
        log_area = np.log10(np.maximum(major * np.abs(minor), 1e-300))
        at = weighted_percentiles(dilatation, weight, (50, 95, 100))
        area = weighted_percentiles(log_area, weight, (5, 50, 95))
        return {
            "method": self.method,
            "vertices": len(self.flat),
            "triangles": len(self.patch.faces),
            "boundary_vertices": len(self.loop),
            "holes": len(self.patch.loops) - 1,
            "seam_edges": len(self.patch.seam),
            "turned": int(self.turned.size),
            "dilatation": dict(zip(("median", "p95", "max"), at)),
            "log10_area": dict(zip(("p05", "median", "p95"), area)),
            "notes": [*self.patch.notes, *self.notes],
        }


def flatten(patch: Patch, *, loop: int = 1, grow: bool = False) -> Flattening:
    """Lay a patch out in the plane so that its outline is simple.

    Args:
        patch: one disk, with or without holes.
        loop: which boundary loop is the outline, 1 being the longest in space.
        grow: lengthen the seam of a patch that was cut until areas are even enough (Gu, Gortler, Hoppe, *Geometry
            Images*, SIGGRAPH 2002).

    Raises:
        InputError: there is no such loop, or nothing gave a flattening without overlap.
    """
    if not 1 <= loop <= len(patch.loops):
        raise InputError(
            f"{patch.mesh.name}: no boundary loop {loop}; there are {len(patch.loops)}, 1 is the longest"
        )
    result = _flatten_once(patch, loop)
    for _ in range(ROUNDS if grow and len(patch.seam) else 0):
        low, _, high = result.report()["log10_area"].values()
        if high - low <= EVEN:
            break
        longer = extended(result.patch, _most_shrunk(result))
        if longer is result.patch:
            break
        result = _flatten_once(longer, 1)
    return result


def _flatten_once(patch: Patch, loop: int) -> Flattening:
    outline = patch.loops[loop - 1]
    result = Flattening(patch, upright(patch, lscm(patch, outline)), outline, "lscm")
    fault = overlap(result)
    if fault is None:
        return result
    for method, place in (("disk", disk_map.conformal), ("tutte", disk_map.convex)):
        try:
            flat = place(patch, outline)
        except RuntimeError:  # scipy's word for a singular matrix: triangles too thin for this method
            continue
        result = Flattening(patch, upright(patch, flat), outline, method, (f"LSCM gave {fault}: repaired",))
        if overlap(result) is None:
            return result
    raise InputError(
        f"{patch.mesh.name}: every flattening overlaps itself ({overlap(result)}); cut the patch smaller"
    )


def overlap(result: Flattening) -> str | None:
    """What keeps the flattening from being one to one, or None."""
    if not np.isfinite(result.flat).all():
        return "no finite positions"
    if result.turned.size:
        return f"{result.turned.size} turned triangles"
    z = result.flat[result.loop]
    ring = shapely.Polygon(np.column_stack([z.real, z.imag]))
    return None if ring.is_valid and ring.exterior.is_ccw else "an outline that crosses itself"


def lscm(patch: Patch, outline: Index) -> Complex:
    """(p,) flat positions by libigl's LSCM with the two farthest vertices of the outline pinned; NaN when it fails.

    The patch has been checked vertex by vertex: libigl ends the process or returns NaN for one that has not.
    """
    import igl

    a, b = farthest(patch.points[outline])
    pins = np.array([outline[a], outline[b]])
    length = np.linalg.norm(patch.points[pins[1]] - patch.points[pins[0]])
    at = np.array([[0.0, 0.0], [length, 0.0]])
    try:
        uv, _ = igl.lscm(patch.points, np.ascontiguousarray(patch.faces), pins, at)
    except RuntimeError:  # a singular system: the caller takes another method
        return np.full(len(patch.points), complex(np.nan, np.nan))
    return uv[:, 0] + 1j * uv[:, 1]


def farthest(points: Real) -> tuple[int, int]:
    """Two of the (k, 3) points that are about as far apart as any (exactly, up to 2000 points)."""
    if len(points) <= 2000:
        from scipy.spatial.distance import pdist, squareform

        pair = int(np.argmax(squareform(pdist(points))))
        return pair // len(points), pair % len(points)
    a = 0
    for _ in range(4):
        b = a
        a = int(np.argmax(np.linalg.norm(points - points[b], axis=1)))
    return a, b


def upright(patch: Patch, flat: Complex) -> Complex:
    """Flat positions at the surface's area, centred, and turned so that they agree best with a view from outside.

    Up is +y, or -z for a surface that faces up or down.
    """
    corners = patch.points[patch.faces]
    across = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = across.sum(axis=0)
    up = (
        np.array([0.0, 1.0, 0.0])
        if abs(normal[1]) < 0.9 * np.linalg.norm(normal)
        else np.array([0.0, 0.0, -1.0])
    )
    right = np.cross(up, normal)
    right = right / max(np.linalg.norm(right), 1e-300)
    up = np.cross(normal, right)
    seen = patch.points @ right + 1j * (patch.points @ (up / max(np.linalg.norm(up), 1e-300)))
    area = np.linalg.norm(across, axis=1)
    weight = np.bincount(patch.faces.ravel(), np.repeat(area, 3), minlength=len(flat))
    centred = flat - np.sum(weight * flat) / weight.sum()
    turn = np.sum(weight * centred.conj() * seen)
    flat_area = np.abs(_signed_areas(flat[patch.faces])).sum()
    scale = np.sqrt(area.sum() / flat_area) if flat_area > 0 else 1.0
    return centred * scale * (turn / abs(turn) if abs(turn) > 0 else 1.0)


def weighted_percentiles(values: Real, weight: Real, percents: tuple[int, ...]) -> list[float]:
    """Values below which these percents of the weight lie."""
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    at = np.searchsorted(share, np.array(percents) / 100 * share[-1])
    return [float(v) for v in values[order][np.minimum(at, values.size - 1)]]


def _signed_areas(z: Complex) -> Real:
    return 0.5 * ((z[:, 1] - z[:, 0]).conj() * (z[:, 2] - z[:, 0])).imag


def _most_shrunk(result: Flattening) -> int:
    """The inner vertex around which the plane shows the surface smallest."""
    faces = result.patch.faces.ravel()
    scale = np.repeat(np.log(np.maximum(np.abs(result.stretch[0]), 1e-300)), 3)
    mean = np.bincount(faces, scale) / np.bincount(faces)
    mean[np.concatenate(result.patch.loops)] = np.inf
    return int(np.argmin(mean))
