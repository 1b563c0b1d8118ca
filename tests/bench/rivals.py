"""Other authors' maps, reimplemented on a triangulation, with which the comparison compares ours.

All of them need a boundary correspondence: vertices and points at equal shares of the two outlines, with the shift that
rotates the picture least (`paired`). Each takes a Mesh and the images of its boundary nodes (b,) and returns (n,)
images.
"""

from dataclasses import dataclass

import igl
import numpy as np
import scipy.sparse.csgraph as graphs
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import Delaunay
from skimage.transform import ThinPlateSplineTransform

from iccm import Curve
from iccm.conformal.harmonic_measure import inner_points
from iccm.paper.energies import Basis, Target, closeness, consistency
from iccm.paper.least_squares import LeastSquares

SHIFTS = 120
FLAT = 1e-12  # relative to the shape's area: triangles with less are degenerate
ROUNDS = 200  # of local and global steps of as-rigid-as-possible
# of the boundary's distance; from 10 to 1e5 the gap of whale → fish decreases from 0.2 to 0.015, and folds grow to 1.1
# %
PENALTY = 1e4


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangulated domain: (n,) nodes, the boundary's first and in order, and (t, 3) counter-clockwise triangles."""

    curve: Curve
    nodes: np.ndarray
    triangles: np.ndarray
    boundary: int

    @classmethod
    def of(cls, curve: Curve, panels: int = 400) -> "Mesh":
        """Triangulate the inside of a curve, about `panels` boundary edges, corners kept."""
        rim = curve.resample(panels)
        return meshed(rim, inner_points(rim, rim.knots[:-1]))

    @property
    def rim(self) -> np.ndarray:
        """Indices of the boundary nodes."""
        return np.arange(self.boundary)

    @property
    def areas(self) -> np.ndarray:
        """(t,) areas of the triangles."""
        a, b, c = self.nodes[self.triangles].T
        return 0.5 * _cross(b - a, c - a)


def paired(mesh: Mesh, target: Curve) -> np.ndarray:
    """Return (b,) target points at equal shares of the outlines, with the shift at which a similarity without rotation
    fits best.
    """
    share = mesh.curve.knots[:-1] / mesh.curve.length
    weight = mesh.curve.lengths + np.roll(mesh.curve.lengths, 1)
    z = mesh.curve.z - np.average(mesh.curve.z, weights=weight)
    candidates = []
    for shift in np.arange(SHIFTS) / SHIFTS:
        w = target.at((share + shift) * target.length)
        candidates.append((np.sum(weight * z.conj() * (w - np.average(w, weights=weight))).real, shift))
    return target.at((share + max(candidates)[1]) * target.length)


