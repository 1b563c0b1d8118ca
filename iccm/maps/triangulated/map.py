"""A homeomorphism between two triangulations, smooth except for small jumps, with an inverse in closed form."""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import overload

import numpy as np

from ...arrays import Complex, Numbers, Pairs, Real, as_points
from ...axes import UP, is_pairs, on_pairs
from ...plane import diagonal
from .adjacency import Edges, Index, edges_of
from .evaluation import evaluate
from .injectivity import Certificate, certify
from .location import PatchLocator
from .patches import bulges, slides
from .rim import Rim, unslid

NEAR_SHARE = 1e-3  # relative to the diagonal; outlines are simplified to 1e-4 and met to 6e-4


@dataclass(frozen=True, eq=False)
class TriangulatedMap:
    """A map that takes the triangles of the source to those of the image; its inverse is quadratic on each triangle.

    A point outside by at most `near` is treated as the nearest point of the outline; farther out, everything is
    NaN.

    Attributes:
        source: (n,) vertices in the source's plane.
        image: (n,) vertices in the image's plane.
        faces: (m, 3) vertices of the triangles, counter-clockwise in both planes.
        loops: vertices of the boundary, the outer loop first and counter-clockwise, then those of holes,
            clockwise.
        near: largest distance of points outside, relative to the diagonal of either plane's bounding box.
        bulge: (e,) of the patches' edges (see `patches`), in the order of `edges`; computed if not given. Zeros
            make the map linear on every triangle.
        seen: for a folded map, the number of triangles that the inverse uses: the first ones, of which earlier
            ones cover later ones. None if all are used, and none covers another.
        axes: meaning of pairs of real numbers on either side, see `iccm.axes`.
    """

    source: Complex
    image: Complex
    faces: Index
    loops: tuple[Index, ...]
    near: float = NEAR_SHARE
    bulge: Complex | None = None
    seen: int | None = None
    axes: tuple[str, str] = UP

    def __repr__(self) -> str:
        """Return the size of the map in one line."""
        return f"<TriangulatedMap: {self.source.size} vertices, {len(self.faces)} triangles>"

    def __getstate__(self) -> dict:
        """Return the attributes without cached properties."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def edges(self) -> Edges:
        """The edges of the triangulation."""
        return edges_of(self.faces)

    @cached_property
    def bulges(self) -> Complex:
        """The bulge of each edge; shape (e,)."""
        return bulges(self.faces, self.image, self.source, self.edges) if self.bulge is None else self.bulge

    @cached_property
    def corners(self) -> Complex:
        """The triangles' corners in the image; shape (m, 3)."""
        return self.image[self.faces]

    @cached_property
    def patches(self) -> Complex:
        """Source points of each triangle's corners, then the bulges of the sides opposite to them; shape (m, 6)."""
        parts = [self.source[self.faces], self.bulges[self.edges.sides]]
        return np.ascontiguousarray(np.concatenate(parts, axis=1))

    @property
    def polygon(self) -> Complex:
        """Vertices of the source's outer boundary, counter-clockwise, including mesh vertices on straight parts."""
        return self.source[self.loops[0]]

    @property
    def rims(self) -> list[Complex]:
        """Vertices of the source's boundaries: the outer one, counter-clockwise, and those of holes, clockwise."""
        return [self.source[loop] for loop in self.loops]

    @cached_property
    def diagonal(self) -> float:
        """Length of the diagonal of the source's bounding box."""
        return diagonal(self.source)

    @cached_property
    def image_diagonal(self) -> float:
        """Length of the diagonal of the image's bounding box."""
        return diagonal(self.image)

    @overload
    def __call__(self, z: Pairs, threads: int | None = None) -> Real: ...

    @overload
    def __call__(self, z: complex, threads: int | None = None) -> complex: ...

    @overload
    def __call__(self, z: Numbers, threads: int | None = None) -> Complex: ...

    def __call__(self, z: Pairs | complex | Numbers, threads: int | None = None) -> Complex | Real | complex:
        """Evaluate f at complex points of any shape, or at pairs (…, 2), in the same form."""
        if is_pairs(z):
            return on_pairs(lambda points: self(points, threads), z, self.axes)
        z = as_points(z)
        return self._jets(*self.place(z.ravel(), threads), threads)[1].reshape(z.shape)[()]

    def derivatives(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex]:
        """Return f_z and f_z̄ at points of any shape; on an edge, those of one of its sides."""
        return self.jet(z, threads)[1:]

    def jet(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """Return f, f_z and f_z̄ at points of any shape."""
        z = as_points(z)
        triangle, place = self.place(z.ravel(), threads)
        _, w, p, q = self._jets(triangle, place, threads)
        f_z, f_zbar = inverted(p, q)
        return w.reshape(z.shape), f_z.reshape(z.shape), f_zbar.reshape(z.shape)

    def derivatives_at(self, triangle: Index, place: Real) -> tuple[Complex, Complex]:
        """f_z and f_z̄ in triangles (p,) at barycentric coordinates of the image (p, 3)."""
        return inverted(*self.jet_at(triangle, place)[1:])

    def inverse(self, w: Complex, threads: int | None = None) -> Complex:
        """Return the points z with f(z) = w, for w of any shape."""
        return self.inverse_jet(w, threads)[0]

    def inverse_jet(self, w: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """Return f⁻¹ and its derivatives with respect to w and w̄ at points of any shape."""
        w = as_points(w)
        triangle, place = self.image_place(w.ravel(), threads)
        z, p, q = self.jet_at(triangle, place, threads)
        return z.reshape(w.shape), p.reshape(w.shape), q.reshape(w.shape)

    def jet_at(
        self, triangle: Index, place: Real, threads: int | None = None
    ) -> tuple[Complex, Complex, Complex]:
        """Return f⁻¹ and its derivatives with respect to w and w̄.

        Args:
            triangle: (p,) triangles.
            place: (p, 3) barycentric coordinates in the image.
            threads: number of threads; by default one per processor.
        """
        z, _, p, q = self._jets(triangle, place, threads)
        return z, p, q

    def extended_inverse(self, w: Complex, threads: int | None = None) -> tuple[Complex, Real]:
        """Return f⁻¹ at the points of the image nearest to w (p,), at any distance, and the distances, 0 inside."""
        triangle, place = self._image_locator(w, threads)
        away = np.zeros(w.size)
        outside = np.flatnonzero((triangle < 0) & np.isfinite(w))
        if outside.size:
            edge, part, away[outside] = self.image_rim.closest(w[outside])
            triangle[outside], place[outside] = self.image_rim.places(edge, part)
        return self.jet_at(triangle, place, threads)[0], away

    def extended_jet(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """Return f, f_z and f_z̄ at the points of the source nearest to z (p,), at any distance."""
        triangle, place = self._source_locator(z, threads)
        outside = np.flatnonzero((triangle < 0) & np.isfinite(z))
        if outside.size:
            edge, part, _ = self._source_rim.closest(z[outside])
            triangle[outside], place[outside] = self._source_rim.places(
                edge, unslid(part, self._slides[edge])
            )
        _, w, p, q = self._jets(triangle, place, threads)
        return w, *inverted(p, q)

    def place(self, z: Complex, threads: int | None = None) -> tuple[Index, Real]:
        """Locate points z (p,) of the source.

        Returns:
            (p,) triangles, -1 outside, and (p, 3) barycentric coordinates in the image.
        """
        triangle, place = self._source_locator(z, threads)
        outside = np.flatnonzero((triangle < 0) & np.isfinite(z))
        if outside.size:
            edge, part, distance = self._source_rim.closest(z[outside])
            is_near = distance <= self.near * self.diagonal
            edge, part = edge[is_near], unslid(part[is_near], self._slides[edge[is_near]])
            triangle[outside[is_near]], place[outside[is_near]] = self._source_rim.places(edge, part)
        return triangle, place

    def image_place(self, w: Complex, threads: int | None = None) -> tuple[Index, Real]:
        """Locate points w (p,) of the image.

        Returns:
            (p,) triangles, -1 outside, and (p, 3) barycentric coordinates in the image.
        """
        triangle, place = self._image_locator(w, threads)
        outside = np.flatnonzero((triangle < 0) & np.isfinite(w))
        if outside.size:
            edge, part, distance = self.image_rim.closest(w[outside])
            is_near = distance <= self.near * self.image_diagonal
            triangle[outside[is_near]], place[outside[is_near]] = self.image_rim.places(
                edge[is_near], part[is_near]
            )
        return triangle, place

    def moved(
        self,
        source: tuple[complex, complex, complex] = (1, 0, 0),
        image: tuple[complex, complex, complex] = (1, 0, 0),
    ) -> "TriangulatedMap":
        """Return the map in other coordinates, a z + b conj(z) + c instead of z, in either plane.

        Args:
            source: a, b and c of the source's plane.
            image: a, b and c of the image's plane.

        Raises:
            ValueError: one of them reverses orientation (|a| <= |b|).
        """
        for a, b, _ in (source, image):
            if not abs(a) > abs(b):
                raise ValueError(f"coordinates: {a} z + {b} conj(z) reverses the plane's orientation")
        (a, b, c), (d, e, f) = source, image
        z = a * self.source + b * self.source.conj() + c
        w = d * self.image + e * self.image.conj() + f
        return replace(self, source=z, image=w, bulge=a * self.bulges + b * self.bulges.conj())

    def linear_inverse(self) -> "TriangulatedMap":
        """Return the map that takes each triangle of the image linearly to that of the source.

        It is the inverse at vertices, and wherever this map is linear. Elsewhere it has its own patches.
        """
        return TriangulatedMap(self.image, self.source, self.faces, self.loops)

    @cached_property
    def injectivity(self) -> Certificate:
        """The certificate that the map is one-to-one."""
        return certify(self.source, self.image, self.faces, self.loops, self.edges, self.bulges)

    @cached_property
    def image_rim(self) -> Rim:
        """The boundary edges in the image's plane."""
        return Rim(self.image, self.edges)

    @cached_property
    def _source_rim(self) -> Rim:
        return Rim(self.source, self.edges)

    @cached_property
    def _slides(self) -> Real:
        return slides(self.bulges, self.source, self.edges)

    @cached_property
    def _source_locator(self) -> PatchLocator:
        return PatchLocator(self.patches[:, :3], self.patches[:, 3:])

    @cached_property
    def _image_locator(self) -> PatchLocator:
        corners = self.corners[: self.seen]
        return PatchLocator(corners, np.zeros_like(corners))

    def _jets(self, triangle: Index, place: Real, threads: int | None) -> tuple[Complex, ...]:
        return evaluate(self.patches, self.corners, triangle, place, threads)


def inverted(p: Complex, q: Complex) -> tuple[Complex, Complex]:
    """Return the derivatives of the inverse from those of a map, or vice versa; not finite where the Jacobian is 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        jacobian = np.abs(p) ** 2 - np.abs(q) ** 2
        return p.conj() / jacobian, -q / jacobian


def without_bulges(map: TriangulatedMap) -> TriangulatedMap:
    """Return the map with the same vertices and images that is linear on every triangle."""
    return replace(map, bulge=np.zeros(len(map.edges.ends), complex))
