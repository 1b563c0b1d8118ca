"""Where a map bends the detail of the picture, such as a smile that becomes a frown.

Figures over areas do not see faces: a map that is even almost everywhere may still bend the part that people look at.
Here the edges of the picture are compared with what the map makes of them, in discs of the size of a feature.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Complex, Real
from ...curve import Curve
from ...drawings.detail import Detail
from ...maps.triangulated.map import TriangulatedMap

FEATURE_RADIUS_SHARE = 0.1
"""Radius of a feature, such as a mouth, relative to the square root of the source's area."""
MOST_BEND = 0.4
"""Of a feature, the largest of three measures: the root mean square distance of its edges from their best place under a
similarity, relative to its size; that of the sines of their rotations; and by how much the feature as a whole is
rotated relative to the picture around it, as a chord of the unit circle. A stretch by 2.6 in one direction, a smile
that is turned over, or an eye that is rotated by 24 degrees in its face, is more.
"""
LEAST_EDGES = 12  # in a feature: fewer do not show its form
LEAST_DETAIL_RATIO = 0.35  # of a feature's detail to that of the feature with most
LEAST_WIDTH_RATIO = (
    0.15  # of a feature's smaller to its larger extent: edges on one line do not enclose anything
)
MOST_FEATURES = 200  # discs that are compared
MOST_PLACES = 3  # that are reported, the most bent first
APART_RADII = 1.5  # between reported features
AROUND_RADII = 2.0  # from the middle of a feature: there, the picture around it is seen
AROUND_POINTS = 24  # all of them in the shape: features at its rim turn with the outline
RIM_RADII = 0.5  # from the source's outline: nearer edges follow the outline, which has to change


class BentPlace(NamedTuple):
    """A feature of the picture that the map bends.

    Attributes:
        point: an edge near its middle, in the source.
        image: where the map takes it.
        radius: of the disc around it, in the source.
        bend: see `MOST_BEND`.
    """

    point: complex
    image: complex
    radius: float
    bend: float


def bent_places(maps: list[TriangulatedMap], detail: Detail, source: Curve) -> list[BentPlace]:
    """Return the features of a picture that maps bend by more than `MOST_BEND`, the most bent first.

    Args:
        maps: of all parts.
        detail: the edges of the picture, in the source's plane.
        source: the outline of the shape.
    """
    radius = FEATURE_RADIUS_SHARE * float(np.sqrt(abs(source.area)))
    is_inner = source.contains(detail.points) & (source.distances(detail.points) > RIM_RADII * radius)
    z, weights = detail.points[is_inner], detail.weights[is_inner]
    w, rotations = _moved(maps, z)
    shown = np.isfinite(w)
    z, w, rotations, weights = z[shown], w[shown], rotations[shown], weights[shown]
    if z.size < LEAST_EDGES:
        return []
    tree = cKDTree(np.column_stack([z.real, z.imag]))
    centres = np.unique(np.linspace(0, z.size - 1, MOST_FEATURES).astype(int))
    discs = tree.query_ball_point(tree.data[centres], radius)
    amounts = np.array([weights[disc].sum() for disc in discs])
    bends = np.array(
        [
            max(_deviation(z[disc], w[disc], weights[disc]), _twist(rotations[disc], weights[disc]))
            for disc in discs
        ]
    )
    bends = np.maximum(bends, _turns(maps, z[centres], discs, rotations, weights, radius, source))
    bends[amounts < LEAST_DETAIL_RATIO * amounts.max()] = 0
    places: list[BentPlace] = []
    for k in np.argsort(-bends):
        if bends[k] <= MOST_BEND or len(places) == MOST_PLACES:
            break
        middle = np.average(z[discs[k]], weights=weights[discs[k]])
        nearest = np.abs(z - middle).argmin()  # the middle itself may lie where nothing is shown
        if all(abs(z[nearest] - place.point) > APART_RADII * radius for place in places):
            room = float(source.distances(z[[nearest]])[0])
            places.append(
                BentPlace(complex(z[nearest]), complex(w[nearest]), min(radius, room), float(bends[k]))
            )
    return places


def _moved(maps: list[TriangulatedMap], z: Complex) -> tuple[Complex, Complex]:
    """Return the images of points (n,), and the rotations there as complex numbers of absolute value 1; both are NaN
    where no map shows the point.
    """
    w, rotations = np.full((2, z.size), complex(np.nan, np.nan))
    for map in maps:
        images, f_z, _ = map.jet(z)
        is_new = np.isfinite(images) & ~np.isfinite(w)
        w[is_new], rotations[is_new] = images[is_new], f_z[is_new] / np.abs(f_z[is_new])
    return w, rotations


def _turns(
    maps: list[TriangulatedMap],
    middles: Complex,
    discs: Sequence[list[int]],
    rotations: Complex,
    weights: Real,
    radius: float,
    source: Curve,
) -> Real:
    """Return (k,) by how much features are rotated relative to the picture around them; 0 at the rim.

    Args:
        maps: of all parts.
        middles: (k,) of the features.
        discs: the edges of each.
        rotations: (n,) of all edges.
        weights: (n,) of all edges.
        radius: of a feature.
        source: the outline of the shape.
    """
    ring = AROUND_RADII * radius * np.exp(2j * np.pi * np.arange(AROUND_POINTS) / AROUND_POINTS)
    around = (middles[:, None] + ring).ravel()
    _, turned = _moved(maps, around)
    turned[~source.contains(around)] = np.nan
    turned = turned.reshape(-1, AROUND_POINTS)
    is_inner = np.isfinite(turned).all(axis=1)
    outer = np.nan_to_num(turned).sum(axis=1)
    inner = np.array([np.average(rotations[disc], weights=weights[disc]) for disc in discs])
    return np.where(is_inner, np.abs(np.exp(1j * (np.angle(inner) - np.angle(outer))) - 1), 0.0)


def _deviation(z: Complex, w: Complex, weights: Real) -> float:
    """Return how far points z (n,) and their images w differ from a similarity, relative to the size of the images."""
    if z.size < LEAST_EDGES:
        return 0.0
    z, w = (points - np.average(points, weights=weights) for points in (z, w))
    xx, yy, xy = (np.average(product, weights=weights) for product in (z.real**2, z.imag**2, z.real * z.imag))
    mean, spread = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    if mean - spread < LEAST_WIDTH_RATIO**2 * (mean + spread):
        return 0.0
    factor = np.average(w * np.conj(z), weights=weights) / (2 * mean)
    rest = np.average(np.abs(w - factor * z) ** 2, weights=weights)
    return float(np.sqrt(rest / np.average(np.abs(w) ** 2, weights=weights)))


def _twist(rotations: Complex, weights: Real) -> float:
    """Return by how much rotations (n,), complex numbers of absolute value 1, differ within a feature: the root mean
    square of the sines of their differences from the mean rotation.
    """
    mean = np.average(rotations, weights=weights)
    sines = (rotations * np.conj(mean)).imag / max(abs(mean), 1e-300)
    return float(np.sqrt(np.average(sines**2, weights=weights)))
