"""Scans and photographs: find what stands out from paper or a table under uneven light, and clean it for tracing.

The background is modelled as a surface of second degree, fitted to the border of the picture and everything like it;
for the inside of lines, as the local mean. Gaps of a line are closed by the smallest disk for which it encloses more
area than its own.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ...errors import InputError
from ...pixels.raster import Float, blurred, depths, nearest, pieces, resized_by_area

LONGER_SIDE_PIXELS = 2048  # of the picture that is analysed, which bounds the time
BLOCKS_ACROSS = 48
"""Blocks along the longer side, to whose medians the background is fitted: shadows are wider, and drawings
narrower, than a few blocks."""
LEAST_DIFFERENCE = 1e-3
"""Share of the range of colours; smaller differences from the background are ignored: a quarter of a step of 8 bits."""
BORDER_DRAWS = 500
"""Random samples of border blocks: if 70 % are paper, 1 in 70 samples has 12 blocks of paper."""
NOISE_DEVIATIONS = 3  # times the variation of the background: smaller differences do not stand out
SPECK_SIDE_SHARE = 1 / 200  # of the longer side: pieces smaller than this in both directions are noise
GAP_SIDE_SHARE = 1 / 32
"""Of the longer side: radius of the largest disk that closes gaps: wider ones are taken for openings."""
BACKGROUND_SHARE = 0.9
"""Of a picture's border: with less background, objects are cut off there, as in most photographs. Coins on a table
leave 92 %, a portrait outdoors 81 %."""
PAPER_SHARE = 0.7  # the same for a line drawing, next to which a table may be visible
LARGEST_HUE_SPREAD = 0.1
"""Difference, over a background, of a channel's share in the sum of all channels (5 to 95 % of the pixels). Light and
shadow change brightness: a noisy table with a shadow has .01. A flower before leaves out of focus has .3: a scene."""
DARKEST_SUM = 0.02  # of the channels: shares of less light are noise
SCATTERED_PIECES = 50  # pieces (limits.PIECES are traced); a page of text or a starry sky has hundreds
FAINTEST_SHARE = 0.1  # of a plain background's difference: half of a line's pixels stand out by more
LINE_AREA_SHARE = 0.2  # of the enclosed area: ink that covers less is a line around it


class Photograph(InputError):
    """A picture in which nothing stands out from a background, so that all of it is shown."""


def field_of(colours: Float, trace: str, *, photographs: bool = False) -> tuple[Float, float, bool]:
    """Return the coverage of each pixel of a picture, possibly reduced in size, by the object in it.

    Args:
        colours: (h, w, c) between 0 and 1.
        trace: "dark" or "light": everything darker or lighter than its background. "auto": everything different from
            it, or the inside of a line. "inside": the area that a line encloses, including the line.
        photographs: whether to refuse pictures whose border is not a background under uneven light, whose background
            has several hues, or that consist of many small pieces.

    Returns:
        (h', w') coverages from 0 to 1, the width of their pixels in pixels of the picture, and whether they are of the
        inside of a line.

    Raises:
        Photograph: with `photographs`, if there is no background.
        InputError: nothing stands out, or no line encloses anything.
    """
    small, by = _shrunk(colours)
    inside = trace == "inside"
    ground, noise = _around(small) if inside else _surface(small)
    away = ground - small
    if trace == "inside":  # of dark lines, or light ones
        trace = "dark" if float((away**3).sum()) > 0 else "light"
    away = {"auto": np.abs(away), "dark": away, "light": -away}[trace]
    distance = np.clip(away.max(axis=2), 0, None)
    usual = np.median(distance[distance > 0.25 * distance.max()])
    if usual / 2 <= NOISE_DEVIATIONS * noise:
        raise InputError("no shape stands out from the background; cut the shape out, or trace it by hand")
    mask = distance >= usual / 2
    inside = inside or (trace == "auto" and is_line(mask))
    is_background = is_on_background(mask, PAPER_SHARE if inside else BACKGROUND_SHARE)
    if photographs and not (is_background and _has_one_hue(small[~mask])):
        raise Photograph(
            "there is no plain background from which a shape stands out; cut the shape out, "
            "or trace it by hand"
        )
    mask = inside_of(mask) if inside else _without_specks(mask)
    return smooth(mask), by, inside


def _shrunk(colours: Float) -> tuple[Float, float]:
    """Reduce a picture to at most LONGER_SIDE_PIXELS pixels per side, slightly blurred; return it and the scale."""
    height, width = colours.shape[:2]
    by = max(1.0, max(height, width) / LONGER_SIDE_PIXELS)
    size = max(1, round(width / by)), max(1, round(height / by))
    return blurred(resized_by_area(colours, size), 1), width / size[0]


def is_on_background(mask: NDArray[np.bool_], share: float) -> bool:
    """Return whether a mask leaves this share of the border free, and does not consist of many pieces."""
    return float(np.mean(border_of(mask))) <= 1 - share and not is_scattered(mask)


def _has_one_hue(colours: Float) -> bool:
    """Return whether colours (n, c) differ in brightness only, as one surface does in uneven light."""
    shares = colours / np.maximum(colours.sum(axis=1, keepdims=True), DARKEST_SUM)
    low, high = np.quantile(shares, [0.05, 0.95], axis=0)
    return bool((high - low).max() <= LARGEST_HUE_SPREAD)


def is_scattered(mask: NDArray[np.bool_]) -> bool:
    """Return whether a mask has so many pieces that they are a texture, like gravel or stars, and not a shape."""
    return pieces(_without_specks(mask), diagonally=True).count >= SCATTERED_PIECES


def border_of(picture: NDArray) -> NDArray:
    """Return the pixels on the four sides of a picture (h, w, …)."""
    return np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])


def smooth(mask: NDArray[np.bool_]) -> Float:
    """Return a mask as coverages, smoothed to avoid a staircase along its outline."""
    return blurred(mask, 1)


def is_line(mask: NDArray[np.bool_]) -> bool:
    """Return whether a mask, with gaps closed, is a line around an area much larger than its own."""
    ink = _without_specks(mask)
    for radius in (0, *_radii(mask)):
        filled = _largest(_closed(ink, radius, fill=True))
        if np.count_nonzero(_closed(ink, radius) & filled) < LINE_AREA_SHARE * np.count_nonzero(filled):
            return True
    return False


def thin_line(colours: Float, ink: Float | None = None) -> tuple[Float, float] | None:
    """Find a pencil line around something, on paper of any brightness.

    A line is darker (or lighter) than both sides of it at a distance of up to twice the widest gap that is closed; the
    edge of a shadow or of another sheet is not.

    Args:
        colours: (h, w, c) between 0 and 1.
        ink: (h, w) how much each pixel stands out from a plain background, if there is one. It shows that a gap between
            two shapes is not a line.

    Returns:
        (h', w') coverages of the inside of the line, and the width of their pixels in pixels of the picture; None if
        there is no such line.
    """
    small, by = _shrunk(colours)
    around = 2 * _radii(small[..., 0])[-1] + 1
    for hat in (ndimage.black_tophat, ndimage.white_tophat):
        away = hat(small, size=(around, around, 1)).max(axis=2)
        strong = away[away > 0.25 * away.max()]
        if not strong.size or np.median(strong) / 2 <= NOISE_DEVIATIONS * np.median(away):
            continue
        usual = np.median(strong)
        line = away >= usual / 2
        if ink is not None and np.median(_resized(ink, line.shape)[line]) < FAINTEST_SHARE:
            continue
        if is_on_background(line, PAPER_SHARE) and is_line(
            line
        ):  # in this order, since the second test takes ten times as long
            return smooth(inside_of(line)), by
    return None


def _resized(field: Float, shape: tuple[int, ...]) -> Float:
    """Reduce values (h, w) to the resolution of a raster of the given shape."""
    return field if field.shape == shape else resized_by_area(field, (shape[1], shape[0]))


def inside_of(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the area that lines enclose, including the lines and all other ink; gaps are closed as little as needed.

    Raises:
        InputError: the lines enclose nothing.
    """
    ink = _without_specks(mask)
    for radius in (0, *_radii(mask)):
        filled = _closed(ink, radius, fill=True)
        if filled.sum() > 2 * ink.sum():
            return filled | ink
    raise InputError(
        f"no line in the picture encloses an area, even after gaps of up to {2 * _radii(mask)[-1]} pixels "
        "are closed; close the line, or use --trace dark"
    )


