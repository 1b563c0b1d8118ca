"""The map of a picture onto a mesh whose pieces are packed inside the picture; each piece shows the part under it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..arrays import Complex
from ..curve import Curve
from ..fit_data import Details
from ..maps.injectivity import Certificate
from ..maps.triangulated.map import TriangulatedMap, without_bulges
from ..meshes.flatten import Flattening, overlap
from ..result import Fit
from ..status import Status

MESSAGE = "All pieces are packed inside the source at one scale."


@dataclass(frozen=True, eq=False)
class PackedFit(Fit):
    """The identity on charts that are packed inside the source.

    Its image is in the source's plane, so its distortion is measured from there to the surface.
    """

    @cached_property
    def certificate(self) -> Certificate:
        """Whether no triangle is folded, and no chart overlaps itself or another."""
        layout = self.details.layouts[1]
        assert layout is not None
        fault = overlap(layout) or ""
        folded = int(layout.flipped.size)
        return Certificate(not fault, 0.0, folded, 0.0, not fault, fault, float(not fault))

    @property
    def _interior(self) -> Complex:
        """Centroids of the charts' triangles."""
        assert isinstance(self.map, TriangulatedMap)
        return self.map.source[self.map.faces].mean(axis=1)

    def report(self) -> dict[str, Any]:
        """Return the report of a map, without an outline that charts would have to reach."""
        return super().report() | {"message": MESSAGE}


def place(source: Curve, layout: Flattening) -> PackedFit:
    """Return the map from the outline of a picture to a mesh whose charts are packed inside it, in the same plane."""
    flat, patch = layout.flat, layout.patch
    outer = {int(loop[0]) for loop in layout.outlines}
    holes = [loop for loop in patch.loops if int(loop[0]) not in outer]
    map = TriangulatedMap(flat, flat, patch.faces, (*layout.outlines, *holes))
    return PackedFit(
        map=without_bulges(map),
        _ended=Status.REACHED,
        energies=[],
        source=source,
        target=None,
        pins=np.zeros((0, 2), complex),
        strokes=[],
        details=Details(layouts=(None, layout)),
    )
