"""Triangulations of a domain's inside with given boundary panels as edges."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import Delaunay

from ..arrays import Complex, Flags, Index, xy_of
from ..balanced.meshing.delaunay import legalise
from ..balanced.meshing.mesh import recover
from ..curve import Curve
from ..errors import InputError
from ..plane import triangle_areas

FLAT_AREA_SHARE = 1e-12
"""Twice the area over the squared longest edge: triangles of collinear nodes have less, due to rounding."""


class TooThinError(InputError):
    """The inside of an outline cannot be determined because of rounding."""

    def __init__(self) -> None:
        super().__init__("an outline has parts too thin to be triangulated; simplify it, or make it wider")


class PlaneMesh(NamedTuple):
    """Counter-clockwise triangles (t, 3), and those across the edges opposite to their vertices (t, 3), -1 for none."""

    faces: Index
    across: Index


def delaunay(nodes: Complex) -> PlaneMesh:
    """Return the Delaunay triangulation of the nodes' convex hull."""
    triangulation = Delaunay(xy_of(nodes))
    return PlaneMesh(triangulation.simplices.astype(np.int64), triangulation.neighbors.astype(np.int64))


def missing(mesh: PlaneMesh, panels: int, nodes: int) -> Flags:
    """Return (panels,) whether a panel, from each of the first nodes to the next, is missing among the edges."""
    present = [keys(mesh.faces[:, k], mesh.faces[:, (k + 1) % 3], nodes) for k in range(3)]
    start = np.arange(panels)
    return ~np.isin(keys(start, (start + 1) % panels, nodes), np.concatenate(present))


def constrained(nodes: Complex, mesh: PlaneMesh, lacking: Flags) -> PlaneMesh:
    """Return the triangulation with all panels as edges (Sloan 1993).

    All other edges are Delaunay subject to that.

    Args:
        nodes: (n,) nodes, the panels' ends first and in order.
        mesh: their Delaunay triangulation.
        lacking: (panels,) the panels that are not among its edges.

    Raises:
        TooThinError: crossings of edges cannot be determined because of rounding.
    """
    faces, across = mesh.faces.copy(), mesh.across.copy()
    following = (np.arange(lacking.size) + 1) % lacking.size
    for k in np.flatnonzero(lacking).tolist():
        if not recover(nodes, faces, across, len(faces), k, int(following[k]), following):
            raise TooThinError
    stack = np.zeros(8 * len(faces), np.int64)
    stack[0], stack[1 : 1 + len(faces)] = len(faces), np.arange(len(faces))
    legalise(nodes, faces, across, stack, following)
    triangulation = PlaneMesh(faces, across)
    if missing(triangulation, lacking.size, nodes.size).any():
        raise TooThinError
    return triangulation


def inside(curve: Curve, nodes: Complex, mesh: PlaneMesh) -> Index:
    """Return (m, 3) the triangles inside a closed curve.

    Degenerate ones, with three nodes on one of the curve's edges, are omitted.
    """
    a, b, c = nodes[mesh.faces].T
    longest = np.maximum.reduce([np.abs(b - a), np.abs(c - b), np.abs(a - c)])
    faces = mesh.faces[2 * triangle_areas(nodes[mesh.faces]) > FLAT_AREA_SHARE * longest**2]
    return faces[curve.contains(nodes[faces].mean(axis=1))]


def keys(a: Index, b: Index, nodes: int) -> Index:
    """Return one key for each unordered pair of nodes."""
    return np.minimum(a, b).astype(np.int64) * nodes + np.maximum(a, b)
