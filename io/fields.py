"""Saved maps sampled on the pixels of the target's canvas, in the forms in which other software takes maps.

`.nrrd`, `.mha`, `.nii`, `.nii.gz`
    Displacement fields of ITK, written by SimpleITK: at each pixel of the fixed picture, the vector from its physical
    place to that in the moving picture. Fields must be defined everywhere; outside of the target, each pixel has the
    vector of the nearest pixel inside.
`.npz`
    Arrays for OpenCV's `remap`: `map_x` and `map_y` (h, w), the pixel of the source, counted from the centre of the
    first one; and `mask` (h, w), the coverage.
`.exr`, `.tif`
    An STMap (`iccm.pixels.stmap`), or with `vectors="pixels"` vectors for Nuke's IDistort and similar nodes: red is the
    distance to the source in pixels to the right, green upwards; alpha is the coverage.

The moving picture, ITK's name for the source, covers the source's canvas, and the fixed picture the target's.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Box, Real
from ..errors import InputError
from ..saved.archive import ERRORS, Archive, opened
from . import files, formats, itk_files, limits
from .apply import Saved, in_one, read_chain
from .itk_files import is_itk, simple_itk, suffix_of
from .spec import saved_map_of

STMAP, PIXELS = "stmap", "pixels"
OUTSIDE_PIXEL = -10.0
"""Value of `map_x` and `map_y` where there is no source: beyond the border of any picture, for every filter of
OpenCV."""
WHOLE_UNIT_SHARE = 1e-6  # by which the side of a canvas may differ from a whole number of units
PROPORTIONS_PIXELS = 1.0  # by which a fixed picture may be too high or too wide for the target's canvas
_DESCRIPTION = "Pixel vectors to the source: R = pixels to the right, G = pixels upwards; A = coverage"


@dataclass(frozen=True, eq=False)
class PixelGrid:
    """The pixels of a picture in physical space, as ITK describes them.

    Attributes:
        size: width and height in pixels.
        origin: (2,) place of the centre of the first pixel.
        spacing: (2,) distance of pixels across and down.
        direction: (2, 2) directions of rows and columns, in columns.
    """

    size: tuple[int, int]
    origin: Real
    spacing: Real
    direction: Real

    @classmethod
    def pixels(cls, width: int, height: int) -> PixelGrid:
        """Return the grid of a picture without physical units, as ITK reads a PNG."""
        return cls((width, height), np.zeros(2), np.ones(2), np.eye(2))

    @classmethod
    def of(cls, path: str) -> PixelGrid:
        """Return the grid of a picture, or of a slice in a format of ITK.

        Raises:
            InputError: it cannot be read, or is not two-dimensional.
        """
        if not is_itk(path):
            from .pictures import image_files

            height, width = image_files.read(path).pixels.shape[:2]
            return cls.pixels(width, height)
        return cls._of_itk(itk_files.read(path))

    @classmethod
    def _of_itk(cls, image: itk_files.ItkImage) -> PixelGrid:
        height, width = image.pixels.shape[:2]
        return cls((width, height), image.origin, image.spacing, image.direction)

    def physical(self, pixels: Real) -> Real:
        """Convert pixels (…, 2), counted from the centre of the first one, to physical places."""
        places: Real = self.origin + (pixels * self.spacing) @ self.direction.T
        return places

    def pixels_at(self, places: Real) -> Real:
        """Convert physical places (…, 2) to pixels; the inverse of `physical`."""
        pixels: Real = ((places - self.origin) @ np.linalg.inv(self.direction).T) / self.spacing
        return pixels

    @property
    def indices(self) -> Real:
        """The pixels (h, w, 2), x first."""
        width, height = self.size
        return np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float)


def write(
    names: Sequence[str],
    output: str,
    *,
    size: tuple[int, ...] | None = None,
    fixed: str | None = None,
    moving: str | None = None,
    vectors: str | None = None,
    force: bool = False,
    tell: Callable[[str], None] = lambda note: None,
) -> tuple[int, int]:
    """Write saved maps, applied one after another, as a field in the format of the output's suffix.

    Args:
        names: the maps; `inverse:name` is the inverse of a map.
        output: the file to write.
        size: of the field in pixels; by default that of `fixed`, or a pixel for each unit of the target's canvas.
        fixed, moving: pictures that cover the canvas of the target and of the source; their sizes, and in formats of
            ITK their places in space, are used. By default a picture with a pixel for each unit.
        vectors: for pictures, "stmap" (default) or "pixels".
        force: whether an existing file may be replaced.
        tell: called with each note.

    Returns:
        Width and height of the field.

    Raises:
        InputError: a file is invalid or of another format, or the size of a picture is not known.
    """
    in_space, arrays = is_itk(output), formats.suffix_of(output) == ".npz"
    if not (in_space or arrays):
        formats.check(output, "stmap", "is not a format of fields (.nrrd .mha .nii .nii.gz .npz are others)")
    if vectors and (in_space or arrays):
        raise InputError(
            f"--vectors {vectors}: only applies to pictures (.exr .tif), and {output} is not one"
        )
    if moving and not (in_space or arrays or vectors == PIXELS):
        raise InputError(
            f"--moving: has no effect, because {output} is an STMap, which holds shares of the source's canvas; leave "
            "it out, or add --vectors pixels"
        )
    if in_space:
        simple_itk()
    if fixed and size:
        raise InputError("--size: cannot be combined with --fixed, whose size the field has")
    inputs = [name for name in (fixed, moving) if name]
    files.check_outputs([output], [*(saved_map_of(name)[0] for name in names), *inputs], force=force)
    saved = in_one(names, read_chain(names))
    of_source, of_target = saved.planes
    to = _grid(fixed, of_target.box, "--fixed", size)
    st = _sampled(saved, to.size, tell)
    covered = st[..., 3] > 0
    if not covered.any():
        raise InputError(f"{names[0]}: no pixel of the field lies on the target; choose a larger --size")
    if not in_space and not arrays and vectors != PIXELS:
        return _write_picture(output, st, force)
    moving_grid = _grid(moving, of_source.box, "--moving")
    place = pixels_of(st, moving_grid.size)
    if arrays:
        place[~covered] = OUTSIDE_PIXEL
        arrays_by_name: dict[str, Any] = {"map_x": place[..., 0], "map_y": place[..., 1], "mask": st[..., 3]}
        with files.writing(output, force=force, suffix=".npz") as path, path.open("wb") as file:
            np.savez_compressed(
                file, **{name: array.astype(np.float32) for name, array in arrays_by_name.items()}
            )
        return to.size
    if not in_space:
        away = place - to.indices
        away[~covered] = 0
        flat = np.dstack([away[..., 0], -away[..., 1], np.zeros(away.shape[:2]), st[..., 3]])
        return _write_picture(output, flat.astype(np.float32), force, _DESCRIPTION)
    away = moving_grid.physical(place) - to.physical(to.indices)
    # at pixels whose centres lie outside, an STMap has the nearest place inside, not a place that continues the map
    inside = st[..., 3] >= min(0.5, st[..., 3].max())
    _write_itk(output, _extended(away, inside), to, force)
    return to.size


def _sampled(saved: Saved, size: tuple[int, int], tell: Callable[[str], None]) -> NDArray[np.float32]:
    """Return a map as an STMap (h, w, 4) of the canvases of both shapes."""
    from .pictures import stmap_files

    boxes = {"texture_box": "viewbox", "target_box": "viewbox"}
    with files.scratch() as folder:
        path = str(folder / "map.exr")
        saved.carry({"output": [], "stmap": path, "size": size, **boxes}, tell=tell)
        return stmap_files.read(path)


def pixels_of(st: NDArray, size: tuple[int, int]) -> Real:
    """Convert s and t (h, w, c) to pixels (h, w, 2) of a picture, counted from the centre of the first one, y down."""
    width, height = size
    return np.dstack([st[..., 0] * float(width) - 0.5, (1 - st[..., 1].astype(float)) * height - 0.5])


def st_of(pixels: Real, size: tuple[int, int], covered: NDArray | None = None) -> NDArray[np.float32]:
    """Convert pixels (h, w, 2) of a picture to an STMap (h, w, 4); inverse of `pixels_of`. `covered` is its alpha."""
    width, height = size
    s, t = (pixels[..., 0] + 0.5) / width, 1 - (pixels[..., 1] + 0.5) / height
    alpha = np.ones(s.shape) if covered is None else covered
    return np.dstack([s, t, np.zeros(s.shape), alpha]).astype(np.float32)


def _grid(path: str | None, box: Box, option: str, size: tuple[int, ...] | None = None) -> PixelGrid:
    """Return the grid of the picture that covers a canvas.

    Args:
        path: the picture; None for a picture with a pixel for each unit.
        box: corners of the canvas.
        option: that names the picture.
        size: of a picture without a file; one number is its longer side.

    Raises:
        InputError: the picture does not have the proportions of the canvas, or its size is unknown.
    """
    extent = box[1] - box[0]
    sides = np.array([extent.real, extent.imag])
    if path is None and size:
        from .run.framing import size_within

        return PixelGrid.pixels(*size_within(tuple(size), extent, limits.PIXELS))
    if path is None:
        whole_units = np.rint(sides)
        if (whole_units < 2).any() or (np.abs(sides - whole_units) > WHOLE_UNIT_SHARE * sides).any():
            alternative = " or --size" if option == "--fixed" else ""
            raise InputError(
                f"{option}: needed, because the canvas is {sides[0]:g} by {sides[1]:g} units, which is not a number "
                f"of pixels; name the picture that covers it{alternative}"
            )
        if whole_units.prod() > limits.PIXELS:
            raise InputError(f"{option}: needed, because the canvas has too many units for a pixel each")
        return PixelGrid.pixels(int(whole_units[0]), int(whole_units[1]))
    grid = PixelGrid.of(path)
    scale = np.array(grid.size) / sides
    if np.abs(sides * scale.max() - grid.size).max() > PROPORTIONS_PIXELS:
        raise InputError(
            f"{path}: has {grid.size[0]} by {grid.size[1]} pixels, but the canvas that it should cover is "
            f"{sides[0]:g} by {sides[1]:g} units; name a picture of the whole canvas for {option}"
        )
    return grid


def _extended(away: Real, inside: NDArray) -> Real:
    """Return vectors (h, w, 2), where those of pixels outside are those of the nearest pixel inside."""
    from scipy.ndimage import distance_transform_edt

    row, column = distance_transform_edt(~inside, return_distances=False, return_indices=True)
    extended: Real = away[row, column]
    return extended


def _write_picture(
    output: str, pixels: NDArray[np.float32], force: bool, description: str = ""
) -> tuple[int, int]:
    """Write an STMap, or with the `description` of its channels, other values; return its size."""
    from .pictures import image_files, stmap_files

    height, width = pixels.shape[:2]
    with files.writing(output, force=force) as path:
        if not description:
            stmap_files.write_whole(path, pixels)
        else:
            like = image_files.Image(
                np.zeros((1, 1, 4), np.float32),
                3,
                True,
                "data",
                {"ImageDescription": ("string", description)},
            )
            image_files.write_bands(path, like, height, width, [pixels])
    return width, height


def _write_itk(output: str, away: Real, grid: PixelGrid, force: bool) -> None:
    itk = simple_itk()
    image = itk.GetImageFromArray(np.ascontiguousarray(away), isVector=True)
    image.SetOrigin(grid.origin.tolist())
    image.SetSpacing(grid.spacing.tolist())
    image.SetDirection(grid.direction.ravel().tolist())
    suffix = suffix_of(output)
    with files.scratch() as folder, files.writing(output, force=force, suffix=suffix) as path:
        written_file = folder / f"field{suffix}"
        try:
            itk.WriteImage(image, str(written_file))
        except RuntimeError:
            raise InputError(f"{output}: SimpleITK cannot write this file") from None
        path.write_bytes(written_file.read_bytes())


def is_field(path: str) -> bool:
    """Return whether a file is a field other than an STMap: one of ITK, arrays for `remap`, or pixel vectors.

    Raises:
        InputError: an archive of arrays is missing, or not a plain file.
    """
    if is_itk(path):
        return True
    if formats.suffix_of(path) == ".npz":
        with files.opened(path) as file:
            try:
                with zipfile.ZipFile(file) as archive:
                    return {"map_x.npy", "map_y.npy"} <= set(archive.namelist())
            except (OSError, *ERRORS):
                return False
    from .pictures import image_files

    return formats.of(path).stmap and image_files.description(path) == _DESCRIPTION


def read(path: str, size: tuple[int, int]) -> NDArray[np.float32]:
    """Read a field as an STMap (h, w, 4) for a picture of a size; ITK's fields see it as `PixelGrid.pixels` places it.

    Raises:
        InputError: the file cannot be read, or is not a field.
    """
    if is_itk(path):
        image = itk_files.read(path)
        if image.components != 2:
            raise InputError(f"{path}: not a displacement field of two components")
        grid = PixelGrid._of_itk(image)
        away = image.pixels.astype(float)
        if not np.isfinite(away).all():
            raise InputError(f"{path}: contains vectors that are not finite")
        place = PixelGrid.pixels(*size).pixels_at(grid.physical(grid.indices) + away)
        return st_of(place, size)
    if formats.suffix_of(path) == ".npz":
        with opened(
            files.open_input(path),
            otherwise="a damaged archive of arrays",
            damaged="the arrays map_x and map_y cannot be read",
        ) as archive:
            members = Archive(archive)
            x, y = (np.asarray(members.member(name), float) for name in ("map_x", "map_y"))
            mask = np.asarray(members.member("mask"), float) if "mask" in members else np.ones(x.shape)
        if x.ndim != 2 or not x.shape == y.shape == mask.shape:
            raise InputError(f"{path}: map_x and map_y are not two arrays (h, w) of the same size")
        is_known = np.isfinite(x) & np.isfinite(y) & (x > OUTSIDE_PIXEL)
        return st_of(np.dstack([np.where(is_known, x, 0), np.where(is_known, y, 0)]), size, mask * is_known)
    from .pictures import stmap_files

    st = stmap_files.read(path)
    height, width = st.shape[:2]
    place = PixelGrid.pixels(width, height).indices + np.dstack([st[..., 0], -st[..., 1]])
    return st_of(place, size, st[..., 3])
