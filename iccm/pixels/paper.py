"""A background for drawings used as textures: a paper colour where the drawing is transparent.

Where a drawing is shown on a target's silhouette, what the target itself paints is a darker tone on the paper, so that
the target is recognised below the drawing. Paper then lies in what the target encloses, and not in the gaps between its
parts, where its rim would look like another shape.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import shapely

from ..arrays import Complex, Real, xy_of
from ..plane import bounding_box, polygon_area
from ..polygons import Polygons, polygons_of, rings_of, unite
from .canvas import Canvas
from .colour import Float, decode, encode
from .coverage import painted_share
from .texture import Texture

INK_SHARE = 0.15
"""Least share of the drawing's mean colour in the colour of the paper: enough to distinguish it from white if the
drawing is dark."""
PAPER_CONTRAST_RATIO = 1.25
"""Contrast of the paper with white, so that the target's shape is visible on a white page. For a light drawing, paper
has half the drawing's contrast with white (in logarithms), if that is less."""
LEAST_CONTRAST_RATIO = 1.3
"""Contrast with white (WCAG 2.2: from 1 to 21) below which a drawing is meant for a dark page."""
GAP_PAPER_SHARE = 0.075
"""Share of ink by which paper falls below plain paper where a tone lies on it."""
TONE_CONTRAST_RATIOS = (2.0, 1.6, 3.0)
"""Contrasts of a tone with white: the first one on which the drawing's silhouette is well seen is used. With less than
1.6, what the target paints is hardly recognised where a drawing covers its middle."""
INK_CONTRAST_RATIO = 4.0
"""Least contrast with white of the ink of a tone: that of a light drawing is darkened, keeping its hue."""
DARK_TONE_SHARE = 0.35
"""Share of the drawing's mean colour in a tone on dark paper."""
INK_SHARES_TRIED = 100
"""Number of shares of ink in the paper that are compared; neighbours differ by less than is visible."""
FULL_BOX_SHARE = 0.95
"""Of its bounding box: a picture that covers more has no margin, as a photo or a flag."""
RIM_WIDTH_SHARE = 0.02
"""Relative to the picture's shorter side: width of the rim that is examined, just inside of its edge."""
FLAT_RIM_SHARE = 0.97
"""Of the rim: a picture that has one colour on more of it lies on this colour."""
LEAST_GROUND_SHARE, MOST_GROUND_SHARE = 0.4, 0.99
"""Of a picture's area, that has the colour of its rim: less is an outline around it, which ends the picture; on more,
there is nothing to see."""
FLAT_DIFFERENCE = 8 / 255
"""Greatest difference of colours that count as one."""
HARDLY_SEEN_DIFFERENCE = 20 / 255
"""Largest difference of any channel between a drawing and paper on which it is hardly seen."""
SEEN_ON_TONE_DIFFERENCE = 30 / 255
"""Difference from a tone from which on a drawing is well seen on it."""
UNSEEN_ON_TONE_SHARE = 0.1
"""Of a drawing's silhouette: a tone on which more of it is not well seen is avoided."""
HARDLY_SEEN_SHARE = 0.5
"""Of a drawing's silhouette: if more of it is hardly seen on light paper, dark paper is used where that shows more."""
LEAST_ROOM_SHARE = 1 / 10
"""Of what a part of the target encloses: the largest circle within a hole. A hole with a smaller one, such as an eye
or a letter, is a mark."""
LEAST_SHARE_IN_ROOM = 3 / 4
"""Of a drawing: a hole with at least this much of it inside is not a mark."""
SAME_SIZE_RATIO = 1.25
"""Of the larger to the smaller width and height of two holes that are marks of a kind."""
HAIRLINE_SHARE = 1e-3
"""Of the diagonal of a target: a line of this width along an outline is hardly seen."""
CLEAR_TEXELS = 8
"""Between a tone and the texture's edge: more than the reach of filters at the texture's own resolution."""
EXAMINED_PIXELS = 256
"""Of the longer side of the copy in which rim and silhouette are examined."""
LUMINANCE_WEIGHTS = (0.2126, 0.7152, 0.0722)  # of red, green and blue in linear light (IEC 61966-2-1)


class Backdrop(NamedTuple):
    """What is seen below a drawing, as colours (c,) in the stored encoding of a texture, from 0 to 1.

    Attributes:
        paper: the colour of the paper.
        tone: the colour of what the target paints, on the paper; None if it has the paper's colour.
    """

    paper: Float
    tone: Float | None = None


