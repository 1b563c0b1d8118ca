"""The result of a solve: a map, how the solver ended (`status`), and figures about its quality."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from .arrays import Box, Complex, Flags
from .axes import AXES, UP, is_pairs, on_pairs
from .blas import on_one_thread
from .coverage import Coverage
from .curve import Curve, boundary_samples, closer_outline, hausdorff, interior_grid
from .drawings.drawing import Drawing
from .drawings.seen import Seen, shares_seen
from .errors import InputError
from .maps import distortion, harmonic, injectivity, inverse
from .maps.approximation import AnyMap, triangulated
from .maps.boundary_image import outline
from .maps.distortion import Distortion
from .maps.extended_inverse import ExtendedInverse
from .maps.injectivity import Certificate
from .maps.moved_rings import move_rings
from .maps.regions import Region, mean_scale, triangles_in
from .maps.summary import CERTAIN_SHARE, SEEN_CRACKS_SHARE, SEEN_FOLDS_SHARE, WELL_SEEN_SHARE, in_short
from .maps.triangulated.map import TriangulatedMap
from .meshes.flatten import Flattening
from .meshes.surface_distortion import distances_at, gap_between, on_surfaces, surface_distances
from .options import PLACES, TOLERANCE
from .pins import Softness
from .problem import ON_OUTLINE_SHARE
from .saved.map_file import DRAWING_RINGS, RINGS, MapFile, Plane, read
from .status import Status
from .transform import Transform

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .pixels.preimages import AnyMap as PixelMap

PLOTTED_PIXELS = 480  # of the picture in a plot, on its longer side
INTERIOR_POINTS = 2000
"""Points at which figures over an area are evaluated: percentiles are then right to about one percent."""
MOST_LOST_SHARE = 0.01  # of the source's area
FAR_OFF_TOLERANCES = 30
"""Tolerances: an outline that is farther from the target's does not meet it, whatever the weights."""
SQUEEZED_AREA_SHARE = 2e-3
"""Relative to a surface's area. Good maps with landmarks have at most 1.1e-3 (cow); a map that lost protrusions
had 2.4e-3 (fox, 622 triangles).
"""
SAME_PLACE_SHARE, DRIFT_SHARE = 0.04, 0.03
"""Relative to a mesh's diagonal: surfaces closer than the first are in the same place; a map that moves points
by the second more than that has drifted. Maps between copies of one model move points by at most 0.006
(docs/reference/shapes.md).
"""
# Relative to the diameter: largest distance of the polygon drawn for a curved image of the boundary.
FLATNESS_SHARE = 1e-4
# Relative to the source's diagonal: an inverse with a larger error is another point.
INVERSE_ERROR_SHARE = 1e-6


