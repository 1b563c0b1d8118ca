"""Transfer pictures embedded in a drawing, each as one picture, clipped once at its outline.

Where the map is affine over all of a picture, the picture itself is kept and transformed. Elsewhere it is resampled in
the target at the resolution that the map needs, and shown inside the image of its rectangle.
"""

import base64
from collections.abc import Sequence
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import shapely
from numpy.typing import NDArray

from ... import deadline
from ...arrays import Box, Complex, complex_of
from ...errors import InputError
from ...pixels import preimages
from ...pixels.canvas import BAND_ROWS, Canvas
from ...pixels.padding import pad
from ...pixels.sampler import Sampler
from ...pixels.texture import Texture, TexturePlaces
from ...plane import bounding_box
from .. import limits
from ..pictures import pillow
from ..pictures.image import Image
from ..svg import affine
from ..svg.affine import Affine
from ..svg.data_uri import content_of
from ..svg.drawing_content import Rectangle
from ..svg.tree import LINKS
from .references import typed
from .regions import MapDomain

LINK = LINKS[1]
"""With the prefix of SVG 1.1, since Inkscape 1.2 shows no pictures without it, and browsers do with it."""
MOST_ENLARGEMENT_RATIO = 4
"""Ratio of resampled to original pixels at most."""
COUNTED_CURVES = 200
"""Number of lines and curves as which a picture counts towards the limits of a drawing."""
LEAST_PIXELS = 1 << 18
"""Pixels that even a tiny picture may get, so that the map's curvature shows between its texels."""
FINE_AREA_SHARE = 0.25
"""Share of a picture that may be shown with less than one pixel per original pixel."""
SAMPLES_ACROSS = 33  # points of a picture in each direction at which the map is sampled
POINTS_PER_SIDE = 128  # per side of a picture; between them its image is straight to less than a pixel
MARGIN_PIXELS = 2  # around the mapped area, since viewers interpolate between pixels
PATH_TOLERANCES = 5  # times the tolerance of paths: a pixel of small pictures, a thousandth of the target
ERROR_TEXELS = 0.1  # error of texture coordinates in texels
NEAREST = frozenset(["pixelated", "crisp-edges", "optimizeSpeed"])


@dataclass(eq=False)
class EmbeddedPicture:
    """An embedded picture to be mapped.

    Attributes:
        out: the group in which it is shown, clipped to its outline.
        group: the element around `out`, which has the picture's styles.
        content: bytes of the file.
        address: the same as written in the drawing, with its media type.
        place: corners of the rectangle in which it is shown, in the root's units.
        to_root: map from the picture, scaled to height 1, to the root's units.
        ratio: width / height of the picture.
        smooth: whether its pixels are interpolated.
        copy: number of the only map that transfers it, if any.
    """

    out: Element
    group: Element
    content: bytes
    address: str
    place: Complex
    to_root: Affine
    ratio: float
    smooth: bool = True
    copy: int | None = None

    def carry(self, regions: Sequence[MapDomain], tolerance: float) -> str:
        """Show the picture as the regions' maps transform it, and return a note, or an empty string."""
        from ..pictures import image_files

        corners = self.place.conj()
        polygon = shapely.Polygon(np.column_stack([corners.real, corners.imag]))
        covering = [region for region in regions if region.domain.reach.intersects(polygon)]
        if len(covering) == 1 and (map := _affine_map(covering[0], polygon, corners, tolerance)):
            size = {"width": f"{self.ratio:.9g}", "height": "1", "preserveAspectRatio": "none"}
            transform = affine.to_svg(_conjugated(map) @ self.to_root)
            SubElement(self.out, _name("image"), size | {LINK: self.address, "transform": transform})
            return ""
        try:
            image = image_files.read_held(self.content, "embedded picture")
        except InputError as error:
            return f"{error}; omitted"
        finest = 1 / (PATH_TOLERANCES * tolerance)
        notes = [
            self._resampled(region, polygon, image, finest, opaque=len(covering) == 1) for region in covering
        ]
        return next((note for note in notes if note), "")

    def _resampled(
        self, region: MapDomain, polygon: shapely.Polygon, image: Image, finest: float, *, opaque: bool
    ) -> str:
        """Add the picture as resampled by a region's map; return a note."""
        visible = shapely.intersection(polygon, region.domain.polygon)
        z = _inside(visible, polygon)
        if not z.size:
            return ""
        height, width = image.pixels.shape[:2]
        to_root = self.to_root @ Affine.matrix(self.ratio / width, 0, 0, 1 / height, 0, 0)
        texels = to_root.inverse
        _, w, alpha, beta = region.jet(z)
        scales = np.sqrt(np.maximum(np.abs(np.abs(alpha) ** 2 - np.abs(beta) ** 2), 1e-300))
        density = float(np.sqrt(abs(texels.determinant)) / np.quantile(scales, FINE_AREA_SHARE))
        _, rim, _, _ = region.jet(_outline(visible))
        box = bounding_box(np.concatenate([w, rim]))
        texel_count = width * height * min(1.0, visible.area / polygon.area)
        canvas = _canvas(box, max(density, finest), texel_count)
        resampled = _warped(region, image, texels, canvas, smooth=self.smooth, opaque=opaque)
        low, high = canvas.box
        place = zip(("x", "y", "width", "height"), (low.real, -high.imag, *_size(canvas.box)))
        attributes = {name: f"{value:.9g}" for name, value in place} | {"preserveAspectRatio": "none"}
        address = address_of(resampled, was_jpeg=self.address[:16].lower().startswith("data:image/jp"))
        SubElement(self.out, _name("image"), attributes | {LINK: address})
        return f"embedded picture resampled, such as one to {canvas.width} × {canvas.height} pixels"


