"""The standard shape: the mean of superimposed specimens, or one of them, placed on a canvas of pixels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Complex, Index, complex_of
from ...curve import Curve
from ...errors import InputError
from ...plane import Similarity, bounding_box
from ...procrustes import Superimposition, mean_outline, superimpose
from .. import limits
from ..run.flat_files import closed_path
from ..run.framing import size_within
from .specimens import Specimen

MARGIN_SHARE = 0.02  # of the longer side of the standard shape, on each side of the canvas
ON_OUTLINE_SHARE = 0.02
"""Distance from the outline, relative to the diagonal, up to which a landmark lies on it in the median of specimens:
those placed by hand on the margin of wings miss it by 0.5 % at most, and those inside by at least 4 %."""
FAR_FROM_OUTLINE_SHARE = 0.1
"""Distance at which a landmark that lies on the outline of other specimens must be wrong."""
TOLERANCE_SHARE = 0.01
"""Distance by which landmarks inside may miss their places, relative to the root of the standard shape's area. With
0.003 drawn wings are as well aligned, with 0.03 half as well."""

Pin = tuple[tuple[float, float], tuple[float, float], dict[str, float]]


@dataclass(frozen=True, eq=False)
class Standard:
    """The standard shape and how specimens correspond to it.

    Attributes:
        specimens: those that can be mapped.
        superimposition: of their landmarks.
        outline: the outline, in pixels of the canvas, y up from its lower edge.
        landmarks: (k,) the landmarks in the same plane.
        anchors: indices of the landmarks on the outline, in their order along it.
        pinned: indices of the landmarks that are pins: those on the outline and inside it.
        size: width and height of the canvas in pixels.
    """

    specimens: list[Specimen]
    superimposition: Superimposition
    outline: Complex
    landmarks: Complex
    anchors: Index
    pinned: Index
    size: tuple[int, int]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the landmarks."""
        return self.specimens[0].names

    def pins(self, specimen: Specimen) -> list[Pin]:
        """Return the landmarks of a specimen as pins, in the units of its file and of the standard shape's.

        Landmarks on the outline are met exactly. Around those inside, a patch moves with the landmark: if only the
        point moved, the picture beside it would stay where it is.
        """
        tolerance = TOLERANCE_SHARE * float(np.sqrt(abs(Curve(self.outline).area)))
        z = specimen.landmarks.copy()
        z[self.anchors] = specimen.curve.nearest(z[self.anchors])
        places = specimen.shape.to_file(z).tolist()
        pins = list[Pin]()
        for k in self.pinned.tolist():
            settings = {"radius": 0.0} if k in self.anchors else {"tolerance": tolerance}
            pins.append((tuple(places[k]), self.to_file(complex(self.landmarks[k])), settings))
        return pins

    def to_file(self, z: complex) -> tuple[float, float]:
        """Convert a point to the file's units: pixels to the right and down."""
        return z.real, self.size[1] - z.imag

    def svg(self) -> str:
        """Return the outline as an SVG file with the canvas of the pictures."""
        width, height = self.size
        path = closed_path(complex_of(np.array([self.to_file(z) for z in self.outline.tolist()])))
        size = f'width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
        return (
            f'<?xml version="1.0" encoding="UTF-8"?>\n<svg xmlns="http://www.w3.org/2000/svg" {size}>\n'
            f'<path id="outline" fill="#22262b" d="{path}"/>\n</svg>\n'
        )

    def csv(self) -> str:
        """Return the landmarks as a table, in pixels of the pictures."""
        rows = [(name, *self.to_file(z)) for name, z in zip(self.names, self.landmarks.tolist())]
        return "name,x,y\n" + "".join(f"{_cell(name)},{x:.9g},{y:.9g}\n" for name, x, y in rows)


def _cell(text: str) -> str:
    """Return the cell of a table."""
    return f'"{text.replace(chr(34), 2 * chr(34))}"' if set(text) & set(',"\n\r') else text


