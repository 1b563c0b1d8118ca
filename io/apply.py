"""Pictures, drawings and points carried through a saved map."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from ..arrays import Complex
from ..curve import Curve, polygon_of
from ..errors import InputError, JobError, naming
from ..maps.approximation import triangulated
from ..maps.harmonic import ROUNDING_SHARE
from ..maps.triangulated.map import TriangulatedMap
from ..plane import diagonal
from ..result import Fit, result_of
from ..saved.geometry import Carrier, as_polygon
from ..saved.inverted import InverseMap
from ..saved.map_file import MapFile, SavedPlane
from ..saved.map_file import read as read_file
from . import files, formats
from .artwork import TOLERANCE_SHARE
from .geometry import document
from .geometry.document import Geometry, Images
from .lengths import MILLIMETRES
from .memory import within
from .run import outputs
from .run.inputs import Inputs
from .run.job import Job
from .run.phases import Phases
from .run.report import write as write_report
from .run.state import Run
from .shapes.shape import Shape
from .spec import INVERSE, path_of, saved_map_of
from .svg import crossings

SCHEMA = "iccm.apply/1"
PICTURE_OPTIONS = ("target_box", "holes")
"""Options of a saved map's job that affect its pictures: what they show, and how holes are treated."""
JOINT_AREA_SHARE = 0.01
"""Share of a shape's area by which the end of a map and the beginning of the next one may differ: outlines of the same
file differ by their tolerance, those of other files by much more."""
# relative to `Saved.near`: lines are cut this far outside of the outline, where points still have images
OUTSIDE_DISTANCE_SHARE = 0.999


