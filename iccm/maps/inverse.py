"""The inverse of a harmonic map: Newton's method from seeds that are laid out as the map itself suggests.

Seeds are the centres of a Whitney decomposition of the source (squares about as large as their distance to the
boundary, down to a size whose image is small), and boundary points moved a little inside. Where the map is univalent,
each seed's image is surrounded by a disc of comparable size that Newton's method reaches. f(z + h) = w gives

    h = (conj(f_z) r - f_z̄ conj(r)) / (|f_z|² - |f_z̄|²),   r = w - f(z);

steps that leave the source or do not lower |r| are halved.
"""

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex, Real, xy_of
from ..curve import Curve
from ..jit import kernel
from ..parallel import over_slices, thread_count
from .boundary_image import BoundaryImage, boundary_image
from .evaluate import Evaluator, jet_in
from .harmonic import HarmonicMap
from .quadtree import RHO, distance, is_inside, leaf_of

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

# Chosen by hand, and nobody knows better, where a line does not say how a number was found.
TRIES = 12  # seeds tried for a point before it is called lost
SEEDS = 400_000  # at most


class Inverse:
    """The inverse of a map, made ready for many points.

    Args:
        map: a harmonic map or its evaluator.
        resolution: spacing of the seeds near the boundary, in units of the target; 1/400 of its size by default.
    """

    def __init__(self, map: HarmonicMap | Evaluator, resolution: float | None = None):
        self.forward = map if isinstance(map, Evaluator) else Evaluator(map)
        image = self.forward(self.forward.map.polygon)
        self.size = float(np.hypot(np.ptp(image.real), np.ptp(image.imag)))
        self.resolution = resolution or self.size / 400

    @cached_property
    def boundary_image(self) -> BoundaryImage:
        """The image of the boundary, flat to a twentieth of the resolution."""
        return boundary_image(self.forward, 0.05 * self.resolution, 2 * self.resolution)

    @cached_property
    def seeds(self) -> tuple[Complex, Complex]:
        """Points inside the source and their images."""
        z, w = whitney(self.forward.tree, self.resolution, SEEDS)
        return np.concatenate([z, self.rim[0]]), np.concatenate([w, self.rim[1]])

    @cached_property
    def rim(self) -> tuple[Complex, Complex]:
        """Points just inside the boundary, one for each of the boundary image's segments, and their images."""
        z = self.boundary_image.z
        ahead = np.roll(z, -1) - z
        inward = 1j * self.forward.tree.edge[self.boundary_image.edge]
        rim = z + 0.5 * ahead + inward / np.abs(inward) * 0.25 * np.abs(ahead)
        w = self.forward(rim)
        good = np.isfinite(w)
        return rim[good], w[good]

    @cached_property
    def nearest(self) -> "cKDTree":
        """Search tree of the seeds' images."""
        from scipy.spatial import cKDTree

        w = self.seeds[1]
        return cKDTree(xy_of(w))

    def __call__(self, w: Complex, threads: int | None = None) -> Complex:
        """The z inside the source with f(z) = w, any shape; NaN where none was found. Each z has been verified."""
        w = np.asarray(w, dtype=np.complex128)
        flat = np.ascontiguousarray(w.ravel())
        out = np.full(flat.size, complex(np.nan, np.nan))
        todo = np.flatnonzero(np.isfinite(flat))
        tried = 0
        for count in (1, TRIES):
            if not todo.size:
                break
            near = self.seed_numbers(flat[todo], count, threads)[:, tried:]
            out[todo] = self.solve(flat[todo], near, threads)
            todo, tried = todo[np.isnan(out[todo])], count
        return out.reshape(w.shape)

    @cached_property
    def _image_curve(self) -> Curve:
        return Curve(self.boundary_image.w)

    def inverse(self, w: Complex, threads: int | None = None) -> Complex:
        """The call, under the name that maps of other kinds have for it."""
        return self(w, threads)

    def extended_inverse(self, w: Complex, threads: int | None = None) -> tuple[Complex, Real]:
        """(p,) preimages of finite points (p,), those outside the image taking that of the nearest point of the
        boundary's image, and (p,) how far they lie from it: 0 where there is a preimage."""
        z, away = self(w, threads), np.zeros(w.size)
        lost = np.flatnonzero(np.isnan(z))
        if lost.size:
            edge, t = self._image_curve.locate(self._image_curve.closest(w[lost]))
            after = (edge + 1) % self.boundary_image.z.size
            z[lost], foot = (
                a[edge] * (1 - t) + a[after] * t for a in (self.boundary_image.z, self.boundary_image.w)
            )
            away[lost] = np.abs(w[lost] - foot)
        return z, away

    def jet(self, z: Complex, threads: int | None = None) -> tuple[Complex, Complex, Complex]:
        """f, f_z and f_z̄ of the map itself, as `Evaluator.jet`."""
        return self.forward.jet(z, threads)

    def seed_numbers(self, w: Complex, count: int, threads: int | None = 1) -> NDArray[np.int64]:
        """(p, count) numbers of the seeds whose images are nearest to w (p,), nearest first."""
        count = min(count, self.seeds[0].size)
        places = xy_of(w)
        found = self.nearest.query(places, k=count, workers=thread_count(threads))[1]
        return np.ascontiguousarray(found.reshape(w.size, count))

    def solve(self, w: Complex, near: NDArray[np.int64], threads: int | None = None) -> Complex:
        """Newton from the given seeds (p, k) in turn; NaN where all fail."""
        out = np.empty(w.size, dtype=np.complex128)
        tree, seeds, tol = self.forward.tree, self.seeds[0], 1e-10 * self.forward.diagonal
        over_slices(
            lambda part: _from_seeds(tree, w[part], near[part], seeds, tol, 1e-9 * self.size, out[part]),
            w.size,
            threads,
        )
        return out