def of(
    specimens: Sequence[Specimen],
    refused: dict[str, str],
    *,
    size: tuple[int, ...],
    reference: str | None = None,
    reflect: Callable[[Specimen], Specimen] | None = None,
    note: Callable[[str], None] = lambda text: None,
) -> Standard:
    """Return the standard shape of specimens.

    Args:
        specimens: those that were read.
        refused: what is wrong with the others, by name; those that cannot be used are added.
        size: of the canvas, as for --size.
        reference: name of the specimen to use instead of the mean.
        reflect: returns the mirror image of a specimen; None if specimens are not reflected.
        note: called with remarks.

    Raises:
        InputError: fewer than two specimens are left, the reference is not among them, or the mean outline crosses
            itself.
    """
    alike = _with_same_landmarks(specimens, refused)
    if reflect is not None:
        alike = _reflected(alike, reflect, refused)
    alike, anchors = _anchored(alike, refused)
    placed = superimpose(np.array([specimen.landmarks for specimen in alike]))
    if reference is None:
        outline, landmarks = _mean(alike, placed, anchors)
    else:
        outline, landmarks = _of_reference(alike, reference, anchors, refused)
    standard = _on_canvas(outline, landmarks, size)
    curve = Curve(standard[0])
    inside = curve.contains(standard[1])
    inside[anchors] = True
    if not inside.all():
        outside = [name for name, is_inside in zip(alike[0].names, inside) if not is_inside]
        note(
            f"landmarks outside of the standard shape only superimpose specimens, and are left out of the pins: "
            f"{', '.join(outside[:8])}"
        )
    return Standard(alike, placed, *standard[:2], anchors, np.flatnonzero(inside), standard[2])


def _with_same_landmarks(specimens: Sequence[Specimen], refused: dict[str, str]) -> list[Specimen]:
    """Return the specimens that have the landmarks of most specimens, all in the same order; refuse the others.

    Raises:
        InputError: fewer than two are left, or they have fewer than two landmarks.
    """
    _check_count(specimens, refused)
    counts = Counter(frozenset(specimen.names) for specimen in specimens)
    usual = max(counts, key=lambda names: (counts[names], len(names)), default=frozenset[str]())
    alike = list[Specimen]()
    order = next((specimen.names for specimen in specimens if frozenset(specimen.names) == usual), ())
    for specimen in specimens:
        if frozenset(specimen.names) == usual:
            indices = [specimen.names.index(name) for name in order]
            alike.append(replace(specimen, landmarks=specimen.landmarks[indices], names=order))
            continue
        missing = [name for name in order if name not in specimen.names]
        additional = [name for name in specimen.names if name not in usual]
        differs = (
            f"lacks landmark {', '.join(missing[:8])}" if missing else f"also has {', '.join(additional[:8])}"
        )
        refused[specimen.name] = f"{specimen.source}: {differs}, unlike most specimens"
    _check_count(alike, refused)
    if len(order) < 2:
        raise InputError("specimens need at least 2 landmarks each")
    return alike


def _check_count(specimens: Sequence[Specimen], refused: dict[str, str]) -> None:
    """Check that there is something to superimpose.

    Raises:
        InputError: there are fewer than two specimens.
    """
    if len(specimens) < 2:
        why = f"; {next(iter(refused.values()))}" if refused else ""
        raise InputError(f"at least 2 specimens are needed, but only {len(specimens)} can be used{why}")


def _reflected(
    specimens: Sequence[Specimen], reflect: Callable[[Specimen], Specimen], refused: dict[str, str]
) -> list[Specimen]:
    """Return the specimens, those that fit the others better with their mirror images replaced by these."""
    mirrored = superimpose(np.array([specimen.landmarks for specimen in specimens]), reflect=True).mirrored
    upright = list[Specimen]()
    for specimen, is_mirrored in zip(specimens, mirrored):
        try:
            upright.append(reflect(specimen) if is_mirrored else specimen)
        except InputError as error:
            refused[specimen.name] = str(error)
    return upright


