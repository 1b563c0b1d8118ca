"""Draw the figures that explain concepts: python docs/figures.py FOLDER NAME ...

A page asks for figures with a comment, `<!-- figures: distortion frames -->`; docs/recipes.py then runs this script.
Figures have a transparent background and grey text, so that they can be read on light and on dark pages.
"""

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path as Outline

import iccm

FILES = Path(__file__).resolve().parent / "files"
SAMPLES = FILES.parents[1] / "samples"
GREY = "#7f8a92"
"""Text and outlines: a contrast of about 3.5 with white and 4 with the site's dark background."""
PAINT = "#b9c4c9"
"""Fill of shapes."""
MARK = "#d1495b"
LINE = "#00798c"
PER_PANEL = 2.3
"""Width of a panel in inches."""
PIXELS_PER_INCH = 100


def board(cells: int = 8) -> np.ndarray:
    """Draw the numbered checkerboard of the command line."""
    return iccm.checkerboard(512, cells=cells)


def panels(count: int, width: float = PER_PANEL) -> tuple[Figure, list[Axes]]:
    """Draw a figure with panels side by side."""
    figure = Figure(figsize=(width * count, width + 0.3))
    axes = figure.subplots(1, count, squeeze=False)[0]
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.9, wspace=0.06)
    for panel in axes:
        panel.set_axis_off()
        panel.set_aspect("equal")
    return figure, list(axes)


def caption(axes: Axes, text: str) -> None:
    """Write a title above a panel."""
    axes.set_title(text, fontsize=9, color=GREY)


def outline(axes: Axes, z: np.ndarray, colour: str = GREY, width: float = 1.2) -> None:
    """Draw a closed polygon."""
    axes.add_patch(Polygon(np.c_[z.real, z.imag], closed=True, fill=False, edgecolor=colour, lw=width))


def fill(axes: Axes, rings: list[np.ndarray], colour: str = PAINT) -> None:
    """Fill polygons by the even-odd rule."""
    points = [_closed(ring) for ring in rings]
    codes = [[Outline.MOVETO, *[Outline.LINETO] * (len(p) - 2), Outline.CLOSEPOLY] for p in points]
    axes.add_patch(PathPatch(Outline(np.concatenate(points), np.concatenate(codes)), facecolor=colour, lw=0))


def picture(axes: Axes, carried: iccm.Transfer) -> None:
    """Show a transferred picture in the plane of the target."""
    low, high = carried.box
    axes.imshow(carried.pixels, extent=(low.real, high.real, low.imag, high.imag), zorder=0.5)


def view(axes: Axes, *shapes: np.ndarray, margin: float = 0.06) -> None:
    """Fit the limits of a panel to shapes."""
    z = np.concatenate(shapes)
    size = max(np.ptp(z.real), np.ptp(z.imag)) * (0.5 + margin)
    middle = complex(z.real.min() + z.real.max(), z.imag.min() + z.imag.max()) / 2
    axes.set_xlim(middle.real - size, middle.real + size)
    axes.set_ylim(middle.imag - size, middle.imag + size)


def curve(name: str) -> np.ndarray:
    """Return the outline of one of the files, as complex vertices."""
    return iccm.read_shape(FILES / name).curve.z


def distortion() -> Figure:
    """Draw circles and their images: ratio of axes, and size."""
    source, target = curve("block.svg"), curve("heart.svg")
    fit = iccm.fit(source, target)
    figure, (left, right, numbers) = panels(3, 2.6)
    x = np.linspace(source.real.min(), source.real.max(), 9)
    y = np.linspace(source.imag.min(), source.imag.max(), 9)
    centres = np.add.outer(1j * (y[1:] + y[:-1]) / 2, (x[1:] + x[:-1]) / 2).ravel()
    radius = 0.36 * (x[1] - x[0])
    round_ = radius * np.exp(2j * np.pi * np.arange(60) / 60)
    f_z, f_zbar = fit.map.derivatives(centres)
    ratio = (np.abs(f_z) + np.abs(f_zbar)) / (np.abs(f_z) - np.abs(f_zbar))
    scale = np.sqrt(np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2)
    colours = matplotlib.colormaps["viridis"](np.clip((ratio - 1) / 1.5, 0, 1))
    for centre, a, b, colour in zip(centres, f_z, f_zbar, colours):
        outline(left, centre + round_, LINE, 1)
        image = fit.map(np.array([centre]))[0] + a * round_ + b * round_.conj()
        right.add_patch(Polygon(np.c_[image.real, image.imag], facecolor=colour, lw=0))
    outline(left, source)
    outline(right, target)
    view(left, source)
    view(right, target)
    caption(left, "circles on the source")
    caption(right, "their images: ellipses")
    numbers.set_aspect("auto")
    numbers.set_axis_on()
    numbers.scatter(ratio, scale / scale.mean(), c=colours, s=18)
    numbers.axhline(1, color=GREY, lw=0.8)
    numbers.set_xlabel("dilatation K", fontsize=8, color=GREY)
    numbers.set_ylabel("scale relative to its mean", fontsize=8, color=GREY)
    numbers.tick_params(labelsize=7, colors=GREY)
    numbers.patch.set_alpha(0)
    for spine in numbers.spines.values():
        spine.set_color(GREY)
    numbers.set_position([0.76, 0.18, 0.22, 0.66])
    caption(numbers, "a dot for each circle")
    return figure


