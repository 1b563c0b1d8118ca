"""How a solver ended."""

from enum import Enum


class Status(Enum):
    """How a solver ended; the value is a sentence."""

    DECREASE = "The energy has converged."
    THRESHOLD = "The energy fell below the threshold."
    REACHED = "The mapped outline meets the target's outline within the tolerance."
    LIMIT = "The iteration limit was reached before the energy converged (max_iterations)."
    GAP = "The mapped outline does not meet the target's outline within the tolerance (boundary.hausdorff)."
    SOURCE_GAP = "The map does not cover the source up to its outline within the tolerance (boundary.source)."
    BOUNDS = (
        "The bounds on dilatation, stretch, or what is hidden or bare cannot be met; the result is the closest map "
        "that was found (max_dilatation, max_stretch, max_left_out, max_uncovered)."
    )
    FOLDED = "The map folds: parts of the picture overlap or disappear (injective.folded)."
    TWISTED = (
        "The mapped outline meets the target's, but the map between the surfaces is twisted or squeezed "
        "(stretch, dilatation); add landmarks there, or move them."
    )
    DRIFTED = (
        "Both meshes lie in the same place, but the map moves points far away from where they are (apart); add "
        "landmarks, or use iccm relayout, which goes by position."
    )
    TILTED = (
        "By the up axes of both models, the source lies on its side on the target, or is not turned by --turn; add "
        "landmarks, or accept it with --turn any."
    )
    MET = "Pins and strokes are met."
    OVERLAP = "Pins and strokes are met and nothing folds, but the outline overlaps itself."
    BENT = "Not all rigid regions could be kept rigid; the result is the closest map without folds (regions)."
    PINS = (
        "Not all pins and strokes could be met; the result is the closest map without folds (pins, strokes)."
    )
    UNPAIRED = (
        "Pieces of the target have no partner in the source, so their faces show nothing of it (unpaired); name a "
        "piece of the source, as in source.obj#piece-1, for --parts each."
    )
    BARE = (
        "The map reaches less than half of what the target paints, and the rest stays bare (covered); use --fit whole "
        "or cover, or allow it with --fit contain or --max-uncovered."
    )
    HIDDEN = "Nothing of the source is shown (shown): all of it lies in gaps of the target, or is too thin."
    LINES = (
        "The target is drawn with lines that enclose no area, so that less than a tenth of the source is seen (shown); "
        "bend the source along a line with --along auto, or close the lines."
    )
    EMPTY = "A picture is empty, because no part of the texture lies in the area that it shows (empty)."
    PARTIAL = (
        "Less than half of a mesh's area is mapped, because it has other pieces, or pieces that cannot be flattened; "
        "name the piece (file#piece-1), or map all of them with --parts all or each (mapped)."
    )
    FLIPPED = "The texture coordinates that were written flip triangles or leave them without area (uv)."
    STACKED = (
        "The target's layout overlaps itself, and overlapping triangles show different parts of the picture, so that "
        "some of them look wrong (conflicting_texels); unwrap the mesh without stacked charts, or say with "
        "--overlap mirror that they are meant to share their texels."
    )
    CROWDED = (
        "Parts of the target are not covered, because the map is too crowded there for double "
        "precision (method conformal)."
    )

    @property
    def ok(self) -> bool:
        """Whether the solver ended as it should."""
        return self in (Status.DECREASE, Status.THRESHOLD, Status.REACHED, Status.MET, Status.OVERLAP)


ROUTINE = tuple(status.value for status in (Status.DECREASE, Status.THRESHOLD, Status.REACHED, Status.MET))
"""Messages that add no information to the figures."""
