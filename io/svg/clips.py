"""Cut shapes by clip paths and masks."""

from collections.abc import Callable

import shapely
from tinycss2.color3 import RGBA, parse_color

from ...polygons import unite
from .. import limits
from . import crossings
from .budget import Quota
from .fill import painted, rings_of
from .path_data import Subpath
from .strokes import painted_by_stroke
from .tree import Clip, Node

HAIR_AREA_SHARE = 1e-9  # of a shape's area: a smaller loss comes from rounding


class Clips:
    """Cuts shapes by the clip paths and masks that apply to them; each of these is drawn only once.

    A mask shows what it paints, except black if it is a luminance mask. Partial transparency counts as shown.
    """

    def __init__(self, runs: Callable[[Node], list[Subpath]]):
        self.runs = runs
        self._areas: dict[Clip, shapely.Geometry] = {}
        self.work = Quota(
            limits.CUT_POINTS,
            "clip paths and masks cut too many shapes; apply them (Inkscape: Path > Intersection)",
        )

    def cut(self, node: Node, region: shapely.Geometry) -> shapely.Geometry:
        """Return the part of a shape's painted region that is shown; the region itself if nothing is hidden.

        Raises:
            InputError: a clip path is malformed, or crosses the region too often.
        """
        for clip in node.clips:
            if clip.properties is not None and not region.is_empty:
                region = self._inside(region, clip)
        return region

    def _inside(self, region: shapely.Geometry, clip: Clip) -> shapely.Geometry:
        area = self._area(clip)
        if area.covers(region):
            return region
        counts = [int(shapely.get_num_coordinates(geometry)) for geometry in (region, area)]
        self.work.spend(sum(counts))
        if counts[0] * counts[1] > limits.CROSSINGS:
            crossings.check([*rings_of(region), *rings_of(area)])
        visible = shapely.intersection(region, area)
        return region if region.area - visible.area <= HAIR_AREA_SHARE * region.area else visible

    def _area(self, clip: Clip) -> shapely.Geometry:
        if clip not in self._areas:
            area = self._mask(clip) if clip.name == "mask" else self._clip_path(clip)
            shapely.prepare(area)
            self._areas[clip] = area
        return self._areas[clip]

    def _clip_path(self, clip: Clip) -> shapely.Geometry:
        """Return the area that the clip path's shapes enclose, whether they paint it or not."""
        return unite([self.cut(node, self._filled(node, "clip-rule")) for node in clip.shapes])

    def _mask(self, clip: Clip) -> shapely.Geometry:
        by_luminance = (clip.properties or {}).get("mask-type", "luminance").strip() != "alpha"
        area: shapely.Geometry = shapely.Polygon()
        for node in clip.shapes:
            for paint, region in self._painted(node):
                dark = by_luminance and _is_black(node.properties.get(paint, "black"))
                crossings.check([*rings_of(area), *rings_of(region)])
                area = (shapely.difference if dark else shapely.union)(area, self.cut(node, region))
        return area

    def _painted(self, node: Node) -> list[tuple[str, shapely.Geometry]]:
        filled = [("fill", self._filled(node, "fill-rule"))] if node.filled else []
        return filled + ([("stroke", painted_by_stroke(node, self.runs(node)))] if node.stroked else [])

    def _filled(self, node: Node, rule: str) -> shapely.Geometry:
        rings = [run.z for run in self.runs(node) if run.z.size > 2]
        return shapely.MultiPolygon(painted(rings, node.properties.get(rule, "nonzero").strip()))


def _is_black(paint: str) -> bool:
    colour = parse_color(paint)
    return isinstance(colour, RGBA) and not any(colour[:3])
