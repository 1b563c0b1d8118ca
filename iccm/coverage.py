"""Which parts of two shapes a map covers: hidden and bare parts of drawings, and parts without a partner."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from .arrays import Complex, Flags, xy_of
from .curve import Curve, inside_any, polygon_of
from .drawings.cost import Cost, cost_of
from .drawings.cracks import crack_share
from .drawings.drawing import Drawing
from .maps.approximation import AnyMap, triangulated
from .maps.extended_inverse import ExtendedInverse
from .maps.moved_rings import RING_SPACING_SHARE
from .maps.triangulated.map import TriangulatedMap
from .polygons import rings_of

ROUNDED_WIDTH_SHARE = 1e-9  # relative to the diagonal: narrower pieces are ignored
SAMPLED_WELL_SHARE = 0.6
"""Of a drawing: if less seems to be covered, thin parts may have been missed by samples."""
THIN_WIDTH_SHARE = 1e-4  # relative to the diagonal: narrower pieces are due to outlines that nearly coincide


@dataclass(frozen=True, eq=False)
class Coverage:
    """The parts of two shapes that a map covers; other attributes are those of `Fit`.

    `hidden` and `bare` are the shares that are lost, `lost_regions` the parts themselves.

    Attributes:
        map: the continuous map from source to target.
        image: the image of the boundary of its polygon.
        source: the domain of the map.
        target: boundary of the target; None for a deformation.
        source_holes: outlines of the source's holes.
        target_holes: those of the target's.
        hole_partners: for each boundary of the map but the outer one, the hole of the source and of the target;
            -1 for a slit.
        is_filled: whether concavities of one shape are filled.
        drawings: the whole drawings of source and target, if the map is one of drawings.
        opaque: whether the texture also covers the gaps between the source's parts.
    """

    map: AnyMap
    image: Complex
    source: Curve
    target: Curve | None
    source_holes: Sequence[Curve]
    target_holes: Sequence[Curve]
    hole_partners: Sequence[tuple[int, int]]
    is_filled: bool
    drawings: tuple[Drawing, Drawing] | None
    opaque: bool

    @cached_property
    def voids(self) -> Flags:
        """The triangles that fill holes of the source without a partner; shape (m,)."""
        assert isinstance(self.map, TriangulatedMap)
        mapped = {i for i, _ in self.hole_partners}
        alone = [] if self.target is None else [h for i, h in enumerate(self.source_holes) if i not in mapped]
        return inside_any(alone, self.map.source[self.map.faces].mean(axis=1))

    @property
    def openings(self) -> tuple[list[Complex], list[Complex]]:
        """The outlines of holes in the map, in the source and in the image, as closed polylines."""
        if not isinstance(self.map, TriangulatedMap):
            return [], []
        holes = self.map.loops[1:]
        return [self.map.source[loop] for loop in holes], [self.map.image[loop] for loop in holes]

    @cached_property
    def seen(self) -> Cost | None:
        """The visible parts of both drawings; None if the map is not one of drawings."""
        if self.drawings is None or self.target is None:
            return None
        source, target = (drawing.region for drawing in self.drawings)
        map = triangulated(self.map)
        faces = map.faces if map is not self.map else map.faces[~self.voids]
        return cost_of(map.source, map.image, faces, source, target, covering=None if self.opaque else source)

    @property
    def hidden(self) -> float:
        """Share of the source that the result does not show: of a drawing's painted area, of an outline's inside."""
        return self.left_out if self.seen is None else self.seen.hidden

    @property
    def bare(self) -> float:
        """Share of the target that shows nothing: of a drawing's painted area, of an outline's inside."""
        if self.seen is None:
            return 0.0 if self.target is None else self.uncovered
        return self.seen.bare

    @property
    def lost_regions(self) -> tuple[shapely.Geometry, shapely.Geometry]:
        """The hidden part of the source and the bare part of the target, as shapely geometries."""
        return self.without_partner if self.drawings is None else self.unseen

    @cached_property
    def cracks(self) -> float:
        """The area of narrow slits in the result, relative to the target drawing's painted area."""
        if self.drawings is None or self.target is None:
            return 0.0
        return crack_share(self.drawings[1], [rings_of(self._covered), self._textured_rings])

    @property
    def reached(self) -> float:
        """Share of what the target paints that lies in the map's image, whatever the texture shows there."""
        if self.target is None:
            return 1.0
        if self.seen is None or self.drawings is None:
            return 1 - self.uncovered
        if self.opaque and 1 - self.seen.bare >= SAMPLED_WELL_SHARE:
            return 1 - self.seen.bare
        painted = self.drawings[1].painted
        return float(shapely.area(shapely.intersection(painted, self._covered)) / max(painted.area, 1e-300))

    @property
    def unseen(self) -> tuple[shapely.Geometry, shapely.Geometry]:
        """The hidden part of the source drawing and the bare part of the target drawing, as shapely geometries."""
        if self.drawings is None or self.target is None:
            return shapely.Polygon(), shapely.Polygon()
        source, target = (drawing.painted for drawing in self.drawings)
        seen_there = shapely.intersection(target, self._covered)
        back = _moved(seen_there, ExtendedInverse(self.map), self.target.diagonal)
        hidden = shapely.difference(source, back)
        bare = shapely.difference(target, shapely.intersection(seen_there, self._textured))
        return _wide(hidden, self.source), _wide(bare, self.target)

    @cached_property
    def _covered(self) -> shapely.Geometry:
        """The part of the target's plane that the map covers."""
        covered = region(self.image, self.openings[1])
        if isinstance(self.map, TriangulatedMap) and self.voids.any():
            triangles = shapely.polygons(xy_of(self.map.image[self.map.faces[self.voids]]))
            covered = covered.difference(shapely.coverage_union_all(triangles))
        return covered

    @cached_property
    def _textured(self) -> shapely.Geometry:
        """The part of the target's plane to which the map takes parts that the texture covers."""
        if self.opaque or self.drawings is None:
            return self._covered
        return _moved(self._painted, self._image_of, self.source.diagonal)

    @property
    def _textured_rings(self) -> list[Complex]:
        """The rings of that part, counter-clockwise around it and clockwise around its holes; they may touch.

        They are the images of the texture's rings. Repairing where rounding makes them touch would take minutes for
        thousands of letters that are stretched a hundredfold.
        """
        if self.opaque or self.drawings is None:
            return rings_of(self._covered)
        dense = rings_of(shapely.segmentize(self._painted, RING_SPACING_SHARE * self.source.diagonal))
        if not dense:
            return []
        # at once, because each search for points is prepared anew
        images = self._image_of(np.concatenate(dense))
        return np.split(images, np.cumsum([len(ring) for ring in dense])[:-1])

    @property
    def _painted(self) -> shapely.Geometry:
        """The part of the source that is both in the map's domain and covered by the texture."""
        assert self.drawings is not None
        return shapely.intersection(self.drawings[0].painted, region(self.map.polygon))

    @property
    def is_partial(self) -> bool:
        """Whether parts may have no partner: concavities are filled, or holes have no partner."""
        slits = isinstance(self.map, TriangulatedMap) and bool(self.voids.any())
        return slits or self.is_filled

    @property
    def left_out(self) -> float:
        """Share of the source's area that the map leaves out, or maps into holes of the target."""
        return self._share_without_partner(0, self.source, self.source_holes)

    @property
    def uncovered(self) -> float:
        """Share of the target's area that the map does not cover, or to which it maps holes of the source; 0 for a
        deformation, which has no target.
        """
        return 0.0 if self.target is None else self._share_without_partner(1, self.target, self.target_holes)

    def _share_without_partner(self, side: int, outer: Curve, holes: Sequence[Curve]) -> float:
        return self.without_partner[side].area / abs(outer.area + sum(hole.area for hole in holes))

    @cached_property
    def without_partner(self) -> tuple[shapely.Geometry, shapely.Geometry]:
        """The parts of the source and of the target without a partner, as shapely geometries."""
        if not self.is_partial:
            return shapely.Polygon(), shapely.Polygon()
        assert self.target is not None and isinstance(self.map, TriangulatedMap)
        source = self.source, self.source_holes, self.map.polygon, self.map.source
        target = self.target, self.target_holes, self.image, self.map.image
        unpaired = []
        for side, (goal, holes, outer, points) in enumerate((source, target)):
            voids = shapely.coverage_union_all(shapely.polygons(xy_of(points[self.map.faces[self.voids]])))
            mapped = region(outer, self.openings[side]).difference(voids)
            parts = shapely.get_parts(region(goal.z, [hole.z for hole in holes]).difference(mapped))
            wide = shapely.area(parts) > ROUNDED_WIDTH_SHARE * goal.diagonal * shapely.length(parts)
            unpaired.append(shapely.union_all(parts[wide]))
        return unpaired[0], unpaired[1]

    def _image_of(self, z: Complex) -> Complex:
        """Return the images of points of the source; points outside the map's polygon are moved to its outline."""
        return self.map(Curve(self.map.polygon).pulled_in(z))


def region(outline: Complex, holes: Iterable[Complex] = ()) -> shapely.Geometry:
    """Return a domain as a shapely geometry, repaired if rounding makes its outlines touch."""
    return shapely.make_valid(polygon_of(outline, *holes))


def _moved(painted: shapely.Geometry, map: Callable[[Complex], Complex], diagonal: float) -> shapely.Geometry:
    """Return the image of a region, with edges subdivided so that they follow the map."""
    if painted.is_empty:
        return painted
    dense = shapely.segmentize(painted, RING_SPACING_SHARE * diagonal)
    return shapely.make_valid(shapely.transform(dense, lambda xy: xy_of(map(xy[:, 0] + 1j * xy[:, 1]))))


def _wide(region: shapely.Geometry, outline: Curve) -> shapely.Geometry:
    """Return the parts of a region that are wider than rounding errors."""
    parts = shapely.get_parts(region)
    return shapely.union_all(
        parts[shapely.area(parts) > THIN_WIDTH_SHARE * outline.diagonal * shapely.length(parts)]
    )
