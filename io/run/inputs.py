"""The files that a job reads, and those that they name in turn: material libraries, pictures, glTF's buffers."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from copy import copy
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import InputError
from .. import files, formats, references
from ..meshes import mesh_files
from ..meshes.mesh_format import MeshFormat
from ..options import FREE
from ..point_syntax import Place, vertex_of
from ..shapes import shape
from ..shapes.shape import Shape
from ..spec import Spec
from .job import Described, Job, is_mesh

if TYPE_CHECKING:
    from ...surfaces.inserted import Opening
    from ..shapes.listing import ConstraintsFile


class Files:
    """The files of any job, and what they name."""

    def __init__(self, job: Described, *, keep: bool = True) -> None:
        """Nothing is opened yet; `keep` says whether shapes will be made of what is read."""
        self.job = job
        self._most_kept = job.max_faces if keep else -1
        self._meshes: dict[Path, MeshFormat] = {}

    def _mesh(self, path: Path) -> MeshFormat:
        """Return a mesh file, opened once."""
        if path not in self._meshes:
            self._meshes[path] = mesh_files.open_mesh(path, self._most_kept)
        return self._meshes[path]

    @cached_property
    def named(self) -> tuple[str, ...]:
        """Every file that the job reads, those that its meshes name included; only those that exist."""
        found = expand_tiles(self.job.inputs)
        with references.outside(self.job.allow_outside):
            for name in self.job.inputs:
                folder = Path(name).parent
                named = [
                    path for path in self._named(Path(name)) if references.may_be_read(Path(path), folder)
                ]
                found += [path for path in expand_tiles(named) if os.path.isfile(path)]
        return tuple(dict.fromkeys(found))

    def _named(self, path: Path) -> list[str]:
        try:
            return self._mesh(path).files_named() if formats.of(path).mesh else []
        except (OSError, InputError):
            return []


class Inputs(Files):
    """What a job reads; a mesh file is opened once, whatever is asked of it."""

    job: Job

    def of_job(self, job: Job) -> Inputs:
        """Return the same files for a job that differs in values that name no file to read."""
        found = copy(self)
        found.job = job
        vars(found).pop("_seams", None)  # which depend on its pins
        return found

    def is_mesh(self, text: str) -> bool:
        """Return whether a spec names a mesh: by its suffix, and by what is to become of it (`MeshFormat.is_mesh`).

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
        """What the constraints file holds, if there is one.

        Raises:
            InputError: it is wrong.
        """
        if not self.job.constraints:
            return None
        from ..shapes import listing

        return listing.read(self.job.constraints)

    def _seam(self, target: bool) -> list[Place]:
        """Return the pins of the source or the target through which closed meshes on both sides are cut, in their
        order.
        """
        return [pair[target] for pair in self._seams[0]]

    @property
    def _cut_pair(self) -> tuple[str, str] | None:
        """The specs of both sides, where these are meshes in space that may be cut."""
        job = self.job
        if job.no_cut or not job.target or job.plane == "uv":
            return None
        pair = job.source, job.target
        return pair if all(map(self.is_mesh, pair)) else None

    def same_vertices(self) -> list[tuple[Place, Place]]:
        """Pins of two closed meshes of the same connectivity, where none are given.

        Raises:
            InputError: a mesh cannot be read.
        """
        job, pair = self.job, self._cut_pair
        if pair is None or job.pin or job.constraints or job.start or job.several:
            return []
        from ..shapes.seam_order import same_vertices

        return same_vertices(pair, (self._sound_mesh(pair[0]), self._sound_mesh(pair[1])))

    @cached_property
    def _seams(self) -> tuple[list[tuple[Place, Place]], Opening | None]:
        """The pins through which closed meshes on both sides are cut; none unless there are two, all on the meshes. And
        where the source is cut, if not along geodesics."""
        job, pair = self.job, self._cut_pair
        if pair is None:
            return [], None
        more = [(pin.source, pin.target) for pin in self.listed.all_pins] if self.listed else []
        pins = [*((start, end) for start, end, *_ in job.pin), *more]
        flat = any(vertex_of(place) is None and len(place) == 2 for pair in pins for place in pair)
        if flat or len(pins) < 2:
            return [], None
        from ..shapes.seam_order import seam_order

        order, opening = seam_order(pair, (self._sound_mesh(pair[0]), self._sound_mesh(pair[1])), pins)
        return [pins[k] for k in order], opening

    def check_trace(self) -> None:
        """Refuse to trace where there is no picture.

        Raises:
            InputError: --trace is given, and the shapes are not pictures.
        """
        specs = [spec for spec in (self.job.source, self.job.target) if spec]
        if self.job.trace != "auto" and not any(formats.of(Spec.of(spec).path).picture for spec in specs):
            raise InputError(
                f"--trace {self.job.trace}: only works for pictures, and {specs[0]} is not a picture"
            )

    def is_layout(self, text: str) -> bool:
        """Return whether a spec names a mesh in the plane of its texture coordinates, as far as its form says so.

        Raises:
            InputError: the file is missing.
        """
        from ..meshes.mesh_files import names_layout

        return self.is_mesh(text) and (self.job.plane == "uv" or names_layout(text))

    def shape(self, text: str, *, target: bool = False, source: Shape | None = None) -> Shape:
        """Return a shape from a drawing, a picture or a mesh.

        Args:
            text: its spec.
            target: which of the two, for a mesh's proportions.
            source: of a target what goes onto it: holes are kept for those of the source alone where a mesh is cut.

        Raises:
            InputError: it cannot be read, is not a domain, or is larger than --max-faces or --max-pixels allow.
        """
        if not self.is_mesh(text):
            meshes = [spec for spec in (self.job.source, self.job.target) if spec and self.is_mesh(spec)]
            return shape.read(
                text,
                max_segments=self.job.max_segments,
                trace=self.job.trace,
                whole=self.job.whole_drawings and not meshes,
            )
        from ..shapes import mesh_reading

        return mesh_reading.read(
            text,
            opened=self._sound_mesh(text),
            pins=self._seam(target),
            split=not target,
            opening=None if target else self._seams[1],
            united=self._names_regions(target),
            **self._lying(target, source),
        )

    def whole_target(self, text: str, source: Shape) -> Shape | None:
        """Return all pieces of a mesh, packed inside the source; None where one piece is the target.

        Raises:
            InputError: as for `shape`; the pieces do not fit into the source.
        """
        job = self.job
        one = (job.pin, job.constraints, job.rigid, job.rigid_target, job.importance, job.size_map, job.start)
        if job.parts == "largest" or any(one) or job.subdivide_rim or source.is_mesh:
            return None
        if not self.is_mesh(text) or self.is_layout(text):
            return None
        from ...curve import polygon_of
        from ..shapes import mesh_reading

        holes = () if job.holes == "fill" else source.holes
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
        )

    def _names_regions(self, target: bool) -> bool:
        """Return whether rigid regions of the source, or of the target, are called by their names in its file."""
        from ..shapes.regions import MARK

        given = (
            self.job.rigid_target
            if target
            else (*self.job.rigid, *(self.listed.rigid if self.listed else ()))
        )
        return any(isinstance(each, str) and each.startswith(MARK) for each in given)

    def shapes(
        self, text: str, most: int, *, target: bool = False, source: Shape | None = None
    ) -> tuple[Sequence[Shape], list[str]]:
        """Return all shapes of a file for --parts all, the `most` largest first, and what is to be said of the others.

        Raises:
            InputError: as for `shape`, or there is none.
        """
        if not self.is_mesh(text):
            found: Sequence[Shape] = shape.read_all(text, trace=self.job.trace)
            beyond = max(len(found) - most, 0)
        else:
            from ..shapes import mesh_reading

            found, beyond = mesh_reading.read_all(
                text, most, opened=self._sound_mesh(text), **self._lying(target, source)
            )
        notes = (
            [f"{text}: ignored {beyond} shapes, because only the {most} largest are mapped"] if beyond else []
        )
        return found[:most], notes

    def _sound_mesh(self, text: str) -> MeshFormat:
        """Return the file of a mesh.

        Raises:
            InputError: it cannot be read, or the mesh is larger than --max-faces allows.
        """
        opened = self._mesh(Spec.of(text).path)
        opened.check_size(self.job.max_faces)
        return opened

    def _lying(self, target: bool, source: Shape | None) -> dict[str, Any]:
        """Return how meshes are flattened: cut or not, flat or by their coordinates, and the proportions of pictures
        there.
        """
        job = self.job
        aspect: Any = None
        if target and job.size and len(job.size) == 2 and FREE not in job.size:
            aspect = job.size[0] / job.size[1]
        elif target or not job.texture:
            aspect = _first_proportions
        else:
            aspect = _first_proportions([Path(job.texture)])
        joins = source is not None and not source.holes
        # what is mapped by landmarks, or onto another mesh, keeps its boundary unless it is to be cut
        bound = job.pin or job.constraints or job.start or self._both_meshes
        return {
            "cut": not job.no_cut,
            "cut_open": job.cut_open or not bound,
            "layout": job.plane == "uv",
            "aspect": aspect,
            "joins": joins,
        }

    @property
    def _both_meshes(self) -> bool:
        job = self.job
        return bool(job.target) and all(map(self.is_mesh, (job.source, job.target or "")))

    def sha256(self, name: str) -> str:
        """Return the hash of an input; of a mesh as it was read."""
        opened = self._meshes.get(Path(name))
        return opened.sha256 if opened else files.sha256(name)


def _first_proportions(pictures: Sequence[Path | bytes]) -> float | None:
    from ..pictures.image_files import proportions

    first = next(iter(expand_tiles(pictures[:1])), None)
    return proportions(first) if first else None


def expand_tiles(names: Iterable[Path | bytes | str]) -> list[Any]:
    """Return names of pictures, those of the tiles that there are in the place of one that stands for all of them."""
    from ..pictures.tiles import files_of, is_pattern

    return [each for name in names for each in (files_of(str(name)) if is_pattern(name) else [name])]
