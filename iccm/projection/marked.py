"""Views found from points that were marked on a photograph."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import Box, Complex, Real
from ..errors import InputError
from ..plane import triangle_areas
from .camera import Camera
from .surfaces import Revolved
from .view import Planar, Projected

FRAME_WIDTH_MM = 36.0
"""Of 35 mm film, to whose longer side focal lengths are relative."""
USUAL_FOCAL_MM = 32.0
"""Between those of phones (24 to 28) and of cameras with a normal lens (50)."""
FOCAL_SPREAD = 0.3
"""Standard deviation of the logarithm of focal lengths, if none is given."""
MIDDLE_SPREAD = 0.3
"""Radians by which a point marked in the middle of an edge of a label may be off to the side."""
MARK_ERROR_SHARE = 0.002
"""Relative to the photograph's diagonal: how accurately points are marked."""
MISFIT_SHARE = 0.02
"""Relative to the extent of the marked points: if a view misses them by more, they are not those of such a surface."""
LEAST_AREA_SHARE = 1e-3
"""Relative to the square of a quadrilateral's extent: with less area, points lie on a line."""


class Found(NamedTuple):
    """A view found from marked points.

    Attributes:
        view: the view.
        error: largest distance of a marked point from the view's, in pixels.
        focal_mm: focal length, relative to 35 mm film; None if it was not needed.
    """

    view: Planar | Projected
    error: float
    focal_mm: float | None


def planar(corners: Sequence[complex], box: Box) -> Found:
    """Return the view of a flat sheet.

    Its proportions follow from the perspective, if the photograph has square pixels and is not cropped (Zhang & He,
    *Whiteboard scanning and image enhancement*, Digital Signal Processing 17, 2007, section 3); without enough
    perspective, they are those of the mean lengths of opposite sides.

    Args:
        corners: Top left, top right, bottom right, bottom left, y up.
        box: Lower left and upper right corner of the photograph.

    Raises:
        InputError: They are not the corners of a convex quadrilateral in this order.
    """
    p = np.array(corners)
    around = triangle_areas(np.stack([np.roll(p, 1), p, np.roll(p, -1)], axis=1))
    extent = max(np.ptp(p.real), np.ptp(p.imag))
    if (around > -LEAST_AREA_SHARE * extent**2).any():
        raise InputError(
            "the four points are not the corners of a sheet; name them as the sheet is read: top left, top right, "
            "bottom right, bottom left"
        )
    sides = [(abs(p[1] - p[0]) + abs(p[2] - p[3])) / 2, (abs(p[3] - p[0]) + abs(p[2] - p[1])) / 2]
    aspect = _aspect(p - (box[0] + box[1]) / 2) or sides[0] / sides[1]
    height = float(np.sqrt(sides[0] * sides[1] / aspect))
    return Found(Planar(p, (float(aspect * height), height)), 0.0, None)


def _aspect(p: Complex) -> float | None:
    """Return width by height of the rectangle with these images, relative to the point that the camera looks at; None
    if the perspective is too weak to tell.
    """
    square = Planar(p / np.abs(p).max(), (1.0, 1.0)).matrix
    across, down, _ = square.T
    if min(abs(across[2]), abs(down[2])) < 0.02:
        return None
    focal2 = -(across[0] * down[0] + across[1] * down[1]) / (across[2] * down[2])
    if not 0.1 < focal2 < 1000:
        return None
    weights = np.array([1 / focal2, 1 / focal2, 1])
    return float(np.sqrt((weights * across**2).sum() / (weights * down**2).sum()))


