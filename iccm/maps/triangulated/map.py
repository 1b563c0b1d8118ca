"""A homeomorphism between two triangulations, smooth but for small jumps, with an inverse known in closed form."""

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from ...arrays import Complex, Real, as_points
from ...axes import UP, is_pairs, on_pairs
from ...plane import diagonal
from .adjacency import Edges, Index, edges_of
from .evaluation import evaluate
from .injectivity import Certificate, certify
from .location import PatchLocator
from .patches import bulges, slides
from .rim import Rim, unslid

NEAR_SHARE = 1e-3  # of the diagonal; outlines are simplified to 1e-4 and met to 6e-4 of it


@dataclass(frozen=True, eq=False)
class TriangulatedMap:
    """Takes the triangles of the source to those of the image; its inverse is quadratic on each triangle of the image.

    A point outside by no more than `near` counts as the nearest point of the outline; farther out everything is NaN.

    Attributes:
        source: (n,) vertices in the source's plane.
        image: (n,) and in the image's.
        faces: (m, 3) vertices of the triangles, counter-clockwise in both planes.
        loops: vertices of the boundary, the outer loop first and counter-clockwise, then those of holes, clockwise.
        near: see there, relative to the diagonal of either plane's bounding box.
        bulge: (e,) of the patches' edges (see `patches`), in the order of `edges`; worked out where not given.
            Zeros make the map linear on every triangle.
        seen: of a folded map, how many triangles have a place in the inverse: the first ones, of which earlier ones lie
            over later ones. None: all, and none lies over another.
        axes: what pairs of real numbers mean on either side, see `iccm.axes`.
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
        """Return a line: its size."""
        return f"<TriangulatedMap: {self.source.size} vertices, {len(self.faces)} triangles>"

    def __getstate__(self) -> dict:
        """Return the attributes, without what was worked out from them."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def edges(self) -> Edges:
        """The edges of the triangulation."""
        return edges_of(self.faces)

    @cached_property
    def bulges(self) -> Complex:
        """(e,) the bulge of each edge."""
        return bulges(self.faces, self.image, self.source, self.edges) if self.bulge is None else self.bulge

    @cached_property
    def corners(self) -> Complex:
        """(m, 3) the triangles' corners in the image."""
        return self.image[self.faces]

    @cached_property
    def patches(self) -> Complex:
        """(m, 6) source points of each triangle's corners, then the bulges of the sides opposite to them."""
        parts = [self.source[self.faces], self.bulges[self.edges.sides]]
        return np.ascontiguousarray(np.concatenate(parts, axis=1))

    @property
    def polygon(self) -> Complex:
        """Vertices of the source's outer boundary, counter-clockwise; mesh vertices on straight parts among them."""
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

    def __call__(self, z: Complex, threads: int | None = None) -> Complex:
        """f at complex points of any shape, or at pairs (…, 2): in the same form."""
        if is_pairs(z):
            return on_pairs(lambda points: self.jet(points, threads)[0], z, self.axes)  # type: ignore[return-value]
        return self.jet(z, threads)[0]

    def derivatives(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex]:
        """f_z and f_z̄ at points of any shape; on an edge, of one of its sides."""
        return self.jet(z, threads)[1:]

    def jet(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """f, f_z and f_z̄ at points of any shape."""
        z = as_points(z)
        triangle, place = self.place(z.ravel(), threads)
        _, w, p, q = self._jets(triangle, place, threads)
        f_z, f_zbar = inverted(p, q)
        return w.reshape(z.shape), f_z.reshape(z.shape), f_zbar.reshape(z.shape)

    def derivatives_at(self, triangle: Index, place: Real) -> tuple[Complex, Complex]:
        """f_z and f_z̄ in triangles (p,) at barycentric coordinates of the image (p, 3)."""
        return inverted(*self.jet_at(triangle, place)[1:])

    def inverse(self, w: Complex, threads: int | None = None) -> Complex:
        """Return the z with f(z) = w, any shape."""
        return self.inverse_jet(w, threads)[0]

    def inverse_jet(self, w: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """f⁻¹ and its derivatives by w and w̄ at points of any shape."""
        w = as_points(w)
        triangle, place = self.image_place(w.ravel(), threads)
        z, p, q = self.jet_at(triangle, place, threads)
        return z.reshape(w.shape), p.reshape(w.shape), q.reshape(w.shape)

    def jet_at(
        self, triangle: Index, place: Real, threads: int | None = None
    ) -> tuple[Complex, Complex, Complex]:
        """f⁻¹ and its derivatives by w and w̄ in triangles (p,) at barycentric coordinates of the image (p, 3)."""
        z, _, p, q = self._jets(triangle, place, threads)
        return z, p, q

    def extended_inverse(self, w: Complex, threads: int | None = None) -> tuple[Complex, Real]:
        """f⁻¹ at the nearest points of the image to w (p,), however far, and their distances, 0 inside."""
        triangle, place = self._image_locator(w, threads)
        away = np.zeros(w.size)
        lost = np.flatnonzero((triangle < 0) & np.isfinite(w))
        if lost.size:
            edge, part, away[lost] = self.image_rim.closest(w[lost])
            triangle[lost], place[lost] = self.image_rim.places(edge, part)
        return self.jet_at(triangle, place, threads)[0], away

    def extended_jet(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """f, f_z and f_z̄ at the nearest points of the source to z (p,), however far."""
        triangle, place = self._source_locator(z, threads)
        lost = np.flatnonzero((triangle < 0) & np.isfinite(z))
        if lost.size:
            edge, part, _ = self._source_rim.closest(z[lost])
            triangle[lost], place[lost] = self._source_rim.places(edge, unslid(part, self._slides[edge]))
        _, w, p, q = self._jets(triangle, place, threads)
        return w, *inverted(p, q)

    def place(self, z: Complex, threads: int | None = None) -> tuple[Index, Real]:
        """Return (p,) triangle, -1 outside, and (p, 3) barycentric coordinates in the image, of source points z
        (p,).
        """
        triangle, place = self._source_locator(z, threads)
        lost = np.flatnonzero((triangle < 0) & np.isfinite(z))
        if lost.size:
            edge, part, away = self._source_rim.closest(z[lost])
            found = away <= self.near * self.diagonal
            edge, part = edge[found], unslid(part[found], self._slides[edge[found]])
            triangle[lost[found]], place[lost[found]] = self._source_rim.places(edge, part)
        return triangle, place

    def image_place(self, w: Complex, threads: int | None = None) -> tuple[Index, Real]:
        """Return (p,) triangle, -1 outside, and (p, 3) barycentric coordinates in the image of points w (p,) of the
        image.
        """
        triangle, place = self._image_locator(w, threads)
        lost = np.flatnonzero((triangle < 0) & np.isfinite(w))
        if lost.size:
            edge, part, away = self.image_rim.closest(w[lost])
            found = away <= self.near * self.image_diagonal
            triangle[lost[found]], place[lost[found]] = self.image_rim.places(edge[found], part[found])
        return triangle, place

    def moved(
        self,
        source: tuple[complex, complex, complex] = (1, 0, 0),
        image: tuple[complex, complex, complex] = (1, 0, 0),
    ) -> "TriangulatedMap":
        """Return the same map in other coordinates, a z + b conj(z) + c instead of z, in either plane.

        Raises:
            ValueError: one of them turns the plane over (|a| <= |b|).
        """
        for a, b, _ in (source, image):
            if not abs(a) > abs(b):
                raise ValueError(f"coordinates: {a} z + {b} conj(z) reverses the plane's orientation")
        (a, b, c), (d, e, f) = source, image
        z = a * self.source + b * self.source.conj() + c
        w = d * self.image + e * self.image.conj() + f
        return replace(self, source=z, image=w, bulge=a * self.bulges + b * self.bulges.conj())

    def linear_inverse(self) -> "TriangulatedMap":
        """Return the map that takes each triangle of the image linearly to that of the source: at vertices, and where
        this map is linear, the inverse; with separate patches elsewhere.
        """
        return TriangulatedMap(self.image, self.source, self.faces, self.loops)

    @cached_property
    def injectivity(self) -> Certificate:
        """What is certain about the map being one-to-one."""
        return certify(self.source, self.image, self.faces, self.loops, self.edges, self.bulges)

    @cached_property
    def image_rim(self) -> Rim:
        """The rim in the image's plane."""
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
    """Return the derivatives of an inverse from those of a map, either way; not finite where the Jacobian is 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        jacobian = np.abs(p) ** 2 - np.abs(q) ** 2
        return p.conj() / jacobian, -q / jacobian
