"""Divide a piece of a mesh into charts: the shortest seams within a bound of distortion, and a place for every face.

One chart has the shortest seams. A hard surface that it distorts beyond the bound is cut into nets (see `unfolding`),
which are shorter than they could be where long ones would leave most of a texture empty. Of an organic surface the seam
is lengthened, and charts that are distorted beyond its bound are split in two (see `bisection`), and each half again.
So is what does not flatten, to single triangles if need be. Seams that are given stay, and no others are made except
where a part does not flatten.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import shapely

from ..arrays import Complex, Flags, Index, Real, complex_of, xy_of
from ..deadline import TimeUp, ends_search
from ..errors import InputError
from ..meshes.borders import marked_edges
from ..meshes.disk_patch import open_piece, split_non_manifold
from ..meshes.flatten import Flattening, overlap, upright, weighted_percentiles
from ..meshes.patch import Patch
from ..meshes.stretch import laid_flat
from ..meshes.topology import Triangles
from ..plane import polygon_area
from ..sorting import grouped
from .bisection import halves
from .charts import separate_boundaries
from .method import convex, flatten
from .unfolding import Faceted

Charts = Literal["auto", "one"]
MAX_DISTORTION = 1.1
"""Default bound of the distortion of hard surfaces: checks that are longer by a tenth look square."""
MAX_ORGANIC_DISTORTION = 1.5
"""The same for organic surfaces, which need long seams for less."""
STRETCH_OF_DISTORTION = 0.75
"""Stretch beyond 1 of layouts relative to their distortion beyond 1: 0.37 with a distortion of 1.49, 0.32 with 1.39."""
LEAST_DECREASE_SHARE = 0.02
"""Share of its distortion by which splitting a chart must be better; noise of a scan cannot be flattened by it."""
MOST_CHARTS = 64
"""Charts of an organic surface from which none is split because of its distortion."""
LEAST_HARD_SHARE = 0.5
"""Share of the area in flat and other developable parts from which a surface is hard."""
LONGEST_CHART_SIDES = (np.inf, 2.5, 1.5, 1.0)
"""Diagonals of nets that are compared, in sides of a square of the surface's area: charts that are longer or wider
waste texture, such as the strip of a gear's teeth."""
USUAL_TEXTURE_SHARE = 2.0
"""Area of a texture relative to the surface's that counts as no waste: half of a packed texture is often empty."""
SEAM_FOR_TEXTURE_SIDES = 1.5
"""Length of seam, in sides of a square of the surface's area, that is as bad as one more such square of texture."""
EXACT_DILATATION = 1.01
"""95th percentile of the dilatation below which a layout counts as undistorted."""


@dataclass(frozen=True, eq=False)
class Chart:
    """A part of a piece with its layout.

    Attributes:
        layout: the layout, whose triangles are those of the part in their order.
        triangles: (k,) the triangles of the piece.
        part: the part before it was cut open.
    """

    layout: Flattening
    triangles: Index
    part: Patch

    @property
    def seam(self) -> float:
        """Length of its seams."""
        ends = self.layout.patch.mesh.points[self.layout.patch.seam]
        return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum())


def charts_of(
    piece: Patch,
    *,
    grow: bool,
    method: str,
    charts: Charts = "auto",
    max_distortion: float | None = None,
    standing: bool = False,
) -> list[Chart]:
    """Flatten a piece, into one chart, or if that is too distorted, into more.

    Args:
        piece: a valid piece, see `meshes.disk_patch.sound_piece`.
        grow: whether it may be cut.
        method: see `flattening.flatten`.
        charts: "one" keeps one chart wherever it flattens, as "lscm" always does.
        max_distortion: bound of the 95th percentile of the dilatation; None for MAX_DISTORTION on hard surfaces, and
            MAX_ORGANIC_DISTORTION on others.
        standing: whether parts of a net are only joined where the model's up is the same on both, for pictures that
            have an up; seams are longer.

    Raises:
        InputError: it is closed or has handles, and may not be cut.
        TimeUp: the time is over.
    """
    if not grow:
        open_piece(piece, cut=False)
    one = charts == "one" or method == "lscm" or not grow
    piece = replace(piece, follows_borders=grow)
    given = marked_edges(piece.mesh, piece.triangles, piece.vertex) if grow else np.zeros(0, bool)
    if given.any():
        parts = parts_of(piece, given)
        between = [
            chart
            for part, members in parts
            for chart in _flatten_or_split(part, members, part.genus > 0 or not part.loops, method)
        ]
        return between if one or max_distortion is None else _within(between, max_distortion, method)
    if one:
        return _flatten_or_split(piece, np.arange(len(piece.faces)), grow, method)
    surface = Faceted(piece)
    if surface.hard_share < LEAST_HARD_SHARE:
        bound = max_distortion or MAX_ORGANIC_DISTORTION
        return _within(_flattened(piece, np.arange(len(piece.faces)), method, bound), bound, method)
    whole = _flatten_or_split(piece, np.arange(len(piece.faces)), True, method)
    if dilated(whole) < EXACT_DILATATION or ends_search():
        return whole
    bound = max_distortion or MAX_DISTORTION
    choices = [whole, *_nets_of_lengths(surface, method, standing)]
    return min(choices, key=lambda layouts: _cost(layouts, bound))


