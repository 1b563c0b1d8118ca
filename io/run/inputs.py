"""The files that a job reads, and those that they name in turn: material libraries, pictures, glTF's buffers."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import InputError
from .. import files, formats, limits, references
from ..meshes import material_library, size_limits
from ..meshes.obj import Obj
from ..meshes.obj_source import ObjSource
from ..options import FREE
from ..point_syntax import Place, vertex_of
from ..shapes import shape
from ..shapes.shape import Shape
from ..spec import Spec
from .job import Described, Job, is_mesh

if TYPE_CHECKING:
    from ...surfaces.inserted import Opening
    from ..shapes.listing import Listed


class Files:
    """The files of any job, and what they name."""

    def __init__(self, job: Described, *, keep: bool = True) -> None:
        """Nothing is opened yet; `keep` says whether shapes will be made of what is read."""
        self.job = job
        self._keep = job.max_faces if keep else -1
        self._objs: dict[Path, ObjSource] = {}

    def _obj(self, path: Path) -> ObjSource:
        if path not in self._objs:
            self._objs[path] = ObjSource(path, self._keep)
        return self._objs[path]

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
        suffix = formats.suffix_of(path)
        try:
            if suffix == ".obj":
                libraries = [_path_beside(path, line) for line in self._obj(path).libraries]
                libraries = [name for name in libraries if references.may_be_read(Path(name), path.parent)]
                return [name for library in libraries for name in (library, *_pictures(Path(library)))]
            return _of_gltf(path) if suffix == ".gltf" else []
        except (OSError, files.InputError):
            return []


class Inputs(Files):
    """What a job reads; an OBJ file is opened once, whatever is asked of it."""

    job: Job

    def is_mesh(self, text: str) -> bool:
        """Whether a spec names a mesh: by its suffix; an OBJ of one face as a target whose coordinates are wanted.

        Raises:
            InputError: the file is missing.
        """
        path = Spec.of(text).path
        if formats.suffix_of(path) != ".obj":
            return formats.of(path).mesh
        wanted = text == self.job.target and (self.job.bake or any(map(is_mesh, self.job.output)))
        return self._obj(path).faces > (0 if wanted else 1)

    @cached_property
    def listed(self) -> Listed | None:
        """What the constraints file holds, if there is one.

        Raises:
            InputError: it is wrong.
        """
        if not self.job.constraints:
            return None
        from ..shapes import listing

        return listing.read(self.job.constraints)

    def _seam(self, target: bool) -> list[Place]:
        """The pins of the source or the target through which closed meshes on both sides are cut, in their order."""
        return [pair[target] for pair in self._seams[0]]

    @property
    def _cut_pair(self) -> tuple[str, str] | None:
        """The specs of both sides, where these are meshes in space that may be cut."""
        job = self.job
        if not job.cut_open or not job.target or job.plane == "uv":
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

        return same_vertices(pair, (self._whole(pair[0]), self._whole(pair[1])))

    @cached_property
    def _seams(self) -> tuple[list[tuple[Place, Place]], Opening | None]:
        """The pins through which closed meshes on both sides are cut; none unless there are two, all on the meshes. And
        where the source is cut, if not along geodesics."""
        job, pair = self.job, self._cut_pair
        if pair is None:
            return [], None
        more = [(pin.source, pin.target) for pin in self.listed.all_pins] if self.listed else []
        pins = [*job.pin, *more]
        flat = any(vertex_of(place) is None and len(place) == 2 for pair in pins for place in pair)
        if flat or len(pins) < 2:
            return [], None
        from ..shapes.seam_order import seam_order

        order, opening = seam_order(pair, (self._whole(pair[0]), self._whole(pair[1])), pins)
        return [pins[k] for k in order], opening

    def check_trace(self) -> None:
        """Refuse to trace where there is no picture.

        Raises:
            InputError: --trace is given, and the shapes are no pictures.
        """
        specs = [spec for spec in (self.job.source, self.job.target) if spec]
        if self.job.trace != "auto" and not any(formats.of(Spec.of(spec).path).picture for spec in specs):
            raise InputError(f"--trace {self.job.trace}: for shapes in pictures, and {specs[0]} is none")

    def is_layout(self, text: str) -> bool:
        """Whether a spec names a mesh in the plane of its texture coordinates, as far as its form says so.

        Raises:
            InputError: the file is missing.
        """
        from ..meshes.mesh_files import names_layout

        return self.is_mesh(text) and (self.job.plane == "uv" or names_layout(text))

    def shape(self, text: str, *, target: bool = False, source: Shape | None = None) -> Shape:
        """A shape from a drawing, a picture or a mesh.

        Args:
            text: its spec.
            target: which of the two, for a mesh's proportions.
            source: of a target what goes onto it: holes are kept for those of the source alone where a mesh is cut.

        Raises:
            InputError: it cannot be read, is no domain, or is larger than --max-faces or --max-pixels allow.
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
            whole=self._whole(text),
            pins=self._seam(target),
            split=not target,
            opening=None if target else self._seams[1],
            united=self._names_regions(target),
            **self._lying(target, source),
        )

    def _names_regions(self, target: bool) -> bool:
        """Whether rigid regions of the source, or of the target, are called by their names in its file."""
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
        """All shapes of a file for --parts all, the `most` largest first, and what is to be said of the others.

        Raises:
            InputError: as for `shape`, or there is none.
        """
        if not self.is_mesh(text):
            found: Sequence[Shape] = shape.read_all(text, trace=self.job.trace)
            beyond = max(len(found) - most, 0)
        else:
            from ..shapes import mesh_reading

            found, beyond = mesh_reading.read_all(
                text, most, whole=self._whole(text), **self._lying(target, source)
            )
        notes = [f"{text}: left out {beyond} shapes beyond the {most} largest"] if beyond else []
        return found[:most], notes

    def _whole(self, text: str) -> Obj | None:
        """The content of an OBJ.

        Raises:
            InputError: it cannot be read, or a mesh is larger than --max-faces allows.
        """
        path = Spec.of(text).path
        if formats.suffix_of(path) != ".obj":
            size_limits.faces(path, self.job.max_faces)
            return None
        size_limits.refuse(path, self._obj(path).faces, self.job.max_faces)
        return self._obj(path).obj

    def _lying(self, target: bool, source: Shape | None) -> dict[str, Any]:
        """How meshes are laid out: cut or not, flat or by their coordinates, and the proportions of pictures there."""
        job = self.job
        aspect: Any = None
        if target and job.size and len(job.size) == 2 and FREE not in job.size:
            aspect = job.size[0] / job.size[1]
        elif target or not job.texture:
            aspect = _first_proportions
        else:
            aspect = _first_proportions([Path(job.texture)])
        joins = source is not None and not source.holes
        return {"cut": job.cut_open, "layout": job.plane == "uv", "aspect": aspect, "joins": joins}

    def sha256(self, name: str) -> str:
        """The hash of an input: of an OBJ that was read, as it was then."""
        source = self._objs.get(Path(name))
        return source.sha256 if source else files.sha256(name)


