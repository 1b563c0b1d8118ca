"""Rigid regions of a shape, and pictures that give the importance or the size of places of the source.

Regions are elements of a drawing, groups of a mesh, masks on the shape's canvas, or listed polygons.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from ...arrays import Complex, complex_of, xy_of
from ...curve import Curve
from ...errors import InputError, naming
from ...maps.fields import Field
from ...maps.regions import rings_of
from .. import formats, limits
from ..files import similar_name
from ..spec import Spec
from . import silhouette
from .mesh_shape import MeshShape
from .shape import Shape, read_drawing, suggested

if TYPE_CHECKING:
    from ..point_syntax import Place

MARK = "#"  # prefix of an element of the source's drawing
LEAST_BRIGHTNESS = 0.1  # least brightness: darker pixels count as this
WHITE_BRIGHTNESS = 0.5  # brightness from which a mask marks a pixel as rigid
GREY_EDGE_SHARE = 0.1  # of the pixels of a mask that are not black: a smaller share of grey is antialiasing


def read(
    shape: Shape,
    regions: Sequence[str],
    listed: Sequence[str | list[Place]] = (),
    option: str = "--rigid",
    *,
    each: bool = False,
) -> list[Complex]:
    """Return the outlines of all rigid regions in the core plane: those drawn in a shape, those given, those listed.

    Args:
        shape: the source or the target.
        regions: each is `#id` for an element or group of its drawing, an object, group or material of its OBJ, or a
            geometry or material of its GLB; or the name of a picture over its canvas or layout, white where it is
            rigid.
        listed: as `given`, or polygons in the shape's units.
        option: name of the option in messages.
        each: whether every outline of an element or group of a drawing is a region; else its convex hull is one, so
            that it moves as one body.

    Raises:
        InputError: an element or group that the file does not have, or a picture without white.
    """
    outlines = list(shape.rigid)
    for region in (*regions, *listed):
        if not isinstance(region, str):
            outlines.append(Curve.domain([shape.at(place) for place in region], "rigid: a polygon").z)
        elif not region.startswith(MARK):
            _refuse_missing(shape, region, option)
            outlines += _mask(shape, Path(region), option)
        elif isinstance(shape, MeshShape):
            outlines += _triangles(shape, region, option)
        else:
            outlines += _element(shape, region, option, each)
    return outlines


def fields(source: Shape, importance: str | None, size_map: str | None) -> dict[str, Field]:
    """Return the importance and the relative size of places of the source, from pictures that cover its canvas.

    Raises:
        InputError: a picture cannot be read, or the source is a mesh.
    """
    fields_by_name = {}
    for name, path, least in (("importance", importance, 0.0), ("size_map", size_map, 1.0)):
        if path is None:
            continue
        option = f"--{name.replace('_', '-')}"
        if source.is_mesh:
            raise InputError(f"{option}: only works for drawings and pictures, and {source.spec} is a mesh")
        bright = _brightness(Path(path), option)
        fields_by_name[name] = Field.of(least + bright, source.box, LEAST_BRIGHTNESS, f"{option} {path}")
    return fields_by_name


def greys(source: Shape, regions: Sequence[str | list[Place]]) -> dict[str, Field]:
    """Return the importance of places that are grey in masks of rigid regions, and thus partly rigid.

    Empty if no mask is grey.

    Raises:
        InputError: a picture cannot be read, or several grey ones differ in size.
    """
    masks = [entry for entry in regions if isinstance(entry, str) and not entry.startswith(MARK)]
    brightnesses = [_brightness(Path(path), "--rigid") for path in masks]
    brightnesses = [
        bright
        for bright in brightnesses
        if ((bright > LEAST_BRIGHTNESS) & (bright < WHITE_BRIGHTNESS)).sum()
        > GREY_EDGE_SHARE * (bright > LEAST_BRIGHTNESS).sum()
    ]
    if len({bright.shape for bright in brightnesses}) > 1:
        raise InputError("--rigid: masks with grey have different sizes; give them the same size")
    return (
        {"importance": Field.of(np.max(brightnesses, axis=0), source.box, LEAST_BRIGHTNESS, "--rigid")}
        if brightnesses
        else {}
    )


def _refuse_missing(shape: Shape, name: str, option: str) -> None:
    """Refuse a name that is not a file, with a hint if an element of the drawing has it as its id."""
    from difflib import get_close_matches

    if Path(name).exists():
        return
    ids = (
        read_drawing(Spec(shape.path)).ids if not isinstance(shape, MeshShape) and _is_drawing(shape) else ()
    )
    similar = get_close_matches(name, ids, 1)
    if similar:
        cure = f"; for the element of {shape.path} write '{MARK}{similar[0]}'"
    else:
        cure = similar_name(Path(name)) or f"; name a mask picture, or an element as '{MARK}id'"
    raise InputError(f"{option} {name}: no such file{cure}")


def _is_drawing(shape: Shape) -> bool:
    return formats.suffix_of(shape.path) in (".svg", ".svgz")


def _element(shape: Shape, name: str, option: str, each: bool) -> list[Complex]:
    """Return the outlines of an element or group of a drawing, or the convex hull of several unless `each`."""
    spec = Spec(shape.path, name[len(MARK) :] or None)
    if not _is_drawing(shape):
        raise InputError(
            f"{option} {name}: names an element of a drawing, and {shape.path} is not a drawing; use a mask"
        )
    drawing = read_drawing(spec)
    if spec.part not in drawing.ids:
        ids = sorted(drawing.ids)
        raise InputError(
            f"{option} {name}: no such element in {shape.path}; {suggested(spec.part or '', ids)}"
        )
    if not drawing.outlines:
        why = str(drawing.refused[0][1]) if drawing.refused else "it has no outline"
        raise InputError(f"{option} {name}: {why}")
    outlines = [outline.z.conjugate() if drawing.flip else outline.z for outline in drawing.outlines]
    if each or len(outlines) == 1:
        return outlines
    hull = shapely.convex_hull(shapely.MultiPoint(xy_of(np.concatenate(outlines))))
    return [complex_of(shapely.get_coordinates(hull)[:-1])]


def _triangles(shape: MeshShape, name: str, option: str) -> list[Complex]:
    """Return the outlines, in the layout, of a named part of a mesh's file."""
    file, patch = shape.file, shape.flattening.patch
    with naming(f"{option} {name}"):
        is_named = file.faces_called(name[len(MARK) :])
    in_region = is_named[np.searchsorted(file.mesh.starts, patch.corner[:, 0], side="right") - 1]
    if not in_region.any():
        raise InputError(
            f"{option} {name}: none of its faces belongs to the part that is mapped, {shape.spec}"
        )
    return [rings[0] for rings in rings_of(shape.flattening.flat, patch.faces[in_region])]