def _flattened(part: Patch, triangles: Index, method: str, bound: float) -> list[Chart]:
    """Flatten a part with a seam that is as long as the bound of its distortion needs, if that is not too long."""
    return _flatten_or_split(part, triangles, True, method, 1 + STRETCH_OF_DISTORTION * (bound - 1))


def _within(charts: Sequence[Chart], bound: float, method: str) -> list[Chart]:
    """Split charts that are distorted beyond a bound, the most distorted first."""
    good, bad = list[Chart](), list[Chart]()

    def sort(charts: Sequence[Chart]) -> None:
        for chart in charts:
            is_good = chart.layout.dilated(95) <= bound or len(chart.triangles) == 1
            (good if is_good else bad).append(chart)

    sort(charts)
    while bad and len(good) + len(bad) < MOST_CHARTS and not ends_search():
        chart = bad.pop(max(range(len(bad)), key=lambda k: _excess(bad[k], bound)))
        parts = parts_of(chart.part, _between(chart.part, halves(chart.part)))
        if len(parts) == 1:
            parts = parts_of(chart.part, _between(chart.part, _halves(chart.part)))
        split = [
            new
            for part, members in parts
            for new in _flattened(part, chart.triangles[members], method, bound)
        ]
        if dilated(split) < (1 - LEAST_DECREASE_SHARE) * chart.layout.dilated(95):
            sort(split)
        else:
            good.append(chart)
    return good + bad


def _excess(chart: Chart, bound: float) -> float:
    """Return the area of a chart that is distorted beyond a bound."""
    return float(chart.layout.patch.areas[chart.layout.dilatation > bound].sum())


def dilated(charts: Sequence[Chart]) -> float:
    """Return the 95th percentile of the dilatation over the area of all charts."""
    dilatation = np.concatenate([chart.layout.dilatation for chart in charts])
    weight = np.concatenate([chart.layout.patch.areas for chart in charts])
    return weighted_percentiles(dilatation, weight, (95,))[0]


def _cost(charts: Sequence[Chart], max_distortion: float) -> tuple[float, float]:
    """Return what the best charts have least of: distortion beyond the bound, then seams and wasted texture."""
    seams = sum(chart.seam for chart in charts) / np.sqrt(_area(charts))
    return max(dilated(charts), max_distortion), seams + SEAM_FOR_TEXTURE_SIDES * _wasted(charts)


def _area(charts: Sequence[Chart]) -> float:
    return float(sum(chart.layout.patch.areas.sum() for chart in charts))


def _wasted(charts: Sequence[Chart]) -> float:
    """Return the area of texture beyond the usual that charts need, relative to the surface's."""
    return max(_texture(charts) / _area(charts) - USUAL_TEXTURE_SHARE, 0.0)


def _texture(charts: Sequence[Chart]) -> float:
    """Return the area that charts need at least in a texture up to twice as long as wide, at the surface's scale."""
    boxes = np.array([_extent(chart) for chart in charts])
    return max(float(boxes.prod(axis=1).sum()), float(boxes.max()) ** 2 / 2)


def _extent(chart: Chart) -> Real:
    """Return the sides of the smallest rectangle around a chart, in any direction: charts are turned for packing."""
    points = shapely.multipoints(xy_of(chart.layout.flat))
    corners = complex_of(shapely.get_coordinates(shapely.oriented_envelope(points)))
    return np.abs(np.diff(corners))[:2] if corners.size == 5 else np.array([np.ptp(corners.real), 0.0])


def _nets_of_lengths(surface: Faceted, method: str, standing: bool) -> Iterator[list[Chart]]:
    """Yield nets whose charts may be of any length, and shorter ones as long as these differ and texture is wasted."""
    side = float(np.sqrt(surface.piece.areas.sum()))
    solved = dict[bytes, list[Chart]]()
    longest = None
    for sides in LONGEST_CHART_SIDES:
        if longest is not None and sides * side >= longest:
            continue  # the nets would be the same
        nets = _nets(surface, method, sides * side, solved, standing)
        if nets is None:
            return
        yield nets
        longest = max(float(np.hypot(*_extent(chart))) for chart in nets)
        if not _wasted(nets) or ends_search():
            return  # shorter charts have longer seams