@dataclass(frozen=True, eq=False)
class Fit:
    """The result of `iccm.fit` and `iccm.deform`.

    Attributes:
        map: the continuous map from source to target.
        ended: how the solver ended, by its own criteria; `status` takes all figures into account.
        energies: one dict per iteration, from term name to value, with "total"; lengths are relative to the
            target's radius.
        source: the domain of the map.
        target: boundary of the target; None for a deformation.
        pins: (k, 2) complex, source and target of each pin.
        strokes: pairs of source and target strokes.
        notes: messages about decisions of the solver, such as omitted content.
        source_holes: outlines of the source's holes, clockwise.
        target_holes: those of the target's.
        hole_partners: for each boundary of the map but the outer one, the hole of the source and of the target;
            -1 for a slit.
        passed_holes: holes of the source, and of the target, that the map ignores.
        filled: if concavities of one shape are filled, the map's outline including these, in the source and in
            the image; None for the map of whole outlines.
        layouts: flattenings of the surfaces that source and target stand for; None for planar domains.
        rigid: the rigid regions, with their similarities and remaining distortion.
        tolerance: requested distance between the image of the boundary and the target, relative to the
            diagonal.
        axes: meaning of pairs of numbers in the source and in the target, see `iccm.axes`.
        drawings: the whole drawings of source and target, if the map is one of drawings: `source` and `target`
            are then the outlines of frames around them, or of their only parts.
        opaque: whether the texture also covers the gaps between the source's parts.
        place: "fill"; or "inside" or "slice", if the drawings keep their proportions, and `source` and `target`
            are the outlines of the parts that are mapped onto each other.
        softness: of the balanced method's pins, with the radii and tolerances that were chosen; None for
            methods that weight pins.

    >>> import iccm
    >>> square = np.array([0, 1, 1 + 1j, 1j])
    >>> fit = iccm.fit(square, 2 * square)
    >>> complex(np.round(fit.inverse(1 + 1j), 3)), fit.report()["injective"]["certified"]
    ((0.5+0.5j), True)
    """

    map: AnyMap
    ended: Status
    energies: list[dict[str, float]]
    source: Curve
    target: Curve | None
    pins: Complex
    strokes: list[tuple[Curve, Curve]]
    notes: list[str] = field(default_factory=list)
    source_holes: Sequence[Curve] = ()
    target_holes: Sequence[Curve] = ()
    hole_partners: Sequence[tuple[int, int]] = ()
    passed_holes: tuple[Sequence[Curve], Sequence[Curve]] = ((), ())
    filled: tuple[Complex, Complex] | None = None
    layouts: tuple[Flattening | None, Flattening | None] = (None, None)
    rigid: Sequence[Region] = ()
    tolerance: float = TOLERANCE
    axes: tuple[str, str] = UP
    drawings: tuple[Drawing, Drawing] | None = None
    opaque: bool = True
    place: str = "fill"
    softness: Softness | None = None
    # with the triangles that fill holes of the target, so that a drag can continue from there
    _covering_map: TriangulatedMap | None = None

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if not name.startswith("_")]

    def __repr__(self) -> str:
        counts = [("pin", len(self.pins)), ("stroke", len(self.strokes)), ("hole", len(self.source_holes))]
        suffix = "".join(f", {count} {name}{'s' * (count > 1)}" for name, count in counts if count)
        kind, count = type(self.map).__name__, self.map.polygon.size
        return f"<Fit: {self.ended.name.lower()}, {kind} with {count} boundary vertices{suffix}>"

    @cached_property
    def status(self) -> Status:
        """How the solver ended, taking all figures of the report into account.

        Even if the solver ended well, the map may fold, pins may pull it far from the target's outline, or it
        may twist one surface relative to the other; then the status is not `ok`.
        """
        if not self.ended.ok:
            return self.ended
        if self.lost > MOST_LOST_SHARE:
            return Status.FOLDED
        if self.ended in (Status.DECREASE, Status.THRESHOLD) and self.is_far_off:
            return Status.GAP
        if self.ended is not Status.REACHED or not all(self.layouts):
            return self.ended
        if self.distortion.strain:
            return Status.TWISTED
        return Status.DRIFTED if self.has_drifted else self.ended

    @property
    def has_drifted(self) -> bool:
        """Whether two surfaces lie in the same place, including their landmarks, and the map moves points far away."""
        source, target = self.layouts
        assert source is not None and target is not None
        away = self._apart["apart"]["p95"]
        if away <= DRIFT_SHARE or (gap := gap_between(source, target)) > SAME_PLACE_SHARE:
            return False
        if len(self.pins) and np.median(distances_at(self.pins, source, target)) > gap + DRIFT_SHARE:
            return False  # landmarks move points, too
        return away > gap + DRIFT_SHARE

    @property
    def is_far_off(self) -> bool:
        """Whether the image of the boundary is more than `FAR_OFF_TOLERANCES` tolerances from the target."""
        return self.target is not None and self.boundary["hausdorff"] > FAR_OFF_TOLERANCES * self.tolerance

    @cached_property
    def certificate(self) -> Certificate:
        """The part of the source on which the map is proven to be one-to-one."""
        if isinstance(self.map, TriangulatedMap):
            return self.map.injectivity
        return injectivity.certify(self.map)

    @cached_property
    def lost(self) -> float:
        """Share of the source's area that the inverse does not recover.

        There it folds or shrinks below numerical precision. The share is sampled, unless the certificate covers
        nearly all of the source.
        """
        if self.certificate.share >= CERTAIN_SHARE or (self.target is None and self.certificate.zeros == 0):
            # Without a target, a map without folds may overlap itself, which is reported for the outline.
            return 0.0
        z = self.interior
        back = self.inverse(self.map.jet(z)[0])
        is_recovered = np.abs(back - z) <= INVERSE_ERROR_SHARE * Curve(self.map.polygon).diagonal
        return float(np.mean(~is_recovered))

    @property
    def iterations(self) -> int:
        """Number of local and global steps."""
        return max(0, len(self.energies) - 1)

    def inverse(self, w: Complex) -> Complex:
        """Return the points z with map(z) = w.

        The result is NaN if there are none (for balanced maps, more than 1e-3 of the diagonal outside). Points
        are complex numbers of any shape, or pairs (…, 2); the result has the same form.
        """
        if is_pairs(w):
            return on_pairs(self.inverse, w, self.axes[::-1])  # type: ignore[return-value]
        if isinstance(self.map, TriangulatedMap):
            return self.map.inverse(w)
        return inverse.inverse(self.map, w)

    @property
    def transform(self) -> Transform:
        """The map and its inverse with the interface of scikit-image's transforms.

        Points are complex or pairs of x and y. Pairs are always x and y, as in `skimage.transform`; y is down
        if the shapes were given that way. The inverse has a value everywhere inside the target: where the
        target stays bare, it is that of the nearest covered point.
        """
        source, target = ("xy" if axes == "xy" else "screen" for axes in self.axes)
        return Transform(self.map, self._inverse_inside, (source, target))

    def _inverse_inside(self, w: Complex) -> Complex:
        """Return the inverse; inside the target, where it is not covered, that of the nearest point of the image."""
        w = np.asarray(w, np.complex128)
        z = self.inverse(w)
        if self.target is None:
            return z
        flat, preimages = w.ravel(), z.ravel()
        missing = np.flatnonzero(np.isnan(preimages) & np.isfinite(flat))
        missing = missing[self.target.contains(flat[missing])]
        for hole in self.target_holes:
            missing = missing[~hole.contains(flat[missing])]
        if missing.size:
            preimages = preimages.copy()
            preimages[missing] = ExtendedInverse(self.map)(flat[missing])
        return preimages.reshape(w.shape)

    def inverted(self) -> Transform:
        """Return the transform from target to source."""
        return self.transform.inverse

    def then(self, other: "Fit | Transform") -> Transform:
        """Return the composition: this map first, then `other`, which starts from its target."""
        return self.transform.then(other.transform if isinstance(other, Fit) else other)

    def save(self, path: str | PathLike, planes: tuple[Plane, Plane] | None = None, **about: Any) -> None:
        """Write the map to a file that `iccm.load` reads exactly, bit for bit. The name should end in .npz.

        Args:
            path: the file; it is replaced.
            planes: coordinate frames and canvases of the source's and the target's files, which are saved too;
                by default y up and bounding boxes.
            **about: further JSON data for `MapFile.about`.

        Raises:
            InputError: the map is between flattened surfaces.
        """
        if any(self.layouts):
            raise InputError("save: the map of a mesh cannot be saved, only maps between planar shapes")
        default_planes = Plane.of(self.source.z, self.source_holes), Plane.of(self.image, self.target_holes)
        if self.place != "fill":
            default_planes = (
                replace(default_planes[0], box=self.boxes[0]),
                replace(default_planes[1], box=self.boxes[1]),
            )
        outlines = self.source.z, self.target.z if self.target else None
        saved_planes = [replace(plane, outline=z) for plane, z in zip(planes or default_planes, outlines)]
        sides = zip(*self.strokes) if self.strokes else ((), ())
        curves = (*sides, self.source_holes, self.target_holes, *self.passed_holes)
        rings = {name: [curve.z for curve in group] for name, group in zip(RINGS, curves)}
        data = {"ended": self.ended.name, "notes": self.notes, "energies": self.energies, **about}
        data |= {"tolerance": self.tolerance, "axes": list(self.axes)}
        data |= {} if self.softness is None else {"softness": self.softness.as_lists()}
        arrays = {"pins": self.pins, "hole_partners": self.hole_partners}
        rings["filled"] = list(self.filled or ())
        for side, name in enumerate(DRAWING_RINGS):
            rings[name] = self.drawings[side].rings if self.drawings else []
        data |= {"opaque": self.opaque, "place": self.place}
        rings["rigid"] = [ring for region in self.rigid for ring in region.rings]
        data["rigid"] = [len(region.rings) for region in self.rigid]
        data["rigid_of_target"] = any(region.of_target for region in self.rigid)
        MapFile(self.map, (saved_planes[0], saved_planes[1]), arrays, rings, data).write(path)

    @classmethod
    def of(cls, map_file: MapFile) -> "Fit":
        """Return the result that a map file contains.

        Raises:
            InputError: the data about the map are inconsistent.
        """
        about, (source, target) = map_file.about, map_file.planes
        ended: str = about["ended"]
        notes: list[str] = about.get("notes", [])
        energies: list[dict[str, float]] = about.get("energies", [])
        tolerance = about.get("tolerance", TOLERANCE)
        axes = about.get("axes", list(UP))
        is_tolerance = isinstance(tolerance, float) and tolerance > 0
        if not isinstance(axes, list) or len(axes) != 2 or any(axis not in AXES for axis in axes):
            raise InputError("about: the axes are not those of two planes")
        if source.outline is None or ended not in Status.__members__ or not is_tolerance:
            raise InputError("about: the description of the solver is invalid")
        begins, ends, *holes = (
            [Curve(z, not name.startswith("stroke")) for z in map_file.rings[name]] for name in RINGS[:6]
        )
        partners = [(int(i), int(j)) for i, j in map_file.arrays["hole_partners"]]
        fits = all(-1 <= i < len(holes[0]) and -1 <= j < len(holes[1]) for i, j in partners)
        fits &= target.outline is None or len(partners) == len(map_file.map.rims) - 1
        filled = map_file.rings["filled"]
        if len(begins) != len(ends) or not fits or len(filled) not in (0, 2):
            raise InputError("hole_partners, strokes, filled: inconsistent with each other")
        return cls(
            map=replace(map_file.map, axes=(axes[0], axes[1])) if tuple(axes) != UP else map_file.map,
            ended=Status[ended],
            energies=energies,
            source=Curve(source.outline),
            target=None if target.outline is None else Curve(target.outline),
            pins=map_file.arrays["pins"],
            strokes=list(zip(begins, ends)),
            notes=notes,
            source_holes=holes[0],
            target_holes=holes[1],
            hole_partners=partners,
            passed_holes=(holes[2], holes[3]),
            filled=(filled[0], filled[1]) if filled else None,
            rigid=_regions(map_file, (holes[0], holes[1])),
            tolerance=tolerance,
            axes=(axes[0], axes[1]),
            drawings=_drawings(map_file),
            opaque=about.get("opaque") is not False,
            place=about["place"] if about.get("place") in PLACES else "fill",
            softness=_softness(map_file),
        )

    def _repr_png_(self) -> bytes:
        """Return a numbered checkerboard mapped to the target, for notebooks."""
        from .pixels.thumbnail import png

        return png(self._checkerboard()[0])

    def _repr_html_(self) -> str:
        """Return the summary and a numbered checkerboard mapped to the target, for notebooks."""
        from base64 import b64encode
        from html import escape

        picture = b64encode(self._repr_png_()).decode()
        words = escape(self.summary() if self.status.ok else f"{self.summary()}. {self.status.value}")
        picture_tag = f'<img alt="the map" src="data:image/png;base64,{picture}">'
        return f"<figure>{picture_tag}<figcaption>{words}</figcaption></figure>"

    def plot(
        self,
        report: dict[str, Any] | None = None,
        names: tuple[str, str] = ("source", "mapped source"),
        carried: tuple[NDArray, Box] | None = None,
        *,
        ax: "Axes | None" = None,
    ) -> "Figure":
        """Return a matplotlib figure of the map: `fit.plot().savefig("fit.png")`.

        With `ax`, only the mapped picture and the target's outline are drawn there. Otherwise the figure shows
        a grid in the source and in the image, the mapped picture, area scale and dilatation over the source,
        and the report with its notes.

        Args:
            report: the report of the map, if it is already computed.
            names: titles of the source and of its image.
            carried: a mapped picture, 8 bits per channel in sRGB, and its box in the target's plane; by default
                a numbered checkerboard.
            ax: axes to draw into; their figure is returned.
        """
        if ax is not None:
            from .maps.figure import draw_carried

            draw_carried(ax, carried or self._checkerboard(), self.target or Curve(self.image))
            return ax.figure  # type: ignore[return-value]
        from .maps.figure import figure

        return figure(
            *(self.map, self.source, self.target, self.image),
            openings=self.openings,
            lost=self.without_partner if self.drawings is None else self.unseen,
            painted=[drawing.painted for drawing in self.drawings or ()],
            pins=self.pins,
            strokes=self.strokes,
            regions=[self.outline_of(region) for region in self.rigid],
            carried=carried or self._checkerboard(),
            report=report or self.report(),
            names=names,
        )

    def outline_of(self, region: Region) -> Complex:
        """Return (p,) the outer outline of a rigid region, in the source."""
        return self.inverse(region.rings[0]) if region.of_target else region.rings[0]

    def _checkerboard(self) -> tuple[NDArray, Box]:
        """Return a numbered checkerboard over the source's bounding box, mapped to the target, and its box there."""
        from .pixels.canvas import Canvas, proportional
        from .pixels.checkerboard import checkerboard
        from .pixels.texture import Texture
        from .pixels.warp import warp

        textured, box = self.boxes
        canvas = Canvas.about(*proportional(PLOTTED_PIXELS, box[1] - box[0]), box)
        return warp(self.map, Texture(checkerboard(), textured), canvas).pixels, canvas.box

    @cached_property
    def image(self) -> Complex:
        """The image of the boundary of the map's polygon, in order; a curved one is approximated to FLATNESS_SHARE."""
        map = self.map
        if isinstance(map, TriangulatedMap):
            return map(map.polygon)
        return outline(map, FLATNESS_SHARE * Curve(map.jet_inside(map.polygon)[0]).diameter)

    @property
    def boxes(self) -> tuple[Box, Box]:
        """The bounding boxes of source and target; of the whole drawings, even if only parts of them are mapped."""
        if self.place != "fill" and self.drawings is not None:
            bounds = [drawing.painted.bounds for drawing in self.drawings]
            source, target = ((complex(*box[:2]), complex(*box[2:])) for box in bounds)
            return source, target
        return self.source.box, (self.target or Curve(self.image)).box

    @property
    def diagonal(self) -> float:
        """The unit of reported lengths: the diagonal of the target's bounding box.

        Without a target, it is that of the image's.
        """
        return (self.target or Curve(self.image)).diagonal

    @cached_property
    def boundary(self) -> dict[str, float]:
        """Distances of the boundary's image from the target, relative to `diagonal`.

        `rms` and `hausdorff` are the root mean square and the two-sided Hausdorff distance. `given` is the
        largest distance of an image of the source's vertices as given, of which the map's polygon may have
        fewer. `source`, present if the polygon misses the source by too much, is the two-sided distance between
        these.
        """
        assert self.target is not None
        pairs = [
            (Curve(closer_outline(self.image, self.filled and self.filled[1], self.target)), self.target),
            *((image, hole) for image, hole, _, _ in self._hole_images),
        ]
        even = self.map(boundary_samples(self.map.polygon, 2))
        even_pairs = [
            (Curve(closer_outline(even, self.filled and self.filled[1], self.target)), self.target),
            *pairs[1:],
        ]
        weights = np.concatenate([image.lengths + np.roll(image.lengths, 1) for image, _ in even_pairs])
        away = np.concatenate([target.distances(image.z) for image, target in even_pairs])
        rms = np.sqrt(np.average(away**2, weights=weights))
        distances = [self.target.distances(self._image_of(self._on_outline))]
        distances += [
            hole.distances(self._image_of(self.source_holes[i].z))
            for _, hole, i, _ in self._hole_images
            if i >= 0
        ]
        return {
            "rms": float(rms) / self.diagonal,
            "hausdorff": max(hausdorff(*pair) for pair in pairs) / self.diagonal,
            "given": float(max(part.max() for part in distances)) / self.diagonal,
            **({"source": self._source_gap} if self.ended is Status.SOURCE_GAP else {}),
        }

    @property
    def _on_outline(self) -> Complex:
        """The source's vertices, as given, that are on the map's outline, not inside concavities and not left out."""
        if self.filled is None:
            return self.source.z
        tolerance = ON_OUTLINE_SHARE * self.source.diagonal
        loops = self.map.polygon, self.filled[0]
        is_near = [Curve(loop).distances(self.source.z) <= tolerance for loop in loops]
        return self.source.z[is_near[0] & is_near[1]]

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
            hole_partners=self.hole_partners,
            passed_holes=self.passed_holes,
            is_filled=self.filled is not None,
            drawings=self.drawings,
            opaque=self.opaque,
        )

    @property
    def seen(self) -> Seen | None:
        """The visible parts of both drawings; None if the map is not one of drawings."""
        return self.coverage.seen

    @property
    def moved_rings(self) -> list[Complex]:
        """The images of the source drawing's rings, with edges subdivided so that they follow the map."""
        return [] if self.drawings is None else move_rings(self.map, self.drawings[0].rings)

    @property
    def visible_map(self) -> "PixelMap":
        """The map restricted to what pictures show.

        A map of whole drawings is restricted to what the target paints, and that of a deformed drawing to the
        image of what it paints itself.
        """
        if self.drawings is None:
            return self.map
        from .pixels.composed import Cut

        return Cut(self.map, self.moved_rings if self.target is None else self.drawings[1].rings)

    @property
    def shown(self) -> float | None:
        """Share of the source drawing's painted area that the result shows."""
        return None if self.seen is None else 1 - self.seen.hidden

    @property
    def covered(self) -> float | None:
        """Share of the target drawing's painted area that shows something; for single outlines, of their area."""
        if self.seen is None:
            return None if self.target is None else 1 - self.uncovered
        return 1 - self.seen.bare

    @property
    def cracks(self) -> float:
        """The area of narrow slits in the result, relative to the target drawing's painted area."""
        return self.coverage.cracks

    @property
    def unseen(self) -> tuple[shapely.Geometry, shapely.Geometry]:
        """The hidden part of the source drawing and the bare part of the target drawing, as shapely geometries."""
        return self.coverage.unseen

    @property
    def is_partial(self) -> bool:
        """Whether parts may have no partner: concavities are filled, or holes are ignored or have no partner."""
        return self.coverage.is_partial

    @property
    def left_out(self) -> float:
        """Share of the source's area that the map leaves out, or maps into holes of the target."""
        return self.coverage.left_out

    @property
    def uncovered(self) -> float:
        """Share of the target's area that the map does not cover, or to which it maps holes of the source."""
        return self.coverage.uncovered

    @property
    def without_partner(self) -> tuple[shapely.Geometry, shapely.Geometry]:
        """The parts of the source and of the target without a partner, as shapely geometries."""
        return self.coverage.without_partner

    @property
    def openings(self) -> tuple[list[Complex], list[Complex]]:
        """The outlines of holes in the map, in the source and in the image, as closed polylines."""
        return self.coverage.openings

    @property
    def voids(self) -> Flags:
        """(m,) the triangles that fill holes of the source without a partner."""
        return self.coverage.voids

    @property
    def _source_gap(self) -> float:
        """Distance of the boundary that the map covers from the source's boundary.

        It is the two-sided Hausdorff distance, relative to the source's diagonal.
        """
        outer = closer_outline(self.map.polygon, self.filled and self.filled[0], self.source)
        pairs = [(Curve(outer), self.source)]
        if isinstance(self.map, TriangulatedMap):
            pairs += [
                (Curve(self.map.source[loop]), self.source_holes[i])
                for loop, (i, _) in zip(self.map.loops[1:], self.hole_partners)
                if i >= 0
            ]
        return max(hausdorff(*pair) for pair in pairs) / self.source.diagonal

    @property
    def _hole_images(self) -> Iterator[tuple[Curve, Curve, int, int]]:
        """The image of each hole's boundary, the outline on which it belongs, and the numbers of both holes."""
        if not isinstance(self.map, TriangulatedMap):
            return
        for loop, (i, j) in zip(self.map.loops[1:], self.hole_partners):
            yield Curve(self.map.image[loop]), self.target_holes[j], i, j

    @property
    def _has_pairs(self) -> bool:
        """Whether holes are mapped onto holes."""
        return self.target is not None and bool(self.source_holes or self.target_holes)

    @property
    def _holes_report(self) -> list[dict[str, Any]]:
        """Holes of the source and of the target, counted from 1, with the distance of their outlines."""
        pairs = [
            {
                "source": i + 1 if i >= 0 else None,
                "target": j + 1,
                "gap": hausdorff(image, hole) / self.diagonal,
            }
            for image, hole, i, j in self._hole_images
        ]
        alone = set(range(len(self.source_holes))) - {i for i, _ in self.hole_partners}
        return pairs + [{"source": i + 1, "target": None, "gap": None} for i in sorted(alone)]

    @cached_property
    def interior(self) -> Complex:
        """About INTERIOR_POINTS points spread evenly over the inside of the source."""
        return interior_grid(Curve(self.map.polygon), INTERIOR_POINTS, self.openings[0])

    @cached_property
    def distortion(self) -> Distortion:
        """Distortion of the map over the target's area, or over the image's without a target.

        If layouts stand for surfaces, it is that of the map between the surfaces.
        """
        if any(self.layouts):
            return on_surfaces(self._samples, self.layouts)
        if not isinstance(self.map, TriangulatedMap):
            return self._samples
        triangles = np.flatnonzero(~self.voids)
        if self.drawings is None or self.target is None:
            return distortion.of_triangles(self.map, triangles)
        # for whole drawings only over visible parts: the distortion of gaps is invisible
        regions = self.drawings[0].region, self.drawings[1].region
        faces = self.map.faces[triangles]
        shares = shares_seen(self.map.source, self.map.image, faces, *regions, covering=None).both
        seen_at_all = shares > 0
        if not seen_at_all.any():
            return distortion.of_triangles(self.map, triangles)
        return distortion.of_triangles(self.map, triangles[seen_at_all], shares[seen_at_all])

    @cached_property
    def triangles(self) -> Distortion:
        """Distortion of the map at the centroid of each triangle, in order.

        For a harmonic map, the triangles are those that approximate it. The `energies` of the result are the
        terms of the balanced energy.
        """
        return distortion.in_middles(triangulated(self.map))

    @property
    def _samples(self) -> Distortion:
        """Distortion of the map at points inside."""
        if isinstance(self.map, TriangulatedMap):
            return distortion.inside_triangles(self.map)
        aim = self.target or Curve(self.image)
        mean = np.sqrt(abs(aim.area / self.source.area))
        return distortion.of_inverse(self.map, interior_grid(aim, INTERIOR_POINTS), float(mean))

    def summary(self) -> str:
        """Return the most important figures in one line, as the command line shows them.

        >>> import iccm
        >>> square = np.array([0, 1, 1 + 1j, 1j])
        >>> iccm.fit(square, 2 * square).summary()
        'scale within 2× on 100 % · no folds'
        """
        return in_short(self.report())

    @on_one_thread
    def report(self) -> dict[str, Any]:
        """Return the figures of the JSON report that depend on the map only; lengths are relative to `diagonal`."""
        area = np.log10(np.maximum(np.abs(harmonic.area_scale(*self.map.jet(self.interior)[1:])), 1e-300))
        pin_errors = np.abs(self._image_of(self.pins[:, 0]) - self.pins[:, 1]) / self.diagonal
        return {
            "status": self.status.name.lower(),
            "message": self.status.value,
            "iterations": self.iterations,
            "energies": self.energies,
            "vertices": int(self.map.polygon.size),
            "boundary": self.boundary if self.target is not None else None,
            **({"holes": self._holes_report} if self._has_pairs else {}),
            **({"left_out": self.left_out, "uncovered": self.uncovered} if self.is_partial else {}),
            **({"shown": self.shown, "covered": self.covered, "cracks": self.cracks} if self.seen else {}),
            **({"regions": [region.report() for region in self.rigid]} if self.rigid else {}),
            **self._distortion_report,
            **self._apart,
            "log10_area": {
                name: _quantile(area, q) for name, q in (("p05", 0.05), ("median", 0.5), ("p95", 0.95))
            },
            "injective": self.certificate.report() | {"folded": self.lost},
            "pins": [
                {"error": float(error)} | tolerance
                for error, tolerance in zip(pin_errors, self._pin_tolerances)
            ],
            "strokes": [{"error": self._stroke_error(a, b)} for a, b in self.strokes],
            "notes": [*self.notes, *self._lost_notes, *self.doubts()],
        }

    @property
    def _pin_tolerances(self) -> list[dict[str, float]]:
        """For each soft pin, the error up to which it counts as met; empty for exact pins."""
        if self.softness is None:
            return [{}] * len(self.pins)
        pairs = zip(self.softness.is_soft, self.softness.limits / self.diagonal)
        return [{"tolerance": float(tolerance)} if soft else {} for soft, tolerance in pairs]

    @property
    def _lost_notes(self) -> list[str]:
        """Notes if large parts of either drawing are not visible, unless that was requested."""
        if self.seen is None:
            return []
        notes = []
        if self.seen.hidden > 1 - WELL_SEEN_SHARE and self.place != "slice":
            notes.append(
                f"{self.seen.hidden:.0%} of the source drawing is hidden, because it lies in gaps of the "
                "target (shown)."
            )
        if self.seen.bare > 1 - WELL_SEEN_SHARE and self.place != "inside":
            notes.append(f"{self.seen.bare:.0%} of the target drawing stays bare (covered).")
        if self.cracks > SEEN_CRACKS_SHARE:
            notes.append(
                f"Cracks cover {self.cracks:.1%} of the target drawing: slits narrower than 1 % of its "
                "size that show nothing (cracks)."
            )
        return notes

    @property
    def _distortion_report(self) -> dict[str, Any]:
        """The figures of distortion; bare parts of the target count as outside of every scale range."""
        report = self.distortion.report()
        if self.is_partial:
            report["scale"] = {name: share * (1 - self.uncovered) for name, share in report["scale"].items()}
        return report

    @cached_property
    def _apart(self) -> dict[str, Any]:
        """Distances in space between corresponding points of two surfaces."""
        source, target = self.layouts
        return {"apart": surface_distances(self._samples, source, target)} if source and target else {}

    def doubts(self) -> list[str]:
        """Return messages about figures that indicate problems of the map."""
        messages = []
        if self.lost >= SEEN_FOLDS_SHARE:
            messages.append(
                f"folds: {self.lost:.1%} of the source's area folds or shrinks to almost nothing, so the "
                "inverse map does not recover it"
            )
        if all(self.layouts) and (share := self.distortion.squeezed) >= SQUEEZED_AREA_SHARE:
            messages.append(
                f"squeezed: on {share:.1%} of a surface the map nearly folds (dilatation above 100, up to "
                f"{self.distortion.dilatations.max():.2g}); add landmarks there, or move them"
            )
        return messages

    def _image_of(self, z: Complex) -> Complex:
        """Return the images of points of the source; points outside the map's polygon are moved to its outline."""
        return self.map(Curve(self.map.polygon).pulled_in(z))

    def _stroke_error(self, source: Curve, target: Curve) -> float:
        """Return the root mean square distance of a stroke's image from its target, relative to `diagonal`."""
        image = self._image_of(source.at(np.linspace(0, source.length, 50)))
        return float(np.sqrt(np.mean(target.distances(image) ** 2))) / self.diagonal


