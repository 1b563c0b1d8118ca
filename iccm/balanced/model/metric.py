"""Surfaces as planes with a metric: for each triangle, a linear map from the plane to the surface.

A triangle z -> u of the solver, with Jacobian J, stands for one between two surfaces with the Jacobian B J A⁻¹,
where A and B take the planes to the surfaces. The kernels use only one linear map, to the rest shape, in whose
coordinates the gradients of the hat functions are given. The rest shape by A J⁻¹ B⁻¹ J results in this Jacobian
exactly at the position u for which it is computed, and everywhere if B is a similarity. It is computed anew at
the beginning of each descent.
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
"""Largest |f_z̄|/|f_z| and smallest ratio of areas for which Jacobians are inverted; beyond, rounding errors grow."""
SIMPLIFIED_SHARE = 1e-3  # relative to the root of the area; outlines are simplified by less
PARTS_OF_SIDE = 3
"""Parts of each side of a triangle; the metric is averaged over as many points as the square of this. With 5,
the 95th percentile of the stretch changed by less than 1 %.
"""


IDENTITY = Linear(np.ones(1, np.complex128), np.zeros(1, np.complex128))


class Metric(Protocol):
    """Linear maps from small triangles of a plane to a surface."""

    @property
    def keeps_sizes(self) -> bool:
        """Whether sizes are those of the plane, so that only the weights of distortion differ."""
        return False

    def over(self, z: Complex) -> Linear:
        """Return the linear maps of triangles z (m, 3) to the surface."""
        ...

    def importance(self, z: Complex) -> Real | float:
        """Return (m,) weights of distortion in triangles z (m, 3), relative to the mean; 1 where all count alike."""
        return 1.0


Metrics = tuple[Metric | None, Metric | None]
"""Metrics of source and target; None for the Euclidean plane."""
PLANES: Metrics = (None, None)


@dataclass(frozen=True, eq=False)
class LaidMetric(Metric):
    """The metric of a surface that is flattened into the plane, averaged over triangles of any mesh there.

    Attributes:
        locator: finds the surface's triangles.
        similarity: to the unit coordinates in which positions are given.
        stretch: (m,) e, and
        shear: (m,) g of the surface's triangles, with which the squared length of dz is e |dz|² + 2 Re(g dz²).
            The surface's area is scaled to one.
    """

    locator: Locator
    similarity: Similarity
    stretch: Real
    shear: Complex

    @classmethod
    def of(cls, layout: Flattening, similarity: Similarity) -> "LaidMetric":
        """Return the metric of a flattening without folds, in the unit coordinates to which a similarity leads."""
        space = layout.patch.points[layout.patch.faces]
        to_surface = linear(layout.flat[layout.patch.faces], laid_flat(space))
        area = face_areas(space).sum() * abs(similarity.factor) ** 2
        scale = 1 / area
        product = (
            scale * to_surface.a * to_surface.b.conj() * (abs(similarity.factor) / similarity.factor) ** 2
        )
        return cls(
            Locator.of(layout),
            similarity,
            scale * (np.abs(to_surface.a) ** 2 + np.abs(to_surface.b) ** 2),
            product.conj() if similarity.mirrored else product,
        )

    def over(self, z: Complex) -> Linear:
        """Return the linear maps of triangles z (m, 3), which have the mean metric and the mean ratio of areas.

        In holes, where there is no surface, the Euclidean metric is used.
        """
        points = self.similarity.pull_back(z @ PLACES.T)
        triangle, place = self.locator(points.ravel(), 1)
        located = np.einsum("pk,pk->p", place, self.locator.flat[self.locator.faces[triangle]])
        off = (np.abs(located - points.ravel()) > SIMPLIFIED_SHARE / abs(self.similarity.factor)).reshape(
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
    """A plane with fields that give the size and the weight of its parts.

    Attributes:
        similarity: to the unit coordinates in which positions are given.
        size: the linear size; None if it is 1 everywhere.
        weight: weight of distortion; None if it is 1 everywhere.
        scale: factor that makes the total area one.
        middle: the mean weight.
    """

    similarity: Similarity
    size: Field | None
    weight: Field | None
    scale: float = 1.0
    middle: float = 1.0

    @property
    def keeps_sizes(self) -> bool:
        """Whether only weights are given."""
        return self.size is None

    @classmethod
    def of(
        cls, similarity: Similarity, inside: Complex, size: Field | None, weight: Field | None
    ) -> "FieldMetric":
        """Return the metric of a domain, which is represented by evenly spread points (p,) in the given coordinates."""
        scale = 1.0 if size is None else 1 / np.sqrt(np.mean(size(inside) ** 2))
        return cls(
            similarity, size, weight, float(scale), 1.0 if weight is None else float(np.mean(weight(inside)))
        )

    def over(self, z: Complex) -> Linear:
        """Return the scalings of triangles z (m, 3) with the mean area."""
        if self.size is None:
            return IDENTITY
        scales = self.scale * np.sqrt((self._at(self.size, z) ** 2).mean(axis=1))
        return Linear(scales + 0j, 0j * scales)

    def importance(self, z: Complex) -> Real | float:
        """Return the mean weights of triangles z (m, 3), relative to the mean of the domain."""
        return 1.0 if self.weight is None else self._at(self.weight, z).mean(axis=1) / self.middle

    def _at(self, field: Field, z: Complex) -> Real:
        """Return (m, p) the field's values at points of triangles z (m, 3)."""
        return field(self.similarity.pull_back(z @ PLACES.T))


