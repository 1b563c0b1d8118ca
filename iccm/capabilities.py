"""Which method supports which constraint, on which kinds of shapes.

There is one row for each constraint; `refuse` raises for combinations that the rows do not list.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from .errors import InputError
from .fits import FITS

Kind = Literal["plane", "from surface", "onto surface", "between surfaces"]
"""Whether a problem is one of planar outlines, or the source, the target or both are surfaces flattened into
the plane.
"""
EVERYWHERE: tuple[Kind, ...] = ("plane", "from surface", "onto surface", "between surfaces")


@dataclass(frozen=True)
class Capability:
    """The combinations in which a constraint is supported.

    Attributes:
        methods: the methods that support it.
        refused: message for other methods.
        kinds: kinds of problems for which it is supported.
        elsewhere: message for each other kind.
        partial: whether it can be combined with a fit that leaves parts out.
        without: other constraints with which it cannot be combined, and the messages.
        without_on_surfaces: the same if a side is a surface.
    """

    methods: tuple[str, ...]
    refused: str
    kinds: tuple[Kind, ...] = EVERYWHERE
    elsewhere: dict[Kind, str] | str = ""
    partial: bool = True
    without: dict[str, str] | None = None
    without_on_surfaces: dict[str, str] | None = None


BALANCED = ("balanced",)
HOLES = Capability(BALANCED, "only the balanced method supports holes")
FIELD = Capability(
    BALANCED,
    "only works with the balanced method between planar outlines",
    kinds=("plane",),
    elsewhere="only works with the balanced method between planar outlines",
    partial=False,
)
PATCHES = "radius and tolerance of a pin"
PATCH_DERIVATIVES = "turn and scale of a pin"
STROKE_WIDTHS = "width of a stroke"
ONE_SIDE = "rigid regions can be given on one side only; remove one of the two options"
BETWEEN_SURFACES = "rigid regions are not supported between two surfaces; use pins instead"
PINS_INSTEAD = "cannot be combined with strokes on surfaces; use pins instead of strokes"


def _rigid(supported: Kind, refused: Kind, instead: str, without: dict[str, str]) -> Capability:
    """Return the row of rigid regions of one side.

    Args:
        supported: the kind of problems with a surface for which they are supported.
        refused: the kind for which they are not, since the triangles of the surface are those of the map.
        instead: the option for regions of the other side.
        without: as for `Capability`.
    """
    return Capability(
        BALANCED,
        "rigid regions need the balanced method",
        kinds=("plane", supported),
        elsewhere={
            "between surfaces": BETWEEN_SURFACES,
            refused: f"the map follows the triangles of the surface; give {instead}",
        },
        partial=False,
        without=without,
        without_on_surfaces={"strokes": PINS_INSTEAD},
    )


CAPABILITIES: dict[str, Capability] = {
    "source_holes": HOLES,
    "target_holes": HOLES,
    "rigid": _rigid(
        "from surface", "onto surface", "rigid_target, regions of the target", {"rigid_target": ONE_SIDE}
    ),
    "rigid_target": _rigid(
        "onto surface",
        "from surface",
        "rigid, regions of the source",
        dict.fromkeys(("importance", "size_map"), "cannot be combined with importance or size_map"),
    ),
    PATCHES: Capability(BALANCED, "are for the balanced method"),
    PATCH_DERIVATIVES: Capability(
        BALANCED,
        "are for the balanced method",
        kinds=("plane",),
        elsewhere="are for pins between drawings; leave them out on meshes",
    ),
    STROKE_WIDTHS: Capability(BALANCED, "is for the balanced method"),
    "importance": FIELD,
    "size_map": FIELD,
    "start": Capability(BALANCED, "needs the balanced method"),
}


def refuse(names: Collection[str], method: str, kind: Kind, fit: str) -> None:
    """Raise an InputError for the first constraint that cannot be combined with the rest.

    Args:
        names: names of the constraints, `strokes` among them.
        method: the method that solves: balanced, conformal or paper.
        kind: kind of the problem.
        fit: a value of `fits.FITS`.
    """
    for name, row in CAPABILITIES.items():
        if name not in names:
            continue
        exclusions = dict(row.without or {})
        if kind != "plane":
            exclusions |= row.without_on_surfaces or {}
        if method not in row.methods:
            raise InputError(f"{name}: {row.refused}")
        if kind not in row.kinds:
            raise InputError(
                f"{name}: {row.elsewhere if isinstance(row.elsewhere, str) else row.elsewhere[kind]}"
            )
        for excluded, why in exclusions.items():
            if excluded in names:
                raise InputError(
                    f"{name}: {why}" if excluded != "rigid_target" else f"{name}, {excluded}: {why}"
                )
        if FITS[fit].leaves_out_parts and not row.partial:
            raise InputError(f"{name}: cannot be combined with fit {fit}; use whole or auto")