def on_paper(texture: Texture, painted: Sequence[Complex] = (), *, toned: bool = False) -> Texture:
    """Return a texture with paper where it is transparent: everywhere, or in what an area encloses.

    The paper is tinted with the drawing's mean colour: light, but not white, or almost black where the drawing itself
    is nearly white. Colours are mixed in the stored encoding, as drawing programs do.

    Parameters
    ----------
    texture
        Grey or RGB colours with an alpha channel; a texture without alpha is returned as it is.
    painted
        Closed outlines of an area that is a tone on the paper, in the texture's plane: those of parts
        counter-clockwise, those of holes clockwise. Paper lies in its holes only. The texture is extended so that it
        contains the area.
    toned
        Whether the paper is the lighter one that a tone lies on, also where the tone itself is painted later.

    Examples
    --------
    >>> pixels = np.zeros((2, 3, 4), np.uint8)
    >>> pixels[:, 0] = 200, 0, 0, 255
    >>> on_paper(Texture(pixels, (0, 3 + 2j), alpha=3)).pixels[0].tolist()
    [[200, 0, 0, 255], [247, 217, 217, 255], [247, 217, 217, 255]]
    """
    if texture.alpha < 0:
        return texture
    ground = ground_of(texture, toned=toned or bool(painted))
    has_tone = bool(painted) and ground.tone is not None
    if has_tone:
        texture = _extended(texture, bounding_box(np.concatenate(painted)))
    pixels = texture.pixels
    values = decode(pixels, texture.alpha, srgb=False, associated=texture.associated, premultiply=True)
    bare = 1 - values[..., texture.alpha]
    tone_share: Float = np.zeros(bare.shape, np.float32)
    if has_tone:
        tone_share, enclosed = (_share_of(rings, texture) for rings in (painted, without_holes(painted)))
        bare *= enclosed
        tone_share = np.divide(tone_share, enclosed, out=np.zeros_like(tone_share), where=enclosed > 0)
    colours = [k for k in range(pixels.shape[2]) if k != texture.alpha]
    for number, k in enumerate(colours):
        paper = ground.paper[number]
        tone = paper if ground.tone is None else ground.tone[number]
        values[..., k] += bare * (paper + tone_share * (tone - paper))
    values[..., texture.alpha] += bare
    return replace(
        texture, pixels=encode(values, pixels.dtype, texture.alpha, srgb=False, associated=texture.associated)
    )


def _extended(texture: Texture, box: tuple[complex, complex]) -> Texture:
    """Return a texture with transparent texels around it, so that it contains a box with CLEAR_TEXELS around.

    What lies at the texture's edge would be continued beyond it.
    """
    height, width = texture.pixels.shape[:2]
    low, high = texture.box
    step = complex((high - low).real / width, (high - low).imag / height)
    below, above = low - box[0], box[1] - high
    left, bottom, right, top = (
        max(0, int(np.ceil(extent)) + CLEAR_TEXELS)
        for extent in (
            below.real / step.real,
            below.imag / step.imag,
            above.real / step.real,
            above.imag / step.imag,
        )
    )
    pixels = np.pad(texture.pixels, ((top, bottom), (left, right), (0, 0)))
    corners = (
        low - complex(left * step.real, bottom * step.imag),
        high + complex(right * step.real, top * step.imag),
    )
    return replace(texture, pixels=pixels, box=corners)


def without_holes(rings: Sequence[Complex]) -> list[Complex]:
    """Return those of an area's boundaries that are counter-clockwise, around its parts, with holes filled.

    A part within a hole lies in what the outer one encloses, and is left out.
    """
    return rings_of(unite(shapely.Polygon(xy_of(ring)) for ring in rings if polygon_area(ring) > 0))


def cleared(area: shapely.Geometry, outlines: Sequence[Complex], shown: shapely.Geometry) -> list[Complex]:
    """Return the boundaries of a target's area without the part below a drawing; they enclose the drawing as well.

    Then paper is seen in the drawing's holes, such as windows and the inside of letters, and through its transparent
    parts, also where these lie across gaps of the target; and no parts of the target, which would be taken for parts of
    the drawing. Marks inside the target, such as the hands of a clock, are left out completely if the drawing lies on
    or around them: their remains would disturb.

    Args:
        area: What the target paints.
        outlines: Outer boundaries of the drawing's parts, in the target's plane.
        shown: The region in which the drawing is shown.

    Returns:
        Closed outlines: those of parts counter-clockwise, those of holes clockwise.
    """
    low, high = bounding_box(np.concatenate(rings_of(area)))
    hairline = HAIRLINE_SHARE * abs(high - low)
    polygons = [shapely.make_valid(shapely.Polygon(xy_of(outline))) for outline in outlines]
    drawing = shapely.intersection(unite(polygons), shown)
    area = _without_marks(area, drawing)
    # a hairline below the drawing's edge encloses it, and hides that no tone is there
    edge, inside = (shapely.buffer(drawing, -times * hairline) for times in (1, 2))
    return rings_of(shapely.difference(shapely.union(area, edge), inside))


