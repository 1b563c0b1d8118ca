"""Transfer SVG drawings through a map as SVG: every shape becomes a path of Bézier curves, styles are kept.

Anything that is not a path follows the map as well as its kind allows: line widths and dashes by the mean scale along
the line; gradients, patterns and filters by the map's affine part. Everything outside the source shape is removed.

document      the new drawing, without transforms and `use`
element       one shape, and the elements that it becomes
mapping       paths mapped and refitted
regions       the domains of maps
affine_part   affine approximation of the map over some shapes
clip          subpaths cut at the domain's boundary
paint_server  gradients, patterns and markers
tiles         patterns as their tiles
unused_ids    drawings shown with another one in the same document
embedded      embedded pictures, resampled
filters       filters, by the map's affine part
attributes    attributes and styles that are kept
references    references, restricted to the drawing itself
rendering     drawings rendered as pictures
dxf           DXF drawings
new_dxf       lines of other drawings as DXF
dxf_as_svg    DXF drawings as SVG
animation     frames joined into an animated SVG
lottie        frames joined into a Lottie animation
rasterize     resvg, in a separate process
areas         drawings of a few areas of flat colours: frames of a morph in which parts and holes grow and shrink
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from ...arrays import Complex
from ...errors import InputError, naming
from ...maps.approximation import AnyMap
from ...maps.bezier_fit import refit, refit_together
from ...pixels.paper import without_holes
from .. import formats
from ..outlines import lettering
from ..shapes.shape import Shape, without_box
from ..spec import Spec
from ..svg.document import SUFFIXES, drawing_bytes
from .document import MappedDocument
from .mapping import PathMapping
from .unused_ids import with_unused_ids

TOLERANCE_SHARE = 2e-4  # of the target's diagonal
BEND_SAMPLES = 400  # points along an outline
BEND_SIZE_SHARE = 1e-3
"""Deviation of a map from an affine one, relative to the target's size, from which on patterns are drawn as tiles."""


class PreparedDrawing:
    """A drawing that is read before a map is solved for, which shows whether it can be transferred.

    It is used up by the first frame that asks for the same.

    Args:
        source: the shape that was read from the drawing.
        target: the shape whose canvas becomes the drawing's.
        copies: number of times that the drawing is transferred.
        alone: whether no other drawing lies in the same document.

    Raises:
        InputError: the source is neither an SVG file nor a text in a font, is malformed, or exceeds a limit.
    """

    def __init__(self, source: Shape, target: Shape, copies: int = 1, *, alone: bool = True):
        self._request = _request(source, target, copies, alone)
        self._document: MappedDocument | None = _document(source, target, copies, alone=alone)

    def take(
        self, source: Shape, target: Shape, copies: int, *, bends: bool, alone: bool
    ) -> MappedDocument | None:
        """Return the document if it is what these arguments of `MappedDocument.of` ask for, and was not taken yet."""
        document = self._document
        if document is None or self._request != _request(source, target, copies, alone):
            return None
        if document.depends_on_bends and not bends:  # it was prepared for any map
            return None
        self._document = None
        return document


def _request(source: Shape, target: Shape, copies: int, alone: bool) -> tuple[object, ...]:
    """Return everything that a document depends on, besides whether the map bends."""
    return source.path, source.spec, target.box, target.millimetres, target.unit, copies, alone


def carry(
    source: Shape,
    map: AnyMap,
    target: Shape,
    path: str | Path,
    *,
    tolerance: float | None = None,
) -> tuple[str, ...]:
    """Write the drawing from which the source shape was read, mapped to the target.

    Args:
        source: a shape from an SVG file, or a text in a font; everything that the file draws inside it is transferred,
            not only the outline.
        map: source → target, core plane.
        target: its canvas becomes the drawing's.
        path: the SVG file to write.
        tolerance: of the paths, in the target's units; by default TOLERANCE_SHARE times the target's diagonal.

    Returns:
        A note, with a count, for each kind of content that was clipped, omitted or approximated.

    Raises:
        InputError: the source is neither an SVG file nor a text in a font, or it is malformed.
    """
    return carry_parts([(source, map)], target, path, tolerance=tolerance)


def carry_parts(
    parts: Sequence[tuple[Shape, AnyMap]],
    target: Shape,
    path: str | Path,
    *,
    repeated: bool = False,
    tolerance: float | None = None,
    painted: Sequence[Complex] = (),
    opacity: float = 0.0,
) -> tuple[str, ...]:
    """Write a drawing from which several shapes were read, each with its own map; see `carry`.

    Content inside one of the shapes follows that shape's map, the smallest shape if there are several. Content that
    extends over several follows each of their maps, clipped at their outlines.

    Args:
        parts: the shapes, each with its map.
        target, path, tolerance: as for `carry`.
        repeated: whether to map the whole drawing by each map, in a separate group.
        painted: rings of the target's painted area, filled by the even-odd rule, if not everything is to be shown.
        opacity: of content outside the painted area.
    """
    frame = ArtworkFrame(parts, target, path, painted, opacity)
    return carry_frames([frame], repeated=repeated, tolerance=tolerance)[0]


