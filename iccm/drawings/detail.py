"""Detail of a picture: the edges that people recognise it by.

People see a drawing by its edges, not by its area. The detail of a picture is a set of edge points, each with a
direction and a weight: the contrast across the edge in the rendered picture, its silhouette against the paper included.
Contrast is clipped, so that one strong edge does not decide.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import ArrayLike
from scipy import ndimage

from ..arrays import Box, Complex, Index, Real
from ..maps.distortion import Distortion
from ..meshes.stretch import linear
from ..pixels.canvas import Canvas
from ..pixels.coverage import painted_share
from ..pixels.paper import FULL_BOX_SHARE, flat_rim
from ..polygons import rings_of
from .cost import Cost
from .region import PaintedRegion

LONGER_SIDE_PIXELS = 256
"""Of the copy in which edges are found: finer edges are texture, not form."""
LEAST_CONTRAST = 8 / 255
"""Differences of colour between neighbouring pixels, below which there is no edge: noise, and smooth shading."""
CLIPPED_QUANTILE = 0.7
"""Of the contrasts of all edges: stronger edges count as this."""
SHADOW_ALPHA = 0.2
"""Opacity up to which parts are shadows and glow around what a picture shows."""
LEAST_WEIGHT = 0.15
"""Relative to the largest weight: weaker edges are ignored."""
MOST_POINTS = 2000
"""Edge points that are kept, evenly spread over all of them."""
HIDDEN_COLOUR = 1.0
"""Grey value of the paper behind transparent parts while edges are found, white unless the drawing itself is white."""
WHITE_INK = 0.9
"""Mean grey value of a drawing that is meant for dark paper."""
RIM_PIXELS = 5
"""Width of the rim of a picture without margin in which the rim's own contrast is felt."""
OUTLINE_DIFFERENCE = 64 / 255
"""Greatest difference from the median colour of a subject's rim: one colour, with its shading."""
OUTLINE_SHARE = 2 / 3
"""Of the rim: where less of it has one colour, the rim is not the subject's own outline."""
VIEW_PIXELS = 160
"""Of the target's longer side, on the raster of distances."""
R2_RATIO = 1.324717957244746  # the real root of x³ = x + 1
LEAST_SUBJECT_RATIO = 0.5
"""Of a subject's shorter to its longer side: thinner ones count as this wide where paper around them is measured."""
RIM_SHARE = 0.08
"""Relative to the target's size: an edge nearer to its rim is pressed against it."""
SIDE_SHARE = 0.01
"""Relative to the picture's size: distance from an edge at which its sides are shown or not."""
NO_POINTS = np.empty(0, complex)
COMPARED_POINTS = 800
"""Edge points, and points of the target, at which maps are compared."""
EDGE_ENERGY_WEIGHT = 12.0
"""Of the energy over the edges of a subject, relative to that over areas: a stretch by 1.25, from which on people call
a subject squeezed, adds a third to the cost."""
FACE_ENERGY_WEIGHT = 30.0
"""The same for a picture with faces: a stretch by 1.15 adds three tenths."""
RIMLESS_ENERGY_WEIGHT = 2.0
"""The same for a picture without margin, such as a flag, which has no outline whose proportions are known."""
OFF_CENTRE_WEIGHT = 2.0
"""Of the squared distance of a subject from the target's centroid, relative to the target's size, in the share that
counts as bare: a fifth of the size counts as .08."""
COVERED_WEIGHT = 0.4
"""Of the share of the target's outline that a subject covers, in the share that counts as bare: the target is
recognised by its outline, so a subject is rather placed in a part of it than across parts."""
FACE_SHARE = 0.5
"""Of all weights of edges: that of faces together."""
HIDDEN_WEIGHT = 2.0
"""Of edges that are not seen, relative to area."""
PAPER_POWER = 4
"""Of the share of the target that shows paper, in its cost."""
DOUBLING_DEGREES = 60.0
"""Mean rotation of what is seen that doubles the cost: 8 degrees are as bad as a tenth of hidden edges."""


