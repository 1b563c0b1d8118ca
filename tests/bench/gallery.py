"""Repeat the experiments of the paper's figures on the project's own shapes: pictures in docs/gallery, and a table.

python -m tests.bench.gallery [NAME ...], by default all figures. The table is docs/gallery/figures.csv; docs/gallery.md
shows the pictures.
"""

import csv
import json
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

import iccm
from iccm import Curve, Fit, cli
from iccm.curve import interior_grid
from iccm.io.pictures import image_files
from iccm.io.shapes import constraints
from iccm.maps.distortion import area_scale, dilatation

from . import comparison, methods, orders, pictures, shapes
from . import whole_drawings as drawings
from .pictures import (
    BLUE,
    MARK,
    ORANGE,
    SOFT,
    around,
    board,
    dots,
    outline,
    plain,
    sheet,
    textured,
    title,
)

Row = tuple[str, str]  # name and figures


def figures(fit: Fit) -> dict[str, float]:
    """Return gap, rms error of pins, rms error of strokes, K (95 %), spread of log10 area, and depth of the
    certificate.
    """
    f_z, f_zbar = fit.map.derivatives(fit._interior)
    log = np.log10(np.maximum(np.abs(area_scale(f_z, f_zbar)), 1e-300))
    report = fit.report()
    pins = [p["error"] for p in report["pins"]]
    return {
        "gap": fit._boundary["hausdorff"] if fit.target is not None else np.nan,
        "pins": float(np.sqrt(np.mean(np.square(pins)))) if pins else np.nan,
        "strokes": max((s["error"] for s in report["strokes"]), default=np.nan),
        "K": float(np.quantile(dilatation(f_z, f_zbar), 0.95, method="inverted_cdf")),
        "area": float(np.quantile(log, 0.95) - np.quantile(log, 0.05)),
        "depth": report["injective"]["depth"] if report["injective"]["certified"] else np.inf,
    }


def caption(fit: Fit, *names: str) -> str:
    """Return some of the figures as text."""
    values = figures(fit)
    words = {
        "pins": "pin error",
        "strokes": "stroke error",
        "area": "log area spread",
        "depth": "injective from depth",
    }
    return ", ".join(f"{words.get(n, n)} {values[n]:{'.2f' if n in ('K', 'area') else '.2g'}}" for n in names)


def convergence() -> list[Row]:
    """Fig. 2: Algorithm 1 step by step, its energy, and the results of the conformal and the balanced method."""
    source, target = (shapes.sample(f"raster/{name}.svg").curve for name in ("whale", "fish"))
    figure, panels = sheet(5, 2, 2.1, -0.45)
    box, rows = around(target, margin=0.08), []
    first, *other_panels = panels.ravel()
    pictures.original(first, source, board(source), around(source))
    title(first, "source")
    for axes, steps in zip(other_panels, (1, 4, 16, 100, 400)):
        fit = iccm.fit(source, target, method="paper", max_iterations=steps, decrease=0)
        textured(axes, fit, board(source), box)
        outline(axes, target.z)
        title(axes, f"paper, {steps} step{'s' * (steps > 1)}", caption(fit, "gap"))
        rows.append(
            (
                f"paper, {steps} step{'s' * (steps > 1)}",
                f"energy {fit.energies[-1]['total']:.1e}, {caption(fit, 'gap', 'area')}",
            )
        )
    energy(other_panels[5], {"paper": fit}, "energy of the paper's method")
    for axes, name in zip(other_panels[6:], ("conformal", "balanced")):
        fit = iccm.fit(source, target, method=name)
        textured(axes, fit, board(source), box)
        outline(axes, target.z)
        title(axes, name, caption(fit, "gap"))
        rows.append((name, caption(fit, "gap", "area", "K")))
    other_panels[8].set_axis_off()
    pictures.save(figure, "convergence")
    return rows