def size_of(address: str) -> tuple[bytes, int, int] | None:
    """Return the file in an address, and its width and height as shown; None where it is not a supported picture."""
    content = content_of(typed(address))
    if not content:
        return None
    try:
        with pillow.opened(content, "embedded picture", pillow.EMBEDDED) as image:
            width, height = image.size
            is_sideways = image.getexif().get(0x0112, 1) > 4
    except InputError:
        return None
    return (content, height, width) if is_sideways else (content, width, height)


def placed(place: Rectangle, size: tuple[float, float], aspect: str) -> tuple[Affine, Rectangle]:
    """Return the map from a picture of a size to user space, and the rectangle there in which it is visible.

    Raises:
        InputError: `aspect` is malformed.
    """
    fit = affine.viewport(place, (0.0, 0.0, *size), aspect or "xMidYMid")
    corner, opposite = fit(0j), fit(complex(*size))
    left, top = max(corner.real, place[0]), max(corner.imag, place[1])
    right, bottom = min(opposite.real, place[0] + place[2]), min(opposite.imag, place[1] + place[3])
    return fit, (left, top, right - left, bottom - top)


@dataclass(frozen=True, eq=False)
class _Placing:
    """Places of the source's points in a picture that is placed by an affine map; see `Placing`."""

    texels: Affine

    @property
    def scale(self) -> tuple[float, float]:
        """See `Placing.scale`."""
        largest = abs(self.texels.alpha) + abs(self.texels.beta)
        return largest, largest

    def places(self, z: Complex, right: NDArray, down: NDArray) -> TexturePlaces:
        """See `Placing.places`."""
        linear = Affine(self.texels.alpha, self.texels.beta)
        points, across, below = self.texels(z.conj()), linear(right.conj()), linear(down.conj())
        jacobian = np.stack([across.real, below.real, across.imag, below.imag], axis=1)
        return TexturePlaces(np.stack([points.real, points.imag], axis=1), jacobian, right, down)