class ArtworkFrame(NamedTuple):
    """A drawing to be written by `carry_frames`; see `carry_parts`.

    Attributes:
        paper: the colour behind it, if any.
        tone: the colour of an area on the paper, if any.
        toned: the rings of this area, filled by the even-odd rule.
        faded: rings outside of which drawing and paper are seen with an opacity; empty: nowhere.
        faded_opacity: this opacity.
        background: what is seen behind everything, in the target's units, if anything.
    """

    parts: Sequence[tuple[Shape, AnyMap]]
    target: Shape
    path: str | Path
    painted: Sequence[Complex] = ()
    opacity: float = 0.0
    paper: str = ""
    tone: str = ""
    toned: Sequence[Complex] = ()
    faded: Sequence[Complex] = ()
    faded_opacity: float = 1.0
    background: Element | None = None


def carry_frames(
    frames: Sequence[ArtworkFrame],
    *,
    repeated: bool = False,
    tolerance: float | None = None,
    prepared_drawing: PreparedDrawing | None = None,
) -> tuple[tuple[str, ...], bool]:
    """Write frames of the same drawing, whose paths have the same commands in each frame; see `carry_parts`.

    Args:
        frames: with the same source shapes, mapped by different maps of the same domains.
        repeated, tolerance: as for `carry_parts`; the tolerance is by default that of the smallest target.
        prepared_drawing: the drawing, if it has been read before.

    Returns:
        Notes, each once, and whether a frame shows nothing of the drawing.
    """
    tolerance = tolerance or TOLERANCE_SHARE * min(frame.target.curve.diagonal for frame in frames)
    bends = any(_bends(source, map) for frame in frames for source, map in frame.parts)
    drawings = []
    for frame in frames:
        copies = len(frame.parts) if repeated else 1
        alone = frame.background is None
        source, target = frame.parts[0][0], frame.target
        drawing = None
        if prepared_drawing is not None:
            drawing = prepared_drawing.take(source, target, copies, bends=bends, alone=alone)
        drawings.append(drawing or _document(source, target, copies, bends=bends, alone=alone))
    mappings = [PathMapping(frame.parts, tolerance, curves=len(frames) > 1) for frame in frames]
    prepared = [mapping.prepare(drawing.elements) for mapping, drawing in zip(mappings, drawings)]
    counts = {len(prepared_shapes.owners) for prepared_shapes in prepared}
    if len(counts) == 1:
        fitted = refit_together(
            [prepared_shapes.image for prepared_shapes in prepared], counts.pop(), tolerance
        )
    else:  # clipped differently, since accuracy limits differ
        fitted = [
            refit(prepared_shapes.image, len(prepared_shapes.owners), tolerance)
            for prepared_shapes in prepared
        ]
    notes: dict[str, int] = {}
    is_empty = False
    for frame, drawing, mapping, prepared_shapes, cubics in zip(frames, drawings, mappings, prepared, fitted):
        mapping.write(prepared_shapes, cubics, drawing.effects)
        mapping.carry_pictures(drawing.pictures)
        has_pictures = any(len(picture.out) for picture in drawing.pictures)
        is_empty = is_empty or not (len(prepared_shapes.owners) or has_pictures)
        if frame.painted:
            enclosed = without_holes(frame.toned) if frame.tone else frame.painted
            grounds = [(frame.paper, enclosed), (frame.tone, frame.toned)]
            drawing.cut_by(frame.painted, frame.opacity, [ground for ground in grounds if ground[0]])
        if frame.faded:
            drawing.cut_by(frame.faded, frame.faded_opacity)
        drawing.finish()
        if frame.background is not None:
            drawing.out.insert(0, with_unused_ids(frame.background, drawing.out))
        ElementTree.ElementTree(drawing.out).write(frame.path, encoding="utf-8", xml_declaration=True)
        notes |= dict(drawing.notes + mapping.notes)
    return tuple(f"{number} × {note}" for note, number in sorted(notes.items())), is_empty


def is_drawn(path: Path) -> bool:
    """Return whether a file has paths that can become artwork: an SVG, a DXF, or a font in which a text is set."""
    return formats.suffix_of(path) in (*SUFFIXES, *formats.FONTS, ".dxf")


def _bends(source: Shape, map: AnyMap) -> bool:
    """Return whether a map differs visibly from an affine one along the outline of its source."""
    z = source.curve.at(np.linspace(0, source.curve.length, BEND_SAMPLES, endpoint=False))
    w = np.asarray(map(z))
    columns = np.stack([z, z.conj(), np.ones_like(z)], axis=1)
    affine = np.linalg.lstsq(columns, w, rcond=None)[0]
    return bool(np.abs(w - columns @ affine).max() > BEND_SIZE_SHARE * np.abs(w - w.mean()).max())


def svg_data(shape: Shape) -> bytes:
    """Return the drawing that a shape was read from as an SVG file: an SVG or DXF file, or a text in a font.

    Raises:
        InputError: the file is not one of these, or cannot be read.
    """
    suffix = formats.suffix_of(shape.path)
    if suffix == ".dxf":
        from .dxf_as_svg import svg_of

        return svg_of(shape.path)
    if suffix in formats.FONTS:
        return lettering.svg(shape.path, without_box(shape.path, Spec.of(shape.spec).selection or ""))
    return drawing_bytes(shape.path)


def _document(
    source: Shape, target: Shape, copies: int, *, bends: bool = True, alone: bool = True
) -> MappedDocument:
    if not is_drawn(source.path):
        raise InputError(
            f"{source.path}: artwork (.svg) can only be made from an SVG or DXF file or a text in a font; use a "
            "picture's suffix for -o"
        )
    data = svg_data(source)
    with naming(source.path):
        return MappedDocument.of(data, target, copies, bends=bends, alone=alone)
