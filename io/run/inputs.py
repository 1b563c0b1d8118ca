"""The files that a job reads, and files that these refer to: material libraries, pictures, and buffers of glTF."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from copy import copy
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...deadline import TimeUp
from ...errors import InputError
from .. import files, formats, references
from ..meshes import mesh_files
from ..meshes.mesh_format import MeshFormat
from ..options import FREE_SIDE
from ..point_syntax import Place, vertex_of
from ..shapes import shape
from ..shapes.shape import Shape
from ..spec import Spec
from .job import Described, Job, is_mesh

if TYPE_CHECKING:
    from ...surfaces.inserted import Opening
    from ..shapes.listing import ConstraintsFile
    from ..shapes.mesh_reading import Aspect, Cutting


class Files:
    """The input files of any job, and the files that they refer to."""

    def __init__(self, job: Described, *, keep: bool = True) -> None:
        """Prepare to read the files of a job, without opening any; `keep` if shapes will be made from them."""
        self.job = job
        self._most_kept = job.max_faces if keep else -1
        self._meshes: dict[Path, MeshFormat] = {}

    def _mesh(self, path: Path) -> MeshFormat:
        """Return a mesh file; it is opened once."""
        if path not in self._meshes:
            opened = self._meshes[path] = mesh_files.open_mesh(path, self._most_kept)
            target = getattr(self.job, "target", None)
            if target and path == Spec.of(target).path:
                opened.halvings = getattr(self.job, "subdivide", 0)
        return self._meshes[path]

    @cached_property
    def named(self) -> tuple[str, ...]:
        """Every existing file that the job reads, including those that its meshes refer to."""
        paths = expand_tiles(self.job.inputs)
        with references.outside(self.job.allow_outside):
            for name in self.job.inputs:
                folder = Path(name).parent
                referenced = [
                    path for path in self._named(Path(name)) if references.may_be_read(Path(path), folder)
                ]
                paths += [path for path in expand_tiles(referenced) if os.path.isfile(path)]
        return tuple(dict.fromkeys(paths))

    def _named(self, path: Path) -> list[str]:
        try:
            return self._mesh(path).files_named() if formats.of(path).mesh else []
        except (OSError, InputError):
            return []


class Inputs(Files):
    """The inputs of a job; each mesh file is opened once, and each planar shape is read once."""

    job: Job

    def __init__(self, job: Job, *, keep: bool = True) -> None:
        """Prepare to read the files of a job, see `Files`."""
        super().__init__(job, keep=keep)
        self._shapes: dict[tuple[object, ...], Shape] = {}

    def of_job(self, job: Job) -> Inputs:
        """Return the inputs of a job that differs only in values that name no input file."""
        inputs = copy(self)
        inputs.job = job
        vars(inputs).pop("_seams", None)  # they depend on the pins
        return inputs

    def is_mesh(self, text: str) -> bool:
        """Return whether a spec names a mesh, by its suffix and by how it is used (see `MeshFormat.is_mesh`).

        Raises:
            InputError: the file is missing.
        """
        path = Spec.of(text).path
        if not formats.of(path).mesh:
            return False
        gets_uv = text == self.job.target and (self.job.bake or any(map(is_mesh, self.job.output)))
        return self._mesh(path).is_mesh(gets_uv=gets_uv)

    @cached_property
    def listed(self) -> ConstraintsFile | None:
        """The contents of the constraints file and of the files of landmarks, if there are any.

        Raises:
            InputError: a file is invalid.
        """
        job = self.job
        if not job.constraints and not job.source_landmarks:
            return None
        from ..shapes import listing

        listed = listing.read(job.constraints) if job.constraints else listing.ConstraintsFile()
        if job.source_landmarks and job.target_landmarks:
            from .point_files import read_pairs

            listed.add_pairs(read_pairs(job.source_landmarks, job.target_landmarks))
        return listed

    def _seam(self, target: bool) -> list[Place]:
        """Return the pins of one side, in order, through which closed meshes on both sides are cut."""
        return [pair[target] for pair in self._seams[0]]

    @property
    def _cut_pair(self) -> tuple[str, str] | None:
        """The specs of both sides if both are meshes in space that may be cut."""
        job = self.job
        if job.no_cut or not job.target or job.plane == "uv":
            return None
        pair = job.source, job.target
        return pair if all(map(self.is_mesh, pair)) else None

    def same_vertices(self) -> list[tuple[Place, Place]]:
        """Return pins for two closed meshes with the same connectivity, if no pins are given.

        Raises:
            InputError: a mesh cannot be read.
        """
        job, pair = self.job, self._cut_pair
        if pair is None or job.has_pins or job.start or job.several:
            return []
        from ..shapes.seam_order import same_vertices

        return same_vertices(pair, (self._sound_mesh(pair[0]), self._sound_mesh(pair[1])))

    @cached_property
    def _seams(self) -> tuple[list[tuple[Place, Place]], Opening | None]:
        """The pins through which closed meshes on both sides are cut, and the cut of the source unless it follows
        geodesics.

        There are none unless at least two pins are given, and all of them lie on the meshes.
        """
        job, pair = self.job, self._cut_pair
        if pair is None:
            return [], None
        listed_pins = [(pin.source, pin.target) for pin in self.listed.all_pins] if self.listed else []
        pins = [*((start, end) for start, end, *_ in job.pin), *listed_pins]
        flat = any(vertex_of(place) is None and len(place) == 2 for pair in pins for place in pair)
        if flat or len(pins) < 2:
            return [], None
        from ..shapes.seam_order import seam_order

        order, opening = seam_order(pair, (self._sound_mesh(pair[0]), self._sound_mesh(pair[1])), pins)
        return [pins[k] for k in order], opening

    def check_trace(self) -> None:
        """Check that --trace is only used with pictures.

        Raises:
            InputError: --trace is given, but neither shape is a picture.
        """
        specs = [spec for spec in (self.job.source, self.job.target) if spec]
        if self.job.trace != "auto" and not any(formats.of(Spec.of(spec).path).picture for spec in specs):
            raise InputError(
                f"--trace {self.job.trace}: only works for pictures, and {specs[0]} is not a picture"
            )

    def is_layout(self, text: str) -> bool:
        """Return whether a spec selects a mesh in the plane of its texture coordinates, as far as the spec itself
        determines it.

        Raises:
            InputError: the file is missing.
        """
        from ..meshes.mesh_files import names_layout

        return self.is_mesh(text) and (self.job.plane == "uv" or names_layout(text))

    def drawing(self, text: str) -> Shape:
        """Read everything that a planar drawing paints as one shape.

        Raises:
            InputError: as in `shape`.
        """
        return shape.read(text, max_segments=self.job.max_segments, trace=self.job.trace, whole=True)

    def shape(self, text: str, *, target: bool = False, source: Shape | None = None) -> Shape:
        """Read a shape from a drawing, a picture or a mesh.

        Args:
            text: its spec.
            target: whether it is the target; this determines the proportions of a mesh.
            source: the shape mapped onto a target; if a mesh has to be cut, its holes are kept only if the source has
                holes.

        Raises:
            InputError: it cannot be read, is not a valid shape, or exceeds --max-faces or --max-pixels.
        """
        if not self.is_mesh(text):
            meshes = [spec for spec in (self.job.source, self.job.target) if spec and self.is_mesh(spec)]
            whole = self.job.whole_drawings and not meshes
            # Both sides may name the same file, but are different shapes.
            key = text, target, self.job.max_segments, self.job.trace, whole
            if key not in self._shapes:
                self._shapes[key] = shape.read(
                    text, max_segments=self.job.max_segments, trace=self.job.trace, whole=whole
                )
            return self._shapes[key]
        from ..shapes import mesh_reading

        return mesh_reading.read(
            text,
            cutting=self._cutting(source)._replace(
                pins=self._seam(target), split=not target, opening=None if target else self._seams[1]
            ),
            opened=self._sound_mesh(text),
            layout=self.job.plane == "uv",
            aspect=self._aspect(target),
            united=self._names_regions(target),
            purpose="solver" if target and self._hides_plane else "domain",
        )

    def target(self, text: str, source: Shape, *, fills_holes: bool) -> Shape:
        """Return the target: a shape, or all pieces of a mesh, packed inside the source.

        A mesh of one piece is packed, too, if it can only be flattened in parts.

        Args:
            text: its spec.
            source: the source.
            fills_holes: whether pieces may lie in holes of the source.

        Raises:
            InputError: as in `shape`, or the pieces do not fit into the source.
        """
        if whole := self._whole_target(text, source, fills_holes, single=False):
            return whole
        try:
            return self.shape(text, target=True, source=source)
        except TimeUp:
            raise
        except InputError:
            if whole := self._whole_target(text, source, fills_holes, single=True):
                return whole
            raise

    def layout_inside(self, text: str, source: Shape) -> Shape | None:
        """Return a mesh, packed inside the source; None where options ask for the map of one outline.

        Raises:
            InputError: as in `target`.
        """
        return self._whole_target(text, source, fills_holes=False, single=True)

    def _whole_target(self, text: str, source: Shape, fills_holes: bool, *, single: bool) -> Shape | None:
        """Return all pieces of a mesh, packed inside the source; None if only one piece is the target.

        Args:
            text: the spec of the mesh.
            source: the shape around the pieces.
            fills_holes: whether pieces may lie in holes of the source.
            single: whether a mesh of one piece is packed, too.

        Raises:
            InputError: as in `shape`, or the pieces do not fit into the source.
        """
        job = self.job
        is_for_one_shape = any(
            (job.has_pins, job.rigid, job.rigid_target, job.importance, job.size_map, job.start)
        )
        if job.parts == "largest" or is_for_one_shape or job.subdivide_rim or source.is_mesh:
            return None
        if not self.is_mesh(text) or self.is_layout(text):
            return None
        from ...curve import polygon_of
        from ..shapes import mesh_reading

        holes = () if fills_holes else source.holes
        if source.drawing is not None and not source.drawing.is_one_part and job.whole_drawings:
            region = source.drawing.painted
        else:
            region = polygon_of(source.curve.z, *holes)
        return mesh_reading.read_whole(
            text,
            cut=not job.no_cut,
            opened=self._sound_mesh(text),
            method="balanced" if job.exact else "conformal",
            region=region,
            box=source.box,
            single=single,
            charts="auto",
        )

    def _names_regions(self, target: bool) -> bool:
        """Return whether rigid regions of the source, or of the target, are given by names in its file."""
        from ..shapes.regions import MARK

        regions = (
            self.job.rigid_target
            if target
            else (*self.job.rigid, *(self.listed.rigid if self.listed else ()))
        )
        return any(isinstance(region, str) and region.startswith(MARK) for region in regions)

    def piece_count(self, text: str) -> int | None:
        """Return the number of pieces of a mesh with an area; None if its specification selects one.

        Raises:
            InputError: it cannot be read, or an element is invalid.
        """
        from ...meshes.disk_patch import Joined

        meshes = mesh_files.read_all(text, self._sound_mesh(text))
        if meshes[0].numbered or meshes[0].chart:
            return None
        return sum(int(np.count_nonzero(Joined.of(file.mesh).areas)) for file in meshes)

    def shapes(
        self, text: str, most: int, *, target: bool = False, source: Shape | None = None
    ) -> tuple[Sequence[Shape], list[str]]:
        """Read the shapes of a file for --parts all: the `most` largest, and notes on the others.

        Raises:
            InputError: as in `shape`, or there are no shapes.
        """
        if not self.is_mesh(text):
            shapes: Sequence[Shape] = shape.read_all(text, trace=self.job.trace)
            beyond = max(len(shapes) - most, 0)
        else:
            from ..shapes import mesh_reading

            shapes, beyond = mesh_reading.read_all(
                text,
                most,
                cutting=self._cutting(source),
                opened=self._sound_mesh(text),
                layout=self.job.plane == "uv",
                aspect=self._aspect(target),
            )
        notes = (
            [f"{text}: ignored {beyond} shapes, because only the {most} largest are mapped"] if beyond else []
        )
        return shapes[:most], notes

    def _sound_mesh(self, text: str) -> MeshFormat:
        """Return the open file of a mesh after checking its size.

        Raises:
            InputError: it cannot be read, or the mesh exceeds --max-faces.
        """
        opened = self._mesh(Spec.of(text).path)
        opened.check_size(self.job.max_faces)
        return opened

    def _cutting(self, source: Shape | None) -> Cutting:
        """Return whether a mesh may be cut, without the places of the cut."""
        from ..shapes.mesh_reading import Cutting

        job = self.job
        # meshes mapped by landmarks, or onto another mesh, keep their boundary unless a cut is requested
        keeps_boundary = job.has_pins or job.start or self._both_meshes
        return Cutting(
            closed=not job.no_cut,
            open=job.cut_open or not keeps_boundary,
            joins=source is not None and not source.holes,
        )

    def _aspect(self, target: bool) -> Aspect | None:
        """Return the proportions of the pictures on a mesh's texture coordinates, or a function that finds them."""
        job = self.job
        if target and job.size and len(job.size) == 2 and FREE_SIDE not in job.size:
            return job.size[0] / job.size[1]
        return _first_proportions if target or not job.texture else _first_proportions([Path(job.texture)])

    @property
    def _hides_plane(self) -> bool:
        """Whether nothing that is given or written lies in the plane of a mesh target."""
        job = self.job
        in_plane = (job.has_pins, job.rigid, job.rigid_target, job.importance, job.size_map, job.start)
        shows_plane = job.stmap or job.plot or not all(map(is_mesh, job.output))
        return job.exact and not self._both_meshes and not any(in_plane) and (job.bake or not shows_plane)

    @property
    def _both_meshes(self) -> bool:
        job = self.job
        return bool(job.target) and all(map(self.is_mesh, (job.source, job.target or "")))

    def sha256(self, name: str) -> str:
        """Return the hash of an input; for a mesh, of the contents that were read."""
        opened = self._meshes.get(Path(name))
        return opened.sha256 if opened else files.sha256(name)


def _first_proportions(pictures: Sequence[Path | bytes]) -> float | None:
    from ..pictures.image_files import proportions

    first = next(iter(expand_tiles(pictures[:1])), None)
    return proportions(first) if first else None


def expand_tiles(names: Iterable[Path | bytes | str]) -> list[Any]:
    """Return names of pictures, with each pattern for tiles (UDIM) replaced by the files that exist."""
    from ..pictures.tiles import files_of, is_pattern

    return [path for name in names for path in (files_of(str(name)) if is_pattern(name) else [name])]
