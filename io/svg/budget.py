"""The work and the memory that one drawing may ask for: what is more is refused before it is done."""

from xml.etree.ElementTree import Element

from ...errors import InputError

MAX_BYTES = 32 << 20  # of a file, and of what a compressed one (.svgz) holds
MAX_DEPTH = 200  # of nested elements
MAX_ELEMENTS = 300_000  # of any kind, text and definitions included
MAX_SHAPES = 100_000  # paths, rectangles and so on: a tenth of a millisecond each
MAX_COPIES = 50_000  # elements that <use>, clip paths, masks, markers and filters make again
MAX_COPIED = 8 << 20  # characters of these: a second or two
MAX_LINKS = 40  # definitions that refer to each other in a chain
MAX_STYLE = 1 << 20  # characters of style sheets: two seconds
MAX_SELECTORS = 50_000  # of style sheets: a second and a half
MAX_SELECTOR = 1000  # characters of one; longer ones are not read
MAX_RULES = 2_000_000  # steps in holding selectors against elements: a second and a half
MAX_SEGMENTS = 1 << 20  # lines and curves of all shapes, each as often as it is drawn (--max-segments)
MAX_POINTS = 4_000_000  # of all shapes once their curves are polylines: 64 MB, several times
MAX_CROSSINGS = 50_000  # of the outlines that are filled together: 50 µs and 3 KB each
MAX_CUT = 20_000_000  # points of shapes, and of the clip paths and masks that cut them: some seconds
MAX_NEAR = 4_000_000  # pairs of segments whose boxes overlap: half a second
MAX_NESTED = 2_000_000  # pairs of runs whose boxes overlap: a second
MAX_WINDING = 200_000_000  # points times segments, for which windings are counted: two seconds


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

    def __init__(self, segments: int = MAX_SEGMENTS):
        self.runs = Quota(MAX_SHAPES, f"it draws more than {MAX_SHAPES} runs (M); split the drawing")
        self.segments = Quota(
            segments,
            f"it draws more than {segments} lines and curves; simplify it (Inkscape: Path > Simplify), "
            "or raise --max-segments",
        )
        self.points = Quota(
            MAX_POINTS, f"its curves take more than {MAX_POINTS} points; draw fewer or gentler curves"
        )


_COUNTED_ELSEWHERE = {"d", "points", "href", "{http://www.w3.org/1999/xlink}href"}


class Copies:
    """What a drawing shows again, and so is read again: elements, and characters beside those of paths and pictures."""

    def __init__(self) -> None:
        self.elements = Quota(
            MAX_COPIES,
            f"<use>, clip paths, masks, markers and filters make more than {MAX_COPIES} elements; "
            "use fewer of them, or carry a picture of the drawing",
        )
        self.characters = Quota(
            MAX_COPIED,
            f"attributes and texts that are used again have more than {MAX_COPIED} characters; shorten them",
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