@dataclass(frozen=True, eq=False)
class Saved:
    """A saved map, or its inverse.

    Attributes:
        name: of the map's file.
        fit: the map.
        planes: of source and target.
        job: its method, and its job's values of PICTURE_OPTIONS.
        function: maps points of the source to the target.
        near: how far outside of the outline points are still mapped.
    """

    name: str
    fit: Fit
    planes: tuple[SavedPlane, SavedPlane]
    job: dict[str, Any]
    function: Callable[[Complex], Complex]
    near: float

    @classmethod
    def read(cls, name: str, *, inverse: bool = False) -> Saved:
        """Read a saved map from a file.

        Raises:
            InputError: the file does not contain a valid map.
        """
        stored = read_file(files.open_input(name))
        with naming(name):
            fit, job = result_of(stored), _job(stored)
        map = fit.map
        margin = (map.near if isinstance(map, TriangulatedMap) else ROUNDING_SHARE) * map.diagonal
        saved = cls(name, fit, stored.planes, job, lambda z: map.jet(z)[0], margin)
        return saved._inverse() if inverse else saved

    def _inverse(self) -> Saved:
        """Return the inverse map, without options that concern pictures of the target."""
        fit, (source, target) = self.fit, self.planes
        if fit.target is None:
            target = replace(target, outline=fit.image)
        triangles = triangulated(fit.map)
        back: Any = InverseMap(triangles)
        swapped = replace(
            fit,
            map=back,
            source=fit.target or Curve(fit.image),
            target=fit.source,
            source_holes=fit.target_holes,
            target_holes=fit.source_holes,
            details=replace(fit.details, drawings=fit.details.drawings and fit.details.drawings[::-1]),
        )
        job = {name: value for name, value in self.job.items() if name != "target_box"}
        margin = triangles.near * triangles.image_diagonal if triangles is fit.map else 0.0
        return Saved(self.name, swapped, (target, source), job, fit.inverse, margin)

    @property
    def shapes(self) -> tuple[Shape, Shape]:
        """Return source and target as shapes; for a deformation both are the source."""
        source = _shape(self.name, self.planes[0])
        return source, source if self.fit.target is None else _shape(self.name, self.planes[1])

    def carry(
        self,
        job: dict[str, Any],
        *,
        threads: int | None = None,
        tell: Callable[[str], None] = lambda note: None,
    ) -> bool:
        """Write a picture or a drawing carried through the map.

        Args:
            job: `output`, and `texture` for a picture or `source` for a drawing; options of `Job`.
            threads: number of threads; None for all cores.
            tell: called with each note.

        Returns:
            Whether a picture is empty.

        Raises:
            InputError: as for a job.
        """
        source, target = self.shapes
        options = (
            {"source": self.name, "target": None if self.fit.target is None else self.name} | self.job | job
        )
        try:
            full_job = Job(**options)
        except JobError as error:
            raise InputError(str(error)) from None
        if full_job.source != self.name:
            source = replace(source, spec=full_job.source, path=Path(full_job.source))
        inputs = Inputs(full_job)
        requested = outputs.of(full_job, inputs)
        files.check_outputs(full_job.outputs, [*full_job.inputs, self.name], force=full_job.force)
        phases = Phases()
        first_output = next(iter(full_job.outputs), None)  # none if the picture goes to stdout
        room = within(full_job.memory, first_output)
        run = Run(full_job, inputs, [(source, target)], room, tell, phases, threads, fits=[self.fit])
        reports = []
        for output in outputs.check(run, requested):
            with files.writing(output.name, force=full_job.force) as path:
                reports.append(output.write(run, path))
        return any(report.figures.get("empty") for report in reports)

    def carry_geometry(self, path: str, output: str, **options: Any) -> dict[str, int]:
        """Write the geometry of a file carried through the map; see the function `carry_geometry`."""
        return carry_geometry([self], path, output, **options)

    @property
    def _painted(self) -> tuple[shapely.Geometry, shapely.Geometry]:
        """The regions that source and target paint, in the core plane; for a deformation, also its image."""
        fit = self.fit
        if fit.details.drawings is not None:
            return fit.details.drawings[0].painted, fit.details.drawings[1].painted
        target = fit.image if fit.target is None else fit.target.z
        sides = (fit.source.z, fit.source_holes), (target, () if fit.target is None else fit.target_holes)
        polygons = [shapely.make_valid(polygon_of(z, *(hole.z for hole in holes))) for z, holes in sides]
        return polygons[0], polygons[1]

    def carried(
        self, geometry: Geometry, upward: bool, max_line_error: float | None
    ) -> tuple[Images, Counter[str]]:
        """Return the images of geometry, and counts of what lay outside or was cut.

        Args:
            geometry: in the units of the source's file.
            upward: whether its y points up from the lower edge of the canvas, see `Document.upward`.
            max_line_error: see `options.ApplyOptions`.
        """
        source, target = self.planes
        reach = max_line_error or TOLERANCE_SHARE * diagonal(
            self.fit.image if target.outline is None else target.outline
        )
        carrier = Carrier(self.function, self.fit.map.rims, OUTSIDE_DISTANCE_SHARE * self.near, reach)

        def core(z: Complex) -> Complex:
            return z + _foot(source) if upward else source.flip(z)

        def back(w: Complex) -> Complex:
            return w - _foot(target) if upward else target.flip(w)

        points = back(carrier.points(core(geometry.points)))
        lines = [
            [back(w) for w in pieces] for pieces in carrier.lines([core(line) for line in geometry.lines])
        ]
        polygons = [
            [[back(ring) for ring in rings] for rings in parts]
            for parts in carrier.polygons([[core(ring) for ring in rings] for rings in geometry.polygons])
        ]
        return Images(points, lines, polygons, name=target.name), carrier.counts


def inverse_chain(names: Sequence[str]) -> list[str]:
    """Return the names of the inverses of maps that are applied one after another, in the opposite order.

    >>> inverse_chain(["a.npz", "inverse:b.npz"])
    ['b.npz', 'inverse:a.npz']
    """
    steps = [saved_map_of(name) for name in reversed(names)]
    return [path if is_inverse else f"{INVERSE}{path}" for path, is_inverse in steps]


def read_chain(names: Sequence[str]) -> list[Saved]:
    """Read maps that are applied one after another; `inverse:` before a name requests the inverse of a map.

    Args:
        names: of files, the map that is applied first first.

    Raises:
        InputError: a file does not contain a valid map, or a map does not begin on the shape on which the one before
            ends.
    """
    steps = [Saved.read(path, inverse=is_inverse) for path, is_inverse in map(saved_map_of, names)]
    for first, second in pairwise(steps):
        ends, begins = first._painted[1], second._painted[0]
        area_between = shapely.symmetric_difference(ends, begins).area / ends.area
        if first.planes[1].down != second.planes[0].down or area_between > JOINT_AREA_SHARE:
            raise InputError(
                f"{second.name}: does not begin on the shape on which {first.name} ends; chain maps that meet in the "
                f"same file, and put {INVERSE} before a map to use its inverse"
            )
    return steps


