"""Figures about a result: distances of outlines, distortion, folds, and the report that collects them."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .arrays import Complex
from .blas import on_one_thread
from .curve import Curve, boundary_samples, closer_outline, hausdorff, interior_grid
from .drawings.visible import visible_shares
from .fit_data import INTERIOR_POINTS, FitData
from .maps import distortion
from .maps.approximation import triangulated
from .maps.distortion import Distortion
from .maps.summary import CERTAIN_SHARE, SEEN_CRACKS_SHARE, SEEN_FOLDS_SHARE, WELL_SEEN_SHARE
from .maps.triangulated.map import TriangulatedMap
from .meshes.surface_distortion import distances_at, gap_between, on_surfaces, surface_distances, tilt
from .problem import ON_OUTLINE_SHARE
from .status import Status

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
# Relative to the source's diagonal: an inverse with a larger error is another point.
INVERSE_ERROR_SHARE = 1e-6


@dataclass(frozen=True, eq=False)
class Figures(FitData):
    """The data of a result with the figures about it, each computed when it is first needed.

    Lengths are relative to the diagonal of the target's bounding box.
    """

    @cached_property
    def status(self) -> Status:
        """How the solver ended, taking all figures of the report into account.

        Even if the solver ended well, the map may fold, pins may pull it far from the target's outline, or it
        may twist one surface relative to the other; then the status is not `ok`.
        """
        if not self._ended.ok:
            return self._ended
        if self._folded_share > MOST_LOST_SHARE:
            return Status.FOLDED
        if self._ended in (Status.DECREASE, Status.THRESHOLD) and self._is_far_off:
            return Status.GAP
        if self._ended is not Status.REACHED or not all(self.details.layouts):
            return self._ended
        if self.distortion.strain:
            return Status.TWISTED
        return Status.DRIFTED if self._has_drifted else self._ended

    @property
    def _has_drifted(self) -> bool:
        """Whether two surfaces lie in the same place, including their landmarks, and the map moves points far away."""
        source, target = self.details.layouts
        assert source is not None and target is not None
        away = self._apart["apart"]["p95"]
        if away <= DRIFT_SHARE or (gap := gap_between(source, target)) > SAME_PLACE_SHARE:
            return False
        if len(self.pins) and np.median(distances_at(self.pins, source, target)) > gap + DRIFT_SHARE:
            return False  # landmarks move points, too
        return away > gap + DRIFT_SHARE

    @property
    def _is_far_off(self) -> bool:
        """Whether the image of the boundary is more than `FAR_OFF_TOLERANCES` tolerances from the target."""
        return (
            self.target is not None
            and self._boundary["hausdorff"] > FAR_OFF_TOLERANCES * self.details.tolerance
        )

    @cached_property
    def _folded_share(self) -> float:
        """Share of the source's area that the inverse does not recover.

        There it folds or shrinks below numerical precision. The share is sampled, unless the certificate covers
        nearly all of the source.
        """
        if self.certificate.share >= CERTAIN_SHARE or (self.target is None and self.certificate.zeros == 0):
            # Without a target, a map without folds may overlap itself, which is reported for the outline.
            return 0.0
        z = self._interior
        back = self._inverse(self.map.jet(z)[0])
        is_recovered = np.abs(back - z) <= INVERSE_ERROR_SHARE * Curve(self.map.polygon).diagonal
        return float(np.mean(~is_recovered))

    @cached_property
    def _boundary(self) -> dict[str, float]:
        """Distances of the boundary's image from the target, relative to the diagonal of the target's bounding box.

        `rms` and `hausdorff` are the root mean square and the two-sided Hausdorff distance. `given` is the
        largest distance of an image of the source's vertices as given, of which the map's polygon may have
        fewer. `source`, present if the polygon misses the source by too much, is the two-sided distance between
        these.
        """
        assert self.target is not None
        pairs = [
            (
                Curve(
                    closer_outline(self.image, self.details.filled and self.details.filled[1], self.target)
                ),
                self.target,
            ),
            *((image, hole) for image, hole, _, _ in self._hole_images),
        ]
        even = self.map(boundary_samples(self.map.polygon, 2))
        even_pairs = [
            (
                Curve(closer_outline(even, self.details.filled and self.details.filled[1], self.target)),
                self.target,
            ),
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
            "rms": float(rms) / self._diagonal,
            "hausdorff": max(hausdorff(*pair) for pair in pairs) / self._diagonal,
            "given": float(max(part.max() for part in distances)) / self._diagonal,
            **({"source": self._source_gap} if self._ended is Status.SOURCE_GAP else {}),
        }

    @property
    def _on_outline(self) -> Complex:
        """The source's vertices, as given, that are on the map's outline, not inside concavities and not left out."""
        if self.details.filled is None:
            return self.source.z
        tolerance = ON_OUTLINE_SHARE * self.source.diagonal
        loops = self.map.polygon, self.details.filled[0]
        is_near = [Curve(loop).distances(self.source.z) <= tolerance for loop in loops]
        return self.source.z[is_near[0] & is_near[1]]

    @property
    def _source_gap(self) -> float:
        """Distance of the boundary that the map covers from the source's boundary.

        It is the two-sided Hausdorff distance, relative to the source's diagonal.
        """
        outer = closer_outline(self.map.polygon, self.details.filled and self.details.filled[0], self.source)
        pairs = [(Curve(outer), self.source)]
        if isinstance(self.map, TriangulatedMap):
            pairs += [
                (Curve(self.map.source[loop]), self.source_holes[i])
                for loop, (i, _) in zip(self.map.loops[1:], self.details.hole_partners)
                if i >= 0
            ]
        return max(hausdorff(*pair) for pair in pairs) / self.source.diagonal

    @property
    def _hole_images(self) -> Iterator[tuple[Curve, Curve, int, int]]:
        """The image of each hole's boundary, the outline on which it belongs, and the numbers of both holes."""
        if not isinstance(self.map, TriangulatedMap):
            return
        for loop, (i, j) in zip(self.map.loops[1:], self.details.hole_partners):
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
                "gap": hausdorff(image, hole) / self._diagonal,
            }
            for image, hole, i, j in self._hole_images
        ]
        alone = set(range(len(self.source_holes))) - {i for i, _ in self.details.hole_partners}
        return pairs + [{"source": i + 1, "target": None, "gap": None} for i in sorted(alone)]

    @cached_property
    def distortion(self) -> Distortion:
        """Distortion of the map over the target's area, or over the image's without a target.

        If layouts stand for surfaces, it is that of the map between the surfaces.
        """
        if any(self.details.layouts):
            return on_surfaces(self._samples, self.details.layouts)
        if not isinstance(self.map, TriangulatedMap):
            return self._samples
        triangles = np.flatnonzero(~self.coverage.voids)
        if self.details.drawings is None or self.target is None:
            return distortion.of_triangles(self.map, triangles)
        # for whole drawings only over visible parts: the distortion of gaps is invisible
        regions = self.details.drawings[0].region, self.details.drawings[1].region
        faces = self.map.faces[triangles]
        shares = visible_shares(self.map.source, self.map.image, faces, *regions, covering=None).both
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

    @on_one_thread
    def report(self) -> dict[str, Any]:
        """Return the figures of the JSON report that depend on the map only; lengths are shares of the diagonal."""
        area = np.log10(np.maximum(np.abs(distortion.area_scale(*self.map.jet(self._interior)[1:])), 1e-300))
        pin_errors = np.abs(self._image_of(self.pins[:, 0]) - self.pins[:, 1]) / self._diagonal
        return {
            "status": self.status.name.lower(),
            "message": self.status.value,
            "iterations": max(0, len(self.energies) - 1),
            "energies": self.energies,
            "vertices": int(self.map.polygon.size),
            "boundary": self._boundary if self.target is not None else None,
            **({"holes": self._holes_report} if self._has_pairs else {}),
            **(
                {"left_out": self.coverage.left_out, "uncovered": self.coverage.uncovered}
                if self.coverage.is_partial
                else {}
            ),
            **self._shares_seen,
            **({"regions": [region.report() for region in self.rigid]} if self.rigid else {}),
            **self._distortion_report,
            **self._apart,
            "log10_area": {
                name: _quantile(area, q) for name, q in (("p05", 0.05), ("median", 0.5), ("p95", 0.95))
            },
            "injective": self.certificate.report() | {"folded": self._folded_share},
            "pins": [
                {"error": float(error)} | tolerance
                for error, tolerance in zip(pin_errors, self._pin_tolerances)
            ],
            "strokes": [{"error": self._stroke_error(a, b)} for a, b in self.strokes],
            "notes": [*self.notes, *self._lost_notes, *self._doubts()],
        }

    @property
    def _shares_seen(self) -> dict[str, float]:
        """Shown share of the source drawing, and shares of the target drawing that are covered and lost to cracks."""
        seen = self.coverage.seen
        if seen is None:
            return {}
        return {"shown": 1 - seen.hidden, "covered": 1 - seen.bare, "cracks": self.coverage.cracks}

    @property
    def _pin_tolerances(self) -> list[dict[str, float]]:
        """For each soft pin, the error up to which it counts as met; empty for exact pins."""
        if self.details.softness is None:
            return [{}] * len(self.pins)
        pairs = zip(self.details.softness.is_soft, self.details.softness.limits / self._diagonal)
        return [{"tolerance": float(tolerance)} if soft else {} for soft, tolerance in pairs]

    @property
    def _lost_notes(self) -> list[str]:
        """Notes if large parts of either drawing are not visible, unless that was requested."""
        if self.coverage.seen is None:
            return []
        notes = []
        if self.coverage.seen.hidden > 1 - WELL_SEEN_SHARE and self.details.place != "slice":
            notes.append(
                f"{self.coverage.seen.hidden:.0%} of the source drawing is hidden, because it lies in gaps of the "
                "target (shown); fit='contain' shows all of it."
            )
        if self.coverage.seen.bare > 1 - WELL_SEEN_SHARE and self.details.place != "inside":
            notes.append(
                f"{self.coverage.seen.bare:.0%} of the target drawing stays bare (covered); "
                "fit='cover' covers all of it."
            )
        if self.coverage.cracks > SEEN_CRACKS_SHARE:
            notes.append(
                f"Cracks cover {self.coverage.cracks:.1%} of the target drawing: slits narrower than 1 % of its "
                "size that show nothing (cracks); fit='cover' leaves none."
            )
        return notes

    @property
    def _distortion_report(self) -> dict[str, Any]:
        """The figures of distortion; bare parts of the target count as outside of every scale range."""
        report = self.distortion.report()
        if self.coverage.is_partial:
            report["scale"] = {
                name: share * (1 - self.coverage.uncovered) for name, share in report["scale"].items()
            }
        return report

    @cached_property
    def _apart(self) -> dict[str, Any]:
        """Distances in space between corresponding points of two surfaces."""
        source, target = self.details.layouts
        return {"apart": surface_distances(self._samples, source, target)} if source and target else {}

    @cached_property
    def tilt(self) -> float:
        """Degrees by which a map turns a surface on another one, see `surface_distortion.tilt`; 0 for other maps."""
        source, target = self.details.layouts
        return tilt(self._samples, source, target) if source and target else 0.0

    def _doubts(self) -> list[str]:
        """Return messages about figures that indicate problems of the map."""
        messages = []
        if self._folded_share >= SEEN_FOLDS_SHARE:
            messages.append(
                f"folds: {self._folded_share:.1%} of the source's area folds or shrinks to almost nothing, so the "
                "inverse map does not recover it"
            )
        if all(self.details.layouts) and (share := self.distortion.squeezed) >= SQUEEZED_AREA_SHARE:
            messages.append(
                f"squeezed: on {share:.1%} of a surface the map nearly folds (dilatation above 100, up to "
                f"{self.distortion.dilatations.max():.2g}); add landmarks there, or move them"
            )
        return messages

    def _image_of(self, z: Complex) -> Complex:
        """Return the images of points of the source; points outside the map's polygon are moved to its outline."""
        return self.map(Curve(self.map.polygon).pulled_in(z))

    def _stroke_error(self, source: Curve, target: Curve) -> float:
        """Return the root mean square distance of a stroke's image from its target, as a share of the diagonal."""
        image = self._image_of(source.at(np.linspace(0, source.length, 50)))
        return float(np.sqrt(np.mean(target.distances(image) ** 2))) / self._diagonal


def _quantile(values: np.ndarray, q: float) -> float:
    """Return a quantile that is well defined even if some values are infinite."""
    return float(np.quantile(values, q, method="inverted_cdf"))