def inverse(map: HarmonicMap | Evaluator | Inverse, w: Complex) -> Complex:
    """The points z inside the source polygon with map(z) = w.

    Args:
        map: the map, or an `Inverse` made from it (which saves the preparation on later calls).
        w: complex points of the target, any shape.

    Returns:
        The same shape, NaN where w has no preimage inside.
    """
    return (map if isinstance(map, Inverse) else Inverse(map))(w)


def inverse_derivatives(f_z: Complex, f_zbar: Complex) -> tuple[Complex, Complex]:
    """z_w and z_w̄ of a map's inverse where the map has such derivatives; not finite where its Jacobian is 0."""
    jacobian = np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        return f_z.conj() / jacobian, -f_zbar / jacobian


@kernel
def newton(t, w, z, tol, accept):
    """Solves f(z) = w from z: the solution, |f - w| before the final step or inf for failure, f_z and f_z̄ there.

    The final step is at most tol, so that the error after it is of order tol², and |f - w| before it at most accept,
    unless the step is as small as numbers are: where the map crowds, a last digit of z moves f visibly.
    """
    k = leaf_of(t, z)
    if k < 0 or not is_inside(t, k, z):
        return z, np.inf, 0j, 0j
    f, a, b = jet_in(t, k, z, -1)
    for _ in range(60):
        r = w - f
        jacobian = a.real * a.real + a.imag * a.imag - b.real * b.real - b.imag * b.imag
        if not jacobian > 0:
            return z, np.inf, a, b
        h = (a.conjugate() * r - b * r.conjugate()) / jacobian
        if abs(h) <= tol and (abs(r) <= accept or abs(h) <= 1e-15 * t.half[0]):
            k = leaf_of(t, z + h)
            return (z + h if k >= 0 and is_inside(t, k, z + h) else z), abs(r), a, b
        moved = False
        for _half in range(30):
            k = leaf_of(t, z + h)
            if k >= 0 and is_inside(t, k, z + h):
                f1, a1, b1 = jet_in(t, k, z + h, -1)
                if abs(w - f1) < abs(r):
                    z, f, a, b, moved = z + h, f1, a1, b1, True
                    break
            h *= 0.5
        if not moved:
            if abs(r) <= accept < np.inf:
                return z, abs(r), a, b
            break
    return z, np.inf, a, b


@kernel
def _from_seeds(t, w, near, seeds, tol, accept, out):
    for i in range(w.size):
        out[i] = complex(np.nan, np.nan)
        for j in range(near.shape[1]):
            z, residual, _, _ = newton(t, w[i], seeds[near[i, j]], tol, accept)
            if residual < np.inf:
                out[i] = z
                break


@kernel
def clearance(t, k, z):
    """A lower bound of the distance from z, a point of leaf k, to the boundary, sharp when the boundary is near."""
    best = RHO * np.sqrt(2.0) * t.half[k] - abs(z - t.centre[k])
    for j in range(t.start[k], t.stop[k]):
        e = t.near[j]
        best = min(best, distance(z, t.za[e], t.edge[e]))
    return best


@kernel
def whitney(t, resolution, limit):
    """Centres of squares that fill the inside, each at most as wide as its distance to the boundary or with an image
    smaller than the resolution, and the images of the centres."""
    zs = np.empty(limit, dtype=np.complex128)
    ws = np.empty(limit, dtype=np.complex128)
    count = 0
    size = 0.0
    for j in range(t.dens.shape[1]):
        size = max(size, abs(t.dens[0, j] - t.dens[0, 0]))
    stack = [(t.centre[0], t.half[0], size / t.half[0], 0)]
    visits = 0
    while len(stack) > 0 and count < limit and visits < 20 * limit:
        visits += 1
        z, half, scale, depth = stack.pop()
        k = leaf_of(t, z)
        gap = clearance(t, k, z)
        if is_inside(t, k, z):
            w, a, b = jet_in(t, k, z, -1)
            if abs(a) + abs(b) < np.inf:
                scale = abs(a) + abs(b)
                if half <= 0.5 * gap or scale * half < resolution:
                    zs[count], ws[count] = z, w
                    count += 1
                    continue
        elif gap > 1.5 * half:
            continue
        if scale * half < resolution or depth > 50:
            continue
        h = 0.5 * half
        for quad in range(4):
            corner = complex(h if quad & 1 else -h, h if quad & 2 else -h)
            stack.append((z + corner, h, scale, depth + 1))
    return zs[:count].copy(), ws[:count].copy()