def _warped(
    region: MapDomain, image: Image, texels: Affine, canvas: Canvas, *, smooth: bool, opaque: bool
) -> Image:
    """Resample a picture onto a canvas by a region's map; its colours are extended beyond the mapped area.

    Unless it is `alone`, it is transparent there.
    """
    height, width = image.pixels.shape[:2]
    texture: Texture = image.texture((0j, complex(width, height)))
    sampler = Sampler(texture, "auto" if smooth else "nearest")
    placing = _Placing(texels)
    bands = preimages.of(region.map, canvas, ERROR_TEXELS / placing.scale[0])
    out = np.zeros((canvas.height * canvas.width, sampler.channels), sampler.dtype)
    filled = np.zeros(canvas.height * canvas.width, bool)
    for row in range(0, canvas.height, BAND_ROWS):
        deadline.check("carrying embedded pictures")
        band = bands(row)
        pixel = np.flatnonzero(band.coverage)
        z, right, down = band.z.ravel()[pixel], band.right.ravel()[pixel], band.down.ravel()[pixel]
        pixel += row * canvas.width
        filled[pixel] = True
        for first in range(0, pixel.size, 1 << 15):
            part = slice(first, first + (1 << 15))
            values = sampler.values(placing.places(z[part], right[part], down[part]))
            out[pixel[part]] = sampler.stored(values)
    pixels, covered = out.reshape(canvas.height, canvas.width, -1), filled.reshape(canvas.height, -1)
    alpha = texture.alpha
    if not opaque:
        reached = np.zeros((*covered.shape, 1), pixels.dtype)
        reached[covered] = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1
        pixels, alpha = (
            (pixels, alpha) if alpha >= 0 else (np.concatenate([pixels, reached], axis=2), pixels.shape[2])
        )
    pad(pixels, covered, -1 if opaque else MARGIN_PIXELS)
    return image.with_pixels(np.ascontiguousarray(pixels), alpha)


def _canvas(box: Box, density: float, texels: float) -> Canvas:
    """Return a raster for a box at a density of pixels per unit, reduced if it would exceed the limits of pictures."""
    width, height = _size(box)
    most = min(limits.RENDERED_PIXELS, max(MOST_ENLARGEMENT_RATIO * texels, LEAST_PIXELS))
    density *= min(1.0, np.sqrt(most / max(width * density * height * density, 1e-300)))
    columns, rows = (max(1, int(np.ceil(side * density))) + 2 * MARGIN_PIXELS for side in (width, height))
    middle, half = (box[0] + box[1]) / 2, complex(columns, rows) / (2 * density)
    return Canvas(columns, rows, (middle - half, middle + half))


def _affine_map(
    region: MapDomain, polygon: shapely.Polygon, corners: Complex, tolerance: float
) -> Affine | None:
    """Return the affine map that equals a region's map over all of a picture, in the core plane, or None."""
    z = _inside(shapely.intersection(polygon, region.domain.polygon), polygon)
    if z.size < 3:
        return None
    _, w, _, _ = region.jet(z)
    centre, size = corners.mean(), np.abs(corners - corners.mean()).max()
    away = (z - centre) / size
    matrix = np.stack([away, away.conj(), np.ones_like(away)], axis=1)
    (a, b, c), *_ = np.linalg.lstsq(matrix, w, rcond=None)
    if not np.abs(matrix @ [a, b, c] - w).max() <= tolerance:
        return None
    linear = Affine(complex(a / size), complex(b / size))
    return replace(linear, gamma=complex(c) - linear(complex(centre)))


def _inside(visible: shapely.Geometry, polygon: shapely.Polygon) -> Complex:
    """Return points (p,) distributed over the visible part of a picture, in the core plane."""
    a, b, _, d = complex_of(shapely.get_coordinates(polygon)[:4])
    share = (np.arange(SAMPLES_ACROSS) + 0.5) / SAMPLES_ACROSS
    z = (a + share * (b - a) + share[:, None] * (d - a)).ravel()
    return z[shapely.contains_xy(visible, z.real, z.imag)]


def _outline(visible: shapely.Geometry) -> Complex:
    """Return closely spaced points on the outline of the visible part of a picture."""
    step = max(np.ptp(shapely.get_coordinates(visible), axis=0).max() / POINTS_PER_SIDE, 1e-300)
    return complex_of(shapely.get_coordinates(shapely.segmentize(visible, step)))


def _conjugated(map: Affine) -> Affine:
    """Convert a map of the core plane, where y points up, to coordinates with y down."""
    return Affine(
        complex(map.alpha).conjugate(), complex(map.beta).conjugate(), complex(map.gamma).conjugate()
    )


def address_of(image: Image, *, was_jpeg: bool) -> str:
    """Return the picture as a data: address; as JPEG if it was one and has no transparency, else as PNG."""
    from ..pictures import image_files

    lossy = image.alpha < 0 and was_jpeg
    kind, content = ("jpeg", image_files.as_jpeg(image)) if lossy else ("png", image_files.as_png(image))
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def _size(box: Box) -> tuple[float, float]:
    size = box[1] - box[0]
    return size.real, size.imag


def _name(tag: str) -> str:
    return f"{{http://www.w3.org/2000/svg}}{tag}"
