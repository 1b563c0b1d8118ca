"""Specimens: the outline of a picture or a drawing, and its landmarks, in one plane."""

from __future__ import annotations

import glob
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...arrays import Complex
from ...curve import Curve
from ...errors import InputError
from .. import files, formats
from ..batch.globs import Globs
from ..pictures import image_files
from ..shapes import shape
from ..shapes.shape import Shape
from ..spec import Spec
from .landmarks import SpecimenLandmarks

CANVAS_PROPORTIONS_SHARE = 0.01  # by which the canvas of an outline may be wider or narrower than its picture


@dataclass(frozen=True, eq=False)
class Specimen:
    """A specimen that can be mapped.

    Attributes:
        name: the stem of its file.
        source: the file and part that its outline was read from.
        picture: the file that shows it.
        shape: the outline with its plane.
        landmarks: (k,) in the plane of the outline, in the order of `names`.
        names: of the landmarks.
        files: all files that it was read from.
        mirrored: whether it is the mirror image of what the files show.
    """

    name: str
    source: str
    picture: str
    shape: Shape
    landmarks: Complex
    names: tuple[str, ...]
    files: tuple[str, ...]
    mirrored: bool = False

    @property
    def curve(self) -> Curve:
        """The outline."""
        return self.shape.curve

    def reflected(self, folder: Path, *, force: bool) -> Specimen:
        """Write the mirror image of the picture to a folder, and return the specimen that it shows.

        Raises:
            InputError: it is a drawing, or has its outline in another file.
        """
        source = Spec.of(self.source)
        if not _is_picture(self.picture) or str(source.path) != self.picture:
            raise InputError(
                f"{self.source}: cannot be reflected, because it is not a picture, or has its outline in another file; "
                "mirror the file itself"
            )
        image = image_files.read(self.picture)
        path = folder / f"{self.name}.png"
        files.make_folder(folder)
        with files.replacing(path, force=force) as temporary:
            image_files.write(temporary, replace(image, pixels=np.ascontiguousarray(image.pixels[:, ::-1])))
        spec = f"{path}#{source.selection}" if source.selection else str(path)
        width = image.pixels.shape[1]
        return replace(
            self,
            source=spec,
            picture=str(path),
            shape=shape.read(spec),
            landmarks=width - self.landmarks.conj(),
            mirrored=True,
        )


def specs_of(names: Sequence[str]) -> list[str]:
    """Return the specimens that files, patterns and folders stand for, each once, by name.

    Raises:
        InputError: a pattern or folder has none, or two have the same name.
    """
    globs = Globs(None)
    specs = list[str]()
    for text in names:
        if os.path.isdir(text):
            suffixes = formats.holding("picture")
            listed = sorted(name for name in os.listdir(text) if not name.startswith("."))
            matched = [os.path.join(text, name) for name in listed if formats.suffix_of(name) in suffixes]
            if not matched:
                raise InputError(f"{text}: contains no pictures")
        elif glob.has_magic(text) and not os.path.lexists(Spec.of(text).path):
            pattern, mark, part = text.partition("#")
            matched = [f"{path}{mark}{part}" for path in globs.files(pattern)]
            if not matched:
                raise InputError(f"{text}: no files match this pattern")
        else:
            matched = [text]
        specs += matched
    specs = list(dict.fromkeys(specs))
    stems = Counter(Spec.of(text).path.stem for text in specs)
    repeated = next((stem for stem, count in stems.items() if count > 1), None)
    if repeated is not None:
        raise InputError(f"{repeated}: is the name of more than one specimen; rename the files")
    return sorted(specs, key=lambda text: Spec.of(text).path.stem)


def read(text: str, landmarks: SpecimenLandmarks, outline: str | None = None) -> Specimen:
    """Read a specimen.

    Args:
        text: a picture or drawing, `file` or `file#part`.
        landmarks: its landmarks, in pixels of the picture, or units of the drawing.
        outline: a drawing with its outline, whose canvas is the picture; by default that in the picture itself.

    Raises:
        InputError: it has no outline, a landmark is missing, or the outline's canvas is not that of the picture.
    """
    spec = Spec.of(text)
    source = outline if outline is not None else text
    outline_shape = shape.read(source)
    missing = [name for name, z in zip(landmarks.names, landmarks.points) if np.isnan(z)]
    if missing:
        raise InputError(
            f"{landmarks.path}: landmark {', '.join(missing[:8])} has no position; place it, or leave it out of all "
            "specimens"
        )
    repeated = [name for name, count in Counter(landmarks.names).items() if count > 1]
    if repeated:
        raise InputError(f"{landmarks.path}: has more than one landmark named {', '.join(repeated[:8])}")
    low, high = outline_shape.box
    scale = 1.0
    if outline is not None:
        height, width = image_files.read(spec.path).pixels.shape[:2]
        canvas = high - low
        if abs(canvas.real * height / (canvas.imag * width) - 1) > CANVAS_PROPORTIONS_SHARE:
            raise InputError(
                f"{outline}: its canvas is {canvas.real:g} by {canvas.imag:g}, but {spec.path} has {width} by {height} "
                "pixels; give it a viewBox with the proportions of the picture"
            )
        scale = canvas.real / width
    if landmarks.upward:
        points = low + scale * landmarks.points
    elif outline is not None or _is_picture(str(spec.path)):
        points = complex(low.real, high.imag) + scale * landmarks.points.conj()
    else:
        points = outline_shape.to_core(np.column_stack([landmarks.points.real, landmarks.points.imag]))
    read_from = dict.fromkeys((str(spec.path), str(Spec.of(source).path), landmarks.path))
    return Specimen(
        spec.path.stem, source, str(spec.path), outline_shape, points, landmarks.names, tuple(read_from)
    )


def _is_picture(path: str) -> bool:
    return formats.of(path).picture is not None