def in_one(names: Sequence[str], steps: Sequence[Saved]) -> Saved:
    """Return maps that are applied one after another as one map: their composition, if there are several.

    Args:
        names: of the maps, as for `read_chain`.
        steps: what it returned.

    Raises:
        InputError: the maps cannot be composed.
    """
    from .compose import compose

    if len(steps) == 1:
        return steps[0]
    fit, planes = compose(names)
    map = triangulated(fit.map)
    job = steps[-1].job | {"method": "balanced"}
    return Saved(steps[0].name, fit, planes, job, lambda z: map.jet(z)[0], map.near * map.diagonal)


def _check_crossings(polygons: Sequence[Sequence[Complex]]) -> None:
    """Refuse polygons (rings, the outer one first) that cross themselves so often that repairing them takes long.

    Raises:
        InputError: they do.
    """
    count = 0
    for rings in polygons:
        if not as_polygon(rings).is_valid:
            count = crossings.check([np.append(ring, ring[0]) for ring in rings if ring.size], before=count)


def carry_geometry(
    steps: Sequence[Saved],
    path: str,
    output: str,
    *,
    columns: str | None = None,
    pixel_size: float | None = None,
    unit: str | None = None,
    max_line_error: float | None = None,
    unmapped: str = "drop",
    report: str | None = None,
    force: bool = False,
    tell: Callable[[str], None] = lambda note: None,
) -> dict[str, int]:
    """Write the points, lines and polygons of a file carried through maps, with all other contents unchanged.

    Args:
        steps: the maps, which are applied one after another.
        path: the file to read.
        output: the file to write, in the same format.
        columns, pixel_size, unit, max_line_error, unmapped, report: see `options.ApplyOptions`.
        force: whether an existing file may be replaced.
        tell: called with each note.

    Returns:
        The numbers of points, lines and polygons that were written, and how many others lay outside or were cut.

    Raises:
        InputError: a file is invalid, or something lies outside and `unmapped` is "refuse".
    """
    suffix = formats.suffix_of(path_of(path))
    if output != "-" and document.READERS.get(formats.suffix_of(output)) != document.READERS[suffix]:
        raise InputError(f"{output}: must have the format of the input; choose a name that ends in {suffix}")
    formats.check_report(report)
    names = [name for name in (output, report) if name not in (None, "-")]
    files.check_outputs(names, [path_of(path), *(step.name for step in steps)], force=force)
    if output == report == "-":
        raise InputError("-: only one output can be stdout; name a file for the others")
    content = document.read(path, columns)
    if output == "-" and content.is_database:
        raise InputError(f"-: {suffix} is written to a file; name one")
    if output != "-" and formats.suffix_of(output) != suffix:
        with naming(path):
            content.convert(formats.suffix_of(output))
    companions = content.companions(output)
    files.check_outputs(list(companions), [path_of(path)], force=force)
    if unmapped == "keep" and not content.keeps:
        raise InputError(
            f"--unmapped keep: {suffix} files cannot contain entries without a position; use drop or refuse"
        )
    if max_line_error is not None and not (content.geometry.lines or content.geometry.polygons):
        raise InputError(f"--max-line-error: has no effect, because {path} contains no lines and no polygons")
    with naming(path):
        _check_crossings(content.geometry.polygons)
    to_source, from_target = _scales(steps, pixel_size, unit)
    if content.unit and pixel_size is None and unit is None:
        tell(
            f"{path}: coordinates in {content.unit} are taken as units of {steps[0].name}; --pixel-size or --unit "
            "converts them"
        )
    geometry = content.geometry
    images, counted = steps[0].carried(geometry.scaled(to_source), content.upward, max_line_error)
    for step in steps[1:]:
        images, further_counts = _carried_again(images, step, content.upward, max_line_error)
        counted += further_counts
    images = replace(images.scaled(from_target), keep=unmapped == "keep")
    nonzero_counts = {name: count for name, count in counted.items() if count}
    losses = ", ".join(f"{count} {name}" for name, count in nonzero_counts.items() if "repaired" not in name)
    if losses and unmapped == "refuse":
        raise InputError(f"{path}: {losses} of the map's domain; use --unmapped drop to leave them out")
    for note in (*content.notes, *(f"{count} {name}" for name, count in nonzero_counts.items())):
        tell(f"{path}: {note}")
    counts = {
        "points": len(geometry.points),
        "lines": len(geometry.lines),
        "polygons": len(geometry.polygons),
    }
    placeless = int(np.isnan(geometry.points).sum())
    if placeless:
        remedy = "kept" if images.keep else "left out; --unmapped keep keeps them"
        tell(f"{path}: {placeless} without a position, {remedy}")
    counts |= {name.replace(" ", "_"): count for name, count in counted.items()}
    written = images.counts
    maps = {"map": steps[0].name} if len(steps) == 1 else {"maps": [step.name for step in steps]}
    with ExitStack() as stack:
        result_file = stack.enter_context(files.writing(output, force=force, suffix=suffix))
        if companions:
            folder = stack.enter_context(files.scratch())
            content.write(images, folder / Path(output).name)
            result_file.write_bytes((folder / Path(output).name).read_bytes())
            for name in companions:
                written_file = folder / Path(name).name
                if written_file.is_file():
                    place = stack.enter_context(files.writing(name, force=force, suffix=Path(name).suffix))
                    place.write_bytes(written_file.read_bytes())
        else:
            content.write(images, result_file)
        if report:
            entries = {"schema": SCHEMA, "input": path, **maps, **counts, "written": written}
            write_report(entries, report, stack, force=force)
    return counts | written