def _places(parts: int) -> Real:
    """Return (parts², 3) barycentric coordinates of the centroids of equal parts of a triangle."""
    i, j = np.mgrid[:parts, :parts]
    upright = (i + j < parts).ravel()
    first = np.column_stack([i.ravel() + 1 / 3, j.ravel() + 1 / 3])[upright]
    is_downward = (i + j < parts - 1).ravel()
    coordinates = (
        np.concatenate([first, np.column_stack([i.ravel() + 2 / 3, j.ravel() + 2 / 3])[is_downward]]) / parts
    )
    return np.column_stack([coordinates, 1 - coordinates.sum(axis=1)])


PLACES = _places(PARTS_OF_SIDE)


def _through(jacobian: Linear, metric: Linear) -> Linear:
    """Return J⁻¹ B J, or where J is nearly singular (at slits) the similarity with B's area."""
    size = np.abs(jacobian.determinant)
    sound = (
        (np.abs(jacobian.b) < MOST_ECCENTRIC * np.abs(jacobian.a)) & (size > SMALLEST) & (size < 1 / SMALLEST)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        exact = jacobian.inverse() @ metric @ jacobian
    mean = np.sqrt(np.abs(metric.determinant))
    return Linear(np.where(sound, exact.a, mean), np.where(sound, exact.b, 0))


def rest_geometry(z: Complex, u: Complex, corners: Index, metrics: Metrics) -> tuple[Complex, Real]:
    """Return the rest shapes of the triangles of a map z -> u.

    With metrics, they are in coordinates in which the map has the Jacobian between the surfaces.

    Args:
        z: (n,) vertices.
        u: (n,) their images.
        corners: (m, 3) triangles.
        metrics: of source and target.

    Returns:
        (m, 3) gradients of the hat functions, and (m,) the areas on the source.
    """
    gradients, areas = geometry(z, corners)
    if metrics == PLANES:
        return gradients, areas
    fixed_metric, moving_metric = metrics
    back = IDENTITY
    if fixed_metric is not None:
        to_surface = fixed_metric.over(z[corners])
        back, areas = to_surface.inverse(), areas * np.abs(to_surface.determinant)
    if moving_metric is not None:
        jacobian = linear(z[corners], u[corners])
        back = _through(jacobian, moving_metric.over(u[corners])) @ back
    a, b = back[0][:, None], back[1][:, None]
    return gradients * a + (gradients * b).conj(), areas
