"""The methods side by side for the gallery: four pairs of the samples, and a contact sheet of random drawings."""

import iccm
from iccm import Fit, InputError
from iccm.io.shapes.shape import Shape

from . import pictures, shapes

PAIRS = (
    ("rose-leaf/rose.svg", "rose-leaf/leaf.svg"),
    ("limbs/gingerbread.svg", "limbs/starfish.svg"),
    ("square-country/square.svg", "square-country/france.svg"),
    ("raster/whale.svg", "raster/fish.svg"),
)
METHODS = ("paper", "conformal", "balanced")
SEED, SHOWN, ROWS = 5, 30, 6
FREE = ("icons", "mdi", "bootstrap", "simple", "twemoji")
WILD_FREE = ("phosphor", "ionicons", "carbon", "lucide", "iconoir", "fluent")
"""Packages whose licences let pictures of their shapes be shown here, with the attribution in the gallery."""


def methods() -> list[tuple[str, str]]:
    """Methods: the same pairs with Algorithm 1 of the paper, the conformal and the balanced method."""
    figure, panels = pictures.sheet(1 + len(METHODS), len(PAIRS), 2.2)
    rows = []
    for line, names in zip(panels.reshape(len(PAIRS), -1), PAIRS):
        source, target = (shapes.sample(name) for name in names)
        texture, box = pictures.board(source.curve), pictures.around(target.curve, margin=0.06)
        pictures.original(line[0], source.curve, texture, pictures.around(source.curve))
        pictures.title(line[0], source.path.stem)
        for axes, method in zip(line[1:], METHODS):
            fit = iccm.fit(source.curve, target.curve, method=method)
            pictures.textured(axes, fit, texture, box, 260)
            pictures.outline(axes, target.curve.z)
            pictures.title(axes, method)
            rows.append((f"{source.path.stem} → {target.path.stem}, {method}", caption(fit)))
    pictures.save(figure, "methods", dpi=70)
    return rows


def caption(fit: Fit) -> str:
    """Return a fit's figures as text."""
    r = fit.report()
    proof = "certified" if r["injective"]["certified"] else "not certified"
    return (
        f"gap {r['boundary']['hausdorff']:.1e}, area within 2 x {r['scale']['within2']:.0%}, p95 stretch "
        f"{r['stretch']['p95']:.1f}, K95 {r['dilatation']['p95']:.1f}, rotation {r['turn']:.0f}°, {proof}"
    )


def contact_sheet() -> list[tuple[str, str]]:
    """Thirty random pairs with the balanced method, each source next to its image; none was selected."""
    pairs = shapes.drawn_pairs(SHOWN, SEED, [], FREE)
    columns = 2 * SHOWN // ROWS
    figure, panels = pictures.sheet(columns, ROWS, 1.25, 0.12)
    cells = panels.reshape(-1)
    rows = []
    for k, (source, target) in enumerate(pairs):
        left, right = cells[2 * k : 2 * k + 2]
        rows.append(
            (f"{k + 1}. {shapes.label(source)} → {shapes.label(target)}", _pair(left, right, source, target))
        )
        left.set_title(f"{k + 1}", fontsize=6, pad=1)
    pictures.save(figure, "sheet", dpi=80)
    return rows


def _pair(left, right, source: Shape, target: Shape) -> str:
    texture = pictures.board(source.curve)
    pictures.original(left, source.curve, texture, pictures.around(source.curve))
    right.set_axis_off()
    try:
        fit = iccm.fit(source.curve, target.curve, method="balanced")
    except InputError as error:
        return str(error)
    pictures.textured(right, fit, texture, pictures.around(target.curve), 130)
    return caption(fit)
