"""Procrustes analysis of landmarks in the plane, and the mean of outlines between corresponding landmarks.

Points are complex numbers x + iy, so a rotation with a scale is one complex factor.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .arrays import Complex, Flags, Real
from .curve import Curve
from .errors import InputError
from .plane import Similarity

CONVERGED = 1e-14  # change of the mean, of unit size, at which iterations stop
MOST_ITERATIONS = 1000  # of alignments with the mean
LEAST_COMMON_ROTATION = 1e-6
"""Length of the mean of unit rotations below which specimens have no common orientation."""
SEMILANDMARKS = 512  # samples of an outline, two pixels apart on pictures of usual size
ALIGNING_ROUNDS = 20  # of finding where outlines without landmarks begin; three are usual


@dataclass(frozen=True, eq=False)
class Superimposition:
    """Landmarks of several specimens superimposed on their mean (generalised Procrustes analysis).

    Attributes:
        mean: (k,) the mean shape: centred, of centroid size one, and rotated as specimens are in the mean.
        placed: for each specimen, the similarity that takes its points onto the mean.
        sizes: (n,) centroid sizes: the root of the summed squared distances of landmarks to their centroid.
        distances: (n,) partial Procrustes distances to the mean: the root of the summed squared distances of
            landmarks after both have been scaled to centroid size one and superimposed.
    """

    mean: Complex
    placed: list[Similarity]
    sizes: Real
    distances: Real

    @property
    def mirrored(self) -> Flags:
        """Whether specimens are reflected; shape (n,)."""
        return np.array([place.mirrored for place in self.placed], dtype=bool)


def superimpose(landmarks: Complex, *, reflect: bool = False) -> Superimposition:
    """Superimpose specimens by translation, scale and rotation (Gower, *Generalized Procrustes analysis*, 1975).

    Each specimen is centred and scaled to centroid size one, as in the R package geomorph; the rotations and the mean
    minimise the sum of squared distances to the mean. The result does not depend on the order of specimens.

    Args:
        landmarks: (n, k) the landmarks of each specimen, y up.
        reflect: whether specimens may be reflected. Most of them keep their orientation.

    Raises:
        InputError: there are fewer than two landmarks, or they coincide in a specimen.

    Examples:
        >>> triangle = np.array([0, 4, 1 + 3j])
        >>> found = superimpose(np.array([triangle, 2j * triangle + 5]))
        >>> found.distances.round(9).tolist(), (found.sizes[1] / found.sizes[0]).round(9).item()
        ([0.0, 0.0], 2.0)
    """
    z = np.asarray(landmarks, dtype=complex)
    if z.ndim != 2 or z.shape[1] < 2 or not z.shape[0]:
        raise InputError("landmarks: at least 2 landmarks of at least one specimen are needed")
    centres = z.mean(axis=1, keepdims=True)
    sizes = np.linalg.norm(z - centres, axis=1)
    if (sizes <= 1e-12 * np.abs(z).max()).any():
        raise InputError("landmarks: all landmarks of a specimen lie in one point")
    shapes = (z - centres) / sizes[:, None]
    mirrored = np.zeros(len(z), dtype=bool)
    mean = _full_mean(shapes)
    if reflect:
        mirrored = _is_closer_reflected(shapes, shapes[0])
        mean = _full_mean(np.where(mirrored[:, None], shapes.conj(), shapes))
    for _ in range(MOST_ITERATIONS):
        if reflect:
            mirrored = _is_closer_reflected(shapes, mean)
        upright = np.where(mirrored[:, None], shapes.conj(), shapes)
        rotated = _rotations(upright, mean)[:, None] * upright
        better = rotated.mean(axis=0)
        better /= np.linalg.norm(better)
        change = float(np.linalg.norm(better - mean))
        mean = better
        if change < CONVERGED:
            break
    # the mean and its mirror image are equally good: most specimens keep their orientation, of halves the first one
    if 2 * mirrored.sum() > len(z) or (2 * mirrored.sum() == len(z) and mirrored[0]):
        mean, mirrored = mean.conj(), ~mirrored
    upright = np.where(mirrored[:, None], shapes.conj(), shapes)
    turns = _rotations(upright, mean)
    # the mean is only known up to a rotation: the one that rotates specimens least
    common = turns[~mirrored].mean()
    common = common / abs(common) if abs(common) > LEAST_COMMON_ROTATION else turns[~mirrored][0]
    mean, turns = mean / common, turns / common
    distances = np.linalg.norm(turns[:, None] * upright - mean, axis=1)
    placed = [
        Similarity(complex(turn.conj() if flip else turn) / float(size), 0j, complex(centre), bool(flip))
        for turn, size, centre, flip in zip(turns, sizes, centres[:, 0], mirrored)
    ]
    return Superimposition(mean, placed, sizes, distances)


def _full_mean(shapes: Complex) -> Complex:
    """Return the shape that is closest to shapes (n, k) if they may be scaled: the first eigenvector (Kent 1994)."""
    _, _, vectors = np.linalg.svd(shapes, full_matrices=False)
    mean: Complex = vectors[0]
    return mean


def _rotations(shapes: Complex, mean: Complex) -> Complex:
    """Return (n,) the unit numbers that rotate shapes onto the mean."""
    products = shapes.conj() @ mean
    lengths = np.abs(products)
    return np.where(lengths > 0, products / np.maximum(lengths, 1e-300), 1)


def _is_closer_reflected(shapes: Complex, mean: Complex) -> Flags:
    """Return (n,) whether shapes are closer to the mean if they are reflected."""
    closer: Flags = np.abs(shapes @ mean) > np.abs(shapes.conj() @ mean)
    return closer


def mean_outline(outlines: Sequence[Curve], anchors: Real, *, count: int = SEMILANDMARKS) -> Complex:
    """Return the mean of closed outlines that have been superimposed.

    Points correspond if they divide the length of the outline between the same two anchors in the same ratio
    (semilandmarks with equal distances). Without anchors, outlines are sampled from the starting points at which they
    are closest to each other.

    Args:
        outlines: counter-clockwise, in the plane of the mean.
        anchors: (n, k) arc lengths of corresponding points on each outline, in the same cyclic order; k may be 0.
        count: approximate number of points.

    Returns:
        The vertices of the mean, the first of which is the mean of the first anchors.
    """
    if not anchors.shape[1]:
        return _aligned_mean([_between(outline, np.zeros(1), [count]) for outline in outlines])
    shares = np.mean(
        [_gaps(outline, starts) / outline.length for outline, starts in zip(outlines, anchors)], axis=0
    )
    counts = np.maximum(2, np.rint(count * shares)).astype(int).tolist()
    samples = [_between(outline, starts, counts) for outline, starts in zip(outlines, anchors)]
    mean: Complex = np.mean(samples, axis=0)
    return mean


def _between(outline: Curve, anchors: Real, counts: Sequence[int]) -> Complex:
    """Sample an outline at its anchors, and at equal distances from each anchor to the next one."""
    gaps = _gaps(outline, anchors)
    return outline.at(
        np.concatenate([start + gap * np.arange(n) / n for start, gap, n in zip(anchors, gaps, counts)])
    )


def _gaps(outline: Curve, anchors: Real) -> Real:
    """Return (k,) the length of the outline from each anchor to the next one, around its start."""
    if len(anchors) == 1:
        return np.array([outline.length])
    return (np.roll(anchors, -1) - anchors) % outline.length


def _aligned_mean(samples: list[Complex]) -> Complex:
    """Return the mean of outlines with equally many samples after shifting each one to where it is closest to it."""
    away = [sum(np.abs(a - other).sum() for other in samples) for a in _from_top(samples)]
    mean = _from_top(samples)[int(np.argmin(away))]
    for _ in range(ALIGNING_ROUNDS):
        # the sum of squared distances is least where the correlation is largest
        products = [np.fft.ifft(np.fft.fft(z) * np.fft.fft(mean).conj()).real for z in samples]
        shifted = [np.roll(z, -int(np.argmax(product))) for z, product in zip(samples, products)]
        better = np.mean(shifted, axis=0)
        if np.array_equal(better, mean):
            break
        mean = better
    return mean


def _from_top(samples: list[Complex]) -> list[Complex]:
    """Return outlines that begin at their highest points."""
    return [np.roll(z, -int(np.argmax(z.imag))) for z in samples]
