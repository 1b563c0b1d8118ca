"""Draw the figures that explain concepts: python docs/figures.py FOLDER NAME ...

A page asks for figures with a comment, `<!-- figures: distortion frames -->`; docs/recipes.py then runs this script in
the folder of the page's commands.
Figures have a transparent background and grey text, so that they can be read on light and on dark pages.
"""

import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path as Outline
from PIL import Image, ImageDraw

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


def cartogram() -> Figure:
    """Draw the regions of a cartogram, which the page has written, next to the original."""
    figure, axes = panels(2, 4)
    for panel, file in zip(axes, ("africa.geojson", "africa-people.geojson")):
        for number, feature in enumerate(_features(file)):
            colour = matplotlib.colormaps["tab20"](number * 7 % 20)
            for part in shapely.get_parts(shapely.from_geojson(json.dumps(feature["geometry"]))):
                panel.add_patch(Polygon(np.array(part.exterior.coords), fc=colour, ec="white", lw=0.4))
        panel.autoscale_view()
    return figure


def island() -> Figure:
    """Draw the features of a region, and their images, which the page has written."""
    colours = {"Polygon": LINE, "LineString": "grey", "Point": MARK}
    styles = {"Polygon": "-", "LineString": "--", "Point": "o"}
    figure, axes = panels(2, 3)
    for panel, file in zip(axes, ("island.geojson", "island-on-shield.geojson")):
        for feature in _features(file):
            kind, points = feature["geometry"]["type"], feature["geometry"]["coordinates"]
            x, y = np.array(points[0] if kind == "Polygon" else np.atleast_2d(points)).T
            panel.plot(x, y, styles[kind], color=colours[kind])
    axes[1].invert_yaxis()  # the shield's file has y down
    return figure


def annotation() -> Figure:
    """Draw an annotation on its picture, and both carried to a heart, which the page has written."""
    figure, axes = panels(2, 3)
    pictures = (
        ("coffee.jpg", None, "cup.geojson"),
        ("slide-on-heart.png", (0, 120, 110, 0), "cup-on-heart.geojson"),
    )
    for panel, (file, extent, drawn) in zip(axes, pictures):
        with Image.open(file) as photo:
            panel.imshow(photo, extent=extent)
        ring = _features(drawn)[0]["geometry"]["coordinates"][0]
        panel.plot(*np.array(ring).T, color="cyan", lw=2)
    return figure


def dxf() -> Figure:
    """Draw a DXF drawing, and the same in another size, which the page has written."""
    import ezdxf
    from ezdxf.addons.drawing import Frontend, RenderContext
    from ezdxf.addons.drawing.config import BackgroundPolicy, Configuration
    from ezdxf.addons.drawing.matplotlib import MatplotlibBackend

    figure, axes = panels(2, 4.5)
    style = Configuration(background_policy=BackgroundPolicy.WHITE, pdmode=34, pdsize=-3)
    for panel, file in zip(axes, ("pattern.dxf", "graded.dxf")):
        document = ezdxf.readfile(file)
        frontend = Frontend(RenderContext(document), MatplotlibBackend(panel), config=style)
        frontend.draw_layout(document.modelspace())
        caption(panel, file)
    figure.set_facecolor("white")
    return figure


def _features(path: str) -> list[dict]:
    """Return the features of a GeoJSON file."""
    return json.loads(Path(path).read_text(encoding="utf-8"))["features"]


DRAG_FRAMES = 20
DRAG_SECONDS = 2.4
DRAG_PIXELS = 240
"""Longer side of a frame."""


def drag() -> list[Image.Image]:
    """Draw the frames of a drag: a pin on a cup in a heart is moved around, and the photo follows."""
    photo = iccm.read_image(str(FILES / "coffee.jpg"))
    height, width = photo.shape[:2]
    frame = np.array([0, width, width + 1j * height, 1j * height])
    heart = curve("heart.svg")
    size = np.ptp(heart.real)
    cup = 0.52 * width + 0.6j * height
    fit = iccm.fit(frame, heart)
    begin = fit.map(np.array([cup]))[0]
    frames = []
    for angle in np.linspace(0, 2 * np.pi, DRAG_FRAMES, endpoint=False):
        place = begin + size * (0.16 * np.sin(angle) + 0.07j * (1 - np.cos(angle)))
        fit = iccm.fit(frame, heart, pins=[(cup, place)], start=fit)
        shown = iccm.warp(fit, photo, size=DRAG_PIXELS)
        low, high = shown.box
        picture = Image.fromarray(shown.pixels)
        scale = picture.width / (high - low).real
        x, y = (place - low).real * scale, picture.height - (place - low).imag * scale
        pen = ImageDraw.Draw(picture)
        for radius, colour in ((7, "white"), (5, MARK)):
            pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=colour)
        frames.append(picture)
    return frames


CORRESPONDENCES = 64
"""Pairs of outline points, at equal shares of both outlines, that `compare` gives to the methods that need pairs."""