def balances() -> Figure:
    """Draw the same pair with three balances."""
    source, target = curve("block.svg"), curve("heart.svg")
    figure, axes = panels(3)
    for panel, balance in zip(axes, (0.0, 1.0, 4.0)):
        fit = iccm.fit(source, target, balance=balance)
        picture(panel, iccm.warp(fit, board(), size=420))
        view(panel, target)
        report = fit.report()
        spread = report["log10_area"]["p95"] - report["log10_area"]["p05"]
        caption(
            panel, f"--balance {balance:.0f}\nK {report['dilatation']['p95']:.1f}, area × {10**spread:.1f}"
        )
    figure.subplots_adjust(top=0.84)
    return figure


def edges() -> Figure:
    """Draw what is shown beyond the texture, with each value of --edge."""
    from iccm.io.run import Job, run

    figure, axes = panels(4, 1.9)
    for panel, edge in zip(axes, ("clamp", "transparent", "repeat", "mirror")):
        with tempfile.TemporaryDirectory() as folder:
            output = f"{folder}/edge.png"
            job = Job(
                source=str(FILES / "block.svg"),
                target=str(FILES / "block.svg"),
                texture=str(FILES / "cat.jpg"),
                texture_scale=(0.5, 0.5),
                edge=edge,
                size=300,
                output=(output,),
            )
            run(job)
            panel.imshow(iccm.read_image(output))
        caption(panel, f"--edge {edge}")
    return figure


def frames() -> Figure:
    """Draw a word as target: its frame, the map of the frame, and the result."""
    from iccm.io.run import Job, run

    letters = [iccm.read_shape(f"{FILES / 'tea.svg'}#{name}").curve.z for name in "TEA"]
    fit = iccm.fit(curve("block.svg"), letters)
    frame = fit.target.z
    figure, axes = panels(3, 3.0)
    figure.set_figheight(1.6)
    figure.subplots_adjust(top=0.82)
    fill(axes[0], letters)
    outline(axes[0], frame, MARK)
    caption(axes[0], "1. a frame around the letters")
    picture(axes[1], iccm.warp(fit, board(), size=420))
    outline(axes[1], frame, MARK)
    caption(axes[1], "2. the texture on the frame")
    with tempfile.TemporaryDirectory() as folder:
        output = f"{folder}/word.png"
        run(Job(source=str(FILES / "block.svg"), target=str(FILES / "tea.svg"), size=420, output=(output,)))
        axes[2].imshow(iccm.read_image(output), extent=(0, 320, 0, 120))
    caption(axes[2], "3. cut to the letters")
    for panel in axes:
        panel.set_xlim(0, 320)
        panel.set_ylim(-2, 122)
    low = complex(frame.real.min(), frame.imag.min())
    for panel in axes[:2]:
        panel.set_xlim(low.real - 10, low.real + 312)
        panel.set_ylim(low.imag - 12, low.imag + 112)
    return figure