def energy(axes: Axes, fits: dict[str, Fit], head: str) -> None:
    """Plot the energy against the iteration."""
    for (name, fit), colour in zip(fits.items(), (BLUE, ORANGE, SOFT)):
        values = [step["total"] for step in fit.energies]
        axes.loglog(np.arange(1, len(values)), values[1:], color=colour, lw=2, label=name)
    plain(axes, "iteration", "")
    axes.set_box_aspect(0.75)
    title(axes, head)
    if len(fits) > 1:
        axes.legend(frameon=False, fontsize=8)


def areas(axes: Axes, fit: Fit):
    """Plot the log10 area scale over the source, relative to its median; return the points for a colour bar."""
    points = interior_grid(Curve(fit.map.polygon), 8000)
    log = np.log10(np.maximum(np.abs(area_scale(*fit.map.derivatives(points))), 1e-300))
    return points, pictures.field(axes, fit, log - np.median(log), points, (-0.6, 0.6), "RdBu_r")


def face() -> tuple[Curve, Curve, np.ndarray]:
    """The pins sample: a round face, a cat's, and four pins."""
    source, target = (shapes.sample(f"pins/{name}.svg") for name in ("round", "cat"))
    return source.curve, target.curve, constraints.pair(source, target)[0]


def pins() -> list[Row]:
    """Fig. 3: conformal maps with no, one, two and four pins, and a balanced one with four."""
    source, target, pairs = face()
    figure, panels = sheet(6, 1, 1.9)
    first, *other_panels = panels.ravel()
    pictures.original(first, source, board(source), around(source, margin=0.08))
    outline(first, source.z, SOFT)
    dots(first, pairs[:, 0])
    title(first, "source", "eyes, nose, mouth")
    rows = []
    all_four = [0, 1, 2, 3]
    pin_choices = {
        "no pin": [],
        "nose": [2],
        "eyes": [0, 1],
        "all four": all_four,
        "all four, balanced": all_four,
    }
    for axes, (name, kept) in zip(other_panels, pin_choices.items()):
        method = "balanced" if "balanced" in name else "conformal"
        fit = iccm.fit(source, target, method=method, pins=pairs[kept])
        textured(axes, fit, board(source), around(target, margin=0.08))
        outline(axes, target.z)
        dots(axes, fit.map(pairs[kept, 0]), pairs[kept, 1])
        title(axes, name, caption(fit, "gap", "pins") if kept else caption(fit, "gap"))
        rows.append((name, caption(fit, *(("gap", "pins", "area") if kept else ("gap", "area")))))
    pictures.save(figure, "pins")
    return rows


def quasiconformal() -> list[Row]:
    """Fig. 4: conformal, quasi-conformal and balanced maps with pins, and both kinds of distortion."""
    source, target, pairs = face()
    figure, panels = sheet(3, 4, 2.1)
    rows = []
    fits = {
        "conformal": {"method": "conformal"},
        "quasi-conformal, weight 0.1": {"quasi": 0.1},
        "quasi-conformal, weight 0.01": {"quasi": 0.01},
        "balanced": {"method": "balanced"},
    }
    for line, (name, options) in zip(panels, fits.items()):
        fit = iccm.fit(source, target, pins=pairs, **options)
        textured(line[0], fit, board(source), around(target, margin=0.08))
        outline(line[0], target.z)
        dots(line[0], fit.map(pairs[:, 0]), pairs[:, 1])
        title(line[0], name, caption(fit, "pins", "gap"))
        distortions(figure, line[1:], fit)
        rows.append((name, caption(fit, "gap", "pins", "area", "K")))
    pictures.save(figure, "quasiconformal")
    return rows


def distortions(figure: Figure, panels: np.ndarray, fit: Fit) -> None:
    """Plot log10 area (relative to its median) and K over the source, with the same colours for every fit."""
    values, (points, first) = figures(fit), areas(panels[0], fit)
    spread = np.minimum(dilatation(*fit.map.derivatives(points)), 9)
    drawn = [first, pictures.field(panels[1], fit, spread, points, (1, 2), "YlOrBr")]
    title(panels[0], "log₁₀ area scale", f"spread {values['area']:.2f}")
    title(panels[1], "dilatation K", f"95 %: {values['K']:.2f}")
    for axes, picture in zip(panels, drawn):
        bar = figure.colorbar(picture, ax=axes, shrink=0.75, pad=0.02)
        bar.ax.tick_params(labelsize=7)
        bar.outline.set_visible(False)