def _mask(shape: Shape, path: Path, option: str) -> list[Complex]:
    """Return the outlines of the white regions of a picture."""
    bright = _brightness(path, option)
    if not (bright >= WHITE_BRIGHTNESS).any():
        raise InputError(f"{option} {path}: contains no white; paint the rigid region white")
    with naming(f"{option} {path}"):
        outlines, _ = silhouette.traced(bright)
    (low, high), (height, width) = shape.box, bright.shape
    size = high - low
    placed = [
        low + outline.z.real / width * size.real + 1j * (1 - outline.z.imag / height) * size.imag
        for outline in outlines
    ]
    return placed if shape.mirror is None else [2 * shape.mirror - z.conj() for z in placed]


def _brightness(path: Path, option: str) -> NDArray[np.float32]:
    """Return (h, w) brightness of a picture, from 0 (black or transparent) to 1 (white), in its stored encoding."""
    from ..pictures import image_files

    image = image_files.read(path, max_pixels=limits.SILHOUETTE_PIXELS)
    pixels, alpha = image.pixels, image.alpha
    if pixels.dtype.kind == "f" and not np.isfinite(pixels).all():
        raise InputError(f"{option} {path}: some pixels are not finite numbers")
    scale = np.float32(np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1)
    colours = np.delete(pixels, alpha, axis=2) if alpha >= 0 else pixels
    bright = colours.astype(np.float32).mean(axis=2) / scale
    return np.clip(bright * (pixels[..., alpha] / scale if alpha >= 0 else 1), 0, 1).astype(np.float32)