def compare() -> Figure:
    """Draw a photo on a heart and on a starfish by a spline, a puppet warp, an envelope and iccm."""
    photo = iccm.read_image(str(FILES / "coffee.jpg"))[::-1] / 255  # row 0 at the bottom, y up
    height, width = photo.shape[:2]
    ratio = height / width
    frame = np.array([0, 1, 1 + 1j * ratio, 1j * ratio])
    x, y = np.meshgrid(np.linspace(0, 1, width // 2 + 1), np.linspace(0, ratio, height // 2 + 1))
    grid = x + 1j * y
    colours = photo[: 2 * (height // 2) : 2, : 2 * (width // 2) : 2]
    figure = Figure(figsize=(9, 5))
    rows = figure.subplots(2, 4)
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.9, wspace=0.02, hspace=0.2)
    shares = np.arange(CORRESPONDENCES) / CORRESPONDENCES
    a = _along(np.append(0.5 + 1j * ratio, np.roll(frame, -3)), shares)
    for row, file in zip(rows, (FILES / "heart.svg", SAMPLES / "limbs" / "starfish.svg")):
        z = _from_top(iccm.read_shape(str(file)).curve.z)
        b = _along(z, shares)
        results = {
            "thin-plate spline": _spline(grid, a, b),
            "puppet warp": _puppet(grid, a, b),
            "envelope": _envelope(grid, ratio, z),
            "iccm": iccm.fit(frame, z, fit="whole").map(grid),
        }
        for axes, (name, w) in zip(row, results.items()):
            area = (np.diff(w, axis=1)[:-1].conj() * np.diff(w, axis=0)[:, :-1]).imag
            even = np.abs(np.log2(np.maximum(area, 1e-300) / area.mean())) < 2  # lengths within a factor of 2
            axes.pcolormesh(w.real, w.imag, colours[: w.shape[0] - 1, : w.shape[1] - 1])
            axes.plot(z.real, z.imag, lw=0.8, color="tab:cyan")
            axes.set_aspect("equal")
            axes.set_axis_off()
            caption(axes, f"{name}\nfolds {np.mean(area <= 0):.1%}, even {even.mean():.0%}")
    return figure


def _along(corners: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return points of a closed polygon at these shares of its length, from its first corner."""
    z = np.append(corners, corners[0])
    length = np.append(0, np.cumsum(np.abs(np.diff(z))))
    return np.interp(shares * length[-1], length, z)


def _from_top(z: np.ndarray) -> np.ndarray:
    """Return the same outline, from the point at the middle of its top."""
    middle = (z.real.min() + z.real.max()) / 2
    return np.roll(z, -np.argmin(np.abs(z.real - middle) - 0.5 * z.imag))


def _spline(z: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Map points by the thin-plate spline through pairs of outline points."""
    from scipy.interpolate import RBFInterpolator

    f = RBFInterpolator(np.c_[a.real, a.imag], np.c_[b.real, b.imag], kernel="thin_plate_spline")
    x, y = f(np.c_[z.real.ravel(), z.imag.ravel()]).T
    return (x + 1j * y).reshape(z.shape)


def _puppet(z: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Map points by rigid moving least squares (Schaefer, McPhail, Warren 2006) with the same pairs."""
    size = np.ptp(b.real) / np.ptp(a.real)
    w = 1 / (np.abs(z[..., None] - a) ** 2 + 1e-9)
    p, q = ((w * c).sum(-1) / w.sum(-1) for c in (a, b))
    rotation = (w * (b - q[..., None]) * (a - p[..., None]).conj()).sum(-1)
    return size * (z - p) * rotation / np.abs(rotation) + q


def _envelope(z: np.ndarray, ratio: float, target: np.ndarray) -> np.ndarray:
    """Map points by a Coons patch between four parts of the outline, as long as the sides of the frame."""
    u, v = z.real, z.imag / ratio
    perimeter = 2 + 2 * ratio
    starts = np.array([0.5, 0.5 + ratio, 1.5 + ratio, 1.5 + 2 * ratio]) / perimeter
    left = _along(target, starts[0] + (1 - v) * ratio / perimeter)
    right = _along(target, starts[2] + v * ratio / perimeter)
    bottom = _along(target, starts[1] + u / perimeter)
    top = _along(target, (starts[3] + (1 - u) / perimeter) % 1)
    tl, bl, br, tr = _along(target, starts)
    corners = (1 - u) * (1 - v) * bl + u * (1 - v) * br + u * v * tr + (1 - u) * v * tl
    return (1 - v) * bottom + v * top + (1 - u) * left + u * right - corners


FIGURES: dict[str, Callable[[], Figure | list[Image.Image]]] = {
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
        compare,
        drag,
        cartogram,
        island,
        annotation,
        dxf,
    )
}


def draw(name: str, folder: Path) -> Path:
    """Draw a figure as a PNG file into a folder, or the frames of an animation as a WebP file."""
    drawn = FIGURES[name]()
    if isinstance(drawn, list):
        path = folder / f"{name}.webp"
        step_ms = round(1000 * DRAG_SECONDS / len(drawn))
        drawn[0].save(
            path, save_all=True, append_images=drawn[1:], duration=step_ms, loop=0, quality=50, method=6
        )
        return path
    path = folder / f"{name}.png"
    drawn.savefig(path, dpi=PIXELS_PER_INCH, transparent=True)
    return path


if __name__ == "__main__":
    for asked in sys.argv[2:] or FIGURES:
        print(draw(asked, Path(sys.argv[1])))
