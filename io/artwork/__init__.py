"""SVG drawings carried through a map as SVG: every shape becomes a path of Béziers, styles stay.

What has no path follows the map as well as its kind allows: line widths and dashes its mean scale along the line,
gradients, patterns and filters its affine part. Of what lies outside the source shape nothing is left.

document      the drawing written anew, without transforms and `use`
element       one shape, and the elements that it becomes
mapping       paths carried through a map and refitted
regions       the domains of maps
affine_part   the map over some shapes as an affine map
clip          runs cut at the domain's boundary
paint_server  gradients, patterns and markers
embedded      pictures that are embedded, resampled
filters       filters, by the map's affine part
attributes    attributes and styles that stay
references    references, kept within the drawing
rendering     drawings as pictures
rasterize     resvg, in a separate process
"""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from ...arrays import Complex
from ...errors import InputError, naming
from ...maps.approximation import AnyMap
from ..shapes.shape import Shape
from ..svg.document import SUFFIXES, drawing_bytes
from . import attributes
from .document import MappedDocument
from .mapping import PathMapping

TOLERANCE = 2e-4  # of the target's diagonal


def check(source: Shape, target: Shape, copies: int = 1) -> None:
    """Refuses, before a map is solved for, a drawing that `carry` would refuse; `copies` is how often it is carried.

    Raises:
        InputError: the source is not an SVG file, it is malformed, or more than can be carried.
    """
    _document(source, target, copies)


def carry(
    source: Shape,
    map: AnyMap,
    target: Shape,
    path: str | Path,
    *,
    tolerance: float | None = None,
) -> tuple[str, ...]:
    """Write the drawing that the source shape was read from, carried to the target.

    Args:
        source: a shape from an SVG file; all that the file draws inside of it is carried, not only the outline.
        map: source → target, core plane.
        target: its canvas becomes the drawing's.
        path: the SVG file to write.
        tolerance: of the paths, in the target's units; TOLERANCE of the target's diagonal by default.

    Returns:
        A note for each kind of thing that was cut off, left out or approximated, with how often.

    Raises:
        InputError: the source is not an SVG file, or it is malformed.
    """
    return carry_parts([(source, map)], target, path, tolerance=tolerance)


def carry_parts(
    parts: Sequence[tuple[Shape, AnyMap]],
    target: Shape,
    path: str | Path,
    *,
    each: bool = False,
    tolerance: float | None = None,
    painted: Sequence[Complex] = (),
    opacity: float = 0.0,
) -> tuple[str, ...]:
    """Return the same of a drawing of which several shapes were read, each with its own map.

    `painted` are the rings of what the target paints, if not all is to be shown, filled by the even-odd rule; what lies
    outside of them is seen with an `opacity`.

    What lies in one of them goes with its map, the smallest if there are several; what reaches over more goes with each
    of them, cut off at their outlines. With `each` the whole drawing goes with each map, in a separate group.
    """
    drawing = _document(parts[0][0], target, len(parts) if each else 1)
    mapping = PathMapping(parts, tolerance or TOLERANCE * target.curve.diagonal)
    mapping.carry(drawing.elements, drawing.effects)
    mapping.carry_pictures(drawing.pictures)
    if painted:
        drawing.cut_by(painted, opacity)
    drawing.finish()
    for prefix, name in attributes.SPACES.items():
        ElementTree.register_namespace(prefix, name)
    ElementTree.ElementTree(drawing.out).write(path, encoding="utf-8", xml_declaration=True)
    notes = (drawing.notes + mapping.notes).items()
    return tuple(f"{number} × {what}" for what, number in sorted(notes))


def _document(source: Shape, target: Shape, copies: int) -> MappedDocument:
    if source.path.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"{source.path}: artwork (.svg) can only be made from an SVG file; use a picture's suffix for -o"
        )
    with naming(source.path):
        return MappedDocument.of(drawing_bytes(source.path), source, target, copies)
