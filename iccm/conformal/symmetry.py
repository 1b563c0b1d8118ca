"""Conformal maps of two shapes that are symmetric about an axis, and commute with the reflections.

Such a map takes the part of the axis inside the source, a geodesic, to that inside the target. On the circles of both
boundaries it is a Möbius map that takes the ends of one geodesic to those of the other. These maps differ by a shift
along the geodesic.
"""

import numpy as np
import shapely

from ..arrays import Complex, Real, complex_of, xy_of
from ..curve import Curve
from ..symmetry import axes_of, centre_of
from .correspondence import Moebius

PARALLEL_RADIANS = 0.02  # angle up to which axes of both shapes count as the same
AXIS_CENTRES_TRIED = 4  # on each axis
APART_CLEARANCES = 0.7  # distance of two centres, relative to the sum of their distances from the outline
AXIS_POINTS = 64  # points of an axis among which centres are selected


def common_axes(source: Curve, target: Curve, upright: complex) -> list[tuple[Complex, Complex]]:
    """Return the axes of symmetry that both shapes have if the picture is not rotated.

    Args:
        source: outline of the source.
        target: outline of the target.
        upright: the rotation, of modulus one, from the coordinates of the source to those of the target.

    Returns:
        For each axis, its ends (2,) on the outlines of source and target, in corresponding order.
    """
    source_axes, target_axes = axes_of(source), axes_of(target)
    if source_axes is None and target_axes is None:
        return []  # of two discs, all maps of centre to centre are symmetric
    if source_axes is None:
        assert target_axes is not None
        source_axes = target_axes / upright
    if target_axes is None:
        target_axes = source_axes * upright
    axes = []
    for direction in source_axes.tolist():
        differences = [
            (axis / (direction * upright)) ** 2 for axis in target_axes.tolist()
        ]  # of either sense
        nearest = int(np.argmax([difference.real for difference in differences])) if differences else 0
        if not differences or abs(np.angle(differences[nearest])) > 2 * PARALLEL_RADIANS:
            continue
        other = complex(target_axes[nearest])
        other = other if (other / (direction * upright)).real > 0 else -other
        ends = ends_of(source, direction), ends_of(target, other)
        if ends[0] is not None and ends[1] is not None:
            axes.append((ends[0], ends[1]))
    return axes


def ends_of(curve: Curve, direction: complex) -> Complex | None:
    """Return the ends (2,) of the axis with a given direction inside an outline; None if there are several parts."""
    centre, reach = centre_of(curve), 2 * curve.diagonal
    line = shapely.LineString(xy_of(np.array([centre - reach * direction, centre + reach * direction])))
    parts = shapely.get_parts(shapely.intersection(line, curve.polygon))
    parts = parts[shapely.length(parts) > 1e-6 * curve.diagonal]
    if len(parts) != 1:
        return None
    ends = complex_of(shapely.get_coordinates(parts[0]))[[0, -1]]
    return ends if ((ends[1] - ends[0]) / direction).real > 0 else ends[::-1]


def centres_between(curve: Curve, ends: Complex) -> Complex:
    """Return up to AXIS_CENTRES_TRIED points of an axis with ends (2,), the one farthest from the outline first.

    Each resolves the harmonic measure of its surroundings well.
    """
    shares = (np.arange(AXIS_POINTS) + 0.5) / AXIS_POINTS
    points = ends[0] + shares * (ends[1] - ends[0])
    clear = curve.distances(points)
    selection = [int(np.argmax(clear))]
    for _ in range(AXIS_CENTRES_TRIED - 1):
        apart = np.min([np.abs(points - points[k]) / (clear + clear[k]) for k in selection], axis=0)
        if apart.max() < APART_CLEARANCES:
            break
        selection.append(int(np.argmax(apart)))
    return points[selection]


def translation(ends: Complex, images: Complex, shift: Real | float) -> Moebius:
    """Return the Möbius map of the disc that takes two points of the circle to two others.

    Args:
        ends: (2,) points of the unit circle.
        images: (2,) their images.
        shift: hyperbolic length, or (r, 1) several, by which points are moved towards the second image. With 0,
            the middle of the arc between the ends is mapped to that of the arc between the images.
    """
    first, second = ends
    first_image, second_image = images
    # In the half-planes (u - first) / (u - second) and those of the images, the map is a multiplication.
    factor = np.exp(shift) * _scale(images) / _scale(ends)
    centre_ratio = first_image / (factor * second_image)  # of the point that is mapped to 0
    b = (first - centre_ratio * second) / (1 - centre_ratio)
    middle = _middle(ends)
    ratio = factor * (middle - first) / (middle - second)
    image = (first_image - ratio * second_image) / (1 - ratio)
    rho = np.angle(image * (1 - np.conj(b) * middle) / (middle - b))
    return Moebius(b, rho)


def shift_of(ends: Complex, images: Complex, others: Complex, other_images: Complex) -> float | None:
    """Return the shift of the map in `translation` that takes the ends of another axis to those of its image as well.

    The ends of the other axis are on opposite sides of the first. In symmetric shapes the same shift takes both
    to their images; the mean is returned, or None if no image is on the same side as its end.
    """
    sources = [_half_plane(ends, end) for end in others.tolist()]
    targets = [_half_plane(images, image) for image in other_images.tolist()]
    quotients = [target / source for source in sources for target in targets if source != 0]
    shifts = np.array(
        [np.log(quotient.real) for quotient in quotients if quotient.real > 0]
    )  # on the same side
    return float(shifts.mean()) if shifts.size and np.isfinite(shifts).all() else None


def _half_plane(ends: Complex, u: complex) -> complex:
    """Return the point of the real line that stands for a point of the circle; 1 for the middle of the arc."""
    return complex((u - ends[0]) / (u - ends[1]) / _scale(ends))


def _scale(ends: Complex) -> complex:
    middle = _middle(ends)
    return complex((middle - ends[0]) / (middle - ends[1]))


def _middle(ends: Complex) -> complex:
    """Return the middle of the counter-clockwise arc from one point of the unit circle to another."""
    angle = np.mod(np.angle(ends[1] / ends[0]), 2 * np.pi)
    return complex(ends[0] * np.exp(0.5j * angle))
