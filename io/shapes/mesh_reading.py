"""Read meshes as planar shapes, one, or all charts or pieces of a file; and their textures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely

from ...arrays import Box, Index, Real, distinct_rows
from ...curve import Curve
from ...errors import InputError
from ...flattening import convex, flatten
from ...flattening.charts import Atlas
from ...flattening.method import Purpose
from ...flattening.segmentation import Charts
from ...flattening.whole import flatten_each, pack_all
from ...meshes.disk_patch import Joined, disk_patch, sound_piece
from ...meshes.flatten import Flattening
from ...meshes.mesh import Mesh
from ...meshes.packing import into_smallest_square
from ...meshes.patch import Patch
from ...pixels.composed import reflected
from ...plane import bounding_box
from ...surfaces.inserted import Opening, with_vertices
from ..meshes import mesh_files
from ..meshes.mesh_format import MeshFile, MeshFormat
from ..options import TEXELS_BETWEEN_CHARTS
from ..point_syntax import Place, vertex_of
from .marked_seams import with_seams
from .mesh_parts import side_by_side
from .mesh_shape import MeshShape, row_of
from .shape import Shape

if TYPE_CHECKING:
    from ..pictures.image import Image

MOST_NOTES = 6
"""Notes on repairs at most; there may be thousands of pieces."""

Aspect = float | Callable[[list[Path | bytes]], float | None]


class Cutting(NamedTuple):
    """Where surfaces may be cut before they are flattened.

    Attributes:
        closed: whether a closed surface, or one with handles, may be cut open.
        open: whether a surface with boundary may also be cut, if its layout would otherwise vary in scale by orders
            of magnitude.
        joins: whether a cut may run into holes; see `flattening.flatten`.
        pins: vertices and points in space through which to cut a closed surface, in this order; none, or at least two.
        split: whether faces may be split, so that the cut runs through the pins themselves and not through vertices
            beside them.
        opening: a mesh split along its cut, which replaces the paths between pins.
    """

    closed: bool = False
    open: bool = True
    joins: bool = False
    pins: Sequence[Place] = ()
    split: bool = False
    opening: Opening | None = None

    def may_lengthen(self, piece: Patch) -> bool:
        """Return whether the seam of a piece may be lengthened, from nothing where it is open."""
        return self.closed and (self.open or len(piece.seam) > 0)


NO_CUT = Cutting()


def read(
    spec: str,
    *,
    cutting: Cutting = NO_CUT,
    opened: MeshFormat | None = None,
    method: str = "conformal",
    layout: bool = False,
    aspect: Aspect | None = None,
    united: bool = False,
    purpose: Purpose = "domain",
) -> MeshShape:
    """Read and flatten the mesh that `file`, `file#part`, `file#loop` or `file#part#loop` specifies.

    Args:
        spec: a part is an OBJ object, group or material, `piece-2` or `uv-2` (see `mesh_files.read`); a loop is a
            number, 1 being the longest boundary.
        cutting: where the surface may be cut.
        opened: the file, if it was opened before.
        method: of flattening; see `flattening.flatten`.
        layout: whether to use the plane of the texture coordinates if `spec` does not specify.
        aspect: width / height of the pictures on the texture coordinates, or a function that returns it, given the
            pictures that the file refers to; 1 by default.
        united: whether to read all geometries of the mesh, since glTF has one for each material.
        purpose: of the plane; see `flattening.flatten`.

    Raises:
        InputError: in one line, naming the first invalid element.
    """
    file = mesh_files.read(spec, opened, united=united)
    if file.chart or (layout and not file.piece):
        atlas = Atlas.of(file.mesh)
        return read_chart(spec, file, atlas, file.chart or 1, aspect_of(file, aspect))
    seam_points = None
    if cutting.opening is not None:
        file, seam_points = replace(file, mesh=cutting.opening.mesh), cutting.opening.points
    elif cutting.pins:
        seam_points = np.array([point_of(file, spec, place) for place in cutting.pins])
        file = split_at(file, seam_points) if cutting.split else file
    piece = disk_patch(file.mesh, cut=cutting.closed, piece=file.piece or 1, through=seam_points)
    # lengthened seams would differ between two meshes
    grow = seam_points is None and cutting.may_lengthen(piece)
    return flatten_patch(
        spec,
        file,
        piece,
        start=_start_of(piece, seam_points),
        grow=grow,
        method=method,
        joins=cutting.joins,
        purpose=purpose,
    )


def read_whole(
    spec: str,
    *,
    cut: bool,
    opened: MeshFormat | None = None,
    method: str = "balanced",
    margin: int = TEXELS_BETWEEN_CHARTS,
    region: shapely.Geometry | None = None,
    box: Box | None = None,
    single: bool = True,
    charts: Charts = "one",
    max_distortion: float | None = None,
    seams: str | None = None,
    backs: bool = False,
) -> MeshShape | None:
    """Return all pieces of a mesh, flattened and packed at one scale; None if a piece or a chart is selected.

    A mesh that is one chart is not packed: it is rotated into its smallest square if it was cut open.

    Args:
        spec: the mesh; a named part is taken as a whole.
        cut: whether pieces that are closed, or nearly so, may be cut open.
        opened: the file, if it was opened before.
        method: of flattening; see `flattening.flatten`.
        margin: distance between charts, in texels of a texture of 1024.
        region: where to pack upright charts for a picture; None for a square, with rotations.
        box: of pictures in this plane, if there is a region.
        single: whether to return a mesh of one piece, too; otherwise None.
        charts, max_distortion: see `segmentation.charts_of`.
        seams: file of seams, see `marked_seams.with_seams`.
        backs: whether the backs of two-sided sheets get their own charts; otherwise they show what the fronts show.

    Raises:
        InputError: no piece can be flattened, or one is closed and may not be cut.
    """
    files = mesh_files.read_all(spec, opened)
    if files[0].numbered or files[0].chart:
        return None
    if not single and sum(np.count_nonzero(Joined.of(file.mesh).areas) for file in files) < 2:
        return None
    files = with_seams(files, seams)
    pieces, firsts, faults = list[Patch](), list[int](), list[str]()
    first = 0
    for file in files:
        sound, further_faults = _sound_pieces(file, backs)
        pieces += sound
        firsts += [first] * len(sound)
        faults += further_faults
        first += file.mesh.corners.size
    if not pieces:
        none = f"{files[0].mesh.name}: no face has an area; does the file contain only lines?"
        raise InputError(faults[0] if faults else none)
    charts_of_pieces = flatten_each(
        pieces,
        grow=cut,
        method=method,
        charts=charts,
        max_distortion=max_distortion,
        standing=region is not None,
    )
    if len(files) == len(pieces) == len(charts_of_pieces[0]) == 1 and not region:
        return _one_chart(spec, files[0], pieces[0], _compact(charts_of_pieces[0][0]))
    layouts = [layout for layouts in charts_of_pieces for layout in layouts]
    corners = [
        layout.patch.corner + first for layouts, first in zip(charts_of_pieces, firsts) for layout in layouts
    ]
    every = np.logical_or.reduce([file.faces for file in files])
    whole = files[0].part_of(files[0].content, every) if len(files) > 1 else files[0]
    whole = replace(
        whole, mesh=replace(whole.mesh, name=str(spec)), part=None if len(files) > 1 else whole.part
    )
    flat, side = pack_all(whole.mesh, layouts, corners, region, rotates=region is None, margin=margin)
    also = _at_same_places(whole.mesh, flat.patch)
    file, patch, also = _with_faces_of(whole, flat.patch, also)
    flat = replace(flat, patch=patch)
    box = box or (0j, complex(side, side))
    notes = [*_summed(layouts, len(pieces)), *(f"ignored: {fault}" for fault in faults[:MOST_NOTES])]
    if len(faults) > MOST_NOTES:
        notes.append(f"ignored {len(faults) - MOST_NOTES} more pieces that cannot be flattened")
    return _lay_out(spec, file, flat, Curve(flat.flat[flat.loop]), box, notes, packed=True, also=also)


def _sound_pieces(file: MeshFile, backs: bool) -> tuple[list[Patch], list[str]]:
    """Return the pieces of a mesh that can be flattened, not yet cut, and the reasons why others cannot.

    With `backs`, the triangles of `Joined.hidden` are further pieces.

    Raises:
        InputError: an invalid element.
    """
    connected = Joined.of(file.mesh)
    pieces, faults = list[Patch](), list[str]()
    for number in range(1, np.count_nonzero(connected.areas) + 1):
        try:
            pieces.append(sound_piece(connected, number))
        except InputError as error:
            faults.append(
                f"#{_part_name(file, 'piece', number)}: {str(error).removeprefix(f'{file.mesh.name}: ')}"
            )
    while backs and connected.hidden is not None:
        connected = connected.hidden
        for number in range(1, np.count_nonzero(connected.areas) + 1):
            with suppress(InputError):  # it then shows what the front shows
                pieces.append(sound_piece(connected, number))
    return pieces, faults


def _summed(layouts: Sequence[Flattening], pieces: int) -> list[str]:
    """Return notes on all charts of a number of pieces; notes that several have in common are given once."""
    what = f"{pieces} pieces" if pieces > 1 else "1 piece"
    if len(layouts) > pieces:
        what = f"{len(layouts)} charts of {what}"
    notes = [f"{what} are packed side by side at one scale; --parts largest takes one"]
    cut = [layout for layout in layouts if len(layout.patch.seam)]
    if cut:
        edges = sum(len(layout.patch.seam) for layout in cut)
        notes.append(
            f"cut open along {edges} edges of {len(cut)} closed or bag-like piece{'s' if len(cut) > 1 else ''}; "
            "--no-cut refuses closed ones"
        )
    kinds = dict.fromkeys(
        note
        for layout in layouts
        for note in (*layout.patch.notes, *layout.notes)
        if not note.startswith("ignored")
    )
    return [*notes, *list(kinds)[:MOST_NOTES]]


def flatten_patch(
    spec: str,
    file: MeshFile,
    piece: Patch,
    *,
    start: int = -1,
    grow: bool,
    method: str = "conformal",
    joins: bool,
    purpose: Purpose = "domain",
) -> MeshShape:
    """Flatten a piece of a mesh; arguments as for `read` and `flatten`, `start` as for `MeshShape`."""
    flat = flatten(piece, loop=file.loop, grow=grow, method=method, joins=joins, purpose=purpose)
    if purpose == "texture" and method != "lscm":
        flat = convex(flat)
    return _one_chart(spec, file, piece, flat, start)


def _compact(chart: Flattening) -> Flattening:
    """Return a chart that was cut open rotated into its smallest square; a sheet stays upright."""
    if not len(chart.patch.seam):
        return chart
    return replace(chart, flat=chart.flat * into_smallest_square(chart.flat), even=None)


def _one_chart(spec: str, file: MeshFile, piece: Patch, flat: Flattening, start: int = -1) -> MeshShape:
    """Return the shape of a piece that is flattened as a whole; arguments as for `flatten_patch`."""
    also = _at_same_places(file.mesh, flat.patch)
    file, patch, also = _with_faces_of(file, flat.patch, also)
    flat = replace(flat, patch=patch)
    # the outline of a least squares map may cross itself
    curve = Curve(flat.flat[flat.loop]) if flat.method == "lscm" else flat.boundary
    notes = [*file.notes, *flat.patch.notes, *flat.notes]
    if len(flat.patch.seam):
        notes.append(f"cut open along {len(flat.patch.seam)} edges")
    loops, loops_left = len(piece.loops), len(flat.patch.loops)
    if loops > 1:
        fate_of_others = "the others are holes"
        if loops_left != loops:
            fate_of_others = f"the cut joins {loops - loops_left} of the others to it"
        notes.append(f"boundary {file.loop} of {loops} is the outline, {fate_of_others}")
    return _lay_out(spec, file, flat, curve, curve.box, notes, start=start, also=also)


def _lay_out(
    spec: str,
    file: MeshFile,
    flat: Flattening,
    curve: Curve,
    box: Box,
    notes: list[str],
    **fields: Any,
) -> MeshShape:
    """Return the shape of a layout, without drawn constraints; `fields` are further fields of a `MeshShape`."""
    return MeshShape(
        spec=spec,
        path=file.path,
        curve=curve,
        box=box,
        flip=False,
        pins={},
        strokes={},
        notes=tuple(notes),
        file=file,
        flattening=flat,
        **fields,
        **_holes(file, flat),
    )


def split_at(file: MeshFile, points: Real) -> MeshFile:
    """Return the mesh with vertices at points (k, 3) if it is a single closed surface; otherwise unchanged."""
    joined = Joined.of(file.mesh)
    surface = sound_piece(joined) if len(joined.sizes) == 1 else None
    if surface is None or surface.loops:
        return file
    return replace(file, mesh=with_vertices(surface, points))


def point_of(file: MeshFile, spec: str, place: Place) -> Real:
    """Return the position of a vertex, or a point in space.

    Raises:
        InputError: there is no such vertex.
    """
    number = vertex_of(place)
    return np.array(place) if number is None else file.mesh.points[row_of(file, spec, number)]


def _start_of(piece: Patch, seam_points: Real | None) -> int:
    """Return the vertex of a patch at which the seam through points (k, 3) starts; -1 if there is no such seam."""
    if seam_points is None or not len(piece.seam):
        return -1
    outline = piece.loops[0]
    first = outline[np.argmin(((piece.points[outline] - seam_points[0]) ** 2).sum(axis=1))]
    is_single = np.count_nonzero(piece.vertex == piece.vertex[first]) == 1
    nearest_point = np.argmin(((piece.points - seam_points[0]) ** 2).sum(axis=1))
    return int(first) if is_single and piece.vertex[nearest_point] == piece.vertex[first] else -1


def read_chart(spec: str, file: MeshFile, atlas: Atlas, number: int, aspect: float) -> MeshShape:
    """Return a chart of a mesh in the plane of its texture coordinates; errors as for `read`."""
    if file.loop != 1:
        raise InputError(
            f"{spec}: the outline of a chart is always its outer boundary; #uv-{file.loop} would be another chart"
        )
    chart = atlas.chart(number, aspect)
    none = np.zeros(0, np.int64)
    file, patch, _ = _with_faces_of(file, chart.flattening.patch, (none, none))
    flat = replace(chart.flattening, patch=patch)
    low = complex(chart.tile.real * aspect, chart.tile.imag)
    notes = [*file.notes, *atlas.notes]
    if atlas.count > 1:
        note = f"ignored {atlas.count - 1} other chart{'s' if atlas.count > 2 else ''} of its texture coordinates"
        notes.append(f"{note}; #uv-{2 if number == 1 else 1} selects another, --parts all maps all of them")
    if shared := atlas.shared(number):
        notes.append(
            f"other charts overlap {shared:.0%} of chart {number}, and show the same part of the texture"
        )
    box = low, low + complex(aspect, 1)
    return _lay_out(spec, file, flat, flat.boundary, box, notes, chart=chart, aspect=aspect)


def aspect_of(file: MeshFile, aspect: Aspect | None) -> float:
    """Return width / height of the pictures on a mesh's texture coordinates."""
    if not callable(aspect):
        return aspect or 1.0
    pictures: list[Path | bytes] = [file.picture] if file.picture else [*file.textures()]
    return aspect(pictures) or 1.0