def first_order() -> list[Row]:
    """Fig. 6: zeroth and first order distance, with the energy curves (not an option of the balanced method)."""
    source, target = (shapes.sample(f"square-country/{name}.svg").curve for name in ("square", "france"))
    figure, panels = sheet(4, 1, 2.6)
    rows, fits = [], {}
    for axes, order in zip(panels[:2], (0, 1)):
        fit = iccm.fit(source, target, method="paper", order=order, max_iterations=10, decrease=0)
        textured(axes, fit, board(source), around(target))
        outline(axes, target.z)
        title(axes, f"order {order}, 10 steps", caption(fit, "gap"))
        rows.append(
            (
                f"square → France, order {order}, 10 steps",
                f"energy {fit.energies[-1]['total']:.1e}, {caption(fit, 'gap')}",
            )
        )
    pairs = [
        ("square-country/square.svg", "square-country/france.svg"),
        ("rose-leaf/rose.svg", "rose-leaf/leaf.svg"),
    ]
    for axes, (a, b) in zip(panels[2:], pairs):
        by_order = {f"order {k}": run(a, b, k) for k in (0, 1)}
        energy(axes, by_order, f"energy, {orders.stem(a)} → {orders.stem(b)}")
        rows += [
            (
                f"{orders.stem(a)} → {orders.stem(b)}, {name}",
                f"energy after 10 and 100 steps: "
                f"{fit.energies[min(10, len(fit.energies) - 1)]['total']:.1e}, {fit.energies[-1]['total']:.1e}",
            )
            for name, fit in by_order.items()
        ]
        fits |= by_order
    fit = iccm.fit(source, target, method="balanced")
    rows.append(("square → France, balanced", caption(fit, "gap", "area", "K")))
    pictures.save(figure, "orders")
    return rows


def run(a: str, b: str, order: int) -> Fit:
    """Run 100 steps of the paper's method on a pair of samples."""
    source, target = shapes.sample(a).curve, shapes.sample(b).curve
    return iccm.fit(source, target, method="paper", order=order, max_iterations=orders.STEPS, decrease=0)


def compared() -> list[Row]:
    """Fig. 7: comparison with other methods (tests/bench/comparison.py). Only our maps use the cat's pins."""
    rows = []
    for a, b in comparison.CASES[:2]:
        source, target = shapes.sample(a), shapes.sample(b)
        mesh, results = comparison.compare(source.curve, target.curve, *constraints.pair(source, target))
        name = f"comparison-{orders.stem(b)}"
        comparison.picture(mesh, results, source.curve, target.curve, name)
        rows += [
            (
                f"{orders.stem(a)} → {orders.stem(b)}: {r.name}",
                f"gap {r.gap:.1e}, K {r.conformal[0]:.2f} (95 %: {r.conformal[1]:.2f}), log area spread {r.area:.2f}, "
                f"folds {r.folds:.1%}",
            )
            for r in results
        ]
    return rows


ARMS = (  # source and target strokes of the gingerbread man, in the file's units
    ([(256, 95), (256, 190), (256, 330)], [(276, 95), (262, 190), (250, 330)]),
    ([(170, 205), (120, 200), (85, 195)], [(170, 195), (135, 150), (125, 100)]),
    ([(342, 205), (392, 200), (427, 195)], [(345, 205), (395, 225), (425, 260)]),
    ([(225, 350), (205, 410), (190, 440)], [(225, 350), (205, 410), (190, 440)]),
    ([(287, 350), (307, 410), (322, 440)], [(290, 345), (340, 395), (385, 400)]),
)


FREE = {
    "conformal": {"method": "paper"},
    "quasi-conformal, 0.02": {"quasi": 0.02},
    "balanced": {"method": "balanced"},
}