@dataclass(frozen=True, eq=False)
class Detail:
    """The edges of a picture in the source's plane.

    Attributes:
        points: (n,) complex positions.
        normals: (n,) complex unit vectors across the edges.
        weights: (n,) weights, with sum 1.
        box: the bounding box of what the picture shows.
        is_full: whether the picture has no margin, and nothing continues it: it fills its box, or was cut from a
            larger one. The flat colour of a picture's rim continues it as paper would.
        on_paper: whether paper is shown where the picture is transparent; else nothing is.
        weight: share of the detail that is seen in the cost of a map, from 0 to 1; the rest is that of areas.
        fills_box: whether the picture fills its box to the edge.
        canvas: the box of the target's plane that pictures show; None if it has no bounds.
        keeps_form: whether the picture is only shown on what the target paints, not on its silhouette.
        faces: the boxes of faces, see `with_faces`.
        is_photo: whether the picture may show things whose proportions people know, although it has no margin.
    """

    points: Complex
    normals: Complex
    weights: Real
    box: Box
    is_full: bool
    on_paper: bool = True
    weight: float = 1.0
    fills_box: bool = False
    canvas: Box | None = None
    keeps_form: bool = False
    faces: tuple[Box, ...] = ()
    is_photo: bool = False

    def energy_weight(self, *, has_margin: bool) -> float:
        """Return the weight of the energy over edges relative to that over areas: people know the proportions of a
        face, and those of a subject with an outline or in a photo, but not those of a flag.
        """
        if self.faces:
            return FACE_ENERGY_WEIGHT
        return EDGE_ENERGY_WEIGHT if has_margin or self.is_photo else RIMLESS_ENERGY_WEIGHT

    def hidden_cost(self, share: float) -> float:
        """Return the share of the source that counts as hidden if a share of its edges is not seen.

        The sides of a photo without margin are mostly background, so that it is rather cropped than stretched.
        """
        return share if self.is_photo and self.is_full else hidden_cost(share)

    def with_faces(self, faces: Sequence[Box]) -> "Detail":
        """Return the detail with edges in faces, which are together as important as all others."""
        in_faces = np.zeros(self.points.size, bool)
        for low, high in faces:
            middle, half = (low + high) / 2, (high - low) / 2
            away = self.points - middle
            in_faces |= np.hypot(away.real / half.real, away.imag / half.imag) <= 1
        shares = self.weights[in_faces].sum(), self.weights[~in_faces].sum()
        if not min(shares) > 0:
            return self
        weights = np.where(in_faces, FACE_SHARE / shares[0], (1 - FACE_SHARE) / shares[1]) * self.weights
        return replace(self, weights=weights, faces=tuple(faces))

    @property
    def has_paper(self) -> bool:
        """Whether what the picture shows lies on paper: it has a margin, and paper is shown there."""
        return self.on_paper and not self.is_full

    @property
    def compared(self) -> tuple[Complex, Complex, Real]:
        """Positions, normals and weights of COMPARED_POINTS edge points at most, evenly spread over all of them."""
        few = np.linspace(0, self.points.size - 1, min(self.points.size, COMPARED_POINTS)).astype(int)
        return self.points[few], self.normals[few], self.weights[few]

    def subject(self, painted: shapely.Geometry) -> PaintedRegion:
        """Return the region that does not count as paper around it.

        It is the convex hull of what the picture paints. A long subject, such as a word, counts at least half as wide
        as it is long: it fills a square that it crosses.
        """
        low, high = self.box
        extent, middle = high - low, (low + high) / 2
        least = LEAST_SUBJECT_RATIO * max(extent.real, extent.imag)
        half = complex(max(extent.real, least), max(extent.imag, least)) / 2
        hull = shapely.convex_hull(painted)
        if half != extent / 2:
            low, high = middle - half, middle + half
            hull = shapely.union(hull, shapely.box(low.real, low.imag, high.real, high.imag))
        return PaintedRegion(hull)

    @property
    def is_empty(self) -> bool:
        """Whether there are no edges."""
        return not self.points.size

    @classmethod
    def of_picture(
        cls, pixels: ArrayLike, box: Box, *, on_paper: bool = True, weight: float = 1.0
    ) -> "Detail":
        """Find the edges of a picture.

        Parameters
        ----------
        pixels
            (h, w, 4) straight RGBA from 0 to 1, row 0 on top; transparent where paper is seen.
        box
            Lower left and upper right corner of its place in the source's plane.
        on_paper, weight
            As for `Detail`.
        """
        rgba = _reduced(np.asarray(pixels, dtype=np.float32))
        height, width = rgba.shape[:2]
        step = complex((box[1] - box[0]).real / width, (box[1] - box[0]).imag / height)
        alpha = rgba[..., 3:]
        is_painted = alpha[..., 0] > SHADOW_ALPHA
        if not is_painted.any():
            return cls(NO_POINTS, NO_POINTS, np.empty(0), box, False, on_paper, weight)
        rows, columns = (np.flatnonzero(is_painted.any(axis=axis)) for axis in (1, 0))
        painted = (
            complex(box[0].real + columns[0] * step.real, box[1].imag - (rows[-1] + 1) * step.imag),
            complex(box[0].real + (columns[-1] + 1) * step.real, box[1].imag - rows[0] * step.imag),
        )
        inside = is_painted[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        fills_box = bool(inside.mean() > FULL_BOX_SHARE)
        ground = flat_rim(rgba, alpha=3) if on_paper else None
        is_full = ground is None and (fills_box or _is_cropped(rgba, is_painted))
        if fills_box and on_paper and ground is None and _is_plain(rgba, is_painted):
            is_full = False  # a bar of one colour is known by its outline
        ink = float((rgba[..., :3].mean(axis=2) * alpha[..., 0]).sum() / alpha.sum())
        paper = HIDDEN_COLOUR if ink < WHITE_INK else 1 - HIDDEN_COLOUR
        colours = rgba[..., :3] * alpha + paper * (1 - alpha)
        smooth = ndimage.gaussian_filter(colours, (1, 1, 0))
        across, down = ndimage.sobel(smooth, axis=1), ndimage.sobel(smooth, axis=0)
        strongest = np.hypot(across, down).argmax(axis=2)[..., None]
        across, down = (np.take_along_axis(slope, strongest, 2)[..., 0] for slope in (across, down))
        contrast = np.hypot(across, down)
        if is_full or ground is not None:
            # the rim of a picture without margin is where it was cut, not a part of what it shows
            contrast[~ndimage.binary_erosion(is_painted, iterations=RIM_PIXELS)] = 0
        contrast[contrast < LEAST_CONTRAST] = 0
        if not contrast.any():
            return cls(NO_POINTS, NO_POINTS, np.empty(0), painted, is_full, on_paper, weight)
        clipped = np.minimum(1, contrast / np.quantile(contrast[contrast > 0], CLIPPED_QUANTILE))
        row, column = np.nonzero(clipped > LEAST_WEIGHT)
        chosen = np.unique(np.linspace(0, row.size - 1, min(MOST_POINTS, row.size)).astype(int))
        row, column = row[chosen], column[chosen]
        weights = clipped[row, column].astype(float)
        points = box[0].real + (column + 0.5) * step.real + 1j * (box[1].imag - (row + 0.5) * step.imag)
        normals = across[row, column] / step.real - 1j * down[row, column] / step.imag
        normals /= np.abs(normals)
        weights /= weights.sum()
        return cls(points, normals, weights, painted, is_full, on_paper, weight, fills_box)


def _is_plain(rgba: np.ndarray, is_painted: np.ndarray) -> bool:
    """Return whether a picture has a single colour where it is painted."""
    colours = rgba[is_painted][:, :3]
    return bool(np.ptp(colours, axis=0).max() < LEAST_CONTRAST)


def _is_cropped(rgba: np.ndarray, is_painted: np.ndarray) -> bool:
    """Return whether a picture is cut from a larger one, such as a flag by a circle.

    The outline is then a convex one that looks the same mirrored across and down, such as a circle or a rounded square,
    and the rim has several colours, where a subject's own outline has one.
    """
    rows = np.flatnonzero(is_painted.any(axis=1))
    first = is_painted[rows].argmax(axis=1)
    last = is_painted.shape[1] - is_painted[rows, ::-1].argmax(axis=1)
    corners = np.column_stack([np.tile(np.concatenate([first, last]), 2), np.repeat([0, 1], 2 * rows.size)])
    corners[:, 1] += np.tile(rows, 4)
    if is_painted.sum() < FULL_BOX_SHARE * shapely.convex_hull(shapely.MultiPoint(corners)).area:
        return False
    box = is_painted[rows[0] : rows[-1] + 1, first.min() : last.max()]
    if any((box != mirrored).mean() > 1 - FULL_BOX_SHARE for mirrored in (box[::-1], box[:, ::-1])):
        return False  # such as a gem, whose facets have several colours
    inner = ndimage.binary_erosion(is_painted)
    rim = rgba[inner & ~ndimage.binary_erosion(inner, iterations=RIM_PIXELS)][:, :3]
    if not len(rim):
        return False
    differences = np.abs(rim - np.median(rim, axis=0)).max(axis=1)
    return bool((differences < OUTLINE_DIFFERENCE).mean() < OUTLINE_SHARE)


def _reduced(pixels: np.ndarray) -> np.ndarray:
    """Return a picture with at most LONGER_SIDE_PIXELS on its longer side, by averaging blocks of pixels."""
    height, width = pixels.shape[:2]
    times = max(1, round(max(height, width) / LONGER_SIDE_PIXELS))
    if times == 1:
        return pixels
    height, width = height // times * times or height, width // times * times or width
    rows, columns = (min(times, side) for side in (height, width))
    pixels = pixels[: height // rows * rows, : width // columns * columns]
    alpha = pixels[..., 3:]
    premultiplied = np.concatenate([pixels[..., :3] * alpha, alpha], axis=2)
    blocks = premultiplied.reshape(height // rows, rows, width // columns, columns, 4).mean(axis=(1, 3))
    mean_alpha = blocks[..., 3:]
    colours = np.divide(blocks[..., :3], mean_alpha, out=np.zeros_like(blocks[..., :3]), where=mean_alpha > 0)
    return np.concatenate([colours, mean_alpha], axis=2)


@dataclass(frozen=True, eq=False)
class TargetView:
    """What a target shows: its painted region as a raster, with the distance of each point from the region's edge.

    Attributes:
        distances: (h, w) distances from the edge inside, 0 outside.
        low: lower left corner of the raster in the target's plane.
        step: size of a pixel.
        box: bounding box of the region.
        centroid: of the region.
        painted: the region itself, prepared.
    """

    distances: Real
    low: complex
    step: float
    box: Box
    centroid: complex
    painted: shapely.Geometry

    @classmethod
    def of(cls, painted: shapely.Geometry) -> "TargetView":
        """Return the view of a painted region."""
        left, bottom, right, top = painted.bounds
        step = max(right - left, top - bottom) / VIEW_PIXELS
        low = complex(left, bottom) - 2 * step * (1 + 1j)
        width, height = (int(np.ceil(side / step)) + 4 for side in (right - left, top - bottom))
        canvas = Canvas.about(width, height, (low, low + step * complex(width, height)))
        inside = painted_share(rings_of(painted), canvas) > 0.5
        inside = ndimage.binary_closing(inside)  # gaps of a pixel are not seen as gaps
        distances = ndimage.distance_transform_edt(inside)[::-1] * step
        middle = painted.centroid
        box = complex(left, bottom), complex(right, top)
        shapely.prepare(painted)
        return cls(distances, low, step, box, complex(middle.x, middle.y), painted)

    @property
    def size(self) -> float:
        """Root of the area of its bounding box."""
        extent = self.box[1] - self.box[0]
        return float(np.sqrt(extent.real * extent.imag))

    @property
    def widest(self) -> complex:
        """The point of the region that is farthest from its edge."""
        return self._at(*np.unravel_index(self.distances.argmax(), self.distances.shape))

    def spread(self, count: int) -> Complex:
        """Return about `count` points spread over the region: the sequence R2 (Roberts 2018) of low discrepancy.

        Points of a grid would make the share that a narrow shape covers depend on where its sides lie between rows.
        """
        tries = round(count * self.distances.size / np.count_nonzero(self.distances))
        places = np.arange(1, tries + 1)[:, None] * np.array([R2_RATIO**-1, R2_RATIO**-2]) % 1
        rows, columns = (places * self.distances.shape).astype(int).T
        inside = self.distances[rows, columns] > 0
        height, width = self.distances.shape
        x, y = (places[inside] * [height, width])[:, ::-1].T
        return self.low + self.step * (x + 1j * y)

    def seen(self, w: Complex) -> Real:
        """Return how well edges at points w are seen: 0 outside the region, 1 at a distance from its rim.

        An edge that is pressed against the rim is only partly seen.
        """
        place = (np.where(np.isfinite(w), w, self.low - 1j * self.step) - self.low) / self.step
        row, column = np.floor(place.imag).astype(int), np.floor(place.real).astype(int)
        height, width = self.distances.shape
        inside = (row >= 0) & (column >= 0) & (row < height) & (column < width)
        distance = np.zeros(w.shape)
        distance[inside] = self.distances[row[inside], column[inside]]
        return np.minimum(1, distance / (RIM_SHARE * self.size))

    def _at(self, row, column):
        return self.low + self.step * (column + 0.5 + 1j * (row + 0.5))


def cost_of_detail(
    z: Complex,
    u: Complex,
    faces: Index,
    detail: Detail,
    view: TargetView,
    *,
    subject: PaintedRegion,
    paper: Callable[[float], float] | None,
    balance: float = 1.0,
) -> Cost:
    """Return the cost of what a piecewise linear map shows of a picture's detail.

    Energy is the mean over the edges that are seen, and `hidden` follows from the share of the others. An edge is seen
    if both of its sides are. An edge of the silhouette that becomes the target's outline is seen as far as it keeps its
    direction: a heart on a shield is recognised, a bell on a rectangle is not. `rotation` counts the rotation of each
    edge that is seen.

    Parameters
    ----------
    z, u
        (n,) complex vertices and their images.
    faces
        (m, 3) triangles, which fold neither in the source nor in the target.
    detail
        The edges of the picture.
    view
        The target.
    subject
        The region of the source's plane that is not paper.
    paper
        Returns the share of the target that counts as bare if a share shows paper; None if all of it does.
    balance
        Weight of areas in the energy, θ.
    """
    points, normals, weights = detail.compared
    f_z, f_zbar = linear(z[faces], u[faces])
    extent = detail.box[1] - detail.box[0]
    beside = SIDE_SHARE * np.sqrt(extent.real * extent.imag) * normals
    sides = [points + beside, points - beside]
    numbers = [_triangles_at(side, z, faces) for side in sides]
    views = []
    for side, number in zip(sides, numbers):
        moved = side - z[faces[number, 0]]
        image = u[faces[number, 0]] + f_z[number] * moved + f_zbar[number] * moved.conj()
        views.append(np.where(number >= 0, view.seen(image), 0.0))
    inside = [number >= 0 for number in numbers]
    number = np.where(inside[0], numbers[0], numbers[1])
    is_mapped = inside[0] | inside[1]
    a, b = f_z[number], f_zbar[number]
    tangents = 1j * normals
    rotation = np.abs(np.angle((a * tangents + b * tangents.conj()) / tangents))
    # the silhouette on the rim: one side is mapped, the other is not
    on_rim = np.maximum(views[0], views[1]) > 0
    alike = np.maximum(0, np.cos(2 * rotation)) * on_rim
    shown = np.where(inside[0] & inside[1], np.minimum(*views), np.where(is_mapped, alike, 0.0))
    seen_weights = weights * shown
    hidden = 1 - float(seen_weights.sum() / weights.sum())
    empty, nothing = _bare(z, u, faces, view, subject)
    bare = nothing + (paper(empty) if paper else empty)
    if not seen_weights.sum() > 0:
        return Cost(np.inf, 1.0, bare)
    areas = np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2
    used = seen_weights > 0
    scale = float(
        np.exp(np.average(np.log(np.maximum(areas[number[used]], 1e-300)) / 2, weights=seen_weights[used]))
    )
    density = Distortion(seen_weights[used], a[used], b[used], scale).energies(balance)["total"]
    energy = float(np.average(density, weights=seen_weights[used]))
    turned = np.abs(np.angle(a[used]))
    leaning = float(np.average(turned, weights=seen_weights[used]))
    return Cost(
        energy_of_form(energy, detail.energy_weight(has_margin=paper is not None)),
        detail.hidden_cost(hidden),
        bare,
        1 + leaning / np.radians(DOUBLING_DEGREES),
    )


def energy_of_form(energy: float, weight: float) -> float:
    """Return the energy that counts for edges, which show every bend, for the balanced energy of a map there."""
    return 1 + weight * (energy - 1)


def off_centre_cost(distance: float) -> float:
    """Return the share of the target that counts as bare if a subject is off its centroid, relative to its size."""
    return OFF_CENTRE_WEIGHT * distance**2


def covered_cost(share: float) -> float:
    """Return the share of the target that counts as bare if a subject covers a share of the target's outline."""
    return COVERED_WEIGHT * share


def hidden_cost(share: float) -> float:
    """Return the share of the source that counts as hidden if a share of its edges is not seen.

    A subject that is cut by a tenth is damaged, which a tenth of its area would not say. Where nothing of it is seen,
    this is 2, so that a subject in pieces always costs more than one that is whole but small.
    """
    return HIDDEN_WEIGHT * share


def paper_cost(share: float) -> float:
    """Return the share of the target that counts as bare if a share of it shows paper.

    A margin costs next to nothing: .012 for a third of the target. A subject that fills a tenth of the target is not
    composed: .66.
    """
    return share**PAPER_POWER


def _triangles_at(points: Complex, vertices: Complex, faces: Index) -> Index:
    """Return the number of the triangle that contains each point (p,); -1 for points outside all of them.

    Coarse meshes have few triangles, so every point is compared with each of them.
    """
    corners = vertices[faces]
    inside = np.ones((points.size, len(faces)), bool)
    for k in range(3):
        side = corners[:, (k + 1) % 3] - corners[:, k]
        inside &= (side.conj() * (points[:, None] - corners[:, k])).imag >= 0
    return np.where(inside.any(axis=1), inside.argmax(axis=1), -1)


def _bare(
    z: Complex, u: Complex, faces: Index, view: TargetView, subject: PaintedRegion
) -> tuple[float, float]:
    """Return the shares of the target that show paper, and nothing at all."""
    w = view.spread(COMPARED_POINTS)
    number = _triangles_at(w, u, faces)
    p, q = linear(u[faces], z[faces])
    moved = w - u[faces[number, 0]]
    back = z[faces[number, 0]] + p[number] * moved + q[number] * moved.conj()
    covered = number >= 0
    shown = covered & subject.contains(np.where(covered, back, z[0]))
    return float((covered & ~shown).mean()), float((~covered).mean())
