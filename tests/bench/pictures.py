"""Pictures of maps for the gallery: textures through smooth maps and through meshes, as small PNG files."""

import io
from collections.abc import Sequence
from pathlib import Path

import cv2
import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as MplPath
from PIL import Image
from scipy.ndimage import distance_transform_edt

from iccm import Curve, Fit
from iccm.pixels.checkerboard import checkerboard
from iccm.pixels.warp import Canvas, Texture, warp

from .rivals import Mesh

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "gallery"
INK, SOFT, MARK, BLUE, ORANGE = "#22262b", "#8a929b", "#c0143c", "#2a78b8", "#d1662b"
MOST_BYTES = 150_000
COLOURS = 128  # of a stored picture
Box = tuple[complex, complex]


def board(curve: Curve, cells: int = 8) -> Texture:
    """Return a numbered checkerboard over the square around a shape."""
    low, high = curve.box
    middle, half = (low + high) / 2, 0.5 * max((high - low).real, (high - low).imag) * (1 + 1j)
    return Texture(checkerboard(1024, cells), (middle - half, middle + half))


def around(*curves: Curve, margin: float = 0.04) -> Box:
    """Return a box around curves, with a margin."""
    z = np.concatenate([c.z for c in curves])
    low, high = Curve(z).box
    edge = margin * abs(high - low) * (1 + 1j)
    return low - edge, high + edge


def canvas(box: Box, pixels: int) -> Canvas:
    """Return a raster over a box, `pixels` on its longer side."""
    size = box[1] - box[0]
    scale = pixels / max(size.real, size.imag)
    return Canvas(max(1, round(size.real * scale)), max(1, round(size.imag * scale)), box)


def textured(axes: Axes, fit: Fit, texture: Texture, box: Box, pixels: int = 360) -> None:
    """Draw the texture through a fit."""
    show_picture(axes, warp(fit.map, texture, canvas(box, pixels)).pixels, box)


