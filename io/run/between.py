"""Intermediate drawings of a morph: the movement of the plane, what is painted there, and how colours are blended.

The map of two drawings defines the movement of the plane; `iccm.morph` gives the maps of the source's frame onto the
intermediate ones. What is painted changes, too: a part or hole of one drawing may lie in a gap of the other. The source
is therefore moved forward and the target back, and the drawing between both (`drawings.intermediate`) is painted: its
parts and holes grow and shrink. In drawings of flat colours, so do the areas of each colour. Other pictures are
blended, one fading out while the other fades in (Beier and Neely, *Feature-based image metamorphosis*, SIGGRAPH 1992),
and have the colours of one where the other paints nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...arrays import Box, Complex
from ...curve import Curve, polygon_of
from ...drawings.drawing import Drawing
from ...drawings.intermediate import intermediate, intermediate_areas
from ...flattening.interpolation import morph
from ...maps.moved_rings import move_rings
from ...maps.triangulated.map import TriangulatedMap
from ...result import Fit
from ..artwork.areas import Area
from ..shapes.shape import Shape
from . import flat_colours
from .flat_colours import FlatArea, Partners
from .parts import Pair

SOURCE, TARGET = 0, 1
SAME_AREA_SHARE = 1e-6
"""Relative to the area inside a map's outlines: a smaller difference to what a drawing paints is rounding."""

SAME_COLOUR_AREA_SHARE = 1e-3
"""The same for an area of one colour and what its drawing paints: curves are flattened with different tolerances."""


@dataclass(frozen=True, eq=False)
class MorphPath:
    """The path of a drawing, or of a part of one, to another.

    Attributes:
        pair: the shapes.
        fit: the map from the source to the target.
        drawings: what both shapes paint.
        shares: positions of the frames, from 0 to 1.
        maps: of the source onto each intermediate shape, including the first and the last one.
    """

    pair: Pair
    fit: Fit
    drawings: tuple[Drawing, Drawing]
    shares: Sequence[float]
    maps: list[TriangulatedMap]

    @classmethod
    def of(
        cls, pair: Pair, fit: Fit, shares: Sequence[float], placed: tuple[complex, complex], *, filled: bool
    ) -> MorphPath:
        """Return the path along the map of a pair.

        Args:
            pair: the shapes.
            fit: the map of the source onto the target.
            shares: positions along the path, from 0 to 1.
            placed: (a, b) of the similarity a z + b that places the source at the start of the path.
            filled: whether the holes of shapes are painted over.
        """
        drawings = fit.details.drawings or (_enclosed(pair[SOURCE], filled), _enclosed(pair[TARGET], filled))
        return cls(pair, fit, drawings, shares, list(morph(fit, shares, placed=placed)))

    @property
    def is_plain(self) -> bool:
        """Whether both drawings paint all that the map's outlines enclose, so that nothing appears or vanishes."""
        outlines = (self.fit.source, self.fit.source_holes), (self.fit.target, self.fit.target_holes)
        return all(
            outline is not None
            and abs(outline.area - sum(abs(hole.area) for hole in holes) - drawing.region.area)
            <= SAME_AREA_SHARE * outline.area
            for (outline, holes), drawing in zip(outlines, self.drawings)
        )

    def is_one_area(self, first: Sequence[FlatArea], second: Sequence[FlatArea]) -> bool:
        """Return whether each drawing is one area of one colour and opacity, which is all that it paints."""
        alpha = {flat.colour[3] for flat in (*first, *second)}
        return len(first) == len(second) == len(alpha) == 1 and all(
            abs(flat.area.region.area - drawing.region.area) <= SAME_COLOUR_AREA_SHARE * drawing.region.area
            for flat, drawing in zip((*first, *second), self.drawings)
        )

    def moved(self, number: int, side: int) -> Drawing:
        """Return what a side paints, moved to a frame."""
        return self._moved(number, side, self.drawings[side])

    def _moved(self, number: int, side: int, drawing: Drawing) -> Drawing:
        return Drawing.of_rings(move_rings(self._maps_to(number)[side], drawing.rings))

    def painted(self, number: int) -> Drawing:
        """Return what a frame paints."""
        return intermediate(self.moved(number, SOURCE), self.moved(number, TARGET), self.shares[number])

    def outlines(self, number: int) -> list[Complex]:
        """Return the boundaries of what the source paints, moved to a frame: the same vertices in all frames."""
        return move_rings(self.maps[number], self.drawings[SOURCE].rings)

    def partners(self, first: Sequence[FlatArea], second: Sequence[FlatArea]) -> Partners:
        """Pair the flat areas of both drawings that become each other."""
        mapped = [FlatArea(flat.colour, self._moved(-1, SOURCE, flat.area)) for flat in first]
        return [
            (None if k is None else first[k], None if j is None else second[j])
            for k, j in flat_colours.pairs(mapped, second)
        ]

    def layers(self, number: int, partners: Partners) -> list[Area]:
        """Return what a frame paints, as one layer for each pair of flat areas."""
        share = self.shares[number]
        first, second = (
            [None if flat is None else self._moved(number, side, flat.area) for flat in flats]
            for side, flats in zip((SOURCE, TARGET), zip(*partners))
        )
        if share in (0, 1):
            covering = flat_colours.covering(second if share else first)
        else:
            covering = intermediate_areas(first, second, share)
        colours = [flat_colours.mixed(*pair, share) for pair in partners]
        return flat_colours.layers_of(colours, covering)

    def _maps_to(self, number: int) -> tuple[TriangulatedMap, TriangulatedMap]:
        """Return the maps of the source and of the target onto a frame."""
        onto_frame = self.maps[number]
        back = TriangulatedMap(self.maps[-1].image, onto_frame.image, onto_frame.faces, onto_frame.loops)
        return onto_frame, back

    def layer(self, number: int, box: Box, *, picture: int, painted: Drawing | None) -> tuple[Pair, Fit]:
        """Return a layer of a frame: a shape, the frame as another shape, and the map between them.

        Args:
            number: index of the frame, from 0.
            box: the canvas of all frames.
            picture: the side whose picture it shows.
            painted: limits what is shown; None: everything inside the map's outline.
        """
        onto_frame, maps = self.maps[number], self._maps_to(number)
        outline, *holes = [onto_frame.image[loop] for loop in onto_frame.loops]
        shape = replace(self.pair[TARGET], curve=Curve(outline), box=box, holes=tuple(holes), extent=None)
        drawings = None if painted is None else (self.drawings[picture], painted)
        fit = self.fit
        assert fit.target is not None
        layer_fit = replace(
            fit,
            map=maps[picture],
            source=fit.target if picture else fit.source,
            source_holes=fit.target_holes if picture else fit.source_holes,
            target=shape.curve,
            target_holes=tuple(Curve(hole) for hole in holes),
            details=replace(fit.details, drawings=drawings),
        )
        return (self.pair[picture], shape), layer_fit


def _enclosed(shape: Shape, filled: bool) -> Drawing:
    """Return the region inside a single outline as a drawing."""
    return Drawing(polygon_of(shape.curve.z, *(() if filled else shape.holes)))