def _first_proportions(pictures: Sequence[Path | bytes]) -> float | None:
    from ..pictures.image_files import proportions

    first = next(iter(expand_tiles(pictures[:1])), None)
    return proportions(first) if first else None


def expand_tiles(names: Iterable[Path | bytes | str]) -> list[Any]:
    """Names of pictures, those of the tiles that there are in the place of one that stands for all of them."""
    from ..pictures.tiles import files_of, is_pattern

    return [each for name in names for each in (files_of(str(name)) if is_pattern(name) else [name])]


def _pictures(library: Path) -> list[str]:
    """The pictures that a material library names."""
    if not os.path.isfile(library) or library.stat().st_size > limits.LIBRARY_BYTES:
        return []
    lines = library.read_bytes().decode("utf-8", "surrogateescape").splitlines()
    return [str(library.parent / name) for name in map(material_library.picture_named, lines) if name]


def _of_gltf(path: Path) -> list[str]:
    if path.stat().st_size > limits.SCENE_BYTES:
        return []
    try:
        scene = json.loads(path.read_bytes())
        names = [item["uri"] for key in ("buffers", "images") for item in scene.get(key, []) if "uri" in item]
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return []
    return [
        str(path.parent / name) for name in names if isinstance(name, str) and not name.startswith("data:")
    ]


def _path_beside(path: Path, name: bytes) -> str:
    return str(path.parent / name.strip().replace(b"\0", b"").decode("utf-8", "surrogateescape"))
