"""What a picture of a result shows of a drawing, measured in pixels: coverage, cracks, holes, and its position."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Mask = NDArray[np.bool_]

OPAQUE = 127.5  # alpha from which a pixel counts as painted
LINES_SHARE = (
    1 / 3
)  # of its silhouette; what paints less is drawn by lines, and may be taken with its inside filled
SAME_COVERAGE = 0.02  # readings of a drawing whose coverage differs by less are considered equal
CRACK_RADIUS_PIXELS, CRACK_SIDE_PIXELS = (
    3,
    512,
)  # of the closing that finds cracks, in a picture of this longer side
LEAST_PART_SHARE = 0.002  # relative to the painted area; smaller components are specks
MOST_BOXES = 40  # components, the largest first, one of which a picture may show alone
LEAST_HOLE_PIXELS = 12  # at CRACK_SIDE_PIXELS; smaller holes are not visible


@dataclass(frozen=True)
class Seen:
    """What a result shows of the target drawing.

    Attributes:
        reading: "drawn", or "filled" if the inside of a line drawing counts as painted.
        covered: share of the target's painted area that the result paints.
        cracks: area of cracks inside the target, relative to the target's painted area.
        spilled: share of the result's painted area that lies outside the target's.
        extra_holes: holes of the result inside the target that the target does not have.
    """

    reading: str
    covered: float
    cracks: float
    spilled: float
    extra_holes: int


def painted(alpha: NDArray) -> Mask:
    """Return the pixels that a picture paints."""
    return alpha > OPAQUE


def readings(target: Mask) -> dict[str, Mask]:
    """Return the painted area of a drawing: as drawn, and filled if it consists of lines only."""
    filled = ndimage.binary_fill_holes(target)
    if target.sum() >= LINES_SHARE * filled.sum():
        return {"drawn": target}
    return {"drawn": target, "filled": filled}


def seen(target: Mask, result: Mask, outside: float = 0.0) -> Seen:
    """Measure what a result shows of a target, for the reading of the target that it covers better.

    Args:
        target: painted area of the target, on the result's canvas.
        result: painted area of the result.
        outside: pixels painted by the target beyond that canvas, at the same scale; they are not covered.
    """
    shares = {
        name: float((area & result).sum() / max(area.sum() + outside, 1))
        for name, area in readings(target).items()
    }
    drawn_better = shares["drawn"] > shares.get("filled", 0) + SAME_COVERAGE
    reading = "drawn" if drawn_better or "filled" not in shares else "filled"
    area = readings(target)[reading]
    return Seen(
        reading,
        shares[reading],
        cracks(area, result) * area.sum() / max(area.sum() + outside, 1),
        float((result & ~area).sum() / max(result.sum(), 1)),
        extra_holes(area, result),
    )


def cracks(target: Mask, result: Mask) -> float:
    """Return the area that a closing of the result fills inside the target, relative to the target's painted area."""
    if not target.any():
        return 0.0
    radius = CRACK_RADIUS_PIXELS * max(target.shape) / CRACK_SIDE_PIXELS
    reach = int(np.ceil(radius))
    # distances are between pixel centres, so half a pixel is added on either side
    wide = np.pad(result, reach + 1)
    grown = ndimage.distance_transform_edt(~wide) <= radius
    closed = ndimage.distance_transform_edt(grown) > radius
    filled = closed[reach + 1 : -reach - 1, reach + 1 : -reach - 1] & ~result & target
    return float(filled.sum() / target.sum())


def shown_share(places: NDArray, visible: Mask, source: Mask) -> float:
    """Return the share of the source drawing's painted area that a picture shows.

    Args:
        places: (height, width, 2) for each pixel the place in the source that it shows: across and up, from 0 to 1.
        visible: the pixels that show something.
        source: painted area of the source on its canvas.
    """
    slopes = []
    for axis in (0, 1):
        ahead = np.roll(visible, -1, axis) & visible
        ahead[(-1, slice(None)) if axis == 0 else (slice(None), -1)] = False
        steps = np.roll(places, -1, axis) - places
        behind = np.roll(ahead, 1, axis)
        # a pixel at the edge uses the step to its only neighbour
        slopes.append(
            np.where(ahead[..., None], steps, np.where(behind[..., None], np.roll(steps, 1, axis), 0))
        )
    (down, right) = slopes
    area = np.abs(down[..., 0] * right[..., 1] - down[..., 1] * right[..., 0])
    height, width = source.shape
    column = np.clip((places[..., 0] * width).astype(int), 0, width - 1)
    row = np.clip(((1 - places[..., 1]) * height).astype(int), 0, height - 1)
    return float(area[visible & source[row, column]].sum() / max(source.mean(), 1e-9))


def parts(mask: Mask) -> int:
    """Return the number of components of a painted area, without specks."""
    labels, count = ndimage.label(mask, np.ones((3, 3)))
    sizes = ndimage.sum_labels(mask, labels, np.arange(1, count + 1))
    return int((sizes >= LEAST_PART_SHARE * mask.sum()).sum()) if count else 0


def extra_holes(target: Mask, result: Mask) -> int:
    """Return the number of enclosed holes of the result that the target paints by more than half."""
    holes = ndimage.binary_fill_holes(result) & ~result
    labels, count = ndimage.label(holes)
    if not count:
        return 0
    numbers = np.arange(1, count + 1)
    sizes = ndimage.sum_labels(holes, labels, numbers)
    inside = ndimage.sum_labels(target, labels, numbers)
    least = LEAST_HOLE_PIXELS * (max(target.shape) / CRACK_SIDE_PIXELS) ** 2
    return int(((sizes >= least) & (inside > sizes / 2)).sum())


def agreement(target: Mask, result: Mask) -> float:
    """Return how well a result matches a target, as drawn or filled: intersection over union."""
    areas = (target, ndimage.binary_fill_holes(target))
    return max(float((area & result).sum() / max((area | result).sum(), 1)) for area in areas)


def component_boxes(mask: Mask) -> list[tuple[float, float, float, float]]:
    """Return left, top, width and height of everything painted and of each component, relative to the picture's
    sides.
    """
    labels, _ = ndimage.label(mask, np.ones((3, 3)))
    slices_of_mask = [ndimage.find_objects(mask.astype(int)), ndimage.find_objects(labels)]
    high, wide = mask.shape
    boxes = [
        (x.start / wide, y.start / high, (x.stop - x.start) / wide, (y.stop - y.start) / high)
        for slices in slices_of_mask
        for y, x in slices
    ]
    return sorted(boxes, key=lambda box: -box[2] * box[3])[:MOST_BOXES]