def _scales(steps: Sequence[Saved], pixel_size: float | None, unit: str | None) -> tuple[float, float]:
    """Return the factors from a file's units to those of the first map's source, and from the last target's back.

    Raises:
        InputError: both options are given, or the length of a map's unit is not known.
    """
    if pixel_size is not None and unit is not None:
        raise InputError("--pixel-size, --unit: use one of the two")
    if pixel_size is not None:
        return 1 / pixel_size, pixel_size
    if unit is None:
        return 1.0, 1.0
    lengths = list[float]()
    for plane in (steps[0].planes[0], steps[-1].planes[1]):
        if plane.millimetres is None:
            raise InputError(
                f"--unit {unit}: {plane.name or steps[0].name} does not state the length of its unit; use --pixel-size"
            )
        lengths.append(plane.millimetres)
    return MILLIMETRES[unit] / lengths[0], lengths[1] / MILLIMETRES[unit]


def _carried_again(
    images: Images, step: Saved, upward: bool, max_line_error: float | None
) -> tuple[Images, Counter[str]]:
    """Return images under the next map of a chain, each piece with the line or polygon that it belongs to."""
    pieces = [piece for line in images.lines for piece in line]
    parts = [part for polygon in images.polygons for part in polygon]
    carried, counts = step.carried(Geometry(images.points, pieces, parts), upward, max_line_error)
    lines, polygons = iter(carried.lines), iter(carried.polygons)
    joined_lines = [[piece for _ in line for piece in next(lines)] for line in images.lines]
    joined_polygons = [[part for _ in polygon for part in next(polygons)] for polygon in images.polygons]
    return replace(carried, lines=joined_lines, polygons=joined_polygons), counts


def _foot(plane: SavedPlane) -> complex:
    """Return the point from which formats with y pointing up measure y, if the shape's file has y down: the lower edge
    of its canvas.
    """
    return complex(0, plane.box[0].imag) if plane.down else 0


def _shape(name: str, plane: SavedPlane) -> Shape:
    assert plane.outline is not None
    holes = tuple(plane.holes)
    outline = Curve(plane.outline)
    path = Path(name)
    return Shape(
        *(plane.name or name, path, outline, plane.box, plane.down, {}, {}),
        holes=holes,
        millimetres=plane.millimetres,
        unit=plane.unit,
        georeference=plane.georeference,
    )


def _job(stored: MapFile) -> dict[str, Any]:
    """Return the options of the saved job that affect pictures made with its map.

    The file may come from an untrusted source, so only these are used. Others, such as names of output files and limits
    on memory, are taken from the command alone.

    Raises:
        InputError: one of them has an invalid value.
    """
    saved = stored.about.get("job", {})
    job = {name: saved[name] for name in PICTURE_OPTIONS if name in saved}
    # the method determines which holes take part in the map
    job["method"] = "balanced" if isinstance(stored.map, TriangulatedMap) else "conformal"
    try:
        Job(source="-", target="-", **job)
    except (JobError, TypeError) as error:
        raise InputError(f"about: the options of its job are invalid ({error})") from None
    return job