def load(path: str | PathLike) -> Fit:
    """Return the result that `Fit.save`, or `iccm map -o map.npz`, wrote; it evaluates to the same values, bit for bit.

    Raises:
        InputError: the file does not exist, or does not contain a valid map.

    >>> import tempfile, pathlib, iccm
    >>> square = np.array([0, 1, 1 + 1j, 1j])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     iccm.fit(square, 3 * square).save(path := pathlib.Path(folder) / "map.npz")
    ...     complex(np.round(iccm.load(path).map(0.5 + 0.5j), 6))
    (1.5+1.5j)
    """
    try:
        return Fit.of(read(path))
    except InputError as error:
        raise InputError(str(error) if str(error).startswith(str(path)) else f"{path}: {error}") from error


def _softness(map_file: MapFile) -> Softness | None:
    """Return the softness of a saved map's pins.

    Raises:
        InputError: their numbers differ.
    """
    lists = map_file.about.get("softness")
    if lists is None:
        return None
    softness = Softness.from_lists(lists)
    if softness is None or len(softness.radii) != len(map_file.arrays["pins"]):
        raise InputError("about: the softness is not that of the pins")
    return softness


def _drawings(map_file: MapFile) -> tuple[Drawing, Drawing] | None:
    """Return the drawings of a saved map; None if it is not a map of whole drawings."""
    source, target = (map_file.rings[name] for name in DRAWING_RINGS)
    if not source or not target:
        return None
    return Drawing.of_rings(source, "source drawing"), Drawing.of_rings(target, "target drawing")


def _regions(map_file: MapFile, holes: tuple[list[Curve], list[Curve]]) -> list[Region]:
    """Return the rigid regions of a saved map.

    Raises:
        InputError: the rings do not form regions, or a region contains no triangles.
    """
    counts, rings = map_file.about.get("rigid", []), list(map_file.rings["rigid"])
    if sum(counts) != len(rings) or (rings and not isinstance(map_file.map, TriangulatedMap)):
        raise InputError("rigid: the rings do not form regions")
    source, target = (None if plane.outline is None else Curve(plane.outline) for plane in map_file.planes)
    mean = mean_scale(source, target, holes) if source else 1.0
    regions, of_target = [], map_file.about.get("rigid_of_target") is True
    for count in counts:
        region, rings = tuple(rings[:count]), rings[count:]
        if (
            not isinstance(map_file.map, TriangulatedMap)
            or not triangles_in(map_file.map, region, of_target=of_target).size
        ):
            raise InputError("rigid: a region contains no triangles")
        regions.append(Region.of(map_file.map, region, mean, of_target=of_target))
    return regions


def _quantile(values: np.ndarray, q: float) -> float:
    """Return a quantile that is well defined even if some values are infinite."""
    return float(np.quantile(values, q, method="inverted_cdf"))
