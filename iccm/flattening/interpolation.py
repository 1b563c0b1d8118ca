"""Shapes between two: the metric of a map is interpolated, and flattened into the plane.

After Chen, Weber, Keren and Ben-Chen, *Planar shape interpolation with bounded distortion*, SIGGRAPH 2013. With the
map's derivative J = RS, they take convex combinations of I and S². Here it is the powers S²ᵗ, the geodesic between both
in the space of metrics (Bhatia, *Positive Definite Matrices*, 2007, ch. 6). Stretch then changes by the same factor in
each frame, is at most the map's to the power of t, and the shapes are the same on the way back. The interpolated metric
is flat only at both ends. In between it is flattened by minimizing the symmetric Dirichlet energy (Smith and Schaefer
2015), which prevents folds; each shape starts from the one before.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Complex, Real
from ..balanced.model.measures import mean_rotation
from ..errors import InputError
from ..maps.triangulated.map import TriangulatedMap, without_bulges
from ..maps.triangulated.simple import fault
from ..meshes.stretch import Linear, linear
from ..plane import triangle_areas
from ..result import Fit, refuse_other_results
from .free import Elastic
from .scaffold import relax_with_scaffold

NEWTON_STEPS, LEAST_DECREASE = 60, 1e-6  # most steps, and the relative decrease that ends the iteration
SCAFFOLD_STEPS = 100  # most steps where a shape would overlap itself


def morph(
    fit: Fit, shares: Sequence[float] | Real, *, placed: tuple[complex, complex] = (1, 0)
) -> Iterator[TriangulatedMap]:
    """Yield maps of the source onto shapes between source and target, without folds or overlaps.

    Args:
        fit: A balanced map of whole outlines, or of the frames of two drawings (fit='frame').
        shares: Positions between the source (0) and the target (1), increasing.
        placed: (a, b) of the similarity a z + b that places the source at the beginning.

    Yields:
        For each share, the map from the source to the shape there; the last one, at 1, is the given map itself.

    Raises:
        InputError: The map is partial, from another method, or a deformation.

    Examples:
        >>> import iccm
        >>> square = np.array([0, 1, 1 + 1j, 1j])
        >>> middle = next(iccm.morph(iccm.fit(square, 3 * square), [0.5]))
        >>> round(float(np.ptp(middle.image.real)), 6)  # the geometric mean
        1.732051
    """
    refuse_other_results(fit, "morph")
    map = fit.map
    if not isinstance(map, TriangulatedMap) or fit.target is None:
        raise InputError("morph: needs a balanced map between two planar shapes")
    if fit.coverage.is_partial:
        raise InputError(
            "morph: the map leaves parts out; use fit='frame', or fit='whole' for shapes with equally many holes"
        )
    return _between(map, placed[0] * map.source + placed[1], shares)


def _between(
    map: TriangulatedMap, begin: Complex, shares: Sequence[float] | Real
) -> Iterator[TriangulatedMap]:
    corners = begin[map.faces]
    jacobian = linear(corners, map.image[map.faces])
    corners = corners - corners[:, :1]
    rotation = mean_rotation(begin, map.image, map.faces)
    sheet, u = Elastic.of(map.faces, corners), begin
    for share in shares:
        if share >= 1:
            yield map
            continue
        if share <= 0:
            u = begin
            yield replace(without_bulges(map), image=u)
            continue
        p, q = _power(jacobian, share)
        shapes = p[:, None] * corners + q[:, None] * corners.conj()
        size = np.sqrt(triangle_areas(shapes).sum())
        sheet = sheet.with_shapes(shapes / size)
        start = u / np.sqrt(triangle_areas(u[map.faces]).sum())
        relaxed = sheet.relaxed(start, 1.0, NEWTON_STEPS, LEAST_DECREASE)
        if fault([relaxed[loop] for loop in map.loops]):
            relaxed = relax_with_scaffold(
                sheet, start, list(map.loops), 1.0, range(SCAFFOLD_STEPS), LEAST_DECREASE
            )
        goal = _blend(begin, map.image, share, rotation)
        relaxed = (relaxed - relaxed.mean()) * size * np.exp(1j * mean_rotation(relaxed, goal, map.faces))
        u = relaxed + (1 - share) * begin.mean() + share * map.image.mean()
        yield replace(map, image=u, bulge=None)


def _power(jacobian: Linear, share: float) -> tuple[Real, Complex]:
    """Return p (m,) and q (m,) of S to the power of t: w ↦ p w + q w̄, where J = RS is w ↦ a w + b w̄."""
    a, b = np.abs(jacobian.a), np.abs(jacobian.b)
    most, least = (a + b) ** share, (a - b) ** share
    along = jacobian.a.conj() * jacobian.b
    along = np.divide(along, a * b, out=np.zeros_like(along), where=a * b > 0)
    return 0.5 * (most + least), 0.5 * (most - least) * along


def _blend(a: Complex, b: Complex, share: float, rotation: float) -> Complex:
    """Return (n,) the interpolation between both ends, each rotated by its share of the total rotation.

    Shapes in between are rotated to match it.
    """
    return (1 - share) * a * np.exp(1j * share * rotation) + share * b * np.exp(-1j * (1 - share) * rotation)