def _with_faces_of(
    file: MeshFile, patch: Patch, also: tuple[Index, Index]
) -> tuple[MeshFile, Patch, tuple[Index, Index]]:
    """Restrict the file's mesh to the faces of a patch, and of the corners `also[0]`, which are at vertices `also[1]`.

    Returns the file, the patch, and these corners. Faces of other pieces stay unchanged.
    """
    mesh = file.mesh
    is_kept = np.zeros(mesh.sizes.size, bool)
    is_kept[patch.polygon] = True
    is_kept[np.searchsorted(mesh.starts, also[0], side="right") - 1] = True
    if is_kept.all():
        return file, patch, also
    part, faces = mesh.part(is_kept, mesh.name), file.faces.copy()
    faces[np.flatnonzero(faces)[~is_kept]] = False
    number = np.cumsum(np.repeat(is_kept, mesh.sizes)) - 1
    patch = replace(patch, mesh=part, corner=number[patch.corner])
    return replace(file, mesh=part, faces=faces), patch, (number[also[0]], also[1])


def _at_same_places(mesh: Mesh, patch: Patch) -> tuple[Index, Index]:
    """Return corners of faces that are not in a patch, and its vertices at the same positions.

    These faces have no area, or the same corners as another face. Vertices are those of a single face if one has all
    corners, best in the same order.
    """
    in_patch = np.zeros(mesh.sizes.size, bool)
    in_patch[patch.polygon] = True
    other_faces = np.flatnonzero(~in_patch)
    if not other_faces.size:
        return other_faces, other_faces
    place = distinct_rows(mesh.points)[1]
    vertex_at = np.full(len(mesh.points), -1)
    vertex_at[place[patch.vertex]] = np.arange(patch.vertex.size)
    corners = [np.arange(*mesh.starts[face : face + 2]) for face in other_faces]
    corners = [
        face_corners for face_corners in corners if (vertex_at[place[mesh.corners[face_corners]]] >= 0).all()
    ]
    if not corners:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    of_faces = {
        _from_least(key): dict(zip(key, vertices))
        for key, vertices in zip(place[patch.vertex[patch.faces]].tolist(), patch.faces.tolist())
    }
    vertices = list[int]()
    for face_corners in corners:
        corner_places = place[mesh.corners[face_corners]].tolist()
        copy, back = _from_least(corner_places), _from_least(corner_places[::-1])
        vertices_at_places = of_faces.get(copy) or of_faces.get(back, {})
        vertices += [vertices_at_places.get(key, int(vertex_at[key])) for key in corner_places]
    return np.concatenate(corners), np.array(vertices)