def _without_marks(area: shapely.Geometry, drawing: shapely.Geometry) -> shapely.Geometry:
    """Return an area without the parts within it, and without the holes, that the convex hull of a drawing meets.

    What belongs together goes together, as the dots of a die or two headlights: parts within the same outline, and
    holes of the same size. A large hole, and one with most of the drawing in it, is a room in which the drawing is
    seen, and stays.
    """
    hull = shapely.convex_hull(drawing)
    parts = polygons_of(area)
    outer = shapely.polygons(shapely.get_exterior_ring(parts))
    inner_part, outer_part = shapely.STRtree(outer).query(parts, predicate="within")
    is_another = inner_part != outer_part
    inner_part, outer_part = inner_part[is_another], outer_part[is_another]
    marked = outer_part[
        shapely.intersects(hull, parts[inner_part])
    ]  # outlines around parts that the hull meets
    kept = []
    for part in np.delete(parts, inner_part[np.isin(outer_part, marked)]):
        holes = np.array([shapely.Polygon(ring) for ring in part.interiors], dtype=object)
        enclosed = shapely.area(shapely.Polygon(part.exterior))
        is_met = shapely.intersects(hull, holes)
        is_mark = is_met.copy()
        for number in np.flatnonzero(is_met):
            is_mark[number] = not _is_room(shapely.difference(holes[number], area), drawing, enclosed)
        ratios = _sizes(holes)[:, None] / _sizes(holes[is_mark])
        is_alike = np.any(np.all(np.maximum(ratios, 1 / ratios) <= SAME_SIZE_RATIO, axis=2), axis=1)
        is_left_out = is_mark | (is_alike & ~is_met)
        kept.append(shapely.Polygon(part.exterior, [hole.exterior for hole in holes[~is_left_out]]))
    return unite(kept)


def _is_room(gap: shapely.Geometry, drawing: shapely.Geometry, enclosed: float) -> bool:
    """Return whether a drawing is seen in a gap within a part that encloses an area; else the gap is a mark."""
    if shapely.intersection(gap, drawing).area >= LEAST_SHARE_IN_ROOM * drawing.area:
        return True
    least = LEAST_ROOM_SHARE * enclosed
    return gap.area >= least and not shapely.is_empty(shapely.buffer(gap, -np.sqrt(least / np.pi)))


def _sizes(polygons: Polygons) -> Real:
    """Return widths and heights (n, 2) of polygons."""
    bounds = shapely.bounds(polygons).reshape(-1, 4)
    return bounds[:, 2:] - bounds[:, :2]


def _share_of(painted: Sequence[Complex], texture: Texture) -> Float:
    """Return the share (h, w) of each texel that lies in an area."""
    height, width = texture.pixels.shape[:2]
    return painted_share(painted, Canvas(width, height, texture.box))


