"""Rigid regions of a surface: triangles that keep the shape that they have when flattened separately."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Complex, Flags, Index
from ..balanced.model.solution import SolveLog
from ..balanced.rigid.given import MOST_REGIONS, aims_by
from ..balanced.rigid.solve import Rigid, keep_on_mesh
from ..curve import Curve, inside_any
from ..errors import InputError
from ..flattening.free import Elastic
from ..flattening.method import LEAST_DECREASE, NEWTON_STEPS
from ..maps.regions import Rings, rings_of
from ..maps.triangulated.map import TriangulatedMap
from ..meshes import topology
from ..meshes.flatten import Flattening
from ..meshes.locate import Locator
from ..meshes.stretch import laid_flat
from ..options import Options
from ..plane import Similarity, triangle_areas
from .target_mesh_map import OwnMap, OwnMetric

OUTLINE = (
    "A rigid region touches the outline, which slides: its triangles there, {:.0%} of its area, "
    "are not rigid."
)


def keep_rigid(
    own_map: OwnMap,
    places: Complex,
    regions: Sequence[Complex],
    options: Options,
    journal: SolveLog,
) -> OwnMap:
    """Continue from a map on a surface's own triangles to one that keeps regions rigid.

    Regions rotate with the map around them.

    Args:
        own_map: the map without rigid regions.
        places: (n,) its vertices in the user's plane.
        regions: polygons in that plane.
        options: of the solver.
        journal: log of the solver; notes are added.

    Raises:
        InputError: no triangle is in the regions, there are too many regions, or no similarity satisfies the pins in
            one of them.
        NoMapError: no map without folds was found.
    """
    state = own_map.state
    on_outline = np.arange(state.z.size) < state.border
    labels, touching = labels_of(state.faces, places, on_outline, regions)
    count = int(labels.max(initial=-1)) + 1
    if not count:
        raise InputError(
            "rigid: contains no triangle of the surface that is away from the outline; enlarge the region"
        )
    if count > MOST_REGIONS:
        raise InputError(
            f"rigid: {count} regions are given, at most {MOST_REGIONS} are possible; remove some"
        )
    if touching:
        journal.notes.append(OUTLINE.format(touching))
    metric = state.metrics[0]
    assert isinstance(metric, OwnMetric)
    a, b = metric.maps[0][:, None], metric.maps[1][:, None]
    corners = state.z[state.faces]
    flat = flat_by_itself(state.z, state.faces, a * corners + b * corners.conj(), labels)
    holding = np.full(flat.size, -1)
    holding[state.faces[labels >= 0]] = labels[labels >= 0, None]
    pins = np.column_stack([flat[state.inner], state.inside.goals])
    size = options.rigid_scale
    aims, is_prescribed, centroids = aims_by(count, holding[state.inner], pins, size or 1.0)
    rigid = Rigid((), aims, ~is_prescribed, ~is_prescribed & (size is None), centroids)
    rigid_state = keep_on_mesh(replace(state, rigid=labels, flat=flat), rigid, options)
    journal.energies.append(rigid_state.value)
    return replace(own_map, state=rigid_state, energy=rigid_state.value)


def laid_by_themselves(
    map: TriangulatedMap, layout: Flattening, regions: Sequence[Complex], *, of_target: bool
) -> tuple[tuple[Rings, ...], Complex]:
    """Return the rigid regions of a map on a surface's own triangles, and their vertices flattened separately.

    Returns the regions' outlines in the surface's layout, and (n,) positions of the vertices, those in a region where
    flattening that region on its own puts them, in the surface's units.
    """
    z = map.image if of_target else map.source
    on_outline = np.zeros(z.size, bool)
    on_outline[np.concatenate(map.loops)] = True
    labels, _ = labels_of(map.faces, z, on_outline, regions)
    face, weights = Locator.of(layout)(z, 1)
    points = np.einsum("pk,pkx->px", weights, layout.patch.points[layout.patch.faces[face]])
    flat = flat_by_itself(z, map.faces, laid_flat(points[map.faces]), labels)
    outlines = [rings for k in range(labels.max() + 1) for rings in rings_of(z, map.faces[labels == k])]
    return tuple(outlines), flat


def labels_of(faces: Index, z: Complex, on_outline: Flags, regions: Sequence[Complex]) -> tuple[Index, float]:
    """Label triangles with the connected region that they are in.

    Triangles that touch the outline do not count, since its vertices slide.

    Returns:
        (m,) labels, -1 outside all regions; and the share of the regions' area that is lost at the outline.
    """
    inside = inside_any(map(Curve, regions), z[faces].mean(axis=1))
    touching = inside & on_outline[faces].any(axis=1)
    labels, labelled = np.full(len(faces), -1), np.flatnonzero(inside & ~touching)
    if labelled.size:
        _, corners = np.unique(faces[labelled], return_inverse=True)
        a, b, c = corners.reshape(-1, 3).T
        component = topology.labels(np.append(a, a), np.append(b, c), int(corners.max()) + 1)
        labels[labelled] = component[a]
    areas = triangle_areas(z[faces])
    return labels, float(areas[touching].sum() / areas[inside].sum()) if labelled.size else 1.0


def flat_by_itself(z: Complex, faces: Index, shapes: Complex, labels: Index) -> Complex:
    """Return vertices (n,) of a layout, those of each region where flattening it separately puts them.

    Each region gets its own even layout, rotated to fit z.

    Args:
        z: (n,) vertices, without folds.
        faces: (m, 3) triangles.
        shapes: (m, 3) their shapes on the surface.
        labels: (m,) the region of each triangle, -1 for none.
    """
    flat = z.copy()
    for k in range(labels.max(initial=-1) + 1):
        inside = labels == k
        vertices, corners = np.unique(faces[inside], return_inverse=True)
        corners, positions = corners.reshape(-1, 3), z[vertices]
        size = np.sqrt(triangle_areas(shapes[inside]).sum())
        start = positions / np.sqrt(np.abs(triangle_areas(positions[corners])).sum())
        sheet = Elastic.of(corners, shapes[inside] / size)
        relaxed = size * sheet.relaxed(start, 1.0, NEWTON_STEPS, LEAST_DECREASE)
        turn = Similarity.fit(relaxed, positions).factor
        flat[vertices] = turn / abs(turn) * relaxed
    return flat
