"""The values of the option `fit`: how to map two shapes onto each other where they differ.

There is one row for each value: its words in menus and help, and its properties. The command line, manifests,
the outputs and the solver read this table; `make generated` writes the menus of the page and of the plug-ins from it.

To add a value: its name in `FitName`, its row in `FITS`, its row in `docs/choose.md`, and a test. Then run
`make generated`. The search reads the row; `balanced.search.partial` changes for values that fill concavities in
another way, and `frames.solve` for those about whole drawings.
"""

from dataclasses import dataclass
from typing import Literal, get_args

FitName = Literal["auto", "frame", "box", "whole", "contain", "cover"]
Side = Literal["source", "target"]


@dataclass(frozen=True)
class FitMode:
    """Properties of a value of `fit`.

    Attributes:
        title: a word or two for menus.
        summary: what it shows, in a few words, for menus.
        help: a clause for the help of the command line and beside menus.
        fills: the sides whose concavities may be filled. If the source's are, the target stays bare where they
            open; if the target's are, parts of the source that lie there are hidden.
        compares: whether the cheapest of several maps is chosen, including that of the whole outlines.
        of_drawings: whether it is about whole drawings; for outlines it is "whole".
    """

    title: str
    summary: str
    help: str
    fills: tuple[Side, ...] = ()
    compares: bool = False
    of_drawings: bool = False

    @property
    def leaves_out_parts(self) -> bool:
        """Whether parts of a shape are left out in any case."""
        return bool(self.fills) and not self.compares

    @property
    def is_searched(self) -> bool:
        """Whether several maps are compared by default: of outlines, or of frames around drawings."""
        return self.compares or self.of_drawings

    @property
    def leaves_bare(self) -> bool:
        """Whether parts of the target stay bare in any case."""
        return self.leaves_out_parts and "source" in self.fills


FITS: dict[str, FitMode] = {
    "auto": FitMode(
        "Automatic",
        "what fits best",
        "the best of these by a cost: distortion, most of all of faces and words, and what is hidden or bare",
        ("source", "target"),
        compares=True,
    ),
    "frame": FitMode(
        "Frames",
        "a frame around all parts",
        "a region around the whole source, with its gaps closed, onto one around the target",
        of_drawings=True,
    ),
    "box": FitMode(
        "Box",
        "the drawing's box",
        "the bounding box of the source, with paper or nothing around the drawing, onto the target",
        of_drawings=True,
    ),
    "whole": FitMode(
        "Whole outlines", "outline onto outline", "outline onto outline, including all concavities"
    ),
    "contain": FitMode(
        "Show all",
        "no part of the source is hidden",
        "all of the source is shown; the target stays bare where concavities of the source open",
        ("source",),
    ),
    "cover": FitMode(
        "Cover all",
        "no part of the target stays bare",
        "the target is covered; parts of the source that would lie in its concavities are hidden",
        ("target",),
    ),
}

assert set(FITS) == set(get_args(FitName))


def leaves_out_parts(name: str | None) -> bool:
    """Return whether a value of `fit` leaves out parts of a shape in any case; None is the default, which does not."""
    return name is not None and FITS[name].leaves_out_parts


def leaves_bare(name: str | None) -> bool:
    """Return whether a value of `fit` leaves parts of the target bare in any case."""
    return name is not None and FITS[name].leaves_bare


def is_of_drawings(name: str | None) -> bool:
    """Return whether a value of `fit` is about whole drawings; None is the default, which decides by their cost."""
    return name is not None and FITS[name].of_drawings


def of_outlines(name: str) -> str:
    """Return the value of `fit` for two outlines that corresponds to a value for drawings."""
    return "whole" if FITS[name].of_drawings else name


def help_text() -> str:
    """Return the sentence for the command line's help, with the default in brackets."""
    order = [name for name, mode in FITS.items() if not mode.compares]
    order += [name for name, mode in FITS.items() if mode.compares]
    clauses = "; ".join(f"{name}: {FITS[name].help}" for name in order)
    return f"{clauses}.  [default: auto; whole with strokes, rigid regions, bounds or meshes]"
