"""A domain of the plane, or a surface flattened there, as it is solved for: surfaces in a layout that is even."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arrays import Complex, Flags, Index, Real
from ..balanced.constraints.validate import ON_OUTLINE_SHARE
from ..curve import Curve
from ..flattening import even_layout
from ..meshes.flatten import Flattening
from ..meshes.locate import Locator
from ..plane import triangle_areas


@dataclass(frozen=True, eq=False)
class Side:
    """Source or target.

    Attributes:
        outlines: the boundaries in the user's plane, the outer one first.
        layout: of the surface in that plane; None for a domain of the plane.
        even: the layout in which it is solved for: an even one, where outlines are about as long as on the surface, or
            the same.
    """

    outlines: tuple[Curve, ...]
    layout: Flattening | None = None
    even: Flattening | None = None

    @classmethod
    def of(cls, outlines: tuple[Curve, ...], layout: Flattening | None) -> "Side":
        """To be solved for in an even layout.

        Raises:
            InputError: every such layout overlaps itself.
        """
        return cls(outlines, layout, layout and even_layout(layout))

    @property
    def as_given(self) -> "Side":
        """To be solved for in the user's plane."""
        return replace(self, even=self.layout)

    @property
    def given(self) -> Flattening:
        """The layout of a surface in the user's plane."""
        assert self.layout is not None
        return self.layout

    @property
    def own(self) -> Flattening:
        """The layout of a surface in which it is solved for."""
        assert self.even is not None
        return self.even

    @property
    def area(self) -> float:
        """Of the surface, or of the domain without its holes."""
        if self.layout is not None:
            return float(self.layout.patch.areas.sum())
        return self.outlines[0].area - sum(abs(hole.area) for hole in self.outlines[1:])

    @cached_property
    def loops(self) -> list[Index]:
        """The layout's vertices along each outline, as it runs in the plane."""
        return [_loop_of(self.given, outline) for outline in self.outlines]

    @property
    def passed_over(self) -> list[Index]:
        """The layout's boundaries that are none of the outlines."""
        known = np.concatenate(self.loops)
        return [loop for loop in self.given.patch.loops if not np.isin(loop[0], known)]

    @cached_property
    def solved(self) -> list[Curve]:
        """The outlines where the problem is solved."""
        if self.even is None:
            return list(self.outlines)
        return [Curve(self.even.flat[loop]) for loop in self.loops]

    def inward(self, z: Complex) -> Complex:
        """Return points (p,) of the user's plane, where the problem is solved; those close to the outline come onto
        it.
        """
        if self.layout is None:
            return z
        if self.own is self.layout or not z.size:
            return z
        on = _is_near(Curve(self.layout.flat[self.loops[0]]), z)
        return _transfer(self._given_locator, self.own, self.loops[0], z, on)

    @cached_property
    def _given_locator(self) -> Locator:
        """Finds the triangle under a point of the user's plane."""
        return Locator(self.given)

    def scale_inward(self, z: Complex) -> Real:
        """Return how many times as long small lengths at points (p,) of the user's plane are where it is solved."""
        if self.layout is None or self.own is self.layout or not z.size:
            return np.ones(z.size)
        face, _ = self._given_locator(z, 1)
        corners = self.layout.patch.faces[face]
        areas = [np.abs(triangle_areas(flat[corners])) for flat in (self.own.flat, self.layout.flat)]
        return np.sqrt(areas[0] / areas[1])

    def is_on(self, z: Complex) -> Flags:
        """Return (n,) which points of where the problem is solved are on the outer outline."""
        return _is_near(self.solved[0], z)

    def loop_outward(self, z: Complex) -> Complex:
        """Return a closed polyline (n,) from there in the user's plane, straight where it leaves the surface."""
        if self.even is None:
            return z
        z = z[self.solved[0].contains(z) | self.is_on(z)]
        return self.outward(z, self.is_on(z))

    def outward(self, z: Complex, on: Flags) -> Complex:
        """And back again, for vertices (n,) of a map, some of which are on the outer outline."""
        if self.layout is None or self.own is self.layout or not z.size:
            return z
        return _transfer(Locator(self.own), self.layout, self.loops[0], z, on)

    def curve_inward(self, stroke: Curve, points: int = 64) -> Curve:
        """Return a polyline of the user's plane, by points along it."""
        if self.layout is None:
            return stroke
        s = np.union1d(stroke.knots, np.linspace(0, stroke.length, points))
        return Curve(self.inward(stroke.at(s)), stroke.closed)


def _is_near(outline: Curve, z: Complex) -> Flags:
    return outline.distances(z) < ON_OUTLINE_SHARE * outline.diagonal


def _transfer(here: Locator, there: Flattening, loop: Index, z: Complex, on: Flags) -> Complex:
    """Return points z (p,) of one layout in another one of the same surface; those `on` the outline's loop along it."""
    face, place = here(z, 1)
    found = np.einsum("pk,pk->p", place, there.flat[here.faces[face]])
    outline, ends = Curve(here.flat[loop]), there.flat[loop]
    edge, share = outline.locate(outline.closest(z[on]))
    found[on] = ends[edge] * (1 - share) + ends[(edge + 1) % loop.size] * share
    return found


def _loop_of(layout: Flattening, outline: Curve) -> Index:
    """Return the boundary loop of a layout that an outline is, in the outline's direction."""
    near = [np.abs(layout.flat[loop] - outline.z[0]).min() for loop in layout.patch.loops]
    loop = layout.patch.loops[int(np.argmin(near))]
    return loop if (Curve(layout.flat[loop]).area > 0) == (outline.area > 0) else loop[::-1]
