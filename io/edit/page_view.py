"""A pair of shapes as the page shows it: coordinates, texture, drawings, meshes, and the images of maps."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Box, Complex
from ...drawings.detail import Detail
from ...maps.moved_rings import move_rings
from ...maps.regions import outline_in_source
from ...maps.triangulated.map import TriangulatedMap
from ...pins import Softness
from ...pixels.paper import on_paper
from ...result import Fit
from ..run import framing, texture
from ..shapes.mesh_shape import MeshShape
from ..shapes.shape import Shape
from .bent import bent_places
from .map_update import ShownSilhouette
from .messages import Scene
from .own_drawing import own_drawing
from .pair import PLACE_DIGITS, Pair
from .scene import PageHalf, patches, png
from .suggest import axis, corners
from .surface_view import SurfaceView, lay_out


class PageView:
    """What the page shows of a pair, in its own coordinates (see `scene`)."""

    def __init__(self, pair: Pair) -> None:
        self._pair, self._image = pair, pair.run.image

    @cached_property
    def halves(self) -> tuple[PageHalf, PageHalf]:
        """The coordinate systems of both halves of the page."""
        source, target = self.boxes
        return PageHalf.of(source, self._pair.source.curve.box), PageHalf.of(
            target, self._pair.target.curve.box
        )

    @cached_property
    def surfaces(self) -> tuple[SurfaceView | None, SurfaceView | None]:
        """The views of the sides that are meshes."""
        source, target = (
            SurfaceView(shape) if isinstance(shape, MeshShape) else None
            for shape in (self._pair.source, self._pair.target)
        )
        return source, target

    @property
    def boxes(self) -> tuple[Box, Box]:
        """The box that the texture covers, and the box that pictures show."""
        pair = self._pair
        return texture.box_of(pair.job, pair.source, self._image), framing.picture_box(pair.job, pair.target)

    @property
    def notes(self) -> list[str]:
        """Notes on the inputs."""
        pair = self._pair
        return [
            *(f"{shape.spec}: {note}" for shape in (pair.source, pair.target) for note in shape.notes),
            *pair.run.notes,
            *framing.remarks(pair.job, pair.source, pair.target),
            *self._image.notes,
        ]

    def describe(self) -> dict[str, Any]:
        """Return what the page needs to know about the pair before it draws."""
        pair = self._pair
        sides = []
        for shape, half, surface, box in zip(
            (pair.source, pair.target), self.halves, self.surfaces, self.boxes
        ):
            side = half.describe(shape, box) | {"mesh": surface is not None, "canvas": half.box(shape.box)}
            if surface is not None:
                side |= surface.describe()
            else:
                side |= {"corners": half.points(corners(shape.curve)[0]), "axis": _axis(half, shape)}
            sides.append(side)
        return {
            "source": sides[0],
            "target": sides[1],
            "notes": self.notes,
            "edge": pair.job.edge,
            "filter": pair.job.filter,
            "holes": pair.job.holed,
            "digits": PLACE_DIGITS,
            "mean": self._magnification,
            "deforming": pair.deforming,
        }

    @property
    def _magnification(self) -> float:
        """The mean scale from the texture's plane to the target, in the page's coordinates of both."""
        surface, (source, target) = self.surfaces[1], self.halves
        scale = surface.scale if surface else target.scale
        area_ratio = self._pair.source.curve.area / self._pair.target.curve.area
        return float(np.sqrt(area_ratio) * scale / source.scale)

    @lru_cache(maxsize=2)  # noqa: B019  (there is one view in a session)
    def texture(self, most: int, *, toned: bool = False) -> bytes:
        """Return the texture as PNG with at most so many pixels a side, on the paper that a tone lies on if `toned`."""
        image, job, source = self._image, self._pair.job, self._pair.source
        if isinstance(source, MeshShape) and texture.on_mesh(job, source):
            image = lay_out(job, source, image, self.boxes[0], most)
        if texture.on_paper(job, source) and image.alpha >= 0:
            placed = image.texture(self.boxes[0], kind=job.kind)
            filled = on_paper(
                placed, toned=toned
            )  # with its antialiased edge, since the whole texture is shown
            image = image.with_pixels(filled.pixels, filled.alpha)
        return png(image, most)

    def drawing(self, side: str) -> tuple[bytes, str] | None:
        """Return content and media type of the picture in the file of a side, if there is one."""
        return own_drawing(self._pair.source if side == "source" else self._pair.target)

    def triangles(self, side: str) -> bytes:
        """Return a mesh for the page: its triangles, and for the source the vertices' places in the texture plane.

        Raises:
            KeyError: that side is not a mesh.
        """
        surface = self.surfaces[side == "target"]
        if surface is None:
            raise KeyError(side)
        flat = self.halves[0](surface.shape.flattening.flat) if side == "source" else np.zeros(0, "f4")
        return surface.triangles + flat.astype("<f4").tobytes()

    @cached_property
    def detail(self) -> Detail | None:
        """The edges of the picture that is mapped; None for meshes, and for a checkerboard, which has no features."""
        run = self._pair.run
        is_picture = texture.has_texture(run.job, self._pair.source) and run.job.kind == "colour"
        if self._pair.has_mesh or not is_picture:
            return None
        return run.detail or texture.detail_of(run.job, self._pair.source, self._image, run.box)

    def bent(self, maps: list[TriangulatedMap]) -> list[dict[str, Any]]:
        """Return the features of the picture that maps bend, in file units."""
        if self.detail is None:
            return []
        source, target = self._pair.source, self._pair.target
        return [
            {
                "source": source.to_file(place.point).tolist(),
                "target": target.to_file(place.image).tolist(),
                "radius": place.radius / source.unit_at(place.point),
            }
            for place in bent_places(maps, self.detail, source.curve)
        ]

    def image_of(self, maps: Sequence[TriangulatedMap]) -> NDArray[np.float32]:
        """Return what the page draws of the maps of all parts.

        This is `scene.patches`, or for a mesh the place (n, 2) of each vertex in the texture plane, as `iccm map`
        writes it.
        """
        target = self._pair.target
        if isinstance(target, MeshShape):
            return self.halves[0](maps[0].extended_inverse(target.flattening.flat)[0])
        return np.concatenate([patches(map, *self.halves) for map in maps])

    def deformed_rings(self, map: TriangulatedMap) -> list[list[list[float]]]:
        """Return the rings of a deformed shape: the outline of its frame and what is painted, or its outline and holes.
        Empty for shapes that are mapped onto a target.
        """
        if not self._pair.deforming:
            return []
        rings = [map.image[loop] for loop in map.loops]
        if self._pair.source.drawing is not None:
            rings = [rings[0], *move_rings(map, self._pair.source.drawing.rings)]
        return [self.halves[1].points(ring) for ring in rings]

    def silhouette(self, silhouette: ShownSilhouette | None) -> dict[str, Any]:
        """Return what pictures show of the target in the page's coordinates; empty if it is what the target paints."""
        if silhouette is None:
            return {}
        rings, toned = ([self.halves[1].points(ring) for ring in side] for side in silhouette[:2])
        return {"rings": rings, "toned": toned, "colors": list(silhouette.colors)}

    def regions(self, fit: Fit, report: dict[str, Any]) -> list[dict[str, Any]]:
        """Return the figures of rigid regions with their outlines on both sides."""
        regions = []
        for region, region_figures in zip(fit.rigid, report.get("regions", ())):
            outline = outline_in_source(region, fit.inverse)
            image = [] if self.surfaces[1] else self.halves[1].points(fit.map(outline))
            regions.append({**region_figures, "source": self.halves[0].points(outline), "target": image})
        return regions

    def soft_pins(
        self, scene: Scene, pins: Complex, map_pins: Complex, softness: Softness | None
    ) -> list[dict[str, float] | None]:
        """Return the radius and tolerance of each soft pin of a scene in file units; None for exact pins.

        Args:
            scene: the pins as listed.
            pins: (k, 2) those pins in the core plane; more may follow.
            map_pins: (j, 2) the pins of the map, without those in holes.
            softness: of the map's pins; None if all are exact.
        """
        if softness is None:
            return []
        soft_pins: list[dict[str, float] | None] = []
        for point, image in pins[: len(scene.pins)]:
            numbers = np.flatnonzero((map_pins[:, 0] == point) & softness.is_soft)
            if not numbers.size:
                soft_pins.append(None)
                continue
            radius, tolerance = float(softness.radii[numbers[0]]), float(softness.tolerances[numbers[0]])
            soft_pins.append(
                {
                    "radius": radius / self._pair.source.unit_at(point),
                    "tolerance": tolerance / self._pair.target.unit_at(image),
                }
            )
        return soft_pins


def _axis(half: PageHalf, shape: Shape) -> float | None:
    """Return the abscissa of a mirror axis in page coordinates, if there is one."""
    point = axis(shape.curve)
    return None if point is None else float(half(np.array(point))[0])
