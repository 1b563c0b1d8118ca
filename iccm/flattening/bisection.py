"""Divide a surface in two where both halves are flatter, along a short seam.

The normals of both halves are near to one direction each (2-means, as in Cohen-Steiner, Alliez, Desbrun, *Variational
Shape Approximation*, SIGGRAPH 2004). The border between them is a minimum cut: it is short, and follows creases and
borders of the file (Katz, Tal, *Hierarchical Mesh Decomposition*, SIGGRAPH 2003, §5). Normals are smoothed over a few
edges, since noise makes every edge of a scan a crease.
"""

import numpy as np

from ..arrays import Index, Real, unit_vectors
from ..meshes.borders import TIE_SHARE, generic
from ..meshes.patch import Patch
from ..meshes.topology import labels

SMOOTHING_TRIANGLES = 2_000
"""Triangles of a surface for which normals are smoothed once; noise of larger ones is finer relative to their size."""
MEANS_ROUNDS = 8  # of 2-means; directions hardly change after that
SEAM_WEIGHT = 0.15
"""Cost of a seam as long as the side of a square of the surface's area, relative to turning all normals by 90°."""
CREASE_RADIANS = 0.35
"""Angle at an edge at which a seam costs half: 20 degrees."""
LEAST_PART_SHARE = 0.1
"""Share of the area of a half's smaller parts that join the other half instead."""
FLOW_UNITS = 2**20  # integers of the flow for the whole surface


def halves(part: Patch) -> Index:
    """Return (m,) 0 or 1, the half of each triangle; all are equal where normals do not differ."""
    shape, area = part.triangles, part.areas
    inner = np.flatnonzero(shape.twin > np.arange(shape.twin.size))
    sides = np.stack([inner, shape.twin[inner]]) // 3
    normals = _smooth_normals(part, sides)
    label = _two_means(normals, area, part)
    toward = [unit_vectors((area[label == k, None] * normals[label == k]).sum(axis=0)) for k in (0, 1)]
    gain = area * (normals @ (toward[1] - toward[0])) / (2 * area.sum())
    angle = np.arccos(np.clip((normals[sides[0]] * normals[sides[1]]).sum(axis=1), -1, 1))
    price = part.seam_lengths[inner] / np.sqrt(area.sum()) / (1 + (angle / CREASE_RADIANS) ** 2)
    inside = ~part.drawn[inner]
    price[inside] = 1.0  # polygons are not divided
    label = _minimum_cut(gain, sides, SEAM_WEIGHT * price)
    return _without_crumbs(label, sides, area)


def _smooth_normals(part: Patch, sides: Index) -> Real:
    a, b, c = np.moveaxis(part.points[part.faces], 1, 0)
    vectors = np.cross(b - a, c - a)
    rounds = int(np.sqrt(len(vectors) / SMOOTHING_TRIANGLES))
    for _ in range(rounds):
        mean = vectors.copy()
        for k in range(3):
            mean[:, k] += np.bincount(sides[0], vectors[sides[1], k], len(mean))
            mean[:, k] += np.bincount(sides[1], vectors[sides[0], k], len(mean))
        vectors = mean
    return unit_vectors(vectors)


def _two_means(normals: Real, area: Real, part: Patch) -> Index:
    """Return (m,) 0 or 1, by which of two directions is nearer to each normal."""
    weight = area / area.sum()
    # of surfaces with symmetries, the same half is always the first one
    weight = weight * (1 + TIE_SHARE * generic(part.points, part.points[part.faces].mean(axis=1)))
    centred = normals - weight @ normals
    _, axes = np.linalg.eigh((weight[:, None] * centred).T @ centred)
    axis = axes[:, 2]
    axis *= np.sign(axis[np.argmax(np.abs(axis))])
    label = (centred @ axis > 0).astype(np.int64)
    for _ in range(MEANS_ROUNDS):
        sums = [(weight[label == k, None] * normals[label == k]).sum(axis=0) for k in (0, 1)]
        new = (normals @ (unit_vectors(sums[1]) - unit_vectors(sums[0])) > 0).astype(np.int64)
        if (new == label).all():
            break
        label = new
    return label


def _minimum_cut(gain: Real, sides: Index, price: Real) -> Index:
    """Return (m,) labels 0 or 1 with the largest sum of gains (m,) of label 1, less the prices (e,) of divided edges.

    Args:
        gain: of label 1 over label 0.
        sides: (2, e) pairs of triangles.
        price: of different labels on them.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    count = gain.size
    source, sink = count, count + 1
    number = np.arange(count)
    capacity = np.rint(FLOW_UNITS * np.concatenate([price, price, np.maximum(gain, 0), np.maximum(-gain, 0)]))
    tail = np.concatenate([sides[0], sides[1], np.full(count, source), number])
    head = np.concatenate([sides[1], sides[0], number, np.full(count, sink)])
    graph = coo_matrix((capacity.astype(np.int32), (tail, head)), shape=(count + 2,) * 2).tocsr()
    flow = maximum_flow(graph, source, sink).flow
    residual = graph - flow
    residual.eliminate_zeros()
    label = np.zeros(count + 2, np.int64)
    label[breadth_first_order(residual, source, return_predecessors=False)] = 1
    return label[:count]


def _without_crumbs(label: Index, sides: Index, area: Real) -> Index:
    """Return labels (m,) where small connected parts have joined the other half, the smallest first."""
    label = label.copy()
    while True:
        same = label[sides[0]] == label[sides[1]]
        part = labels(sides[0][same], sides[1][same], label.size)
        size = np.bincount(part, area)
        small = int(np.argmin(size))
        if size.size <= 2 or size[small] >= LEAST_PART_SHARE * area.sum():
            return label
        label[part == small] ^= 1