def _radii(mask: NDArray) -> list[int]:
    """Return the radii of disks that close gaps, each twice the one before."""
    most = max(1, round(GAP_SIDE_SHARE * max(mask.shape)))
    return [*(1 << k for k in range(most.bit_length() - 1)), most]


def _closed(mask: NDArray[np.bool_], radius: int, *, fill: bool = False) -> NDArray[np.bool_]:
    """Close gaps of a mask up to twice the radius wide; with `fill`, also fill the remaining holes."""
    wide = nearest(np.pad(mask, radius + 1)).distances <= radius
    if fill:
        free = pieces(~wide, diagonally=False).labels
        wide = free != free[0, 0]
    return (depths(wide) > radius)[radius + 1 : -radius - 1, radius + 1 : -radius - 1]


def _largest(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the piece of a mask with the largest bounding box."""
    connected = pieces(mask, diagonally=True)
    if not connected.count:
        return mask
    return connected.labels == 1 + int(connected.extents.prod(axis=1).argmax())


def _without_specks(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Remove pieces and holes that are small in both directions."""
    least = SPECK_SIDE_SHARE * max(mask.shape)
    for _ in range(2):
        connected = pieces(mask, diagonally=True)
        mask = ~connected.where(
            connected.extents.max(axis=1) > least
        )  # the complement, whose small pieces are holes
    return mask


def _around(colours: Float) -> tuple[Float, float]:
    """Return the mean of a neighbourhood much wider than lines, and the variation of the picture around it."""
    ground = blurred(colours, max(2.0, max(colours.shape) / 32))
    return ground, _spread(ground - colours)


def _surface(colours: Float) -> tuple[Float, float]:
    """Fit a surface of second degree to the background, per channel; return it and the background's variation."""
    height, width, channels = colours.shape
    step = max(1, -(-max(height, width) // BLOCKS_ACROSS))
    rows, columns = np.arange(0, height, step), np.arange(0, width, step)
    blocks = np.array(
        [[np.median(colours[i : i + step, j : j + step], axis=(0, 1)) for j in columns] for i in rows]
    ).reshape(-1, channels)
    y, x = (grid.ravel() for grid in np.meshgrid(rows / height, columns / width, indexing="ij"))
    is_background = np.minimum.reduce([x, y, x[-1] - x, y[-1] - y]) <= 0
    powers = _powers(x, y)
    fitted = _most(powers[is_background], blocks[is_background])
    for _ in range(8):
        difference = np.abs(blocks - powers @ fitted).max(axis=1)
        is_background = difference <= max(
            NOISE_DEVIATIONS * np.median(difference[is_background]), LEAST_DIFFERENCE
        )
        fitted = np.linalg.lstsq(powers[is_background], blocks[is_background], rcond=None)[0]
    down, across = np.mgrid[:height, :width]
    ground = _powers((across.ravel()) / width, down.ravel() / height) @ fitted
    ground = ground.reshape(colours.shape).astype(np.float32)
    return ground, _spread(ground - colours)


def _most(powers: NDArray, values: NDArray) -> NDArray:
    """Return the surface closest to more than half of the values: the least median of squares (Rousseeuw 1984)."""
    rng, (count, terms) = np.random.default_rng(0), powers.shape
    candidates = [np.linalg.lstsq(powers, values, rcond=None)[0]]
    for _ in range(BORDER_DRAWS):
        sample = rng.choice(count, min(count, 2 * terms), replace=False)
        candidates.append(np.linalg.lstsq(powers[sample], values[sample], rcond=None)[0])
    return min(candidates, key=lambda fitted: float(np.median(np.abs(values - powers @ fitted).max(axis=1))))


def _powers(x: NDArray, y: NDArray) -> NDArray:
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)


def _spread(away: Float) -> float:
    """Return the median deviation of border pixels from the background, for the channel where it is largest."""
    return float(np.median(np.abs(border_of(away)), axis=0).max())