def _anchored(specimens: Sequence[Specimen], refused: dict[str, str]) -> tuple[list[Specimen], Index]:
    """Return the specimens with the usual landmarks on their outlines, and these landmarks in order along the outline.

    Raises:
        InputError: fewer than two specimens are left.
    """
    _check_count(specimens, refused)
    names = specimens[0].names
    distances = np.array(
        [specimen.curve.distances(specimen.landmarks) / specimen.curve.diagonal for specimen in specimens]
    )
    anchors = np.flatnonzero(np.median(distances, axis=0) <= ON_OUTLINE_SHARE)
    accepted = list[Specimen]()
    for specimen, away in zip(specimens, distances[:, anchors]):
        distant = [names[k] for k in anchors[away > FAR_FROM_OUTLINE_SHARE].tolist()]
        if distant:
            refused[specimen.name] = (
                f"{specimen.source}: landmark {', '.join(distant[:8])} is far from the outline, on which it lies in "
                "most specimens; check the landmarks, and what `iccm info --plot` shows as the outline"
            )
        else:
            accepted.append(specimen)
    _check_count(accepted, refused)
    if not anchors.size:
        return accepted, anchors
    orders = [tuple(anchors[_order(specimen, anchors)].tolist()) for specimen in accepted]
    counts = Counter(orders)
    usual = max(counts, key=lambda order: (counts[order], order))
    alike = list[Specimen]()
    for specimen, order in zip(accepted, orders):
        if order == usual:
            alike.append(specimen)
            continue
        misplaced = next(b for a, b in zip(usual, order) if a != b)
        refused[specimen.name] = (
            f"{specimen.source}: landmark {names[misplaced]} comes at another place along the outline than in most "
            "specimens; check the landmarks, or use --reflect if the specimen is a mirror image"
        )
    _check_count(alike, refused)
    return alike, np.array(usual)


def _order(specimen: Specimen, anchors: Index) -> Index:
    """Return the order of landmarks along the outline, counter-clockwise from the first one."""
    lengths = specimen.curve.closest(specimen.landmarks[anchors])
    return np.argsort((lengths - lengths[0]) % specimen.curve.length, kind="stable")


def _mean(specimens: Sequence[Specimen], placed: Superimposition, anchors: Index) -> tuple[Complex, Complex]:
    """Return the mean outline and the mean landmarks, those on outlines with their mean place there.

    Raises:
        InputError: the mean outline crosses itself.
    """
    outlines, lengths, landmarks = [], [], placed.mean.copy()
    for place, specimen in zip(placed.placed, specimens):
        outline = Curve(place(specimen.curve.z))
        outlines.append(outline)
        lengths.append(outline.closest(place(specimen.landmarks[anchors])))
    mean = mean_outline(outlines, np.array(lengths).reshape(len(outlines), anchors.size))
    try:
        Curve.domain(mean, "the mean outline")
    except InputError as error:
        raise InputError(
            f"{error}; place more landmarks on the outlines, or use --reference for a specimen instead of the mean"
        ) from error
    landmarks[anchors] = np.mean(
        [outline.at(arclengths) for outline, arclengths in zip(outlines, lengths)], axis=0
    )
    return mean, landmarks


def _of_reference(
    specimens: Sequence[Specimen], name: str, anchors: Index, refused: dict[str, str]
) -> tuple[Complex, Complex]:
    """Return outline and landmarks of a specimen.

    Raises:
        InputError: it is not among the specimens.
    """
    reference = next((specimen for specimen in specimens if specimen.name == name), None)
    if reference is None:
        raise InputError(refused.get(name, f"--reference {name}: is not the name of a specimen"))
    landmarks = reference.landmarks.copy()
    landmarks[anchors] = reference.curve.nearest(landmarks[anchors])
    return reference.curve.z, landmarks


def _on_canvas(
    outline: Complex, landmarks: Complex, size: tuple[int, ...]
) -> tuple[Complex, Complex, tuple[int, int]]:
    """Return outline and landmarks in pixels of a canvas, in its middle, and the canvas' size."""
    low, high = bounding_box(outline)
    margin = MARGIN_SHARE * max((high - low).real, (high - low).imag)
    extent = high - low + 2 * margin * (1 + 1j)
    width, height = size_within(size, extent, limits.PIXELS)
    scale = min(width / extent.real, height / extent.imag)
    to_canvas = Similarity(scale, complex(width, height) / 2, (low + high) / 2)
    return to_canvas(outline), to_canvas(landmarks), (width, height)