def painted(
    axes: Axes, mesh: Mesh, images: np.ndarray, texture: Texture, box: Box, pixels: int = 360
) -> None:
    """Draw the texture through a map of a mesh, triangle by triangle; folded triangles lie on top."""
    raster = canvas(box, 2 * pixels)
    corners = raster.pixels(images)[mesh.triangles]
    owner = np.full((raster.height, raster.width), -1, np.int32)
    for t, corner in enumerate(np.rint(16 * np.stack([corners.real, corners.imag], -1)).astype(np.int32)):
        cv2.fillConvexPoly(owner, corner, t, shift=4)
    row, column = np.nonzero(owner >= 0)
    a, b, c = corners[owner[row, column]].T
    p, u, v = (column + 0.5) + 1j * (row + 0.5) - a, b - a, c - a
    total = (u.conj() * v).imag
    total = np.where(total == 0, 1e-30, total)
    s = np.clip((p.conj() * v).imag / total, 0, 1)
    t = np.clip((u.conj() * p).imag / total, 0, 1 - s)
    a, b, c = mesh.nodes[mesh.triangles[owner[row, column]]].T
    place = a + s * (b - a) + t * (c - a)
    high, wide = texture.pixels.shape[:2]
    size = texture.box[1] - texture.box[0]
    x = (place.real - texture.box[0].real) / size.real * wide - 0.5
    y = (texture.box[1].imag - place.imag) / size.imag * high - 0.5
    small = cv2.GaussianBlur(texture.pixels[..., :3], (0, 0), 0.8)
    coordinates = np.zeros((2, raster.height, raster.width), np.float32)
    coordinates[:, row, column] = x, y
    colour = cv2.remap(small, *coordinates, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    picture = np.where(owner[..., None] >= 0, colour, np.uint8(255))
    show_picture(axes, cv2.resize(picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), box)


def original(axes: Axes, curve: Curve, texture: Texture, box: Box, pixels: int = 360) -> None:
    """Draw the texture on the source."""
    from iccm import HarmonicMap

    still = HarmonicMap(curve.z, curve.z, np.zeros_like(curve.z))
    show_picture(axes, warp(still, texture, canvas(box, pixels)).pixels, box)


def show_picture(axes: Axes, pixels: np.ndarray, box: Box) -> None:
    """Draw a picture at its place in the plane."""
    extent = (box[0].real, box[1].real, box[0].imag, box[1].imag)
    axes.imshow(pixels, extent=extent, interpolation="antialiased")
    axes.set_xlim(extent[:2])
    axes.set_ylim(extent[2:])
    axes.set_aspect("equal")
    axes.set_anchor("N")
    axes.set_axis_off()


def outline(axes: Axes, z: np.ndarray, colour: str = INK, width: float = 1.0, closed: bool = True, **style):
    """Draw a curve."""
    z = np.append(z, z[:1]) if closed else z
    axes.plot(z.real, z.imag, color=colour, lw=width, solid_joinstyle="round", **style)


def dots(axes: Axes, places: np.ndarray, goal: np.ndarray | None = None) -> None:
    """Draw pins: filled at their images, rings at their targets."""
    if goal is not None:
        axes.plot(goal.real, goal.imag, "o", ms=9, mfc="none", mec="white", mew=3)
        axes.plot(goal.real, goal.imag, "o", ms=9, mfc="none", mec=MARK, mew=1.6)
    axes.plot(places.real, places.imag, "o", ms=5, color=MARK, mec="white", mew=0.8)


def field(
    axes: Axes, fit: Fit, values: np.ndarray, points: np.ndarray, limits: tuple[float, float], cmap: str
):
    """Draw values at points inside the source as a coloured field over it; return the artist for a colour bar."""
    step = np.min(np.diff(np.unique(np.round(points.real, 9))))
    size = 1 + np.round((points - complex(points.real.min(), points.imag.min())) / step)
    grid = np.full((int(size.imag.max()), int(size.real.max())), np.nan)
    grid[size.imag.astype(int) - 1, size.real.astype(int) - 1] = values
    low = complex(points.real.min(), points.imag.min()) - step / 2 * (1 + 1j)
    high = low + step * complex(grid.shape[1], grid.shape[0])
    # cells outside take the nearest value, and are clipped at the outline
    indices = distance_transform_edt(np.isnan(grid), return_distances=False, return_indices=True)
    grid = np.pad(grid[tuple(indices)], 2, mode="edge")
    extent = (low.real - 2 * step, high.real + 2 * step, low.imag - 2 * step, high.imag + 2 * step)
    picture = axes.imshow(
        grid,
        extent=extent,
        origin="lower",
        cmap=cmap,
        vmin=limits[0],
        vmax=limits[1],
        interpolation="nearest",
    )
    border = MplPath(np.column_stack([fit.source.z.real, fit.source.z.imag]))
    picture.set_clip_path(PathPatch(border, transform=axes.transData))
    outline(axes, fit.source.z)
    axes.set_aspect("equal")
    axes.set_anchor("N")
    axes.set_axis_off()
    return picture


def strands(axes: Axes, lines: Sequence[np.ndarray], colour: str) -> None:
    """Draw thin lines."""
    points = [np.column_stack([z.real, z.imag]) for z in lines]
    axes.add_collection(LineCollection(points, colors=colour, linewidths=0.8))


def sheet(columns: int, rows: int = 1, size: float = 2.6, extra: float = 0.35) -> tuple[Figure, np.ndarray]:
    """Return a figure of square panels, without pyplot: no display, no state."""
    figure = Figure(figsize=(columns * size, rows * (size + extra)), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, np.atleast_1d(figure.subplots(rows, columns))


def title(axes: Axes, head: str, line: str = "") -> None:
    """Set a panel's title, and a second line in grey."""
    axes.set_title(f"{head}\n{line or ' '}", fontsize=9.5, color=INK, linespacing=1.35)


def plain(axes: Axes, across: str, up: str) -> None:
    """Style a pair of axes."""
    axes.set_xlabel(across, fontsize=9)
    axes.set_ylabel(up, fontsize=9)
    axes.tick_params(which="both", labelsize=7)
    axes.grid(True, which="major", color="#e3e6ea", lw=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def save(figure: Figure, name: str, folder: Path = FOLDER, dpi: int = 100) -> Path:
    """Store a figure as a small PNG with few colours; raise ValueError if it exceeds MOST_BYTES."""
    raw = io.BytesIO()
    with mpl.rc_context({"font.family": "DejaVu Sans"}):
        figure.savefig(raw, dpi=dpi, metadata={"Software": None}, facecolor="white")
    picture = Image.open(raw).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.png"
    picture.save(path, optimize=True)
    if path.stat().st_size > MOST_BYTES:
        raise ValueError(f"{path}: {path.stat().st_size} bytes, more than {MOST_BYTES}")
    return path