def _from_least(ring: list[int]) -> tuple[int, ...]:
    """Return the same ring from its least number on: equal for faces with the same corners, wound in the same way."""
    first = ring.index(min(ring))
    return (*ring[first:], *ring[:first])


def _holes(file: MeshFile, flat: Flattening) -> dict[str, Any]:
    """Return the outlines of holes in the plane, and the objects, groups and materials around each."""
    outer = {int(loop[0]) for loop in flat.outer_loops}
    loops = [loop for loop in flat.patch.loops if int(loop[0]) not in outer]
    names = [names_around(file, flat.patch, loop) for loop in loops]
    return {"holes": tuple(flat.flat[loop] for loop in loops), "hole_names": tuple(names)}


def names_around(file: MeshFile, patch: Patch, loop: Index) -> tuple[str, ...]:
    """Return the objects, groups and materials of the faces that touch a boundary loop of a patch."""
    on_loop = np.zeros(len(patch.points), bool)
    on_loop[loop] = True
    touching = on_loop[patch.faces].any(axis=1)
    face = np.searchsorted(file.mesh.starts, patch.corner[touching, 0], side="right") - 1
    return tuple(sorted(file.content.names_at(np.flatnonzero(file.faces)[np.unique(face)])))


def read_all(
    spec: str,
    most: int,
    *,
    cutting: Cutting = NO_CUT,
    opened: MeshFormat | None = None,
    layout: bool = False,
    aspect: Aspect | None = None,
) -> tuple[list[MeshShape], int]:
    """Return the largest charts or pieces of a mesh, and the number of those beyond `most`.

    Charts are where their texture coordinates are; pieces are placed side by side in one plane. The other arguments are
    as for `read`.

    Raises:
        InputError: none is a domain, or as for `read`.
    """
    parts = mesh_files.read_all(spec, opened)
    if parts[0].numbered:
        return [read(spec, cutting=cutting, opened=opened, layout=layout, aspect=aspect)], 0
    charts = bool(parts[0].chart) or layout
    candidates = _charts(spec, parts, aspect) if charts else _pieces(spec, parts, cutting)
    candidates = sorted(candidates, key=lambda candidate: -candidate.area)
    named_shapes, faults = _pick(candidates[:most])
    if not named_shapes:
        raise InputError(faults[0])
    shapes = [shape for _, shape in named_shapes]
    if not charts:
        shapes = side_by_side(shapes)
    extent = bounding_box(np.array([reflected(shape.curve.box, shape.mirror) for shape in shapes]))
    notes = tuple(f"ignored: {fault.removeprefix(f'{parts[0].path}: ')}" for fault in faults)
    box = shapes[0].box if charts else extent
    return [
        replace(
            shape,
            part=name,
            names=shape.around or tuple(filter(None, [shape.file.part])),
            extent=extent,
            box=box,
            notes=(*_common(shape), *notes),
        )
        for (name, _), shape in zip(named_shapes, shapes)
    ], max(len(candidates) - most, 0)


