"""Approximate a map over some shapes by an affine map and a scale, and measure how good these are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...arrays import Complex
from ...plane import bounding_box
from ..svg.affine import Affine


@dataclass(frozen=True, eq=False)
class AffinePart:
    """Affine approximation of a map over some shapes, in coordinates with y down.

    Attributes:
        affine: the nearest affine map.
        curved: RMS deviation of the map from it, relative to the size of the image.
        scale: mean scale of the map along the lines.
        uneven: ratio of the largest to the smallest scale, without the extreme twentieth at both ends.
        box: corners of the image's bounding box.
    """

    affine: Affine
    curved: float
    scale: float
    uneven: float
    box: tuple[complex, complex]


@dataclass(frozen=True, eq=False)
class MapSamples:
    """A map sampled at points, y down; (p,) arrays unless stated otherwise.

    Attributes:
        z, w: points and images.
        alpha, beta: the derivatives ∂w/∂z and ∂w/∂z̄; not finite where they do not exist.
        length: length of curve that each point represents.
        lined: whether the point is on a stroked line.
        control: (any,) points whose convex hull contains the image.
    """

    z: Complex
    w: Complex
    alpha: Complex
    beta: Complex
    length: NDArray[np.float64]
    lined: NDArray[np.bool_]
    control: Complex

    def part(self, span: slice, lined: NDArray[np.bool_], control: Sequence[Complex]) -> "MapSamples":
        """Return a range of the samples, with its own `lined` flags and control points."""
        hull = np.concatenate([np.empty(0, np.complex128), *(points.ravel() for points in control)])
        parts = (self.z[span], self.w[span], self.alpha[span], self.beta[span])
        return MapSamples(*parts, self.length[span], lined, hull)


def affine_part(samples: Sequence[MapSamples]) -> AffinePart | None:
    """Return the affine approximation over several shapes together; None where nothing of them is left."""
    names = ("z", "w", "alpha", "beta", "length", "lined", "control")
    joined = [np.concatenate([getattr(sample, name) for sample in samples]) for name in names if samples]
    if not joined:
        return None
    *arrays, hull = joined
    finite = np.isfinite(arrays[1]) & np.isfinite(arrays[2]) & np.isfinite(arrays[3])
    z, w, alpha, beta, length, lined = (values[finite] for values in arrays)
    if not z.size:
        return None
    length = np.maximum(length, max(1e-9 * float(length.max()), 1e-300))
    affine = _nearest(z, w, alpha, beta, length)
    away = float(np.average(np.abs(w - affine(z)) ** 2, weights=length)) ** 0.5
    low, high = bounding_box(hull)
    weight = length * lined if lined.any() else length
    scales = np.sqrt(np.abs(np.abs(alpha) ** 2 - np.abs(beta) ** 2))
    order = np.argsort(scales)
    share = np.cumsum(weight[order]) / weight.sum()
    small, large = (float(scales[order][np.searchsorted(share, part)]) for part in (0.05, 0.95))
    uneven = large / small if small else np.inf
    scale = float(np.average(scales, weights=weight))
    return AffinePart(affine, away / max(abs(high - low), 1e-300), scale, uneven, (low, high))


def _nearest(z: Complex, w: Complex, alpha: Complex, beta: Complex, weight: NDArray[np.float64]) -> Affine:
    """Return the affine map nearest to values and derivatives at points.

    Derivatives determine it where the points are collinear.
    """
    centre = np.average(z, weights=weight)
    step = 0.1 * float(np.average(np.abs(z - centre), weights=weight)) or 1e-9
    moves = np.array([0, 1, -1, 1j, -1j])[:, None] * step
    points = (z + moves - centre).ravel()
    values = (w + alpha * moves + beta * moves.conj()).ravel()
    root_weight = np.tile(np.sqrt(weight / weight.sum()), moves.size)
    matrix = np.stack([points / step, points.conj() / step, np.ones_like(points)], axis=1)
    a, b, c = np.linalg.lstsq(matrix * root_weight[:, None], values * root_weight, rcond=None)[0]
    linear = Affine(complex(a / step), complex(b / step))
    return Affine(linear.alpha, linear.beta, complex(c) - linear(complex(centre)))
