"""Further terms of the energy, written in NumPy.

A term is a sum over *stencils*, small sets of vertices: triangles, pairs of neighbouring triangles, or any
other. Newton's method requests the sum, and its derivatives with respect to the positions of each stencil's
vertices. They are added to those of the density, whose Hessian gets blocks for all pairs of a stencil's
vertices.

To add a term, write a class in a separate file: see `docs/developers/terms.md`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from ...arrays import Complex, Index, Real
from ...linalg.cholesky import BlockPattern
from ...native import Record, array_at, callback, record
from .energy import RestShapes

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


class Term(ABC):
    """A further term of the energy; its weight is part of it.

    Terms are compared by value, as frozen dataclasses are, when problems are compared.
    """

    @abstractmethod
    def stencils(self, faces: Index) -> Index:
        """Return the stencils (k, s) of a mesh with triangles (m, 3)."""

    @abstractmethod
    def on_mesh(self, rest: RestShapes) -> TermOnMesh:
        """Return the term for a mesh.

        Args:
            rest: the rest triangles, without virtual triangles: corners in some order, gradients and areas.
                Lengths are those of domains of area one; between surfaces, the derivatives f_z = Σ α u and f_z̄
                = Σ ᾱ u are those of the map between them. The map and its inverse are minimised in turn, with
                the sides exchanged, so the sum should be the same for both.
        """

    def of_part(self, share: float) -> "Term":
        """Return the term for a part with a share of the domain's area, scaled to area one.

        Symmetric shapes are mapped by halves. A mean over the area is the same for a half, and so is its term;
        a sum that does not change with the scale, such as the integral of a squared gradient, has to be doubled
        for a half.
        """
        return self


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

        def total(u: int) -> float:
            return self._guarded(lambda: self.total(array_at(u, n, np.complex128)))

        def derivatives(u: int, matrix: int, gradient: int) -> float:
            blocks = array_at(matrix, 4 * e, np.float64).reshape(e, 4)
            arrays = array_at(u, n, np.complex128), blocks, array_at(gradient, n, np.complex128)
            return self._guarded(lambda: self.add_derivatives(*arrays))

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
