"""Render a textured surface: parallel projection, depth buffer, soft light. It needs no display and no driver."""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Index, Real, unit_vectors
from ..native import function
from ..pixels.sampler import Sampler
from ..pixels.texture import TexturePlaces
from .rasterise import affine

_nearest = function("""int64_t iccm_meshes_nearest(
    const double *corners, const double *slopes, int64_t m, int32_t *owner, float *depth, int64_t height,
    int64_t width)""")
SAMPLES_PER_AXIS = 2  # per pixel and axis, which smooths edges
AMBIENT_SHARE = 0.35  # share of ambient light: faces that turn away stay recognizable
CREASE_COSINE = 0.7  # cosine of 45 degrees


def view(points: Real, faces: Index) -> Real:
    """Return (3, 3) the view axes as rows: right, up, and towards the viewer.

    The view is slightly to the side of the mean normal, with +y up. A closed surface, whose mean normal is
    about zero, is seen from the front left and above.
    """
    a, b, c = (points[faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    mean = across.sum(axis=0) / max(np.linalg.norm(across, axis=1).sum(), 1e-300)
    if np.linalg.norm(mean) < 0.2:
        return axes_towards(np.array([-0.55, 0.35, 0.75]), np.array([0.0, 1.0, 0.0]))
    up = (
        np.array([0.0, 1.0, 0.0]) if abs(mean[1]) < 0.9 * np.linalg.norm(mean) else np.array([0.0, 0.0, -1.0])
    )
    front = axes_towards(mean, up)
    return axes_towards(front[2] + 0.42 * front[0] + 0.32 * front[1], up)


def render(
    points: Real,
    faces: Index,
    uv: Real,
    sampler: Sampler | None,
    size: int,
    axes: Real | None = None,
    *,
    shaded: bool = True,
) -> NDArray[np.uint8]:
    """Return an (h, w, 4) picture with transparent background, `size` pixels along its longer side.

    Args:
        points: (n, 3) positions.
        faces: (m, 3) vertices.
        uv: (m, 3, 2) positions of the corners in the texture, in texels, y down.
        sampler: the texture, None for plain clay.
        size: pixels along the longer side.
        axes: the view axes; those of `view` if None.
        shaded: whether there is a lamp; otherwise the texture's colours are shown as they are.
    """
    axes = view(points, faces) if axes is None else axes
    projected = points @ axes.T
    low, high = projected[:, :2].min(axis=0), projected[:, :2].max(axis=0)
    scale = SAMPLES_PER_AXIS * (size - 2) / max(*(high - low), 1e-300)
    # rounded first: the longer side is an integer up to rounding errors
    width, height = (int(np.ceil(round(e, 6))) for e in (high - low) * scale + 2 * SAMPLES_PER_AXIS)
    screen = (projected[:, :2] - low) * scale + SAMPLES_PER_AXIS
    screen[:, 1] = height - screen[:, 1]
    width, height = width + width % SAMPLES_PER_AXIS, height + height % SAMPLES_PER_AXIS
    corners = np.ascontiguousarray(screen[faces], np.float64)
    owner = visible_triangles(corners, projected[:, 2][faces], width, height)
    covered = np.flatnonzero(owner >= 0)
    triangles = owner.ravel()[covered]
    colour = _texels(corners, uv, triangles, covered, width, sampler)
    light = np.ones(covered.size)
    if shaded:
        shade = affine(corners, _light(points, faces, axes))[triangles]
        light = shade[:, 0] + shade[:, 1] * (covered % width + 0.5) + shade[:, 2] * (covered // width + 0.5)
    picture = np.zeros((height * width, 4), np.float32)
    picture[covered, :3] = colour * light[:, None]
    picture[covered, 3] = 1.0
    small = picture.reshape(
        height // SAMPLES_PER_AXIS, SAMPLES_PER_AXIS, width // SAMPLES_PER_AXIS, SAMPLES_PER_AXIS, 4
    ).mean(axis=(1, 3))
    small[..., :3] /= np.maximum(small[..., 3:], 1e-6)
    return np.rint(np.clip(small, 0, 1) * 255).astype(np.uint8)


def visible_triangles(corners: Real, depths: Real, width: int, height: int) -> NDArray[np.int32]:
    """Return (height, width) the triangle that is seen at the centre of each pixel, or -1.

    Args:
        corners: (m, 3, 2) corners on the screen, in pixels, y down.
        depths: (m, 3) their depths, larger nearer the viewer.
        width, height: of the screen.
    """
    owner, depth = np.full((height, width), -1, np.int32), np.full((height, width), -np.inf, np.float32)
    _nearest(corners, affine(corners, depths), len(corners), owner, depth, height, width)
    return owner


def axes_towards(toward: Real, up: Real) -> Real:
    """Return (3, 3) view axes as rows: right, up, and towards the viewer, who is in the direction `toward` (3,)."""
    toward = toward / np.linalg.norm(toward)
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


def _light(points: Real, faces: Index, axes: Real) -> Real:
    """Return (m, 3) the brightness at each triangle's corners: a lamp over the viewer's left shoulder, both sides lit.

    A corner has the normal of its vertex, or that of its triangle at edges sharper than CREASE_COSINE.
    """
    a, b, c = (points[faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    mean = np.zeros_like(points)
    for k in range(3):
        np.add.at(mean, faces[:, k], across)
    flat, smooth = unit_vectors(across)[:, None], unit_vectors(mean)[faces]
    is_smooth = np.einsum("mij,mkj->mk", flat, smooth) > CREASE_COSINE
    normal = np.where(is_smooth[..., None], smooth, flat)
    lamp = axes.T @ np.array([-0.35, 0.5, 0.8])
    return AMBIENT_SHARE + (1 - AMBIENT_SHARE) * np.abs(normal @ (lamp / np.linalg.norm(lamp)))


def _texels(
    corners: Real, uv: Real, triangles: NDArray, covered: Index, width: int, sampler: Sampler | None
) -> Real:
    if sampler is None:
        return np.full((covered.size, 3), 0.8, np.float32)
    across = affine(corners, uv[..., 0])
    down = affine(corners, uv[..., 1])
    x, y = covered % width + 0.5, covered // width + 0.5

    def places(p: slice) -> TexturePlaces:
        u, v = across[triangles[p]], down[triangles[p]]
        xy = np.column_stack([c[:, 0] + c[:, 1] * x[p] + c[:, 2] * y[p] for c in (u, v)])
        return TexturePlaces(xy, np.column_stack([u[:, 1], u[:, 2], v[:, 1], v[:, 2]]))

    pixels = sampler(places, covered.size)
    top = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1
    values = pixels.astype(np.float32) / top
    return values[:, :3] if values.shape[1] >= 3 else np.repeat(values[:, :1], 3, axis=1)