def constraints() -> Figure:
    """Draw the same pair without constraints, with a pin, a stroke and a rigid region."""
    disc = 60 * np.exp(2j * np.pi * np.arange(120) / 120)
    target = curve("shield.svg")
    target = (
        target - complex(target.real.min() + target.real.max(), target.imag.min() + target.imag.max()) / 2
    )
    line = np.linspace(-30, 30, 15) - 8j
    wave = np.linspace(-30, 30, 40)
    bent = wave + 1j * (12 * np.cos(np.pi * wave / 30) - 8)
    square = 24 * np.exp(1j * np.pi * (np.arange(4) / 2 + 0.25)) + 14j
    cases = {
        "no constraint": {},
        "a pin": {"pins": [(0j, 22 + 24j)]},
        "a stroke": {"strokes": [(line, bent)]},
        "a rigid region": {"rigid": [square]},
    }
    figure, axes = panels(4)
    for panel, (name, given) in zip(axes, cases.items()):
        fit = iccm.fit(disc, target, **given)
        picture(panel, iccm.warp(fit, board(10), size=420))
        for _, to in given.get("pins", ()):
            panel.plot(to.real, to.imag, "o", color="white", ms=8, mec="black")
        for _, to in given.get("strokes", ()):
            panel.plot(to.real, to.imag, color="white", lw=4)
            panel.plot(to.real, to.imag, color="black", lw=2)
        for region in given.get("rigid", ()):
            z = fit.map(np.concatenate([np.linspace(a, b, 30) for a, b in zip(region, np.roll(region, -1))]))
            outline(panel, z, "black", 2)
        view(panel, target)
        caption(panel, name)
    return figure


def certificates() -> Figure:
    """Draw a triangulation, an image without and one with a flipped triangle."""
    angles = 2 * np.pi * np.arange(6) / 6
    ring = np.exp(1j * angles)
    good = ring * (1 + 0.25 * np.cos(2 * angles)) + 0.1
    bad = good.copy()
    figure, axes = panels(3)
    for panel, (rim, middle, name) in zip(
        axes,
        (
            (ring, 0j, "source triangles"),
            (good, 0.15 + 0.1j, "image: all triangles\nkeep their orientation"),
            (bad, 1.05 + 0.75j, "image: a vertex crosses an edge,\ntriangles flip"),
        ),
    ):
        for a, b in zip(rim, np.roll(rim, -1)):
            area = ((a - middle).conjugate() * (b - middle)).imag
            corners = np.array([middle, a, b])
            colour = PAINT if area > 0 else MARK
            panel.add_patch(
                Polygon(np.c_[corners.real, corners.imag], facecolor=colour, edgecolor=GREY, lw=1, alpha=0.75)
            )
        view(panel, ring * 1.25, np.array([1.2 + 0.8j]))
        caption(panel, name)
    figure.subplots_adjust(top=0.84)
    return figure


def footprints() -> Figure:
    """Draw pixels of the target and their footprints on the texture."""
    source, target = curve("block.svg"), curve("heart.svg")
    fit = iccm.fit(source, target)
    x = np.linspace(target.real.min(), target.real.max(), 23)
    y = np.linspace(target.imag.min(), target.imag.max(), 21)
    centres = np.add.outer(1j * (y[1:] + y[:-1]) / 2, (x[1:] + x[:-1]) / 2).ravel()
    centres = centres[fit.target.contains(centres)]
    half = (x[1] - x[0]) / 2
    figure, (left, right) = panels(2, 3.2)
    picture(left, iccm.warp(fit, board(), size=420))
    right.imshow(
        board(),
        extent=(source.real.min(), source.real.max(), source.imag.min(), source.imag.max()),
        zorder=0.5,
        alpha=0.7,
    )
    corner = half * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    left.add_collection(LineCollection([_closed(c + corner) for c in centres], colors="black", lw=0.5))
    back = fit.inverse(centres)
    step = 1e-3 * half
    across, up = ((fit.inverse(centres + step * d) - back) / step for d in (1, 1j))
    unit = np.exp(2j * np.pi * np.arange(40) / 40)
    ellipses = [
        _closed(b + half * (unit.real * a + unit.imag * u))
        for b, a, u in zip(back, across, up)
        if np.isfinite(b + a + u)
    ]
    right.add_collection(LineCollection(ellipses, colors="black", lw=0.8))
    view(left, target)
    view(right, source)
    caption(left, "pixels of the target")
    caption(right, "their footprints on the texture")
    return figure


def _closed(z: np.ndarray) -> np.ndarray:
    return np.c_[np.append(z.real, z[0].real), np.append(z.imag, z[0].imag)]


def filtering() -> Figure:
    """Draw a fine texture reduced to a small picture: nearest texel and filtered."""
    disc = np.exp(2j * np.pi * np.arange(100) / 100)
    stripes = np.zeros((512, 512, 3), np.uint8) + np.uint8(255)
    y, x = np.mgrid[:512, :512]
    stripes[np.hypot(x - 256, y - 256) % 24 < 12] = (0, 121, 140)
    figure, axes = panels(3)
    axes[0].imshow(stripes)
    caption(axes[0], "texture, 512 texels")
    square = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    for panel, name in zip(axes[1:], ("nearest", "auto")):
        carried = iccm.transfer(stripes, square, 1.3 * disc, size=64, filter=name)
        panel.imshow(carried.pixels, interpolation="nearest")
        caption(panel, f"64 pixels, --filter {name}")
    return figure