def strokes() -> list[Row]:
    """Fig. 5: a shape deformed without a target, by strokes and by the same points pinned, with log₁₀ area scale."""
    man = shapes.sample("limbs/gingerbread.svg")
    sketch = [(man.to_core(np.array(a)), man.to_core(np.array(b))) for a, b in ARMS]
    even = [
        [Curve(z, False).at(np.linspace(0, 1, 8) * Curve(z, False).length) for z in pair] for pair in sketch
    ]
    points = np.concatenate([np.column_stack(pair) for pair in even])
    figure, panels = sheet(2 * len(FREE) + 1, 2, 1.6)
    rows, constraint_kinds = [], {"strokes": {"strokes": sketch}, "pins": {"pins": points}}
    for line, (kind, settings) in zip(panels, constraint_kinds.items()):
        pictures.original(line[0], man.curve, board(man.curve), man.box)
        outline(line[0], man.curve.z)
        _marked(line[0], [a for a, _ in sketch], points[:, 0], kind)
        title(line[0], kind)
        for k, (name, options) in enumerate(FREE.items()):
            fit = iccm.deform(man.curve, **settings, **options)
            textured(line[2 * k + 1], fit, board(man.curve), man.box)
            outline(line[2 * k + 1], fit.image)
            _marked(line[2 * k + 1], [b for _, b in sketch], points[:, 1], kind)
            title(line[2 * k + 1], name, caption(fit, kind))
            _, picture = areas(line[2 * k + 2], fit)
            title(line[2 * k + 2], "area", caption(fit, "area"))
            rows.append((f"{kind}, {name}", caption(fit, kind, "area", "K", "depth")))
    bar = figure.colorbar(picture, ax=panels, shrink=0.5, pad=0.01)
    bar.ax.tick_params(labelsize=7)
    pictures.save(figure, "strokes")
    return rows


def _marked(axes: Axes, lines: list[np.ndarray], points: np.ndarray, kind: str) -> None:
    """Draw strokes, or pins."""
    if kind == "pins":
        axes.plot(points.real, points.imag, "o", ms=3, color=MARK, mec="white", mew=0.5)
        return
    for z in lines:
        outline(axes, z, "white", 3, closed=False)
        outline(axes, z, MARK, 1.5, closed=False)


TWO = np.array([(0.25, 0.3), (0.75, 0.7)])  # positions along the quills that must meet
KINDS = {
    "conformal": {"method": "conformal"},
    "quasi-conformal, 0.01": {"quasi": 0.01},
    "balanced": {"method": "balanced"},
}


def sketches() -> list[Row]:
    """Fig. 8: sketch to sketch with two pins: conformal, quasi-conformal and balanced."""
    source, target = (shapes.sample(f"strokes/{name}.svg") for name in ("straight", "bent"))
    quills = constraints.pair(source, target)[1][0]
    pairs = np.column_stack([quill.at(share * quill.length) for quill, share in zip(quills, TWO.T)])
    figure, panels = sheet(4, 1, 2.4)
    first, *other_panels = panels.ravel()
    pictures.original(first, source.curve, board(source.curve), around(source.curve))
    outline(first, source.curve.z, SOFT)
    dots(first, pairs[:, 0])
    title(first, "source", "two points of the quill")
    rows = []
    for axes, (name, options) in zip(other_panels, KINDS.items()):
        fit = iccm.fit(source.curve, target.curve, pins=pairs, **options)
        textured(axes, fit, board(source.curve), around(target.curve, margin=0.06))
        outline(axes, target.curve.z)
        dots(axes, fit.map(pairs[:, 0]), pairs[:, 1])
        title(axes, name, caption(fit, "gap", "pins"))
        rows.append((name, caption(fit, "gap", "pins", "area", "K", "depth")))
    pictures.save(figure, "sketches")
    return rows


def rose() -> list[Row]:
    """Fig. 1: the texture of a rose on the sketch of a leaf."""
    source, target = (shapes.sample(f"rose-leaf/{name}.svg") for name in ("rose", "leaf"))
    petals = image_files.read(str(shapes.ROOT / "samples" / "rose-leaf" / "petals.jpg"))
    texture, box, rows = petals.texture(source.box), around(target.curve), []
    figure, panels = sheet(4, 1, 2.4)
    first, *other_panels = panels.ravel()
    pictures.original(first, source.curve, texture, around(source.curve))
    title(first, "source")
    for axes, name in zip(other_panels, methods.METHODS):
        fit = iccm.fit(source.curve, target.curve, method=name)
        textured(axes, fit, texture, box)
        outline(axes, target.curve.z)
        title(axes, name, caption(fit, "gap"))
        rows.append((name, caption(fit, "gap", "area", "K", "depth")))
    pictures.save(figure, "rose")
    return rows


