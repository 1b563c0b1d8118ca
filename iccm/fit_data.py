"""What a result consists of: a map, what was given, notes, and what follows from these at once."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

from .arrays import Box, Complex
from .axes import UP
from .coverage import Coverage
from .curve import Curve, interior_grid
from .drawings.drawing import Drawing
from .maps import injectivity, inverse
from .maps.approximation import AnyMap
from .maps.boundary_image import outline
from .maps.injectivity import Certificate
from .maps.moved_rings import move_rings
from .maps.regions import RigidRegion
from .maps.triangulated.map import TriangulatedMap
from .meshes.flatten import Flattening
from .options import TOLERANCE
from .pins import Softness
from .status import Status

if TYPE_CHECKING:
    from .pixels.preimages import AnyMap as PixelMap

INTERIOR_POINTS = 2000
"""Points at which figures over an area are evaluated: percentiles are then right to about one percent."""
# Relative to the diameter: largest distance of the polygon drawn for a curved image of the boundary.
FLATNESS_SHARE = 1e-4


Data = TypeVar("Data", bound="FitData")


@dataclass(frozen=True, eq=False)
class Details:
    """How a map was set up: what it stands for besides two outlines, and how it was requested.

    Attributes:
        hole_partners: for each boundary of the map but the outer one, the hole of the source and of the target;
            -1 for a slit.
        filled: if concavities of one shape are filled, the map's outline including these, in the source and in
            the image; None for the map of whole outlines.
        layouts: flattenings of the surfaces that source and target stand for; None for planar domains.
        drawings: the whole drawings of source and target, if the map is one of drawings: `source` and `target`
            are then the outlines of frames around them, or of their only parts.
        opaque: whether the texture also covers the gaps between the source's parts.
        place: "fill"; or "inside" or "slice", if the drawings keep their proportions, and `source` and `target`
            are the outlines of the parts that are mapped onto each other.
        softness: of the balanced method's pins, with the radii and tolerances that were chosen; None for
            methods that weight pins.
        tolerance: requested distance between the image of the boundary and the target, relative to the
            diagonal.
    """

    hole_partners: Sequence[tuple[int, int]] = ()
    filled: tuple[Complex, Complex] | None = None
    layouts: tuple[Flattening | None, Flattening | None] = (None, None)
    drawings: tuple[Drawing, Drawing] | None = None
    opaque: bool = True
    place: str = "fill"
    softness: Softness | None = None
    tolerance: float = TOLERANCE


@dataclass(frozen=True, eq=False)
class FitData:
    """The data of a result, see `iccm.Fit`; how the solver ended by its own criteria is private."""

    map: AnyMap
    _ended: Status
    energies: list[dict[str, float]]
    source: Curve
    target: Curve | None
    pins: Complex
    strokes: list[tuple[Curve, Curve]]
    notes: list[str] = field(default_factory=list)
    source_holes: Sequence[Curve] = ()
    target_holes: Sequence[Curve] = ()
    rigid: Sequence[RigidRegion] = ()
    axes: tuple[str, str] = UP
    details: Details = field(default_factory=Details)
    # with the triangles that fill holes of the target, so that a drag can continue from there
    _covering_map: TriangulatedMap | None = None

    @cached_property
    def image(self) -> Complex:
        """The image of the boundary of the map's polygon, in order; a curved one is approximated to FLATNESS_SHARE."""
        map = self.map
        if isinstance(map, TriangulatedMap):
            return map(map.polygon)
        return outline(map, FLATNESS_SHARE * Curve(map.jet_inside(map.polygon)[0]).diameter)

    @cached_property
    def coverage(self) -> Coverage:
        """The parts of both shapes that the map covers."""
        return Coverage(
            map=self.map,
            image=self.image,
            source=self.source,
            target=self.target,
            source_holes=self.source_holes,
            target_holes=self.target_holes,
            hole_partners=self.details.hole_partners,
            is_filled=self.details.filled is not None,
            drawings=self.details.drawings,
            opaque=self.details.opaque,
        )

    @cached_property
    def certificate(self) -> Certificate:
        """The part of the source on which the map is proven to be one-to-one."""
        if isinstance(self.map, TriangulatedMap):
            return self.map.injectivity
        return injectivity.certify(self.map)

    @property
    def _diagonal(self) -> float:
        """The unit of reported lengths: the diagonal of the target's bounding box, or of the image's."""
        return (self.target or Curve(self.image)).diagonal

    @property
    def _boxes(self) -> tuple[Box, Box]:
        """The bounding boxes of source and target; of the whole drawings, even if only parts of them are mapped."""
        if self.details.place != "fill" and self.details.drawings is not None:
            bounds = [drawing.painted.bounds for drawing in self.details.drawings]
            source, target = ((complex(*box[:2]), complex(*box[2:])) for box in bounds)
            return source, target
        return self.source.box, (self.target or Curve(self.image)).box

    @cached_property
    def _interior(self) -> Complex:
        """About INTERIOR_POINTS points spread evenly over the inside of the source."""
        return interior_grid(Curve(self.map.polygon), INTERIOR_POINTS, self.coverage.openings[0])

    @property
    def _moved_rings(self) -> list[Complex]:
        """The images of the source drawing's rings, with edges subdivided so that they follow the map."""
        return [] if self.details.drawings is None else move_rings(self.map, self.details.drawings[0].rings)

    @property
    def _visible_map(self) -> "PixelMap":
        """The map restricted to what pictures show.

        A map of whole drawings is restricted to what the target paints, and that of a deformed drawing to the
        image of what it paints itself.
        """
        if self.details.drawings is None:
            return self.map
        from .pixels.composed import PaintedMap

        return PaintedMap(
            self.map, self._moved_rings if self.target is None else self.details.drawings[1].rings
        )

    def _inverse(self, w: Complex) -> Complex:
        """Return the points z (complex) with map(z) = w; NaN if there are none."""
        if isinstance(self.map, TriangulatedMap):
            return self.map.inverse(w)
        return inverse.inverse(self.map, w)


def with_details(fit: Data, **changes: Any) -> Data:
    """Return a result with some of its `Details` changed."""
    return replace(fit, details=replace(fit.details, **changes))