def ground_of(texture: Texture, *, toned: bool = False) -> Backdrop:
    """Return the colours below a texture with alpha; with `toned`, paper and a tone on it if there may be one."""
    values = decode(
        texture.pixels, texture.alpha, srgb=False, associated=texture.associated, premultiply=True
    )
    painted = max(float(values[..., texture.alpha].sum()), 1.0)
    colours = [k for k in range(values.shape[2]) if k != texture.alpha]
    step = max(1, max(values.shape[:2]) // EXAMINED_PIXELS)
    few = values[::step, ::step]
    rim = flat_rim(few, texture.alpha)
    if rim is not None:
        return Backdrop(rim)  # what the picture lies on, and not paper
    mean = np.array([values[..., k].sum(dtype=np.float64) for k in colours]) / painted
    share = _share_of_ink(mean, texture.transfer == "srgb")
    paper = None if share is None else _mixed(mean, share)
    dark = (INK_SHARE * mean).astype(np.float32)
    if paper is not None:
        from scipy import ndimage  # slow to import

        alpha = few[..., texture.alpha]
        is_painted = alpha > 0.9
        silhouette = few[is_painted & ~ndimage.binary_erosion(is_painted)][:, colours]
        unseen, unseen_on_dark = (_hardly_seen_share(silhouette, ground) for ground in (paper, dark))
        if unseen > HARDLY_SEEN_SHARE and unseen_on_dark < unseen:
            paper = None
    if paper is None:
        return Backdrop(dark, (DARK_TONE_SHARE * mean).astype(np.float32) if toned else None)
    if not toned or share is None:
        return Backdrop(paper)
    return Backdrop(
        _mixed(mean, share - GAP_PAPER_SHARE), _tone(mean, silhouette, texture.transfer == "srgb")
    )


def _tone(mean: Real, silhouette: Float, is_srgb: bool) -> Float:
    """Return the tone (c,) for a drawing with a mean colour (c,) and colours (n, c) along its silhouette."""
    darker = np.linspace(1, 0, INK_SHARES_TRIED)[:, None] * mean
    ink = darker[np.argmax(_contrast_with_white(darker, is_srgb) >= INK_CONTRAST_RATIO)]
    shares = np.linspace(0, 1, INK_SHARES_TRIED)
    colours = shares[:, None] * ink + (1 - shares[:, None])
    contrasts = _contrast_with_white(colours, is_srgb)
    tones = [colours[np.argmax(contrasts >= ratio)].astype(np.float32) for ratio in TONE_CONTRAST_RATIOS]
    unseen = [_hardly_seen_share(silhouette, tone, SEEN_ON_TONE_DIFFERENCE) for tone in tones]
    well_seen = (tone for tone, share in zip(tones, unseen) if share <= UNSEEN_ON_TONE_SHARE)
    return next(well_seen, tones[int(np.argmin(unseen))])


def _mixed(mean: Float | Real, share: float) -> Float:
    """Return white with a share of a colour (c,)."""
    return (share * mean + (1 - share)).astype(np.float32)


def _hardly_seen_share(
    colours: Float, ground: Float, least_difference: float = HARDLY_SEEN_DIFFERENCE
) -> float:
    """Return the share of colours (n, c) whose largest difference from a ground (c,) is less than a difference."""
    if not len(colours):
        return 0.0
    return float((np.abs(colours - ground).max(axis=1) < least_difference).mean())


def flat_rim(values: Float, alpha: int) -> Float | None:
    """Return the colour (c,) of the rim of a picture that fills its box, if it has only one; else None.

    Parameters
    ----------
    values
        (h, w, c) colours with alpha, from 0 to 1.
    alpha
        Index of the alpha channel.
    """
    is_painted = values[..., alpha] > 0.9
    rows, columns = (np.flatnonzero(is_painted.any(axis=axis)) for axis in (1, 0))
    if not rows.size:
        return None
    box = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    if is_painted[box].mean() < FULL_BOX_SHARE:
        return None
    from scipy import ndimage  # slow to import

    width = 1 + round(RIM_WIDTH_SHARE * min(is_painted[box].shape))
    outer = ndimage.binary_erosion(np.pad(is_painted[box], 1))[1:-1, 1:-1]  # without antialiased pixels
    rim = values[box][outer & ~ndimage.binary_erosion(outer, iterations=width)]
    rim = np.delete(rim, alpha, axis=1)
    if not len(rim):
        return None
    colour = np.median(rim, axis=0)
    ground = np.abs(np.delete(values[box], alpha, axis=2) - colour).max(axis=2) <= FLAT_DIFFERENCE
    is_flat = (np.abs(rim - colour).max(axis=1) <= FLAT_DIFFERENCE).mean() >= FLAT_RIM_SHARE
    is_ground = LEAST_GROUND_SHARE <= ground[outer].mean() <= MOST_GROUND_SHARE
    return colour.astype(np.float32) if is_flat and is_ground else None


def _share_of_ink(mean: Float | Real, is_srgb: bool) -> float | None:
    """Return the share of ink in the light paper for a drawing with a mean colour (c,); None if paper is dark."""
    contrast = _contrast_with_white(mean[None], is_srgb)[0]
    if contrast < LEAST_CONTRAST_RATIO:
        return None
    shares = np.linspace(INK_SHARE, 1, INK_SHARES_TRIED)
    papers = shares[:, None] * mean + (1 - shares[:, None])
    contrast_goal = min(PAPER_CONTRAST_RATIO, np.sqrt(contrast))
    return float(shares[np.argmax(_contrast_with_white(papers, is_srgb) >= contrast_goal)])


def _contrast_with_white(colours: Float | Real, is_srgb: bool) -> Float:
    """Return the contrast ratios (n,) of colours (n, c) with white (WCAG 2.2)."""
    light = decode(colours[None].astype(np.float32), -1, srgb=is_srgb, associated=False, premultiply=False)
    count = colours.shape[1]
    weights = np.array(LUMINANCE_WEIGHTS) if count == 3 else np.full(count, 1 / count)
    return 1.05 / (light[0] @ weights + 0.05)