def _nets(
    surface: Faceted, method: str, longest: float, solved: dict[bytes, list[Chart]], standing: bool
) -> list[Chart] | None:
    """Return the nets of a surface, and its parts that are not developable, each as one chart; None if too many.

    Nets are not made longer than `longest`, in the unit of the surface. Parts that are not developable are the same
    whatever that is, so the charts of each are kept in `solved`, by its triangles.
    """
    net = surface.net(longest, standing=standing)
    if net is None:
        return None
    charts = list[Chart]()
    for part, members in parts_of(surface.piece, net.seams):
        is_developable = bool(surface.developable[surface.part[members[0]]])
        unfolded = _unfolded(part, net.flat[members], method) if is_developable else None
        key = members.tobytes()
        if unfolded is not None:
            charts.append(Chart(unfolded, members, part))
        elif is_developable or part.seam.size:  # the seams of all nets go with the first part
            charts += _flatten_or_split(part, members, True, method)
        else:
            if key not in solved:
                solved[key] = _flatten_or_split(part, members, True, method)
            charts += solved[key]
    return charts


def _unfolded(part: Patch, corners: Complex, method: str) -> Flattening | None:
    """Return the layout of a net with corners of triangles at (m, 3); None if it overlaps, or needs a solver."""
    if part.genus or not part.loops:
        return None
    flat = np.zeros(len(part.points), complex)
    np.add.at(flat, part.faces, corners)
    flat /= np.bincount(part.faces.ravel())
    # a boundary that touches itself is valid or not by rounding, which packing changes
    flat = separate_boundaries(part.triangles, flat)
    outline = max(part.loops, key=lambda loop: polygon_area(flat[loop]))
    layout = Flattening(part, upright(part, flat), outline, method)
    return None if overlap(layout) or not layout.dilated(95) < EXACT_DILATATION else layout


def _flatten_or_split(
    part: Patch, triangles: Index, grow: bool, method: str, stretch: float | None = None
) -> list[Chart]:
    """Return the charts of a part whose triangles are those of the piece with the numbers `triangles` (k,).

    Other arguments are as for `flatten`.
    """
    try:
        layout = flatten(
            open_piece(part, cut=True), grow=grow, method=method, purpose="texture", stretch=stretch
        )
        return [Chart(layout if method == "lscm" else convex(layout), triangles, part)]
    except TimeUp:
        raise
    except InputError:
        if len(triangles) == 1:
            return [Chart(_one_triangle(part, method), triangles, part)]
    return [
        chart
        for half, members in parts_of(part, _between(part, _halves(part)))
        for chart in _flatten_or_split(half, triangles[members], grow, method, stretch)
    ]


def _between(part: Patch, label: Index) -> Flags:
    """Return (3m,) whether half-edges are between triangles with different labels (m,)."""
    twin = part.triangles.twin
    return (twin >= 0) & (label[twin // 3] != label.repeat(3))


def _one_triangle(part: Patch, method: str) -> Flattening:
    flat = np.empty(3, complex)
    flat[part.faces[0]] = laid_flat(part.points[part.faces])[0]
    return Flattening(part, flat, part.loops[0], method)


def _halves(part: Patch) -> Index:
    """Return (m,) 0 or 1: which of two triangles far apart is nearer to each triangle, along the surface."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra

    shape = part.triangles
    half = np.flatnonzero(shape.twin > np.arange(shape.twin.size))
    sides = np.stack([half, shape.twin[half]]) // 3
    middle = part.points[part.faces].mean(axis=1)
    # a step has a length even between triangles at one place, so that each half is connected
    size = np.linalg.norm(np.ptp(part.points, axis=0))
    length = np.linalg.norm(middle[sides[0]] - middle[sides[1]], axis=1) + 1e-9 * size + 1e-300
    graph = coo_matrix((length, tuple(sides)), shape=(len(middle),) * 2).tocsr()
    start = int(np.argmax(np.linalg.norm(middle - middle.mean(axis=0), axis=1)))
    from_start = dijkstra(graph, directed=False, indices=start)
    end = int(np.argmax(from_start))
    return (dijkstra(graph, directed=False, indices=end) < from_start).astype(np.int64)


def parts_of(patch: Patch, seams: Flags) -> list[tuple[Patch, Index]]:
    """Return the parts of a patch cut along half-edges (3m,), each with its triangles; seams go to the first."""
    apart = patch.cut(seams)
    label = apart.triangles.components()
    order, starts = grouped(label, int(label.max()) + 1)
    parts = []
    for k in range(starts.size - 1):
        members = order[starts[k] : starts[k + 1]]
        used, local = np.unique(apart.faces[members], return_inverse=True)
        shape, vertex = split_non_manifold(Triangles(local.reshape(-1, 3), used.size), used, [])
        parts.append(
            (
                replace(
                    patch,
                    points=apart.points[vertex],
                    triangles=shape,
                    vertex=apart.vertex[vertex],
                    corner=apart.corner[members],
                    seam=apart.seam if k == 0 else apart.seam[:0],
                    notes=patch.notes if k == 0 else (),
                ),
                members,
            )
        )
    return parts
