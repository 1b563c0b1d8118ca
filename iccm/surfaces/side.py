"""Source or target of a problem: a planar domain, or a surface with the layout in which it is solved."""

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
        layout: of the surface in the user's plane; None for a planar domain.
        even: the layout in which the problem is solved: an even one, where outlines are about as long as on the
            surface, or `layout` itself.
    """

    outlines: tuple[Curve, ...]
    layout: Flattening | None = None
    even: Flattening | None = None

    @classmethod
    def of(cls, outlines: tuple[Curve, ...], layout: Flattening | None) -> "Side":
        """Create a side that is solved in an even layout.

        Raises:
            InputError: every such layout overlaps itself.
        """
        return cls(outlines, layout, layout and even_layout(layout))

    @property
    def as_given(self) -> "Side":
        """This side, solved in the user's plane."""
        return replace(self, even=self.layout)

    @property
    def given(self) -> Flattening:
        """The layout of a surface in the user's plane."""
        assert self.layout is not None
        return self.layout

    @property
    def solver_layout(self) -> Flattening:
        """The layout of a surface in which the problem is solved."""
        assert self.even is not None
        return self.even

    @property
    def area(self) -> float:
        """Area of the surface, or of the planar domain without its holes."""
        if self.layout is not None:
            return float(self.layout.patch.areas.sum())
        return self.outlines[0].area - sum(abs(hole.area) for hole in self.outlines[1:])

    @cached_property
    def loops(self) -> list[Index]:
        """The layout's vertices along each outline, in the outline's direction in the plane."""
        return [_loop_of(self.given, outline) for outline in self.outlines]

    @property
    def passed_over(self) -> list[Index]:
        """The layout's boundary loops that are not among the outlines: holes that are ignored."""
        outlined = np.concatenate(self.loops)
        return [loop for loop in self.given.patch.loops if not np.isin(loop[0], outlined)]

    @cached_property
    def solved(self) -> list[Curve]:
        """The outlines in the plane where the problem is solved."""
        if self.even is None:
            return list(self.outlines)
        return [Curve(self.even.flat[loop]) for loop in self.loops]

    def inward(self, z: Complex) -> Complex:
        """Return points (p,) of the user's plane in the solver's plane; those close to the outline are put onto it."""
        if self.layout is None:
            return z
        if self.solver_layout is self.layout or not z.size:
            return z
        on = _is_near(Curve(self.layout.flat[self.loops[0]]), z)
        return _transfer(self._given_locator, self.solver_layout, self.loops[0], z, on)

    @cached_property
    def _given_locator(self) -> Locator:
        """Locator of triangles under points of the user's plane."""
        return Locator.of(self.given)

    def scale_inward(self, z: Complex) -> Real:
        """Return the local scales (p,) from the user's plane to the solver's at points (p,) of the former."""
        if self.layout is None or self.solver_layout is self.layout or not z.size:
            return np.ones(z.size)
        face, _ = self._given_locator(z, 1)
        corners = self.layout.patch.faces[face]
        areas = [
            np.abs(triangle_areas(flat[corners])) for flat in (self.solver_layout.flat, self.layout.flat)
        ]
        return np.sqrt(areas[0] / areas[1])

    def is_on(self, z: Complex) -> Flags:
        """Mark (n,) the points of the solver's plane that are on the outer outline."""
        return _is_near(self.solved[0], z)

    def loop_outward(self, z: Complex) -> Complex:
        """Return a closed polyline (n,) of the solver's plane in the user's, straight where it leaves the surface."""
        if self.even is None:
            return z
        z = z[self.solved[0].contains(z) | self.is_on(z)]
        return self.outward(z, self.is_on(z))

    def outward(self, z: Complex, on: Flags) -> Complex:
        """Return points (n,) of the solver's plane in the user's; those marked in `on` are on the outer outline."""
        if self.layout is None or self.solver_layout is self.layout or not z.size:
            return z
        return _transfer(Locator.of(self.solver_layout), self.layout, self.loops[0], z, on)

    def curve_inward(self, stroke: Curve, points: int = 64) -> Curve:
        """Return a curve of the user's plane as a polyline in the solver's, from at least so many samples."""
        if self.layout is None:
            return stroke
        s = np.union1d(stroke.knots, np.linspace(0, stroke.length, points))
        return Curve(self.inward(stroke.at(s)), stroke.closed)


def _is_near(outline: Curve, z: Complex) -> Flags:
    return outline.distances(z) < ON_OUTLINE_SHARE * outline.diagonal


def _transfer(locator: Locator, layout: Flattening, loop: Index, z: Complex, on: Flags) -> Complex:
    """Map points z (p,) between two layouts of the same surface; those marked in `on` stay on the outline's loop."""
    face, place = locator(z, 1)
    images = np.einsum("pk,pk->p", place, layout.flat[locator.faces[face]])
    outline, ends = Curve(locator.flat[loop]), layout.flat[loop]
    edge, share = outline.locate(outline.closest(z[on]))
    images[on] = ends[edge] * (1 - share) + ends[(edge + 1) % loop.size] * share
    return images


def _loop_of(layout: Flattening, outline: Curve) -> Index:
    """Return the boundary loop of a layout that coincides with an outline, in the outline's direction."""
    distances = [np.abs(layout.flat[loop] - outline.z[0]).min() for loop in layout.patch.loops]
    loop = layout.patch.loops[int(np.argmin(distances))]
    return loop if (Curve(layout.flat[loop]).area > 0) == (outline.area > 0) else loop[::-1]