def aligned(mesh: Mesh, images: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return z moved by the similarity that brings the boundary nodes closest to their images."""
    scale, shift = np.polyfit(mesh.nodes[mesh.rim], images, 1)
    return scale * z + shift


def polygon_harmonic(mesh: Mesh, images: np.ndarray) -> np.ndarray:
    """[SH15] Harmonic onto a regular polygon, then the inverse of the target's harmonic map onto it.

    T. Schneider, K. Hormann, *Smooth bijective maps between arbitrary planar polygons*, 2015; with one intermediate
    polygon.
    """
    corners = np.exp(2j * np.pi * np.arange(mesh.boundary) / mesh.boundary)
    rim = Curve.domain(images)
    goal = meshed(rim, inner_points(rim, rim.knots[:-1]))
    source_images, target_images = harmonic(mesh, corners), harmonic(goal, corners)
    return interpolated(Mesh(rim, target_images, goal.triangles, goal.boundary), goal.nodes, source_images)


def interpolated(mesh: Mesh, images: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return (p,) images of points under the piecewise linear map of a mesh; for points outside, of the closest
    point.
    """
    _, hit, foot = igl.point_mesh_squared_distance(_xyz(z), _xyz(mesh.nodes), mesh.triangles)
    a, b, c = mesh.nodes[mesh.triangles[hit]].T
    p = foot[:, 0] + 1j * foot[:, 1]
    total = _cross(b - a, c - a)
    u, v = _cross(p - a, c - a) / total, _cross(b - a, p - a) / total
    a, b, c = images[mesh.triangles[hit]].T
    return a + u * (b - a) + v * (c - a)


def harmonic(mesh: Mesh, images: np.ndarray) -> np.ndarray:
    """Return the piecewise linear harmonic map with given boundary values."""
    return _complex(igl.harmonic(_xy(mesh.nodes), mesh.triangles, mesh.rim, _xy(images), 1))


def rigid(mesh: Mesh, images: np.ndarray) -> np.ndarray:
    """[ESA07] As rigid as possible with a sliding boundary: its distance to the closest points of the target is
    penalised.

    M. Eitz, O. Sorkine, M. Alexa, *Sketch based image deformation*, 2007: starting from the shape at the target's place
    and size, it alternates between rotations with closest points, and positions.
    """
    z, target = aligned(mesh, images, mesh.nodes), Curve(images)
    laplacian = -igl.cotmatrix(_xy(z), mesh.triangles).tocoo()
    apart = laplacian.row != laplacian.col
    i, j, weight = laplacian.row[apart], laplacian.col[apart], -laplacian.data[apart]
    edge, share = z[i] - z[j], np.zeros(z.size)
    rim = Curve(z[mesh.rim])
    share[mesh.rim] = 0.5 * (rim.lengths + np.roll(rim.lengths, 1)) * PENALTY / rim.length
    solve = splu((laplacian + diags_array(share)).tocsc()).solve
    w, pull = harmonic(mesh, images), np.zeros(z.size, complex)
    for _ in range(ROUNDS):
        turn = np.zeros(z.size, complex)
        np.add.at(turn, i, weight * edge.conj() * (w[i] - w[j]))
        turn /= np.maximum(np.abs(turn), 1e-300)
        right = np.zeros(z.size, complex)
        np.add.at(right, i, 0.5 * weight * (turn[i] + turn[j]) * edge)
        pull[mesh.rim] = target.nearest(w[mesh.rim])
        right += share * pull
        w = solve(right.real) + 1j * solve(right.imag)
    return w


def szego(mesh: Mesh, images: np.ndarray) -> np.ndarray:
    """[WBCG09] Return the holomorphic function closest to the boundary values, by Cauchy-Green coordinates."""
    polygon = mesh.nodes[mesh.rim]
    basis = Basis(polygon)
    per_edge = 4
    measure = np.repeat(mesh.curve.lengths / (per_edge * mesh.curve.length), per_edge)
    t = (np.arange(per_edge) + 0.5) / per_edge
    goal = (images[:, None] + (np.roll(images, -1) - images)[:, None] * t).ravel()
    closest = closeness(basis, mesh.curve.sample(per_edge), measure, mesh.curve)
    return basis.positions(mesh.nodes) @ LeastSquares([closest]).solve([Target(goal)])


def angles(mesh: Mesh, images: np.ndarray) -> np.ndarray:
    """[WG10] Return the conformal map whose boundary turns like the target's: Im log f' on the boundary, then ∫ f'.

    O. Weber, C. Gotsman, *Controllable conformal maps for shape deformation and interpolation*, 2010. The end is moved
    by the similarity that brings it closest to the target.
    """
    turn = np.unwrap(np.angle((np.roll(images, -1) - images) / mesh.curve.edges))
    basis = Basis(mesh.nodes[mesh.rim])
    positions = basis.positions(mesh.curve.sample(1))
    keep = 1e-2 * consistency(basis, np.ones(mesh.boundary), 1.0).matrix
    rows = np.vstack([np.hstack([positions.imag, positions.real]), real_form(keep)])
    right = np.concatenate([turn, np.zeros(2 * mesh.boundary)])
    coefficients = np.linalg.lstsq(rows, right, rcond=1e-10)[0]
    f = integrated(mesh, lambda z: np.exp(basis.positions(z) @ _complex(coefficients.reshape(2, -1).T)))
    scale, shift = np.polyfit(f[mesh.rim], images, 1)
    return scale * f + shift


def real_form(matrix: np.ndarray) -> np.ndarray:
    """Return the real matrix that acts on real and imaginary parts like a complex one."""
    return np.block([[matrix.real, -matrix.imag], [matrix.imag, matrix.real]])


def integrated(mesh: Mesh, slope) -> np.ndarray:
    """Return (n,) the integral of a function along a tree of edges that starts deep inside, with three Gauss points per
    edge.
    """
    a, b = np.concatenate([mesh.triangles[:, [k, (k + 1) % 3]] for k in range(3)]).T
    edges = coo_array((np.ones(a.size), (a, b)), (mesh.nodes.size,) * 2).tocsr()
    root = int(np.argmax(mesh.curve.distances(mesh.nodes)))
    order, before = graphs.breadth_first_order(edges, root, directed=False)
    child = order[1:]
    start, step = mesh.nodes[before[child]], mesh.nodes[child] - mesh.nodes[before[child]]
    x, weight = np.polynomial.legendre.leggauss(3)
    z = start[:, None] + step[:, None] * (0.5 + 0.5 * x)
    part = step * (slope(z.ravel()).reshape(z.shape) @ (0.5 * weight))
    out = np.zeros(mesh.nodes.size, complex)
    for node, grown in zip(child, part):  # parents come first
        out[node] = out[before[node]] + grown
    return out


def thin_plate(mesh: Mesh, images: np.ndarray) -> np.ndarray:
    """Return the thin-plate spline of scikit-image through the boundary nodes."""
    spline = ThinPlateSplineTransform.from_estimate(_xy(mesh.nodes[mesh.rim]), _xy(images))
    return _complex(spline(_xy(mesh.nodes)))


def distortion(mesh: Mesh, images: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (t,) conformal distortion σ₁/σ₂ and signed area scale of the linear map of each triangle."""
    a, b, c = mesh.nodes[mesh.triangles].T
    p, q = (b - a), (c - a)
    u, v = (images[mesh.triangles[:, k]] - images[mesh.triangles[:, 0]] for k in (1, 2))
    twice = 2j * _cross(p, q)  # f = f_z z + f_zbar conj(z) on the triangle
    f_z, f_zbar = -(u * q.conj() - v * p.conj()) / -twice, (u * q - v * p) / -twice
    stretch = np.abs(np.abs(f_z) - np.abs(f_zbar))
    return (np.abs(f_z) + np.abs(f_zbar)) / np.maximum(stretch, 1e-300), np.abs(f_z) ** 2 - np.abs(
        f_zbar
    ) ** 2


def meshed(rim: Curve, inside: np.ndarray) -> Mesh:
    """Return a mesh with given boundary vertices and inner points."""
    nodes = np.concatenate([rim.z, inside])
    triangles = Delaunay(_xy(nodes)).simplices.astype(np.int64)
    triangles = triangles[rim.contains(nodes[triangles].mean(axis=1))]
    a, b, c = nodes[triangles].T
    area = _cross(b - a, c - a)
    triangles[area < 0] = triangles[area < 0][:, ::-1]
    kept = np.abs(area) > FLAT * abs(
        rim.area
    )  # three neighbours on a straight edge would make a triangle from rounding errors
    return Mesh(rim, nodes, triangles[kept], rim.z.size)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a.conj() * b).imag


def _xy(z: np.ndarray) -> np.ndarray:
    return np.column_stack([z.real, z.imag])


def _xyz(z: np.ndarray) -> np.ndarray:
    return np.column_stack([z.real, z.imag, np.zeros(z.size)])


def _complex(xy: np.ndarray) -> np.ndarray:
    return xy[:, 0] + 1j * xy[:, 1]
