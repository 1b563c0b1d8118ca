"""Comparison with other authors' maps on the same shapes, as in Fig. 7 of the paper: a table and a picture.

python -m tests.bench.comparison [--picture]

The other methods need a boundary correspondence. They get points at equal shares of both outlines, starting where the
picture rotates least; [ESA07] slides from there. Ours need none, but use the pins and strokes in the samples' drawings,
which the others cannot. Without any, the quasi-conformal map equals the conformal one, and is left out. For all
methods, distortion is that of the linear maps of the triangles of one mesh of the source, weighted by area; a conformal
map therefore has slightly more than 1. `gap` is the two-sided Hausdorff distance between the image of the boundary and
the target, relative to its diagonal: for the others of the mesh's boundary, for ours of the map's. A method that fixes
the boundary's nodes has a gap only between them.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import iccm
from iccm import Curve, Fit
from iccm.curve import hausdorff
from iccm.io.shapes import constraints

from . import pictures, rivals, shapes
from .rivals import Mesh

CASES = (
    ("pins/round.svg", "pins/cat.svg"),
    ("raster/whale.svg", "raster/fish.svg"),
    ("strokes/straight.svg", "strokes/bent.svg"),
)
RIVALS: dict[str, Callable[[Mesh, np.ndarray], np.ndarray]] = {
    "[SH15] harmonic": rivals.polygon_harmonic,
    "[ESA07] rigid, sliding": rivals.rigid,
    "[WBCG09] Szegő": rivals.szego,
    "[WG10] angles": rivals.angles,
    "thin-plate spline": rivals.thin_plate,
}
OURS = {
    "ours, conformal": {"method": "conformal"},
    "ours, quasi-conformal": {"quasi": 0.01},
    "ours, balanced": {"method": "balanced"},
}


@dataclass(frozen=True, eq=False)
class Result:
    """The map of a mesh by one method, and its figures in the table."""

    name: str
    images: np.ndarray
    fit: Fit | None
    gap: float
    conformal: tuple[float, float]
    area: float
    folds: float
    pins: float
    seconds: float


def compare(source: Curve, target: Curve, pins: np.ndarray, strokes: list) -> tuple[Mesh, list[Result]]:
    """Run all methods on one pair; pins and strokes are only given to our maps, and errors at pins are measured for
    all.
    """
    mesh = Mesh.of(source)
    targets = rivals.paired(mesh, target)
    out = []
    for name, options in OURS.items():
        if "quasi" in options and not (pins.size or strokes):
            continue
        start = time.perf_counter()
        fit = iccm.fit(source, target, pins=pins, strokes=strokes, **options)
        seconds = time.perf_counter() - start
        images = fit.map(Curve(fit.map.polygon).pulled_in(mesh.nodes))
        out.append(judged(name, mesh, images, target, pins, seconds, fit))
    for name, method in RIVALS.items():
        start = time.perf_counter()
        images = method(mesh, targets)
        out.append(judged(name, mesh, images, target, pins, time.perf_counter() - start))
    return mesh, out


def judged(
    name: str,
    mesh: Mesh,
    images: np.ndarray,
    target: Curve,
    pins: np.ndarray,
    seconds: float,
    fit: Fit | None = None,
) -> Result:
    """Return the figures of one map."""
    dilatation, area = rivals.distortion(mesh, images)
    weight = mesh.areas / mesh.areas.sum()
    log = np.log10(np.maximum(np.abs(area), 1e-300))
    gap = fit._boundary["hausdorff"] if fit else hausdorff(Curve(images[mesh.rim]), target) / target.diagonal
    return Result(
        name,
        images,
        fit,
        gap,
        (share(dilatation, weight, 0.5), share(dilatation, weight, 0.95)),
        share(log, weight, 0.95) - share(log, weight, 0.05),
        float(weight[area < 0].sum()),
        pin_error(mesh, images, pins) / target.diagonal,
        seconds,
    )


def share(values: np.ndarray, weight: np.ndarray, q: float) -> float:
    """Return the weighted quantile q of values."""
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weight[order]), q * weight.sum())])


def pin_error(mesh: Mesh, images: np.ndarray, pins: np.ndarray) -> float:
    """Return the root mean square distance of the pins' images from their targets; NaN without pins."""
    if not pins.size:
        return float("nan")
    return float(np.sqrt(np.mean(np.abs(rivals.interpolated(mesh, images, pins[:, 0]) - pins[:, 1]) ** 2)))


def table(results: list[Result]) -> None:
    """Print one line per method."""
    print(f"{'method':30} gap      distortion 50 % 95 %  area  folds   pins     seconds")
    for r in results:
        pins = "   -   " if np.isnan(r.pins) else f"{r.pins:.1e}"
        print(
            f"{r.name:30} {r.gap:.1e}  {r.conformal[0]:10.2f} {r.conformal[1]:9.2f}  {r.area:4.2f}  {r.folds:6.2%}"
            f"  {pins}  {r.seconds:6.2f}"
        )


def picture(mesh: Mesh, results: list[Result], source: Curve, target: Curve, name: str) -> None:
    """Draw the source and the result of each method."""
    low, high = target.box
    figure, panels = pictures.sheet(5, 2, 2.1, 0.35 if (high - low).imag > 0.75 * (high - low).real else -0.5)
    texture, home, away = pictures.board(source), pictures.around(source), pictures.around(target)
    first, *other_panels = panels.ravel()
    pictures.original(first, source, texture, home, 300)
    pictures.title(first, "source", "squares of a numbered board")
    for axes, r in zip(other_panels, results):
        if r.fit:
            pictures.textured(axes, r.fit, texture, away, 300)
        else:
            pictures.painted(axes, mesh, r.images, texture, away, 300)
        pictures.outline(axes, target.z, pictures.INK, 0.9)
        pictures.title(axes, r.name, f"gap {r.gap:.0e}, K {r.conformal[1]:.2g}, folds {r.folds:.1%}")
    for axes in other_panels[len(results) :]:
        axes.set_axis_off()
    pictures.save(figure, name)


def main(words: list[str] | None = None) -> None:
    """Print a table per pair; with --picture, also draw the picture for the gallery."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--picture", action="store_true", help="draw docs/gallery/comparison.png")
    options = parser.parse_args(words)
    print(
        "## Comparison (distortion K = σ₁/σ₂, area = log10 spread 5 % to 95 %, pins = rms error; see the module)"
    )
    # for compilation and imports
    iccm.fit(np.exp(2j * np.pi * np.arange(5) / 5), np.array([0, 1, 1 + 1j, 1j]))
    for number, (a, b) in enumerate(CASES):
        source, target = shapes.sample(a), shapes.sample(b)
        pins, strokes = constraints.pair(source, target)
        print(f"\n{a} → {b}")
        mesh, results = compare(source.curve, target.curve, pins, strokes)
        table(results)
        if options.picture and number == 0:
            picture(mesh, results, source.curve, target.curve, "comparison")


if __name__ == "__main__":
    main()
