"""Limits on the work and memory that one drawing may require; excess is refused before the work is done."""

from xml.etree.ElementTree import Element

from ...errors import InputError
from .. import limits


class Quota:
    """A limit on a count; counts above it are refused.

    Args:
        limit: the largest count.
        refusal: message for the user, a sentence.
    """

    def __init__(self, limit: int, refusal: str):
        self.remaining, self.refusal = limit, refusal

    def spend(self, count: int = 1) -> None:
        """Add to the count.

        Raises:
            InputError: the limit is exceeded.
        """
        self.remaining -= count
        self.check(0)

    def check(self, count: int) -> None:
        """Check whether `count` more would be allowed, without counting them.

        Raises:
            InputError: the limit would be exceeded.
        """
        if count > self.remaining:
            raise InputError(self.refusal)


class Budget:
    """Limits on the curves of one drawing.

    Attributes:
        runs, segments: subpaths and segments of all shapes, counted each time they are drawn; the user may set the
            limit on segments.
        points: points of polylines.
    """

    def __init__(self, segments: int = limits.SEGMENTS):
        self.runs = Quota(
            limits.SVG_SHAPES, f"it contains more than {limits.SVG_SHAPES} subpaths; split the drawing"
        )
        self.segments = Quota(
            segments,
            f"it contains more than {segments} lines and curves; simplify it (Inkscape: Path > Simplify), "
            "or raise --max-segments",
        )
        self.points = Quota(
            limits.SVG_POINTS,
            f"its curves need more than {limits.SVG_POINTS} points; draw fewer or smoother curves",
        )


_COUNTED_ELSEWHERE = {"d", "points", "href", "{http://www.w3.org/1999/xlink}href"}


class Copies:
    """Limits on content that is drawn repeatedly: elements, and characters other than path data and pictures."""

    def __init__(self) -> None:
        self.elements = Quota(
            limits.SVG_COPIES,
            f"<use>, clip paths, masks, markers and filters expand to more than {limits.SVG_COPIES} "
            "elements; use fewer of them, or map a picture of the drawing",
        )
        self.characters = Quota(
            limits.SVG_COPIED,
            f"copied attributes and texts have more than {limits.SVG_COPIED} characters; shorten them",
        )

    def add(self, element: Element, *, whole: bool = False) -> None:
        """Count an element that is drawn again; with `whole`, also its descendants and all attributes.

        Raises:
            InputError: the limit is exceeded.
        """
        for descendant in element.iter() if whole else (element,):
            self.elements.spend()
            attributes = descendant.attrib.items()
            length = sum(len(value) for name, value in attributes if whole or name not in _COUNTED_ELSEWHERE)
            self.characters.spend(length + len(descendant.text or ""))
