"""Two meshes by their position: maps of those in the same place, and pins by the up axes of both."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...deadline import TimeUp
from ...errors import InputError
from ...figures import SAME_PLACE_SHARE
from ...plane import bounding_box
from ..point_syntax import Place

if TYPE_CHECKING:
    from ...meshes.patch import Patch
    from ...meshes.views import Viewpoint
    from ...solve import Fit
    from ..shapes.mesh_shape import MeshShape
    from .parts import Pair
    from .state import Run


def place_on_twins(run: Run) -> None:
    """Map meshes that lie in the same place, such as a model and its subdivision, by nearest points.

    The target is cut along the source's seam. Maps that are good are put into `run.known`, and the shapes, cut
    anew, into `run.pairs`; all others are left to the solver.
    """
    job = run.job
    asks_for_more = (
        *(job.has_pins, job.start, job.rigid, job.rigid_target, job.importance, job.size_map),
        *(job.no_cut, job.cut_open, job.handles, job.repeated, job.turn, job.holes == "keep"),
    )
    if any(asks_for_more) or not job.target or not job.exact or job.fit not in (None, "auto", "whole"):
        return
    for k, pair in enumerate(run.pairs):
        try:
            found = _twins(run, pair)
        except TimeUp:
            raise
        except InputError:  # no such seam, or no map along it
            continue
        if found is not None:
            *shapes, fit = found
            run.pairs[k], run.known[k] = (shapes[0], shapes[1]), fit
            update_extents(run)
            remark = f"lies where {run.job.source} does, so it is cut along the same seam"
            part = f"#{shapes[1].part} of " if job.several else ""
            run.note(f"{part}{run.job.target}: {remark} (use --pin for another map)")


def _twins(run: Run, pair: Pair) -> tuple[MeshShape, MeshShape, Fit] | None:
    """Return two meshes in the same place, cut along the same seam, and their map; None if that is not good.

    Raises:
        InputError: there is no such seam, or no map along it.
    """
    import iccm

    from ...meshes.disk_patch import Joined, open_piece, sound_piece
    from ...meshes.surface_distortion import gap_between
    from ...surfaces.coincident import join_loops, map_by_nearest_points, twin_of
    from ..shapes.mesh_reading import flatten_patch
    from ..shapes.mesh_shape import MeshShape

    source, target = pair
    if not (isinstance(source, MeshShape) and isinstance(target, MeshShape)):
        return None
    if any(shape.is_layout or shape.packed for shape in (source, target)):
        return None
    if gap_between(source.flattening, target.flattening) > SAME_PLACE_SHARE:
        return None
    wholes = [sound_piece(Joined.of(shape.file.mesh), shape.file.piece or 1) for shape in (source, target)]
    if len(source.flattening.patch.seam) == 0 or len(source.flattening.patch.loops) > 1:
        opened = join_loops(open_piece(wholes[0], cut=True))
        cut_source = flatten_patch(source.spec, source.file, opened, grow=True, joins=True)
        source = beside(run, 0, cut_source, source)
    twin = twin_of(source.flattening.patch, wholes[1])
    target = beside(
        run, 1, flatten_patch(target.spec, target.file, twin.patch, grow=False, joins=False), target
    )
    start = map_by_nearest_points(source.flattening, target.flattening, twin.nodes)
    fit = iccm.fit(source.domain, target.domain, start=start, **run.job.solver)
    return (source, target, fit) if fit.status.ok else None


def beside(run: Run, side: int, shape: MeshShape, replaced: MeshShape) -> MeshShape:
    """Return a piece that was cut differently in place of another: beside all others of its side in their plane."""
    from ..shapes.mesh_parts import move_beside

    if len(run.pairs) > 1 or run.job.several:
        shape = move_beside(shape, [piece.curve.box for piece in run.shapes(side)])
    return replace(shape, spec=replaced.spec, part=replaced.part, names=replaced.names, notes=replaced.notes)


def update_extents(run: Run) -> None:
    """Set the extents of all pieces to the box of all of their side, where several are mapped."""
    if not run.job.several:
        return
    sides = []
    for side in (0, 1):
        shapes = [pair[side] for pair in run.pairs]
        extent = bounding_box(np.array([shape.curve.box for shape in shapes]))
        sides.append([replace(shape, extent=extent, box=extent) for shape in shapes])
    run.pairs = [*zip(*sides)]


PLACES_SEEN = (0.5j, -0.5j, -0.5 + 0j, 0.5 + 0j)
"""Right + i up of landmarks, relative to the middle of a model and to half its width and height."""


def pins_by_up(run: Run, turn: float) -> list[tuple[Place, Place]]:
    """Return pins between places of two models that are seen from the same side, with their own up axes.

    The places are the same on both, or turned counter-clockwise on the target by some degrees.
    """
    from ...meshes.views import views
    from ..shapes.mesh_shape import as_mesh

    source, target = (as_mesh(shape).flattening.patch for shape in run.pairs[0])
    source_view, target_view = views(source, target)
    base = as_mesh(run.target).file.mesh.base
    vertices = _landmarks(source, source_view)
    target_vertices = _landmarks(target, target_view, complex(np.exp(1j * np.radians(turn))))
    return [
        (tuple(source.points[a].tolist()), f"v{target.vertex[b] + base}")
        for a, b in zip(vertices, target_vertices)
    ]


def _landmarks(patch: Patch, view: Viewpoint, turn: complex = 1) -> list[int]:
    """Return the vertices of the side that is seen which are nearest to `PLACES_SEEN`, turned."""
    a, b, c = np.moveaxis(patch.points[patch.faces], 1, 0)
    facing = np.zeros(len(patch.points))
    np.add.at(facing, patch.faces, (np.cross(b - a, c - a) @ view.toward)[:, None])
    seen = view.plan(patch.points)
    low, high = (complex(pick(seen.real), pick(seen.imag)) for pick in (np.min, np.max))
    half, middle = (high - low) / 2, (low + high) / 2
    unit = (seen - middle).real / max(half.real, 1e-300) + 1j * (seen - middle).imag / max(half.imag, 1e-300)
    behind = np.where(facing > 0, 0.0, np.inf) - 1e-9 * (patch.points @ view.toward)
    return [int(np.argmin(np.abs(unit - turn * place) + behind)) for place in PLACES_SEEN]
