"""Further terms of the energy, written in NumPy.

A term is a sum over *stencils*, small sets of vertices: triangles, pairs of neighbouring triangles, or any
other. Newton's method requests the sum, and its derivatives with respect to the positions of each stencil's
vertices. They are added to those of the density, whose Hessian gets blocks for all pairs of a stencil's
vertices.

Shapes are rotated, mirrored, exchanged and halved before they are mapped. `Term` has a method for each of these; where
a term does not define it, the value is computed as if the shapes were still as given (`Oriented`, `Inverted`).

To add a term, write a class in a separate file: see `docs/developers/terms.md`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...arrays import Complex, Index, Real
from ...linalg.cholesky import BlockPattern
from ...native import Record, array_at, callback, record
from ...plane import triangle_areas
from .energy import RestShapes, geometry

TotalCallback = callback("double TotalCallback(const Complex *u)")
DerivativesCallback = callback(
    "double DerivativesCallback(const Complex *u, double *matrix, Complex *gradient)"
)
TermsRecord = record("struct Terms { TotalCallback total; DerivativesCallback derivatives; }")


class TermOnMesh(ABC):
    """A term as a function of the images of one mesh's vertices.

    Attributes:
        stencils: (k, s) the vertices that each summand depends on.
    """

    stencils: Index

    @abstractmethod
    def values(self, u: Complex) -> Real:
        """Return the summands (k,) for images u (n,), none of whose triangles is folded."""

    @abstractmethod
    def derivatives(self, u: Complex) -> tuple[Complex, Real]:
        """Return gradients (k, s), x + iy for each vertex of a stencil, and Hessians (k, s, s, 2, 2).

        Entry [k, i, j] of the latter is the block of second derivatives with respect to vertices i (rows x and
        y) and j (columns). Each summand's Hessian has to be positive semidefinite: if it is not, drop its
        negative part, or use the Gauss-Newton approximation.
        """


class MapSides(NamedTuple):
    """Both sides of a map of which one side moves.

    Attributes:
        fixed: (n,) positions of the vertices on the side that does not move.
        moving: (n,) their positions on the other side.
        rest: the triangles on the fixed side, with which images on the moving side are compared.
        moving_rest: the triangles on the moving side, with which those on the fixed side are compared.
    """

    fixed: Complex
    moving: Complex
    rest: RestShapes
    moving_rest: RestShapes

    def inverse(self) -> "MapSides":
        """Return the sides of the inverse map."""
        return MapSides(self.moving, self.fixed, self.moving_rest, self.rest)


class Term(ABC):
    """A further term of the energy; its weight is part of it.

    Terms are compared by value, as frozen dataclasses are, when problems are compared.

    A term with a direction, such as one that pulls the picture towards an angle, has another form when the shapes are
    rotated, mirrored or exchanged. `rotated`, `mirrored` and `inverse` return that form. They need not be defined: by
    default, the term is computed in the directions of the shapes as they were given. Defining them makes a term
    faster, and lets a term that is the same for mirrored shapes be minimised on halves of symmetric ones.
    """

    @abstractmethod
    def stencils(self, faces: Index) -> Index:
        """Return the stencils (k, s) of a mesh with triangles (m, 3)."""

    @abstractmethod
    def on_mesh(self, rest: RestShapes) -> TermOnMesh:
        """Return the term for a mesh.

        Args:
            rest: the rest triangles, without virtual triangles: corners in some order, gradients and areas.
                Lengths are those of domains of area one, with the centroid at 0; between surfaces, the
                derivatives f_z = Σ α u and f_z̄ = Σ ᾱ u are those of the map between them.
        """

    def of_part(self, share: float) -> "Term":
        """Return the term for a part with a share of the domain's area, scaled to area one.

        Symmetric shapes are mapped by halves. A mean over the area is the same for a half, and so is its term;
        a sum that does not change with the scale, such as the integral of a squared gradient, has to be doubled
        for a half.
        """
        return self

    def rotated(self, source: complex, target: complex) -> "Term":
        """Return the term for rotated shapes; it has the value for the map between them that this one has for the map.

        The rotated map is z ↦ t f(z/s), whose derivatives are f_z t/s and f_z̄ t s.

        Args:
            source: s, of modulus one, by which the source is multiplied.
            target: t, by which the target is multiplied.
        """
        return Oriented.of(self, source, target, is_mirrored=False)

    def mirrored(self) -> "Term":
        """Return the term for both shapes mirrored about the real axis; see `rotated`.

        The mirrored map is z ↦ conj(f(conj(z))), whose derivatives are conj(f_z) and conj(f_z̄). If the result
        equals this term, also after a rotation of both shapes by 180°, symmetric shapes are mapped by halves.
        """
        return Oriented.of(self, 1.0, 1.0, is_mirrored=True)

    def inverse(self) -> "Term":
        """Return the term for exchanged shapes; it has the value for the inverse map that this one has for the map.

        The inverse has the derivatives conj(f_z)/J and -f_z̄/J, where J = |f_z|² - |f_z̄|². The map and its inverse are
        minimised in turn.
        """
        return Inverted(self)

    def on_sides(self, sides: MapSides) -> TermOnMesh:
        """Return the term for a mesh, of which both sides are known; called instead of `on_mesh`."""
        return self.on_mesh(sides.rest)


@dataclass(frozen=True)
class Oriented(Term):
    """A term for shapes that were rotated and mirrored, computed as if they were not.

    Attributes:
        term: for the shapes as they were.
        source: of modulus one; the source was multiplied by it.
        target: the target was multiplied by it.
        is_mirrored: whether both shapes were then mirrored about the real axis.
    """

    term: Term
    source: complex
    target: complex
    is_mirrored: bool

    @classmethod
    def of(cls, term: Term, source: complex, target: complex, *, is_mirrored: bool) -> Term:
        """Return the term, or the original one if the shapes are as they were."""
        if source == 1 and target == 1 and not is_mirrored:
            return term
        return cls(term, complex(source), complex(target), is_mirrored)

    def stencils(self, faces: Index) -> Index:
        """Return the stencils (k, s) of a mesh with triangles (m, 3)."""
        return self.term.stencils(np.ascontiguousarray(faces[:, ::-1]) if self.is_mirrored else faces)

    def of_part(self, share: float) -> Term:
        """Return the term for a part."""
        return replace(self, term=self.term.of_part(share))

    def rotated(self, source: complex, target: complex) -> Term:
        """Return the term for rotated shapes."""
        if self.is_mirrored:  # a rotation after mirroring is the opposite one before
            source, target = np.conj(source), np.conj(target)
        return Oriented.of(
            self.term, self.source * source, self.target * target, is_mirrored=self.is_mirrored
        )

    def mirrored(self) -> Term:
        """Return the term for mirrored shapes."""
        return Oriented.of(self.term, self.source, self.target, is_mirrored=not self.is_mirrored)

    def on_mesh(self, rest: RestShapes) -> TermOnMesh:
        """Return the term for a mesh."""
        return OrientedOnMesh(self.term.on_mesh(self._rest_as_given(rest)), self.target, self.is_mirrored)

    def on_sides(self, sides: MapSides) -> TermOnMesh:
        """Return the term for a mesh of which both sides are known."""
        as_given = MapSides(
            _undo(sides.fixed, self.source, self.is_mirrored),
            _undo(sides.moving, self.target, self.is_mirrored),
            self._rest_as_given(sides.rest),
            Oriented(self.term, self.target, self.source, self.is_mirrored)._rest_as_given(sides.moving_rest),
        )
        return OrientedOnMesh(self.term.on_sides(as_given), self.target, self.is_mirrored)

    def _rest_as_given(self, rest: RestShapes) -> RestShapes:
        """Return the triangles of the rest shape, counter-clockwise, with gradients relative to their lengths."""
        gradients = rest.gradients * self.source
        if self.is_mirrored:
            gradients = np.ascontiguousarray(rest.gradients.conj()[:, ::-1] * self.source)
            return rest._replace(corners=np.ascontiguousarray(rest.corners[:, ::-1]), gradients=gradients)
        return rest._replace(gradients=gradients)


def _undo(w: Complex, factor: complex, is_mirrored: bool) -> Complex:
    """Return points as they were before they were multiplied by a factor, and then mirrored."""
    return (w.conj() if is_mirrored else w) * np.conj(factor)


class OrientedOnMesh(TermOnMesh):
    """A term as a function of images that were rotated and mirrored.

    Args:
        term: as a function of the images as they were.
        target: of modulus one; the images were multiplied by it.
        is_mirrored: whether they were then mirrored.
    """

    def __init__(self, term: TermOnMesh, target: complex, is_mirrored: bool):
        self.term, self.target, self.is_mirrored = term, complex(target), is_mirrored
        self.stencils = term.stencils
        columns = [_undo(np.array([unit]), self.target, is_mirrored)[0] for unit in (1.0 + 0j, 1j)]
        self._linear = np.array([[w.real for w in columns], [w.imag for w in columns]])

    def values(self, u: Complex) -> Real:
        """Return the summands (k,) for images (n,)."""
        return self.term.values(_undo(u, self.target, self.is_mirrored))

    def derivatives(self, u: Complex) -> tuple[Complex, Real]:
        """Return gradients (k, s) and Hessians (k, s, s, 2, 2) with respect to images (n,)."""
        slopes, blocks = self.term.derivatives(_undo(u, self.target, self.is_mirrored))
        slopes = slopes * self.target
        blocks = np.einsum("ax,kijab,by->kijxy", self._linear, blocks, self._linear)
        return (slopes.conj() if self.is_mirrored else slopes), blocks


@dataclass(frozen=True)
class Inverted(Term):
    """A term for exchanged shapes, computed on the map that was given and not on its inverse.

    Attributes:
        term: for the shapes before they were exchanged.
    """

    term: Term

    def stencils(self, faces: Index) -> Index:
        """Return the stencils (k, s) of a mesh with triangles (m, 3)."""
        return self.term.stencils(faces)

    def of_part(self, share: float) -> Term:
        """Return the term for a part."""
        return Inverted(self.term.of_part(share))

    def rotated(self, source: complex, target: complex) -> Term:
        """Return the term for rotated shapes."""
        return self.term.rotated(target, source).inverse()

    def mirrored(self) -> Term:
        """Return the term for mirrored shapes."""
        return self.term.mirrored().inverse()

    def inverse(self) -> Term:
        """Return the term for the shapes before they were exchanged."""
        return self.term

    def on_mesh(self, rest: RestShapes) -> TermOnMesh:
        """Raise an error, since the inverse is not known by its rest shapes alone."""
        raise TypeError("an inverted term needs both sides of a map; call on_sides")

    def on_sides(self, sides: MapSides) -> TermOnMesh:
        """Return the term for a mesh of which both sides are known."""
        return InvertedOnMesh(self.term.on_sides(sides.inverse()), sides)


class InvertedOnMesh(TermOnMesh):
    """A term of a map, as a function of the positions of vertices in its domain.

    Moving vertices z of the domain by dz while their images stay changes the map as moving the images by -f'(z) dz
    does while the vertices stay, if those of the outline slide along it. So the term is computed for images that are
    moved accordingly. This is exact at the positions where it starts, and for infinitesimal displacements of a smooth
    map. The map and its inverse are minimised in turn, and each turn starts anew.

    Args:
        term: as a function of images, for vertices that stay.
        sides: of the inverse map: vertices of the domain move, their images are fixed.
    """

    def __init__(self, term: TermOnMesh, sides: MapSides):
        self.term, self.stencils = term, term.stencils
        self._start, self._images, self._corners = sides.moving, sides.fixed, sides.rest.corners
        # Derivatives at vertices are means of those on the triangles around them.
        gradients, areas = geometry(sides.moving, self._corners)
        weights = np.repeat(np.maximum(areas, 0), 3)
        around, n = self._corners.ravel(), sides.moving.size
        total = np.maximum(np.bincount(around, weights, n), np.finfo(float).tiny)
        images = sides.fixed[self._corners]

        def at_vertices(by_triangle: Complex) -> Complex:
            spread = np.repeat(by_triangle, 3) * weights
            sums: Complex = np.bincount(around, spread.real, n) + 1j * np.bincount(around, spread.imag, n)
            return sums / total

        self._f_z = at_vertices((gradients * images).sum(axis=1))
        self._f_zbar = at_vertices((gradients.conj() * images).sum(axis=1))

    def values(self, u: Complex) -> Real:
        """Return the summands (k,) for positions (n,); infinite if the moved images would fold."""
        moved = self._moved(u)
        if triangle_areas(moved[self._corners]).min(initial=np.inf) <= 0:
            return np.full(len(self.stencils), np.inf)
        return self.term.values(moved)

    def derivatives(self, u: Complex) -> tuple[Complex, Real]:
        """Return gradients (k, s) and Hessians (k, s, s, 2, 2) with respect to positions (n,)."""
        slopes, blocks = self.term.derivatives(self._moved(u))
        a, b = self._f_z[self.stencils], self._f_zbar[self.stencils]
        by_position: Complex = -(a.conj() * slopes + b * slopes.conj())
        # (k, s, 2, 2): the Jacobian of -f' at each vertex of a stencil
        linear = -np.stack(
            [
                np.stack([a.real + b.real, b.imag - a.imag], axis=-1),
                np.stack([a.imag + b.imag, a.real - b.real], axis=-1),
            ],
            axis=-2,
        )
        return by_position, np.einsum("kiax,kijab,kjby->kijxy", linear, blocks, linear)

    def _moved(self, u: Complex) -> Complex:
        """Return the images (n,) that stand for the positions (n,)."""
        displacement = u - self._start
        return self._images - self._f_z * displacement - self._f_zbar * displacement.conj()


class TermsOnMesh:
    """The terms of an energy for the vertices of one mesh, with the callbacks of the core.

    Args:
        terms: for the mesh.
        pattern: of its Hessian, with blocks for all pairs of a stencil's vertices.
    """

    def __init__(self, terms: Sequence[TermOnMesh] = (), pattern: BlockPattern | None = None):
        self.terms, self._pattern = terms, pattern
        self._error: BaseException | None = None

    def total(self, u: Complex) -> float:
        """Compute the sum of all terms for images u (n,)."""
        return float(sum(term.values(u).sum() for term in self.terms))

    def add_derivatives(self, u: Complex, matrix: Real, gradient: Complex) -> float:
        """Compute the sum, and add the gradient (n,) and the Hessian's blocks (e, 4)."""
        for term, (entries, upper) in zip(self.terms, self._entries):
            slopes, blocks = term.derivatives(u)
            np.add.at(gradient, term.stencils, slopes)
            np.add.at(matrix, entries, blocks[upper].reshape(-1, 4))
        return self.total(u)

    @cached_property
    def _entries(self) -> list[tuple[Index, np.ndarray]]:
        """For each term, the vertex pairs (k, s, s) that are in the upper triangle, and their entries there."""
        assert self._pattern is not None
        entries = []
        for term in self.terms:
            tails, heads = np.broadcast_arrays(term.stencils[:, :, None], term.stencils[:, None, :])
            upper = self._pattern.position[tails] <= self._pattern.position[heads]
            entries.append((self._pattern.entries(tails[upper], heads[upper]), upper))
        return entries

    @cached_property
    def record(self) -> Record:
        """The struct that is passed to the core."""
        if not self.terms:
            return TermsRecord(None, None)
        assert self._pattern is not None
        n, e = self._pattern.order.size, self._pattern.columns.size

        def total(address: int) -> float:
            return self._guarded(lambda: self.total(array_at(address, n, np.complex128)))

        def derivatives(address: int, matrix_address: int, gradient_address: int) -> float:
            u = array_at(address, n, np.complex128)
            blocks = array_at(matrix_address, 4 * e, np.float64).reshape(e, 4)
            gradient = array_at(gradient_address, n, np.complex128)
            return self._guarded(lambda: self.add_derivatives(u, blocks, gradient))

        return TermsRecord(TotalCallback(total), DerivativesCallback(derivatives))

    def _guarded(self, compute: Callable[[], float]) -> float:
        """Compute a value for the core; infinite after an error, so that the descent ends (see `raise_error`)."""
        if self._error is None:
            try:
                return float(compute())
            except BaseException as error:
                self._error = error
        return np.inf

    def raise_error(self) -> None:
        """Raise the error that a term raised when the core called it, if any."""
        error, self._error = self._error, None
        if error is not None:
            raise error


NO_TERMS = TermsOnMesh()