def layouts() -> Figure:
    """Draw a mesh in space, and its layouts by two methods."""
    import trimesh

    mesh = trimesh.load(SAMPLES / "hexagon-surface" / "sail.obj", process=False)
    figure, axes = panels(3, 2.6)
    space = figure.add_subplot(1, 3, 1, projection="3d", computed_zorder=False)
    axes[0].remove()
    space.plot_trisurf(
        *mesh.vertices.T[[0, 2, 1]], triangles=mesh.faces, color=PAINT, edgecolor=GREY, lw=0.15
    )
    space.set_axis_off()
    space.patch.set_alpha(0)
    space.set_box_aspect(np.ptp(mesh.vertices, axis=0)[[0, 2, 1]])
    space.set_title("mesh in space", fontsize=9, color=GREY)
    for panel, method in zip(axes[1:], ("conformal", "balanced")):
        flattened = iccm.flatten(mesh.vertices, mesh.faces, method=method)
        z = flattened.flat
        areas = _area_scales(flattened)
        faces = flattened.patch.triangles.faces
        colours = {"facecolors": areas, "cmap": "RdBu_r", "vmin": -1, "vmax": 1}
        panel.tripcolor(z.real, z.imag, faces, **colours, edgecolors=GREY, lw=0.1)
        view(panel, z)
        caption(panel, f"{method}: area scale\n(red: enlarged, blue: reduced)")
    figure.subplots_adjust(top=0.84)
    return figure


def sail_view() -> Figure:
    """Draw a textured mesh in space: the right half of the command's plot, without its background."""
    from PIL import Image, ImageDraw

    from iccm.io.run import Job, run

    folder = SAMPLES / "hexagon-surface"
    with tempfile.TemporaryDirectory() as here:
        plot = f"{here}/plot.png"
        job = Job(
            source=str(folder / "hexagon.svg"),
            target=str(folder / "sail.obj"),
            texture=str(folder / "tiles.png"),
            output=(f"{here}/sail.obj",),
            plot=plot,
        )
        run(job)
        with Image.open(plot) as image:
            whole = image.convert("RGB")
    white = (255, 255, 255)
    right = whole.crop((whole.width // 2, int(whole.height * 0.07), whole.width, int(whole.height * 0.76)))
    transparent = (255, 0, 255)
    for corner in ((0, 0), (right.width - 1, 0), (0, right.height - 1), (right.width - 1, right.height - 1)):
        if right.getpixel(corner) == white:
            ImageDraw.floodfill(right, corner, transparent, thresh=30)
    pixels = np.asarray(right.convert("RGBA")).copy()
    pixels[(pixels[..., :3] == transparent).all(axis=2)] = 0
    rows, columns = np.nonzero(pixels[..., 3])
    pixels = pixels[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    figure = Figure(figsize=(pixels.shape[1] / PIXELS_PER_INCH, pixels.shape[0] / PIXELS_PER_INCH))
    figure.figimage(pixels, resize=False)
    return figure


def _area_scales(flattened) -> np.ndarray:
    """Return log2 of the area scale of each triangle, relative to the mean."""
    faces, points, z = flattened.patch.triangles.faces, flattened.patch.points, flattened.flat
    a, b, c = (points[faces[:, k]] for k in range(3))
    space = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    p, q, r = (z[faces[:, k]] for k in range(3))
    plane = np.abs(((q - p).conj() * (r - p)).imag)
    ratio = np.log2(plane / space)
    return ratio - np.average(ratio, weights=space)


FIGURES: dict[str, Callable[[], Figure]] = {
    figure.__name__: figure
    for figure in (
        distortion,
        balances,
        edges,
        frames,
        constraints,
        certificates,
        footprints,
        filtering,
        layouts,
        sail_view,
    )
}


def draw(name: str, folder: Path) -> Path:
    """Draw a figure as a PNG file into a folder."""
    path = folder / f"{name}.png"
    FIGURES[name]().savefig(path, dpi=PIXELS_PER_INCH, transparent=True)
    return path


if __name__ == "__main__":
    for asked in sys.argv[2:] or FIGURES:
        print(draw(asked, Path(sys.argv[1])))
