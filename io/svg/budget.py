"""The work and the memory that one drawing may ask for: what is more is refused before it is done."""

from xml.etree.ElementTree import Element

from ...errors import InputError
from .. import limits


class Quota:
    """So much of something may be counted; what is more is refused.

    Args:
        limit: of what is counted.
        refusal: a sentence for the user.
    """

    def __init__(self, limit: int, refusal: str):
        self.left, self.refusal = limit, refusal

    def spend(self, count: int = 1) -> None:
        """Count so many.

        Raises:
            InputError: they are too many.
        """
        self.left -= count
        self.check(0)

    def check(self, count: int) -> None:
        """Refuse so many more, without counting them.

        Raises:
            InputError: they are too many.
        """
        if count > self.left:
            raise InputError(self.refusal)


class Budget:
    """What the curves of one drawing may take.

    Attributes:
        runs, segments: of all shapes, each as often as it is drawn; the user may set the limit of segments.
        points: of polylines.
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
    """What a drawing shows again, and so is read again: elements, and characters beside those of paths and pictures."""

    def __init__(self) -> None:
        self.elements = Quota(
            limits.SVG_COPIES,
            f"<use>, clip paths, masks, markers and filters expand to more than {limits.SVG_COPIES} "
            "elements; use fewer of them, or carry a picture of the drawing",
        )
        self.characters = Quota(
            limits.SVG_COPIED,
            f"copied attributes and texts have more than {limits.SVG_COPIED} characters; shorten them",
        )

    def add(self, element: Element, *, whole: bool = False) -> None:
        """Count an element that is shown again; with `whole`, all that is in it and every attribute.

        Raises:
            InputError: they are too many.
        """
        for each in element.iter() if whole else (element,):
            self.elements.spend()
            named = each.attrib.items()
            length = sum(len(value) for name, value in named if whole or name not in _COUNTED_ELSEWHERE)
            self.characters.spend(length + len(each.text or ""))