def revolved(
    top: float,
    bottom: float,
    height: float,
    points: Sequence[complex],
    box: Box,
    focal_mm: float | None = None,
) -> Found:
    """Return the view of a label around a cylinder or a cone.

    Args:
        top, bottom: Diameters of the object at the upper and at the lower edge of the label.
        height: Of the label, along the axis.
        points: Of the label's upper edge: left end, a point near the middle, right end; and of its lower edge: right
            end, a point near the middle, left end; y up.
        box: Lower left and upper right corner of the photograph.
        focal_mm: Focal length of the camera, relative to 35 mm film; estimated if it is None.

    Raises:
        InputError: The points are not those of such a label.
    """
    from scipy.optimize import least_squares

    p = np.array(points)
    upper, lower = p[:3], p[5:2:-1]
    # clockwise: along the upper edge, and back along the lower one
    if (triangle_areas(np.array([p[[0, 2, 3]], p[[0, 3, 5]]])) > 0).any():
        raise InputError(_ORDER)
    principal, longer = (box[0] + box[1]) / 2, max(np.ptp(np.real(box)), np.ptp(np.imag(box)))
    usual = (focal_mm or USUAL_FOCAL_MM) / FRAME_WIDTH_MM * longer
    spread = MARK_ERROR_SHARE * abs(box[1] - box[0])
    surface = Revolved(top / 2, bottom / 2, height)
    half_height = surface.size[1] / 2

    def camera(x: _Unknowns) -> Camera:
        rotation = _rotation(np.array([x.rotation_x, x.rotation_y, x.rotation_z]))
        focal = usual * (1 if focal_mm else np.exp(x.log_focal))
        place = np.array([x.across, x.up, -1.0]) * np.exp(x.log_distance)
        return Camera(rotation, -rotation.T @ place, focal, principal)

    def misses(x: _Unknowns) -> Complex:
        half = x.half_angle
        angles = np.array([-half, x.upper_middle, half, -half, x.lower_middle, half])
        sheet = surface.radius * angles + 1j * half_height * np.repeat([1, -1], 3)
        return camera(x).image(surface.place(sheet)) - np.concatenate([upper, lower])

    def residuals(values: Real) -> Real:
        x = _Unknowns(*values)
        away = misses(x) / spread
        priors = [x.upper_middle / MIDDLE_SPREAD, x.lower_middle / MIDDLE_SPREAD, x.log_focal / FOCAL_SPREAD]
        return np.concatenate([away.real, away.imag, priors])

    best = None
    for pitch in (None, 0.2, -0.2):
        start = _start(upper, lower, surface, usual, principal, pitch)
        low = np.array(_Unknowns(*np.full(len(start), -np.inf))._replace(half_angle=0.02))
        high = np.array(_Unknowns(*np.full(len(start), np.inf))._replace(half_angle=np.pi / 2))
        inside = np.clip(start, low + 1e-9, high - 1e-9)
        solution = least_squares(residuals, inside, bounds=(low, high), x_scale="jac")
        if best is None or solution.cost < best.cost:
            best = solution
    assert best is not None
    solved = _Unknowns(*best.x)
    error = float(np.abs(misses(solved)).max())
    extent = max(np.ptp(p.real), np.ptp(p.imag))
    if not error <= MISFIT_SHARE * extent:
        raise InputError(
            f"the points are up to {error:.0f} pixels from those of a label of this size; {_ORDER}, and check the sizes"
        )
    used = camera(solved)
    label = 2 * surface.radius * float(solved.half_angle), 2 * half_height
    return Found(Projected(surface, used, label), error, used.focal / longer * FRAME_WIDTH_MM)


class _Unknowns(NamedTuple):
    """What the fit of a label solves for.

    Attributes:
        rotation_x, rotation_y, rotation_z: rotation vector of the camera, in radians.
        across, up: offset of the object from the camera's axis, relative to its distance.
        log_distance: logarithm of the distance.
        half_angle: radians from the label's middle to its ends, around the axis.
        upper_middle, lower_middle: radians by which the points marked near the middle are off it.
        log_focal: logarithm of the focal length relative to the usual one; unused if it is given.
    """

    rotation_x: float
    rotation_y: float
    rotation_z: float
    across: float
    up: float
    log_distance: float
    half_angle: float
    upper_middle: float
    lower_middle: float
    log_focal: float


_ORDER = (
    "name the points of the label's upper edge from left to right (left end, middle, right end), and then those of its "
    "lower edge from right to left"
)


def _start(
    upper: Complex, lower: Complex, surface: Revolved, focal: float, principal: complex, pitch: float | None
) -> _Unknowns:
    """Return first values for `revolved`, as if the camera were far away.

    Args:
        upper, lower: (3,) points of both edges, from left to right.
        surface: the object.
        focal: in pixels.
        principal: the point that the camera looks at.
        pitch: radians by which the camera looks down; None: from how much the edges are bent.
    """
    axis = (upper[0] + upper[2] - lower[0] - lower[2]) / 2
    upright = axis / abs(axis)
    half_width = (abs(upper[2] - upper[0]) + abs(lower[2] - lower[0])) / 4
    bends = [((edge[0] + edge[2]) / 2 - edge[1]) / upright for edge in (upper, lower)]
    scale = abs(axis) / surface.height
    sine = np.clip(half_width / (scale * surface.radius), 0.1, 0.98)
    half = float(np.arcsin(sine))
    if pitch is None:
        depth = scale * surface.radius * (1 - np.cos(half))
        pitch = float(np.arcsin(np.clip(np.mean(np.real(bends)) / depth, -0.9, 0.9)))
    roll = float(np.angle(upright / 1j))
    # the axis of the camera's rotation, first about x and then in the picture
    x, y, z = _vector(_rotation(np.array([0, 0, roll])) @ _rotation(np.array([pitch, 0, 0])))
    middle = np.concatenate([upper[[0, 2]], lower[[0, 2]]]).mean() - principal
    scale /= np.cos(pitch)
    return _Unknowns(
        rotation_x=x,
        rotation_y=y,
        rotation_z=z,
        across=middle.real / focal,
        up=middle.imag / focal,
        log_distance=np.log(focal / scale),
        half_angle=half,
        upper_middle=0,
        lower_middle=0,
        log_focal=0,
    )


def _rotation(vector: Real) -> Real:
    from scipy.spatial.transform import Rotation

    matrix: Real = Rotation.from_rotvec(vector).as_matrix()
    return matrix


def _vector(rotation: Real) -> Real:
    from scipy.spatial.transform import Rotation

    vector: Real = Rotation.from_matrix(rotation).as_rotvec()
    return vector
