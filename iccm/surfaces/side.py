"""A domain of the plane, or a surface laid out there, as it is solved for: surfaces in a layout that is even."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Complex, Index
from ..balanced.constraints.given import ON_OUTLINE
from ..curve import Curve
from ..flattening import even
from ..meshes.flatten import Flattening
from ..meshes.locate import Locator


@dataclass(frozen=True, eq=False)
class Side:
    """Source or target.

    Attributes:
        outlines: the boundaries in the user's plane, the outer one first.
        layout: of the surface in that plane; None for a domain of the plane.
    """

    outlines: tuple[Curve, ...]
    layout: Flattening | None = None

    @cached_property
    def even(self) -> Flattening | None:
        """The surface's even layout, in which it is solved for: outlines are about as long there as on the surface."""
        return self.layout and even(self.layout)

    @cached_property
    def loops(self) -> list[Index]:
        """The layout's vertices along each outline, as it runs in the plane."""
        assert self.layout is not None
        return [_loop_of(self.layout, outline) for outline in self.outlines]

    @property
    def passed_over(self) -> list[Index]:
        """The layout's boundaries that are none of the outlines."""
        assert self.layout is not None
        known = np.concatenate(self.loops)
        return [loop for loop in self.layout.patch.loops if not np.isin(loop[0], known)]

    @cached_property
    def solved(self) -> list[Curve]:
        """The outlines where the problem is solved."""
        if self.even is None:
            return list(self.outlines)
        return [Curve(self.even.flat[loop]) for loop in self.loops]

    def inward(self, z: Complex) -> Complex:
        """Points (p,) of the user's plane, where the problem is solved; those on the outline stay on it."""
        return self._carried(self.layout, self.even, z)

    def outward(self, z: Complex) -> Complex:
        """And back again."""
        return self._carried(self.even, self.layout, z)

    def _carried(self, here: Flattening | None, there: Flattening | None, z: Complex) -> Complex:
        if here is None or there is None or not z.size:
            return z
        outline, loop = Curve(here.flat[self.loops[0]]), self.loops[0]
        face, place = Locator(here)(z, 1)
        found = np.einsum("pk,pk->p", place, there.flat[here.patch.faces[face]])
        s = outline.closest(z)
        near = np.abs(outline.at(s) - z) < ON_OUTLINE * outline.diagonal
        edge, share = outline.locate(s[near])
        ends = there.flat[loop]
        found[near] = ends[edge] * (1 - share) + ends[(edge + 1) % loop.size] * share
        return found

    def curve_inward(self, stroke: Curve, points: int = 64) -> Curve:
        """A polyline of the user's plane, by points along it."""
        if self.layout is None:
            return stroke
        s = np.union1d(stroke.knots, np.linspace(0, stroke.length, points))
        return Curve(self.inward(stroke.at(s)), stroke.closed)


def _loop_of(layout: Flattening, outline: Curve) -> Index:
    """The boundary loop of a layout that an outline is, in the outline's direction."""
    near = [np.abs(layout.flat[loop] - outline.z[0]).min() for loop in layout.patch.loops]
    loop = layout.patch.loops[int(np.argmin(near))]
    return loop if (Curve(layout.flat[loop]).area > 0) == (outline.area > 0) else loop[::-1]
