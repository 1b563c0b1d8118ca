"""Distortion between surfaces by a map between their layouts."""

from dataclasses import replace

import numpy as np

from ..arrays import Complex, Flags, Index, Real
from ..maps.distortion import Distortion
from ..plane import diagonal
from .flatten import Flattening, weighted_percentiles
from .locate import Locator
from .stretch import Linear, laid_flat, linear
from .views import views

NEAR_SHARE = 1e-3  # relative to the diagonal: the default tolerance of outlines

LEAST_CORRELATION = 0.4
"""Correlation of corresponding points, after the best rotation, below which there is no such rotation."""


def on_surfaces(flat: Distortion, layouts: tuple[Flattening | None, Flattening | None]) -> Distortion:
    """Return the distortion between surfaces, from samples of the map between their planes.

    Args:
        flat: samples in the planes, with their positions.
        layouts: of source and target; None for a planar domain. Samples in holes of layouts are omitted.
    """
    on, triangles = np.ones(flat.z.size, bool), list[Index | None]()
    for layout, w in zip(layouts, (flat.z, flat.w)):
        triangles.append(None)
        if layout is not None:
            triangles[-1], inside = _on_surface(layout, w)
            on &= inside
    flat = replace(
        flat, area=flat.area[on], f_z=flat.f_z[on], f_zbar=flat.f_zbar[on], z=flat.z[on], w=flat.w[on]
    )
    jacobian, area = Linear(flat.f_z, flat.f_zbar), flat.area
    source_area = area / np.maximum(np.abs(jacobian.determinant), 1e-300)
    source_maps, target_maps = (
        None if layout is None or triangle is None else _to_surface(layout, triangle[on])
        for layout, triangle in zip(layouts, triangles)
    )
    if source_maps is not None:
        jacobian, source_area = jacobian @ source_maps.inverse(), source_area * source_maps.determinant
    if target_maps is not None:
        jacobian, area = target_maps @ jacobian, area * target_maps.determinant
    painted = np.abs(flat.f_z) + np.abs(flat.f_zbar) > 0
    scale = float(np.sqrt(area[painted].sum() / source_area[painted].sum()))
    return replace(flat, area=area, f_z=jacobian.a, f_zbar=jacobian.b, scale=scale)


def surface_distances(flat: Distortion, source: Flattening, target: Flattening) -> dict[str, float]:
    """Return the median, 95th percentile and maximum of the distances in space between points and their preimages.

    They are taken over the target's area, relative to the diagonal of the target's box. For copies of one model
    in the same place, these are the errors of the map.

    Args:
        flat: samples of the map between the planes, with their positions.
        source: layout of the source.
        target: layout of the target.
    """
    target_maps = _to_surface(target, Locator.of(target)(flat.w, 1)[0])
    away = np.linalg.norm(_in_space(source, flat.z) - _in_space(target, flat.w), axis=1)
    percentiles = weighted_percentiles(away, flat.area * np.abs(target_maps.determinant), (50, 95, 100))
    size = np.linalg.norm(np.ptp(target.patch.points, axis=0))
    return {name: value / float(size) for name, value in zip(("median", "p95", "max"), percentiles)}


def gap_between(source: Flattening, target: Flattening) -> float:
    """Return the distance between two surfaces, relative to the diagonal of the target's box.

    It is the 95th percentile of the distances of one surface's vertices and triangle centroids to the other
    one, the larger of both directions.
    """
    import igl

    gaps = []
    for patch, reference in ((source.patch, target.patch), (target.patch, source.patch)):
        points, faces = np.ascontiguousarray(reference.points), np.ascontiguousarray(reference.faces)
        queries = np.concatenate([patch.points, patch.points[patch.faces].mean(axis=1)])
        tree = igl.AABB()
        tree.init(points, faces)
        gaps.append(np.quantile(np.sqrt(tree.squared_distance(points, faces, queries)[0]), 0.95))
    return float(max(gaps) / np.linalg.norm(np.ptp(target.patch.points, axis=0)))


def tilt(flat: Distortion, source: Flattening, target: Flattening) -> float:
    """Return the angle by which a map turns the source, seen from the front of both models, or from above.

    In degrees, counter-clockwise; `views` says which side that is.

    It is the rotation between corresponding points that fits best, where right and up are each model's own, scaled to
    the same deviation. It is 0 where no rotation fits well, as for points around a closed surface that is turned about
    its axis.

    Args:
        flat: samples of the map between the planes, with their positions.
        source: layout of the source.
        target: layout of the target.
    """
    before, after = (
        _standardized(view.plan(_in_space(layout, z)))
        for view, layout, z in zip(views(source.patch, target.patch), (source, target), (flat.z, flat.w))
    )
    weight = flat.area / flat.area.sum()
    correlation = complex((weight * after * before.conj()).sum()) / 2
    return float(np.degrees(np.angle(correlation))) if abs(correlation) >= LEAST_CORRELATION else 0.0


def _standardized(points: Complex) -> Complex:
    """Return points (k,) relative to their mean, and both coordinates to their deviations."""
    right, up = ((x - x.mean()) / max(float(x.std()), 1e-300) for x in (points.real, points.imag))
    return right + 1j * up


def distances_at(pairs: Complex, source: Flattening, target: Flattening) -> Real:
    """Return (k,) distances in space between the points of pairs (k, 2) in both layouts.

    They are relative to the target's diagonal.
    """
    away = np.linalg.norm(_in_space(source, pairs[:, 0]) - _in_space(target, pairs[:, 1]), axis=1)
    return away / np.linalg.norm(np.ptp(target.patch.points, axis=0))


def _in_space(layout: Flattening, z: Complex) -> Real:
    """Return (p, 3) the points of a surface at points z of its layout."""
    face, place = Locator.of(layout)(z, 1)
    return np.einsum("pk,pkc->pc", place, layout.patch.points[layout.patch.faces[face]])


def _on_surface(layout: Flattening, z: Complex) -> tuple[Index, Flags]:
    """Return the triangles (p,) at points, and whether these are on the surface and not in its holes.

    Points count as on the surface up to NEAR_SHARE of its diagonal.
    """
    triangle, place = Locator.of(layout)(z, 1)
    nearest = np.einsum("pk,pk->p", place, layout.flat[layout.patch.faces[triangle]])
    return triangle, np.abs(nearest - z) <= NEAR_SHARE * diagonal(layout.flat)


def _to_surface(layout: Flattening, triangle: Index) -> Linear:
    """Return the linear maps from the plane to the surface in triangles (p,)."""
    faces = layout.patch.faces
    maps = linear(layout.flat[faces], laid_flat(layout.patch.points[faces]))
    return Linear(maps.a[triangle], maps.b[triangle])