class _Candidate(NamedTuple):
    """A chart or piece of a mesh.

    Attributes:
        area: in the layout, or in space.
        name: with which `#` selects it.
        make: creates the shape.
    """

    area: float
    name: str
    make: Callable[[], MeshShape]


def _charts(spec: str, parts: Sequence[MeshFile], aspect: Aspect | None) -> list[_Candidate]:
    """Return the charts of all geometries.

    Raises:
        InputError: no geometry has any; the error of the first.
    """
    charts, faults = list[_Candidate](), list[InputError]()
    for file in parts:
        try:
            atlas = Atlas.of(file.mesh)
        except InputError as error:
            faults.append(error)
            continue
        wide = aspect_of(file, aspect)
        charts += [
            _Candidate(
                float(area), _part_name(file, "uv", k), partial(read_chart, spec, file, atlas, k, wide)
            )
            for k, area in enumerate(atlas.areas, 1)
        ]
    if not charts:
        raise faults[0]
    return charts


def _pieces(spec: str, parts: Sequence[MeshFile], cutting: Cutting) -> list[_Candidate]:
    """Return the pieces of all geometries; errors as for `_charts`."""

    def make(file: MeshFile, connected: Joined, number: int) -> MeshShape:
        piece = disk_patch(connected, cut=cutting.closed, piece=number)
        return flatten_patch(spec, file, piece, grow=cutting.may_lengthen(piece), joins=cutting.joins)

    pieces = []
    for file in parts:
        connected = Joined.of(file.mesh)
        areas = connected.areas[connected.order]
        pieces += [
            _Candidate(float(area), _part_name(file, "piece", k), partial(make, file, connected, k))
            for k, area in enumerate(areas, 1)
        ]
    return pieces


def _part_name(file: MeshFile, word: str, number: int) -> str:
    return "#".join([*filter(None, [file.part]), f"{word}-{number}"])


def _pick(candidates: Sequence[_Candidate]) -> tuple[list[tuple[str, MeshShape]], list[str]]:
    """Return the shapes that can be created, with their names, and the reasons why others cannot."""
    named_shapes, faults = [], []
    for candidate in candidates:
        try:
            named_shapes.append((candidate.name, candidate.make()))
        except InputError as error:
            faults.append(str(error))
    return named_shapes, faults


def _common(shape: MeshShape) -> tuple[str, ...]:
    """Return the notes that concern all parts, and not what one part leaves out."""
    return tuple(
        note for note in shape.notes if "selects another" not in note and "is the outline" not in note
    )


def read_texture(shape: Shape, **options: Any) -> Image:
    """Return the first texture that a mesh file refers to or contains; options as in `image_files.read`.

    Raises:
        InputError: there is none.
    """
    from ..pictures import image_files

    if not shape.pictures:
        raise InputError(f"{shape.spec}: has no texture; name one with --texture")
    return image_files.read_held(shape.pictures[0], f"{shape.spec}: the texture in the file", **options)
