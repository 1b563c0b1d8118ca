"""Surfaces as the solver sees them: planes with a metric, one linear map a triangle from the plane to the surface.

A solver's triangle z -> u between two surfaces has the Jacobian B J A⁻¹, where A and B take the planes to the surfaces.
The kernels know of one linear map alone, that to the rest shape, in whose coordinates the hat functions' gradients are.
The rest shape by A J⁻¹ B⁻¹ J gives this Jacobian, at the place u at which it is made exactly, and wherever B is a
similarity; steps of Newton's method begin with it made anew.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...arrays import Complex, Index, Real
from ...maps.fields import Field
from ...meshes.flatten import Flattening
from ...meshes.locate import Locator
from ...meshes.mesh import face_areas
from ...meshes.stretch import Linear, laid_flat, linear
from ...plane import Similarity
from ..minimise.energy import geometry

MOST_ECCENTRIC, SMALLEST = 0.98, 1e-4
"""Of |f_z̄|/|f_z| and of areas' ratios: beyond, rounding would be magnified."""
SIMPLIFIED_SHARE = 1e-3  # of the root of the area: outlines are simplified by less
PARTS_OF_SIDE = 3
"""Parts of a triangle's sides: the metric is averaged over as many points as their square. With 5, the 95th percentile
of the stretch changed by less than 1 %."""


IDENTITY = Linear(np.ones(1, np.complex128), np.zeros(1, np.complex128))


class Metric(Protocol):
    """What takes small triangles of a plane to a surface."""

    def over(self, z: Complex) -> Linear:
        """Return the linear maps of triangles z (m, 3)."""
        ...

    def importance(self, z: Complex) -> Real | float:
        """Return (m,) how much distortion hurts in triangles z (m, 3), by how much it does on average: everywhere
        alike.
        """
        return 1.0


Metrics = tuple[Metric | None, Metric | None]
"""Of source and target; None where that is the plane itself."""
PLANES: Metrics = (None, None)


@dataclass(frozen=True, eq=False)
class LaidMetric(Metric):
    """The metric of a surface that is flattened into the plane, averaged over triangles of any mesh there.

    Attributes:
        locator: finds the surface's triangles.
        frame: of the unit coordinates in which it is asked.
        stretch: (m,) e, and
        shear: (m,) g of the surface's triangles, so that the squared length of dz is e |dz|² + 2 Re(g dz²), with the
            surface's area taken as one.
    """

    locator: Locator
    frame: Similarity
    stretch: Real
    shear: Complex

    @classmethod
    def of(cls, layout: Flattening, frame: Similarity) -> "LaidMetric":
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
        """Return the linear maps of triangles z (m, 3): that of the mean metric, with the mean of the areas' ratios.

        In holes, where there is no surface, that of the plane.
        """
        points = self.frame.pull_back(z @ PLACES.T)
        triangle, place = self.locator(points.ravel(), 1)
        found = np.einsum("pk,pk->p", place, self.locator.flat[self.locator.faces[triangle]])
        off = (np.abs(found - points.ravel()) > SIMPLIFIED_SHARE / abs(self.frame.factor)).reshape(
            points.shape
        )
        triangle = triangle.reshape(points.shape)
        stretch, shear = np.where(off, 1.0, self.stretch[triangle]), np.where(off, 0.0, self.shear[triangle])
        ratio = np.sqrt(np.maximum(stretch**2 - 4 * np.abs(shear) ** 2, 0)).mean(axis=1)
        stretch, shear = stretch.mean(axis=1), shear.mean(axis=1)
        root = np.sqrt(stretch**2 - 4 * np.abs(shear) ** 2)
        a = np.sqrt(0.5 * (stretch + root))
        scale = np.sqrt(ratio / root)
        return Linear(scale * a + 0j, scale * shear.conj() / a)


@dataclass(frozen=True, eq=False)
class FieldMetric(Metric):
    """A plane whose parts are as large, and count as much, as fields say.

    Attributes:
        frame: of the unit coordinates in which it is asked.
        size: the linear size; None where it is everywhere the same.
        weight: how much distortion hurts; as above.
        scale: what brings the area to one.
        middle: the mean weight.
    """

    frame: Similarity
    size: Field | None
    weight: Field | None
    scale: float = 1.0
    middle: float = 1.0

    @classmethod
    def of(
        cls, frame: Similarity, inside: Complex, size: Field | None, weight: Field | None
    ) -> "FieldMetric":
        """For a domain, of which there are evenly spread points (p,) in the given coordinates."""
        scale = 1.0 if size is None else 1 / np.sqrt(np.mean(size(inside) ** 2))
        return cls(
            frame, size, weight, float(scale), 1.0 if weight is None else float(np.mean(weight(inside)))
        )

    def over(self, z: Complex) -> Linear:
        """Return the scalings of triangles z (m, 3), of the mean area."""
        if self.size is None:
            return IDENTITY
        found = self.scale * np.sqrt((self._at(self.size, z) ** 2).mean(axis=1))
        return Linear(found + 0j, 0j * found)

    def importance(self, z: Complex) -> Real | float:
        """Return the mean weights."""
        return 1.0 if self.weight is None else self._at(self.weight, z).mean(axis=1) / self.middle

    def _at(self, field: Field, z: Complex) -> Real:
        """Return (m, p) the field at points of triangles z (m, 3)."""
        return field(self.frame.pull_back(z @ PLACES.T))


def _places(parts: int) -> Real:
    """Return (parts², 3) barycentric coordinates of the middles of equal parts of a triangle."""
    i, j = np.mgrid[:parts, :parts]
    upright = (i + j < parts).ravel()
    first = np.column_stack([i.ravel() + 1 / 3, j.ravel() + 1 / 3])[upright]
    turned = (i + j < parts - 1).ravel()
    both = np.concatenate([first, np.column_stack([i.ravel() + 2 / 3, j.ravel() + 2 / 3])[turned]]) / parts
    return np.column_stack([both, 1 - both.sum(axis=1)])


PLACES = _places(PARTS_OF_SIDE)


def _through(jacobian: Linear, metric: Linear) -> Linear:
    """J⁻¹ B J; where J is nearly singular (slits), the similarity of B's area."""
    size = np.abs(jacobian.determinant)
    sound = (
        (np.abs(jacobian.b) < MOST_ECCENTRIC * np.abs(jacobian.a)) & (size > SMALLEST) & (size < 1 / SMALLEST)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        exact = jacobian.inverse() @ metric @ jacobian
    mean = np.sqrt(np.abs(metric.determinant))
    return Linear(np.where(sound, exact.a, mean), np.where(sound, exact.b, 0))


def rest_geometry(z: Complex, u: Complex, corners: Index, metrics: Metrics) -> tuple[Complex, Real]:
    """Return (m, 3) gradients of the hat functions on the rest shapes of the triangles of the map z -> u, and (m,)
    their areas on the source: with metrics, in coordinates in which the map has the Jacobian between the surfaces.
    """
    gradients, areas = geometry(z, corners)
    if metrics == PLANES:
        return gradients, areas
    kept, moving = metrics
    back = IDENTITY
    if kept is not None:
        to_surface = kept.over(z[corners])
        back, areas = to_surface.inverse(), areas * np.abs(to_surface.determinant)
    if moving is not None:
        jacobian = linear(z[corners], u[corners])
        back = _through(jacobian, moving.over(u[corners])) @ back
    a, b = (each[:, None] for each in back)
    return gradients * a + (gradients * b).conj(), areas
