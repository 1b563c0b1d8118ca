"""Surfaces as the solver sees them: planes with a metric, one linear map a triangle from the plane to the surface.

A solver's triangle z -> u between two surfaces has the Jacobian B J A⁻¹, where A and B take the planes to the surfaces.
The kernels know of one linear map alone, that to the rest shape, in whose coordinates the hat functions' gradients are.
The rest shape by A J⁻¹ B⁻¹ J gives this Jacobian, at the place u at which it is made exactly, and wherever B is a
similarity; steps of Newton's method begin with it made anew.
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from ..arrays import Complex, Index, Real
from ..meshes.flatten import Flattening
from ..meshes.locate import Locator
from ..meshes.mesh import face_areas
from ..meshes.stretch import laid_flat
from .frames import UnitFrame
from .minimise.energy import geometry

PARTS = 3  # of a triangle's sides: the metric is averaged over PARTS² points; 5 changed p95 of the stretch by < 1 %


class Linear(NamedTuple):
    """Linear maps of the plane, z -> a z + b z̄, each (m,) complex."""

    a: Complex
    b: Complex

    def __call__(self, z: Complex) -> Complex:
        """Of (m, k) points, k for each map."""
        return self.a[:, None] * z + self.b[:, None] * z.conj()

    @property
    def determinant(self) -> Real:
        """(m,) the areas' ratio."""
        return np.abs(self.a) ** 2 - np.abs(self.b) ** 2

    def inverse(self) -> "Linear":
        """Back again."""
        return Linear(self.a.conj() / self.determinant, -self.b / self.determinant)


class Metric(Protocol):
    """What takes small triangles of a plane to a surface."""

    def over(self, z: Complex) -> Linear:
        """The linear maps of triangles z (m, 3)."""
        ...


Metrics = tuple[Metric | None, Metric | None]
"""Of source and target; None where that is the plane itself."""
PLANES: Metrics = (None, None)


@dataclass(frozen=True, eq=False)
class LaidMetric:
    """The metric of a surface that is laid out in the plane, averaged over triangles of any mesh there.

    Attributes:
        locator: finds the surface's triangles.
        frame: of the unit coordinates in which it is asked.
        stretch: (m,) e, and
        shear: (m,) g of the surface's triangles, so that the squared length of dz is e |dz|² + 2 Re(g dz²), with the
            surface's area taken as one.
    """

    locator: Locator
    frame: UnitFrame
    stretch: Real
    shear: Complex

    @classmethod
    def of(cls, layout: Flattening, frame: UnitFrame) -> "LaidMetric":
        """Of a layout without folds, in the unit coordinates of a frame."""
        space = layout.patch.points[layout.patch.faces]
        to_surface = linear(layout.flat[layout.patch.faces], laid_flat(space))
        area = face_areas(space).sum() * abs(frame.factor) ** 2
        scale = 1 / area
        turned = scale * to_surface.a * to_surface.b.conj() * (abs(frame.factor) / frame.factor) ** 2
        return cls(
            Locator(layout),
            frame,
            scale * (np.abs(to_surface.a) ** 2 + np.abs(to_surface.b) ** 2),
            turned.conj() if frame.mirrored else turned,
        )

    def over(self, z: Complex) -> Linear:
        """The linear maps of triangles z (m, 3): that of the mean metric, with the mean of the areas' ratios."""
        points = self.frame.world(z @ _PLACES.T)
        triangle = self.locator(points.ravel(), 1)[0].reshape(points.shape)
        stretch, shear = self.stretch[triangle], self.shear[triangle]
        ratio = np.sqrt(np.maximum(stretch**2 - 4 * np.abs(shear) ** 2, 0)).mean(axis=1)
        stretch, shear = stretch.mean(axis=1), shear.mean(axis=1)
        root = np.sqrt(stretch**2 - 4 * np.abs(shear) ** 2)
        a = np.sqrt(0.5 * (stretch + root))
        scale = np.sqrt(ratio / root)
        return Linear(scale * a + 0j, scale * shear.conj() / a)


def _places(parts: int) -> Real:
    """(parts², 3) barycentric coordinates of the middles of equal parts of a triangle."""
    i, j = np.mgrid[:parts, :parts]
    upright = (i + j < parts).ravel()
    first = np.column_stack([i.ravel() + 1 / 3, j.ravel() + 1 / 3])[upright]
    turned = (i + j < parts - 1).ravel()
    both = np.concatenate([first, np.column_stack([i.ravel() + 2 / 3, j.ravel() + 2 / 3])[turned]]) / parts
    return np.column_stack([both, 1 - both.sum(axis=1)])


_PLACES = _places(PARTS)


def linear(z: Complex, w: Complex) -> Linear:
    """The linear parts of the affine maps of triangles z (m, 3) to w (m, 3)."""
    e, f, p, q = z[:, 1] - z[:, 0], z[:, 2] - z[:, 0], w[:, 1] - w[:, 0], w[:, 2] - w[:, 0]
    across = e * f.conj() - f * e.conj()
    return Linear((p * f.conj() - q * e.conj()) / across, (q * e - p * f) / across)


def rest_geometry(z: Complex, u: Complex, corners: Index, metrics: Metrics) -> tuple[Complex, Real]:
    """(m, 3) gradients of the hat functions on the rest shapes of the triangles of the map z -> u, and (m,) their
    areas on the source: with metrics, in coordinates in which the map has the Jacobian between the surfaces."""
    if metrics == PLANES:
        return geometry(z, corners)
    kept, moving = metrics
    rest, image = z[corners], u[corners]
    if kept is not None:
        to_surface = kept.over(rest)
        rest = to_surface(rest)
    gradients, areas = _geometry(rest)
    if moving is not None:
        jacobian = linear(z[corners], image)
        small = jacobian.inverse()(moving.over(image).inverse()(image))
        gradients, _ = _geometry(small if kept is None else to_surface(small))
    return gradients, areas


def _geometry(rest: Complex) -> tuple[Complex, Real]:
    return geometry(np.ascontiguousarray(rest).ravel(), np.arange(rest.size).reshape(-1, 3))
