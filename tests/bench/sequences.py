"""Sequences: how far inner points move from frame to frame, with independent maps and with maps that continue.

python -m tests.bench.sequences [--frames 24]

A waving flag, a growing star, a figure with a swinging arm, and a walking figure, each mapped from a disc or a square.
For 24 frames: the largest ratio of the movement of inner points (95 %) to that of the outline, as a set and as a curve;
the second differences of their paths (median, 95 %, largest, relative to the diagonal); frames solved from scratch; and
CPU-seconds. Where legs meet, the set of the outline's points moves by the gap between them, but the curve by the length
of a leg.
"""

import argparse
import time
from contextlib import suppress
from itertools import pairwise

import numpy as np
import shapely

import iccm
from iccm.curve import Curve
from iccm.io.run.maps import better

SAMPLES = 300  # of an outline, to compute its Fréchet distance
DISC = np.exp(2j * np.pi * np.arange(80) / 80)
SQUARE = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])


def outline(*parts):
    """Return the outline of lines with a width, and of other shapes."""
    whole = shapely.union_all([part if isinstance(part, shapely.Polygon) else _limb(*part) for part in parts])
    return shapely.get_coordinates(whole.exterior)[:-1] @ [1, 1j]


def _limb(width, *points):
    return shapely.LineString([(z.real, z.imag) for z in points]).buffer(width)


def flag(phase):
    """Return a flag in the wind."""
    x = np.linspace(0, 3, 61)
    wave = 0.25 * np.sin(2.2 * x - phase) * x / 3
    return np.concatenate([x + 1j * wave, (x + 1j * (wave + 2))[::-1]])


def star(phase):
    """Return a star whose points grow."""
    radii = np.where(np.arange(10) % 2, 1, 1 + 1.2 * phase / (2 * np.pi))
    return radii * np.exp(1j * (np.pi / 2 + np.pi * np.arange(10) / 5))


def arm(phase):
    """Return a body with an arm that swings by 100 degrees and back."""
    shoulder, angle = 0.4 + 0.7j, np.radians(-50 + 50 * (1 - np.cos(phase)))
    body = shapely.box(-0.6, -1.5, 0.6, 1.2).buffer(0.15)
    return outline(body, (0.22, 0.3 + 0.7j, shoulder + 1.8 * np.exp(1j * angle)))


def walk(phase):
    """Return a walking figure."""
    parts = [(0.34, 0, 0.05 + 1.4j), (0.33, 0.08 + 2.1j, 0.081 + 2.1j), (0.15, 0.05 + 1.4j, 0.08 + 2.1j)]
    for side in (1, -1):
        thigh, swing = 0.45 * side * np.sin(phase), -0.4 * side * np.sin(phase) + 0.75 * side
        shin = thigh - 0.35 * max(0, side * np.cos(phase))
        for width, begin, lengths, angles in (
            (0.17, 0.14 * side, (0.8, 0.8), (thigh + 0.32 * side, shin + 0.3 * side)),
            (0.13, 0.05 + 1.3j + 0.2 * side, (0.6, 0.5), (swing, swing + 0.2)),
        ):
            steps = [length * np.exp(1j * (angle - np.pi / 2)) for length, angle in zip(lengths, angles)]
            parts.append((width, begin, begin + steps[0], begin + steps[0] + steps[1]))
    return outline(*parts)


FILMS = {"flag": (DISC, flag), "star": (SQUARE, star), "arm": (DISC, arm), "walk": (DISC, walk)}


def maps(source, frames, *, follow):
    """Return the map of each frame, and how many were solved from scratch, as in `iccm map --sequence`."""
    fits, anew = [], 0
    for frame in frames:
        if not (follow and fits):
            fits.append(iccm.fit(source, frame, fit="whole"))
            continue
        continued = None
        with suppress(iccm.IccmError):
            continued = iccm.fit(source, frame, start=fits[-1], fit="whole")
        fits.append(better(fits[-1], continued, lambda frame=frame: iccm.fit(source, frame, fit="whole")))
        anew += fits[-1] is not continued
    return fits, anew


def moved(before, after):
    """Return how far an outline moves: the Hausdorff distance of both as sets, and the Fréchet distance as curves,
    which is a lower bound for any continuous map of one onto the other.
    """
    a, b = Curve.domain(before), Curve.domain(after)
    ends = [(c, d, c.at(np.linspace(0, c.length, 2000))) for c, d in ((a, b), (b, a))]
    apart = max(float(d.distances(z).max()) for _, d, z in ends)
    return apart, max(apart, frechet(*(c.at(np.arange(SAMPLES) * c.length / SAMPLES) for c in (a, b))))


def frechet(a, b):
    """Return the discrete Fréchet distance of two closed curves (n,) and (m,), independent of their first vertices."""
    distances, starts = np.abs(a[:, None] - b), np.arange(b.size)
    row = [np.full(b.size, np.inf) for _ in range(b.size + 2)]  # each for all starts of b
    row[0] = np.zeros(b.size)  # the corner before the first of both
    for i in range(a.size + 1):
        left, row[0] = row[0], np.full(b.size, np.inf)
        for j in range(b.size + 1):
            best = np.minimum(np.minimum(left, row[j]), row[j + 1])
            left, row[j + 1] = row[j + 1], np.maximum(best, distances[i % a.size, (j + starts) % b.size])
    return float(row[-1].min())


def main():
    """Print a line for each film and mode."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=24)
    count = parser.parse_args().frames
    print(f"{'':5} {'maps':9} {'motion':>15} {'second differences':>28} {'anew':>5} {'CPU s':>6}")
    for name, (source, film) in FILMS.items():
        frames = [film(2 * np.pi * k / count) for k in range(count)]
        outlines = np.array([moved(a, b) for a, b in pairwise(frames)])
        for follow in (False, True):
            start = time.process_time()
            fits, anew = maps(source, frames, follow=follow)
            seconds = time.process_time() - start
            z = fits[0]._interior
            w = np.array([fit.map(z) for fit in fits])
            w = w[:, np.isfinite(w).all(axis=0)]
            steps = np.quantile(np.abs(np.diff(w, axis=0)), 0.95, axis=1)
            sets, curves = (steps[:, None] / outlines).max(axis=0)
            bend = np.abs(np.diff(w, 2, axis=0)) / fits[0].diagonal
            order = "in turn" if follow else "their own"
            figures = " ".join(
                f"{value:9.2e}" for value in (np.median(bend), np.quantile(bend, 0.95), bend.max())
            )
            print(
                f"{name:5} {order:9} {sets:7.2f} {curves:7.2f} {figures} {anew:5} {seconds:6.1f}", flush=True
            )


if __name__ == "__main__":
    main()
