"""Redoes the experiments of the paper's figures on the project's own shapes: pictures and a table in docs/gallery.

python -m tests.bench.gallery [NAME ...], all figures by default; the table is written when all are made.
"""

import sys
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import iccm
from iccm import Curve, Fit
from iccm.io.shapes import constraints
from iccm.maps.harmonic import area_scale, dilatation
from iccm.result import interior_grid

from . import comparison, methods, orders, pictures, shapes
from .pictures import (
    BLUE,
    INK,
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

Row = tuple[str, str]  # what, and its figures


def figures(fit: Fit) -> dict[str, float]:
    """Gap, rms error of pins, rms error of strokes, K (95 %), spread of log10 area, depth of the certificate."""
    f_z, f_zbar = fit.map.derivatives(fit.interior)
    log = np.log10(np.maximum(np.abs(area_scale(f_z, f_zbar)), 1e-300))
    report = fit.report()
    pins = [p["error"] for p in report["pins"]]
    return {
        "gap": fit.boundary["hausdorff"] if fit.target is not None else np.nan,
        "pins": float(np.sqrt(np.mean(np.square(pins)))) if pins else np.nan,
        "strokes": max((s["error"] for s in report["strokes"]), default=np.nan),
        "K": float(np.quantile(dilatation(f_z, f_zbar), 0.95, method="inverted_cdf")),
        "area": float(np.quantile(log, 0.95) - np.quantile(log, 0.05)),
        "depth": report["injective"]["depth"] if report["injective"]["certified"] else np.inf,
    }


def said(fit: Fit, *names: str) -> str:
    """Some of the figures in words."""
    values = figures(fit)
    words = {
        "pins": "pin error",
        "strokes": "stroke error",
        "area": "log area spread",
        "depth": "injective from depth",
    }
    return ", ".join(f"{words.get(n, n)} {values[n]:{'.2f' if n in ('K', 'area') else '.2g'}}" for n in names)


def convergence() -> list[Row]:
    """Fig. 2: Algorithm 1 step by step, its energy, and where the conformal method ends."""
    source, target = (shapes.sample(f"raster/{name}.svg").curve for name in ("whale", "fish"))
    figure, panels = sheet(4, 2, 2.4, -0.55)
    box, rows = around(target, margin=0.08), []
    first, *rest = panels.ravel()
    pictures.original(first, source, board(source), around(source))
    title(first, "source")
    for axes, steps in zip(rest, (1, 4, 16, 100, 400)):
        fit = iccm.fit(source, target, method="paper", max_iterations=steps, decrease=0)
        textured(axes, fit, board(source), box)
        outline(axes, target.z)
        title(axes, f"paper, {steps} step{'s' * (steps > 1)}", said(fit, "gap"))
        rows.append(
            (
                f"paper, {steps} step{'s' * (steps > 1)}",
                f"energy {fit.energies[-1]['total']:.1e}, {said(fit, 'gap', 'area')}",
            )
        )
    energy(rest[5], {"paper": fit}, "energy of the paper's method")
    fit = iccm.fit(source, target)
    textured(rest[6], fit, board(source), box)
    outline(rest[6], target.z)
    title(rest[6], "conformal", said(fit, "gap"))
    rows.append(("conformal", said(fit, "gap", "area")))
    pictures.save(figure, "convergence")
    return rows


def energy(axes: Axes, fits: dict[str, Fit], head: str) -> None:
    """Energy against the iteration."""
    for (name, fit), colour in zip(fits.items(), (BLUE, ORANGE, SOFT)):
        values = [step["total"] for step in fit.energies]
        axes.loglog(np.arange(1, len(values)), values[1:], color=colour, lw=2, label=name)
    plain(axes, "iteration", "")
    axes.set_box_aspect(0.75)
    title(axes, head)
    if len(fits) > 1:
        axes.legend(frameon=False, fontsize=8)


def face() -> tuple[Curve, Curve, np.ndarray]:
    """The pins sample: a round face, a cat's, and four pins."""
    source, target = (shapes.sample(f"pins/{name}.svg") for name in ("round", "cat"))
    return source.curve, target.curve, constraints.pair(source, target)[0]


def pins() -> list[Row]:
    """Fig. 3: conformal maps with no, one, two and four pins."""
    source, target, pairs = face()
    figure, panels = sheet(5, 1, 2.1)
    first, *rest = panels.ravel()
    pictures.original(first, source, board(source), around(source, margin=0.08))
    outline(first, source.z, SOFT)
    dots(first, pairs[:, 0])
    title(first, "source", "eyes, nose, mouth")
    rows = []
    for axes, (name, kept) in zip(
        rest, {"no pin": [], "nose": [2], "eyes": [0, 1], "all four": [0, 1, 2, 3]}.items()
    ):
        fit = iccm.fit(source, target, pins=pairs[kept])
        textured(axes, fit, board(source), around(target, margin=0.08))
        outline(axes, target.z)
        dots(axes, fit.map(pairs[kept, 0]), pairs[kept, 1])
        title(axes, name, said(fit, "gap", "pins") if kept else said(fit, "gap"))
        rows.append((name, said(fit, *(("gap", "pins", "area") if kept else ("gap", "area")))))
    pictures.save(figure, "pins")
    return rows


def quasiconformal() -> list[Row]:
    """Fig. 4: conformal against quasi-conformal maps with pins, both distortions."""
    source, target, pairs = face()
    figure, panels = sheet(3, 3, 2.35)
    rows = []
    fits = {
        "conformal": {},
        "quasi-conformal, weight 0.1": {"quasi": 0.1},
        "quasi-conformal, weight 0.01": {"quasi": 0.01},
    }
    for line, (name, options) in zip(panels, fits.items()):
        fit = iccm.fit(source, target, pins=pairs, **options)
        textured(line[0], fit, board(source), around(target, margin=0.08))
        outline(line[0], target.z)
        dots(line[0], fit.map(pairs[:, 0]), pairs[:, 1])
        title(line[0], name, said(fit, "pins", "gap"))
        distortions(figure, line[1:], fit)
        rows.append((name, said(fit, "gap", "pins", "area", "K")))
    pictures.save(figure, "quasiconformal")
    return rows


def distortions(figure: Figure, panels: np.ndarray, fit: Fit) -> None:
    """log10 area (relative to its median) and K over the source; the same colours for every fit."""
    points = interior_grid(Curve(fit.map.polygon), 8000)
    f_z, f_zbar = fit.map.derivatives(points)
    log = np.log10(np.maximum(np.abs(area_scale(f_z, f_zbar)), 1e-300))
    values = figures(fit)
    drawn = [
        pictures.field(panels[0], fit, log - np.median(log), points, (-0.6, 0.6), "RdBu_r"),
        pictures.field(panels[1], fit, np.minimum(dilatation(f_z, f_zbar), 9), points, (1, 2), "YlOrBr"),
    ]
    title(panels[0], "log₁₀ area scale", f"spread {values['area']:.2f}")
    title(panels[1], "dilatation K", f"95 %: {values['K']:.2f}")
    for axes, picture in zip(panels, drawn):
        bar = figure.colorbar(picture, ax=axes, shrink=0.75, pad=0.02)
        bar.ax.tick_params(labelsize=7)
        bar.outline.set_visible(False)


def strokes() -> list[Row]:
    """Fig. 5: a stroke against the same points pinned, with area distortion."""
    source, target = (shapes.sample(f"strokes/{name}.svg") for name in ("straight", "bent"))
    quill = constraints.pair(source, target)[1][0]
    rows = []
    figure, panels = sheet(4, 2, 2.35)
    for share, line in ((1.0, None), (0.8, panels)):
        a, b = quill[0].at(np.linspace(0, share, 40) * quill[0].length), quill[1].z
        even = np.linspace(0, 1, 12)
        start, goal = Curve(a, False), Curve(b, False)
        points = np.column_stack([start.at(even * start.length), goal.at(even * goal.length)])
        for k, (name, held) in enumerate({"stroke": {"strokes": [(a, b)]}, "pins": {"pins": points}}.items()):
            fit = iccm.fit(source.curve, target.curve, quasi=0.1, **held)
            rows.append((f"{name}, {share:.0%} of the quill", said(fit, "gap", "area", "K")))
            if line is not None:
                stroke_panels(figure, line[k], fit, name, source.curve, target.curve, points, b)
    pictures.save(figure, "strokes")
    return rows


def stroke_panels(
    figure: Figure, line: np.ndarray, fit: Fit, name: str, source: Curve, target: Curve, points, goal
) -> None:
    """The source, its image and the distortions of one row of Fig. 5."""
    held = points[:, 0]
    pictures.original(line[0], source, board(source), around(source))
    outline(line[0], source.z, SOFT)
    if name == "stroke":
        outline(line[0], held, MARK, 2.2, closed=False)
    else:
        dots(line[0], held)
    title(line[0], name, "on 80 % of the quill")
    textured(line[1], fit, board(source), around(target))
    outline(line[1], target.z)
    outline(line[1], goal, INK, 1.2, closed=False, ls=":")
    if name == "stroke":
        outline(line[1], fit.map(held), MARK, 2.2, closed=False)
    else:
        dots(line[1], fit.map(held), points[:, 1])
    title(line[1], "image", said(fit, "gap"))
    distortions(figure, line[2:], fit)


def first_order() -> list[Row]:
    """Fig. 6: zeroth against first order, with the energy curves."""
    source, target = (shapes.sample(f"square-country/{name}.svg").curve for name in ("square", "france"))
    figure, panels = sheet(4, 1, 2.6)
    rows, fits = [], {}
    for axes, order in zip(panels[:2], (0, 1)):
        fit = iccm.fit(source, target, method="paper", order=order, max_iterations=10, decrease=0)
        textured(axes, fit, board(source), around(target))
        outline(axes, target.z)
        title(axes, f"order {order}, 10 steps", said(fit, "gap"))
        rows.append(
            (
                f"square → France, order {order}, 10 steps",
                f"energy {fit.energies[-1]['total']:.1e}, {said(fit, 'gap')}",
            )
        )
    pairs = [
        ("square-country/square.svg", "square-country/france.svg"),
        ("rose-leaf/rose.svg", "rose-leaf/leaf.svg"),
    ]
    for axes, (a, b) in zip(panels[2:], pairs):
        both = {f"order {k}": run(a, b, k) for k in (0, 1)}
        energy(axes, both, f"energy, {orders.stem(a)} → {orders.stem(b)}")
        rows += [
            (
                f"{orders.stem(a)} → {orders.stem(b)}, {name}",
                f"energy after 10 and 100 steps: "
                f"{fit.energies[min(10, fit.iterations)]['total']:.1e}, {fit.energies[-1]['total']:.1e}",
            )
            for name, fit in both.items()
        ]
        fits |= both
    pictures.save(figure, "orders")
    return rows


def run(a: str, b: str, order: int) -> Fit:
    """100 steps of the paper's method on a pair of samples."""
    source, target = shapes.sample(a).curve, shapes.sample(b).curve
    return iccm.fit(source, target, method="paper", order=order, max_iterations=orders.STEPS, decrease=0)


def compared() -> list[Row]:
    """Fig. 7: beside other people's maps; see tests/bench/comparison.py."""
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


def deformation() -> list[Row]:
    """Fig. 8: a shape and its texture moved by strokes alone."""
    man = shapes.sample("limbs/gingerbread.svg")
    sketch = [(man.to_core(np.array(a)), man.to_core(np.array(b))) for a, b in ARMS]
    figure, panels = sheet(3, 1, 2.9)
    first, *rest = panels.ravel()
    box = (man.box[0], man.box[1])
    pictures.original(first, man.curve, board(man.curve), box)
    outline(first, man.curve.z)
    for a, _ in sketch:
        outline(first, a, "white", 4, closed=False)
        outline(first, a, MARK, 2, closed=False)
    title(first, "source and strokes")
    held = {
        "strokes": {"strokes": sketch},
        "pins": {"pins": np.concatenate([np.column_stack(p) for p in sketch])},
    }
    rows = []
    for axes, (name, options) in zip(
        rest, {"conformal": {"method": "paper"}, "quasi-conformal, 0.02": {"quasi": 0.02}}.items()
    ):
        fits = {kind: iccm.deform(man.curve, **given, **options) for kind, given in held.items()}
        fit = fits["strokes"]
        textured(axes, fit, board(man.curve), box)
        outline(axes, fit.image)
        for _, b in sketch:
            outline(axes, b, "white", 4, closed=False)
            outline(axes, b, MARK, 2, closed=False)
        title(axes, name, said(fit, "strokes", "area"))
        rows += [(f"{name}, {kind}", said(fit, kind, "area", "K", "depth")) for kind, fit in fits.items()]
    pictures.save(figure, "deformation")
    return rows


FIGURES: dict[str, Callable[[], list[Row]]] = {
    "methods": methods.methods,
    "sheet": methods.contact_sheet,
    "convergence": convergence,
    "pins": pins,
    "quasiconformal": quasiconformal,
    "strokes": strokes,
    "orders": first_order,
    "comparison": compared,
    "deformation": deformation,
}


HEAD = """# Gallery

The experiments of the paper's figures on this project's own shapes, made by `make gallery`. Lengths are relative to
the diagonal of the target's bounding box. *gap* is the two-sided Hausdorff distance of the boundary's image to the
target, *pin error* and *stroke error* are root mean squares, *K* is the dilatation that 95 % of the inside stay below
(for the comparison: the median, then this), *log area spread* the range of log10 of the area scale from 5 % to 95 % of
the inside. Red rings are where pins should be, dots where they are.

What the figures do not show as a rule: a stroke distorts areas less than its points pinned only where those points are
not where the map would take them anyway (over the whole quill of the feather pins do better); and a quasi-conformal map
brings pins and areas closer, not the gap, and may fold next to the outline (*injective from depth*: relative to the
source's diagonal, what the certificate says). Angle-based and Szegő maps follow the outline only roughly because their
boundary correspondence is given and not, as in the paper, iterated."""


def table(name: str, rows: list[Row]) -> list[str]:
    """The section of a figure in Markdown."""
    pictures_of = {"comparison": ("comparison-cat", "comparison-fish")}.get(name, (name,))
    lines = [f"## {(FIGURES[name].__doc__ or '').strip()}", ""]
    for stem in pictures_of:
        lines += [f"![{stem}]({stem}.png)", ""]
    return [*lines, "| map | figures |", "|---|---|", *(f"| {what} | {found} |" for what, found in rows)]


def main(names: list[str]) -> int:
    """0 when all the figures that were asked for are drawn, 2 when one is unknown."""
    unknown = sorted(set(names) - set(FIGURES))
    if unknown:
        print(f"no figure {unknown[0]!r}; there is {', '.join(FIGURES)}", file=sys.stderr)
        return 2
    parts = []
    for name in names or FIGURES:
        lines = table(name, FIGURES[name]())
        print("\n".join(lines), flush=True)
        parts.append("\n".join(lines))
    if not names:
        (pictures.FOLDER / "README.md").write_text("\n\n".join([HEAD, *parts]) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
