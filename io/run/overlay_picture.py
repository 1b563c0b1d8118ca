"""A picture of an overlay in the flattening of its surface."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Real
from ...errors import InputError
from ...maps.triangulated.location import PatchLocator
from ...pixels.canvas import LONGER_SIDE_PIXELS
from .. import extras, formats
from ..meshes.overlays import Overlay, interpolate
from ..pictures import image_files
from ..pictures.image import Image
from ..shapes.mesh_shape import MeshShape

MARGIN_SHARE = 0.01  # of the longer side, on each side
SAMPLES_ACROSS = 2  # samples across and down a pixel of a coloured picture, for smooth edges
END_PERCENTILES = (2, 98)  # of the values: ends of the colour map


def is_coloured(name: str) -> bool:
    """Return whether a picture shows colours; others contain the numbers."""
    format = formats.picture(name)
    return not formats.of(name).stmap and format.light == "display"


def check_colormap(name: str | None) -> None:
    """Check that Matplotlib has a colour map.

    Raises:
        InputError: it has not, or Matplotlib is not installed.
    """
    if name is not None and name not in _colormaps():
        raise InputError(
            f"--colormap {name}: Matplotlib has no such colour map; viridis and coolwarm are two"
        )


def write(
    shape: MeshShape,
    overlay: Overlay,
    path: Path,
    *,
    colormap: str | None = None,
    ends: tuple[float, float] | None = None,
) -> None:
    """Write a picture of an overlay.

    Args:
        shape: the flattened surface.
        overlay: of its vertices.
        path: the picture; formats of floats get the numbers, NaN outside of the surface, others colours.
        colormap: as Matplotlib names it.
        ends: the values at the ends of the colour map.
    """
    coloured = is_coloured(str(path))
    samples = SAMPLES_ACROSS if coloured else 1
    low, high = shape.box
    longer = max((high - low).real, (high - low).imag) * (1 + 2 * MARGIN_SHARE)
    pixel = longer / LONGER_SIDE_PIXELS
    width, height = (
        max(1, round((side + 2 * MARGIN_SHARE * longer) / pixel))
        for side in ((high - low).real, (high - low).imag)
    )
    corner = (low + high) / 2 + complex(-width, height) / 2 * pixel
    x = (np.arange(width * samples) + 0.5) * pixel / samples
    y = (np.arange(height * samples) + 0.5) * pixel / samples
    z = corner + x - 1j * y[:, None]
    flat, patch = shape.flattening.flat, shape.flattening.patch
    corners = flat[patch.faces]
    triangle, weights = PatchLocator(corners, np.zeros_like(corners))(z.ravel())
    inside = triangle >= 0
    vertices = patch.vertex[patch.faces[triangle[inside]]]
    values, colors = interpolate(overlay, vertices, weights[inside])
    if not coloured:
        numbers = np.full(z.size, np.nan, np.float32)
        numbers[inside] = values
        image_files.write(path, Image(numbers.reshape(height, width, 1), colorspace="data"))
        return
    rgba = np.zeros((z.size, 4))
    rgba[inside] = colors if overlay.colors is not None else _colored(values, overlay.values, colormap, ends)
    rgba[..., :3] *= rgba[..., 3:]
    rgba = rgba.reshape(height, samples, width, samples, 4).mean(axis=(1, 3))
    alpha = np.maximum(rgba[..., 3:], 1e-9)
    pixels = np.concatenate([rgba[..., :3] / alpha, rgba[..., 3:]], axis=2)
    image_files.write(path, Image(np.rint(255 * pixels).astype(np.uint8), alpha=3))


def _colored(values: Real, every: Real, colormap: str | None, ends: tuple[float, float] | None) -> Real:
    """Return colours (p, 4) of values (p,), given all values of the overlay; values that are NaN are transparent."""
    finite = every[np.isfinite(every)]
    low, high = ends or (np.percentile(finite, END_PERCENTILES) if finite.size else (0.0, 1.0))
    signed = low < 0 < high
    if ends is None and signed:
        low, high = -max(-low, high), max(-low, high)
    scale = colormap or ("coolwarm" if signed else "viridis")
    colors = _colormaps()[scale]((values - low) / ((high - low) or 1.0))
    colors[~np.isfinite(values)] = 0
    return colors


def _colormaps() -> Any:
    """Return the colour maps by their names.

    Raises:
        InputError: Matplotlib is not installed.
    """
    otherwise = "write the numbers with -o FILE.exr"
    return extras.load("--overlay as colours", "matplotlib", otherwise=otherwise).colormaps