def constrained() -> list[Row]:
    """Fig. 9: constrained texture mapping: a drawing on a face, by four pins."""
    return surfaces(
        "constrained", "face-pins", {"quasi-conformal, 0.01": ["--quasi", "0.01"], "balanced": []}
    )


def transfer() -> list[Row]:
    """Fig. 10: from a hexagon to a surface."""
    return surfaces("surface", "hexagon-surface", {"conformal": ["--method", "conformal"], "balanced": []})


def surfaces(name: str, sample: str, kinds: dict[str, list[str]]) -> list[Row]:
    """Run the command of a sample with several sets of options, with the plots below each other."""
    folder = shapes.ROOT / "samples" / sample
    words = shlex.split((folder / "command.txt").read_text(encoding="utf-8"))[1:]
    words = (
        words[: words.index("--quasi")] + words[words.index("--quasi") + 2 :] if "--quasi" in words else words
    )
    plots, rows = [], []
    for kind, options in kinds.items():
        with TemporaryDirectory() as scratch:
            arguments = [str(folder / word) if (folder / word).is_file() else word for word in words]
            arguments = [word.replace("out/", f"{scratch}/") for word in arguments]
            assert cli.run([*arguments, *options, "-q"]) in (0, 1)
            plots.append(np.asarray(Image.open(f"{scratch}/picture.png").convert("RGB")))
            report = json.loads(Path(scratch, "report.json").read_text(encoding="utf-8"))
        spread = report["log10_area"]["p95"] - report["log10_area"]["p05"]
        pins = [pin["error"] for pin in report["pins"]]
        error_text = f"pin error {np.sqrt(np.mean(np.square(pins))):.2g}, " if pins else ""
        distortion_text = f"K {report['dilatation']['p95']:.2f}, log area spread {spread:.2f}"
        rows.append((kind, f"gap {report['boundary']['hausdorff']:.2g}, {error_text}{distortion_text}"))
    figure, panels = sheet(1, len(plots), 5.0, -2.4)
    for axes, (kind, _), plot in zip(panels.ravel(), rows, plots):
        axes.imshow(plot, interpolation="antialiased")
        axes.set_axis_off()
        title(axes, kind)
    pictures.save(figure, name)
    return rows


FIGURES: dict[str, Callable[[], list[Row]]] = {
    "teaser": drawings.teaser,
    "methods": methods.methods,
    "fits": drawings.fits,
    "sheet": methods.contact_sheet,
    "rose": rose,
    "convergence": convergence,
    "pins": pins,
    "quasiconformal": quasiconformal,
    "strokes": strokes,
    "orders": first_order,
    "comparison": compared,
    "sketches": sketches,
    "constrained": constrained,
    "surface": transfer,
}


FIELDS = ("figure", "map", "values")
"""Columns of the table of all figures."""


def main(names: list[str]) -> int:
    """Draw figures; return 0 if all were drawn, 2 if one is unknown."""
    unknown = sorted(set(names) - set(FIGURES))
    if unknown:
        print(f"no figure {unknown[0]!r}; there is {', '.join(FIGURES)}", file=sys.stderr)
        return 2
    table = pictures.FOLDER / "figures.csv"
    rows_by_name: dict[str, list[Row]] = {name: [] for name in FIGURES}
    with table.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            rows_by_name[row["figure"]].append((row["map"], row["values"]))
    for name in names or FIGURES:
        rows_by_name[name] = FIGURES[name]()
        for label, values in rows_by_name[name]:
            print(f"{name}: {label}: {values}", flush=True)
        lines = [(name, *row) for name, rows in rows_by_name.items() for row in rows]
        with table.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([FIELDS, *lines])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
