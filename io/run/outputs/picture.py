"""The texture carried to the target's canvas, with the bit depth and colour space of the texture."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ....errors import InputError
from ....pixels.canvas import Canvas, Diagnostics
from ....pixels.warp import Warp, band_bytes, padded, whole, whole_bytes
from ... import formats
from ...pictures import georeferenced
from ...pictures.image import Image, prepare, unassociate
from ..blank_picture import Colours
from ..job import Job
from ..report import OutputReport
from ..state import Run
from ..texture import drawing_of, has_texture, shows_itself
from . import checks
from .output import Output
from .world_file import canvas_transform

if TYPE_CHECKING:
    from ..background import Background

PADDED = "the whole picture at once (--padding)"


class Picture(Output):
    """A picture of the target."""

    samples, shows, tiles = True, True, True
    shows_target = True

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require a suffix of pictures, for --padding one that keeps colours where alpha is 0."""
        if self.name != "-":
            formats.check(self.name, "picture", "unknown suffix for -o", "drawing", "uv", "map")
        if job.padding and not self._format.hidden:
            suffix = formats.suffix_of(self.name)
            raise InputError(
                f"{self.name}: {suffix} does not keep colours where alpha is 0, so --padding has no "
                "effect; use .png or .tif"
            )
        if job.padding and job.background == "target":
            raise InputError(
                "--padding: has no effect with --background target, which shows beyond the outline"
            )

    @property
    def _format(self) -> formats.PictureFormat:
        return formats.picture(formats.written(self.name))

    def _keeps_numbers(self, run: Run) -> bool:
        """Return whether the picture is one of numbers, and written in a format that keeps them."""
        return run.image.raster is not None and formats.suffix_of(self.name) in formats.TIFF_SUFFIXES

    def check(self, run: Run) -> None:
        """Check the canvas, the texture, memory, and the format."""
        if run.on_mesh:
            checks.coordinates(run, run.source)
        width, height = checks.canvas(run, self.tile)
        checks.texture(run)
        image = run.image.covered()
        checks.room(run)
        run.room.check(band_bytes(width), f"rows of {width} pixels")
        if run.job.padding:
            room = whole_bytes(height, width, image.pixels.shape[2], image.pixels.itemsize)
            run.room.check(room, PADDED)
        self.check_format(run, image, width, height)

    def check_format(self, run: Run, image: Image, width: int, height: int) -> None:
        """Check that the format can hold the picture, and note what it loses.

        Raises:
            InputError: there are too many pixels or channels, or the colour space is not supported.
        """
        from ...pictures import image_files

        job, suffix, format = run.job, formats.suffix_of(self.name), self._format
        path = formats.written(self.name)
        raster = run.image.raster
        if job.background == "target" and (raster or image.pixels.shape[2] not in (2, 4)):
            raise InputError(
                f"--background target: {_name(run)} is not a picture of colours; leave the option out"
            )
        if raster and self._keeps_numbers(run):
            if job.padding:
                raise InputError(
                    f"--padding: {self.name} keeps the numbers of {_name(run)}, and has no alpha"
                )
            run.room.check(
                2 * whole_bytes(height, width, image.pixels.shape[2], 8), "the whole raster at once"
            )
            beyond = f"{raster.fill:g}" + (" (no data)" if raster.nodata is not None else "")
            run.note(f"{self.name}: beyond the shape, pixels are {beyond}")
            return
        image_files.check(path, image, height, width)
        if has_texture(job, run.source) and not drawing_of(job, run.source):
            run.note(*(f"{self.name}: {loss}" for loss in image_files.losses(path, run.image)))
        self._note_place(run, suffix)
        if job.edge == "transparent" and not (run.image.alpha >= 0 and format.alpha):
            lacking = self.name if run.image.alpha >= 0 else "the texture"
            run.note(
                f"--edge transparent: {lacking} has no alpha channel, so beyond the texture's edge it is black"
            )
        as_stored = job.kind != "colour" or job.filter == "nearest"
        keeps_hidden = format.hidden or (format.light == "linear" and format.alpha and image.associated)
        if as_stored and run.image.alpha >= 0 and not keeps_hidden:
            note = f"{suffix} does not keep colours where alpha is 0; use .png or .tif to keep them"
            run.note(f"{self.name}: {note}")
        usual = "lin_rec709" if image.pixels.dtype.kind == "f" else "sRGB"
        keeps_name = (
            format.named or format.light != "any" or image.colorspace in (usual, "data", job.colorspace)
        )
        if not keeps_name:
            warning = (
                f"{suffix} cannot store the name of the colour space {image.colorspace}; the numbers are kept"
            )
            run.note(f"{self.name}: {warning}")

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Write rows as they are computed, or with --padding the whole picture at once."""
        from ...pictures import image_files, rasters

        canvas, error = run.canvas_of(self.tile), run.job.max_pixel_error
        work = Warp(run.mapping, run.sampler, canvas, placing=run.placing, max_error=error)
        colours = Colours(numbers=run.image.raster is not None)
        with run.phases.timed("resample"):
            rows: Iterable[NDArray]
            if self._keeps_numbers(run):
                rows = _seen(work.blocks(run.threads), work.alpha, colours)
                rasters.write(path, run.image, rows, work.alpha, same_grid=_is_same_grid(run, canvas))
            else:
                if run.job.padding:
                    image = self._padded(run, work, colours)
                    rows = [image.pixels]
                else:
                    image = replace(run.image, alpha=work.alpha)
                    rows = self._rows(run, work, colours)
                    if run.job.background == "target":
                        image = replace(image, alpha=3, associated=False)
                image_files.write_bands(path, image, canvas.height, canvas.width, rows)
        self._georeference(run, path)
        return _report_pixels(run, colours, work.diagnostics, canvas)

    def _note_place(self, run: Run, suffix: str) -> None:
        """Note that the picture does not say where it lies on a map, if the target does and no other output does."""
        if run.target.georeference is None or suffix in formats.TIFF_SUFFIXES:
            return
        if not any(formats.of(name).world for name in run.job.output):
            cure = "use .tif, or also write a world file (-o FILE.pgw)"
            run.note(f"{self.name}: {suffix} does not store where the target lies on a map; {cure}")

    def _georeference(self, run: Run, path: Path) -> None:
        """Say in a TIFF where it lies on a map, if the target does."""
        place = run.target.georeference
        if place is None or formats.suffix_of(self.name) not in formats.TIFF_SUFFIXES:
            return
        try:
            georeferenced.write(path, canvas_transform(run), place.crs)
        except InputError as error:
            run.note(f"{self.name}: {error}")  # the picture itself is right

    def _rows(self, run: Run, work: Warp, colours: Colours) -> Iterator[NDArray]:
        """Yield blocks of rows while they are computed, with only some of them in memory."""
        background = _background(run, work.canvas)
        row = 0
        for block in work.blocks(run.threads):
            colours.see(block, work.alpha)
            if background is None:
                yield run.image.with_pixels(block, work.alpha).pixels
            else:
                yield background.behind(block, work.alpha, row).pixels
            row += len(block)

    def _padded(self, run: Run, work: Warp, colours: Colours) -> Image:
        """Return the picture with its colours extended beyond the outline, which needs the whole picture in memory."""
        canvas = work.canvas
        picture_bytes = whole_bytes(canvas.height, canvas.width, work.channels, work.dtype.itemsize)
        run.room.threads(1, picture_bytes, PADDED)
        warped = whole(work, threads=run.threads)
        colours.see(warped.pixels, warped.alpha)
        image = unassociate(run.image.with_pixels(warped.pixels, warped.alpha))
        extended = padded(image.pixels, image.alpha, run.job.padding or 0, run.job.padding_fill)
        return replace(image, pixels=extended)


def _background(run: Run, canvas: Canvas) -> Background | None:
    """Return what is seen behind the result, if --background asks for it."""
    if run.job.background != "target":
        return None
    from ..background import Background

    return Background(run, canvas)


def _seen(blocks: Iterable[NDArray], alpha: int, colours: Colours) -> Iterator[NDArray]:
    """Yield blocks of rows after counting their colours."""
    for block in blocks:
        colours.see(block, alpha)
        yield block


def _name(run: Run) -> str:
    return run.job.texture or run.source.spec


def _is_same_grid(run: Run, canvas: Canvas) -> bool:
    """Return whether the result has the pixels of a texture that covers the same canvas."""
    same_size = run.image.pixels.shape[:2] == (canvas.height, canvas.width)
    return same_size and bool(np.allclose(run.source.box, run.target.box))


def displayed(run: Run, canvas: Canvas) -> NDArray:
    """Carry the texture to a canvas for display. Returns (height, width, channels), sRGB with 8 bits per channel."""
    warped = whole(Warp(run.mapping, run.sampler, canvas, placing=run.placing), threads=run.threads)
    return prepare(run.image.with_pixels(warped.pixels, warped.alpha), formats.picture(".webp")).pixels


def _report_pixels(run: Run, colours: Colours, diagnostics: Diagnostics, canvas: Canvas) -> OutputReport:
    """Report the size of the picture and counts of its pixels, and note if it is blank."""
    textured = bool(run.job.texture) and run.job.texture_box != "bbox" and not run.on_mesh
    # a drawing with a single colour, such as a line drawing, shows that colour
    is_own_colour = colours.single and shows_itself(run.job, run.source)
    if not is_own_colour and (note := colours.note(bool(diagnostics.inside or diagnostics.edge), textured)):
        run.note(note)
    pixels: dict[str, Any] = {"width": canvas.width, "height": canvas.height, **diagnostics.as_dict()}
    if not has_texture(run.job, run.source):
        pixels["checkerboard"] = True
    elif run.detail is not None and run.detail.has_paper and not run.detail.fills_box and run.paper:
        pixels["paper"] = run.paper
    if run.job.background == "target":
        pixels["background"] = "target"
    return OutputReport({"pixels": pixels} | ({"empty": True} if colours.empty else {}))
