"""The keys of all JSON reports in one table: a row for each figure, with its type, unit and meaning.

The JSON schemas and the tables of docs/reference/report.md are written from it (`make generated`); `iccm check` takes
its tolerances from it, and `iccm batch` the figures of its results. To add a figure, add its row here, and write it
where it is computed (`iccm/figures.py`, or an output's `OutputReport`); a test compares reports with the table.
"""

from collections.abc import Iterable, Iterator
from copy import deepcopy
from typing import Any, NamedTuple


class Kind(NamedTuple):
    """The type and unit of a figure.

    Attributes:
        schema: its JSON schema.
        unit: of a number, in words; empty for others.
    """

    schema: dict[str, Any]
    unit: str = ""


class Tolerance(NamedTuple):
    """How far a figure may be from its baseline in `iccm check`, relative or absolute; meeting either is enough.

    Figures without one have that of `compare.Figure`.
    """

    rel: float = 1e-6
    abs: float = 1e-9
    ignore: bool = False


class FigureRow(NamedTuple):
    """A figure, or another key of a report.

    Attributes:
        key: dotted path; `[]` follows the key of a list, and stands for each item.
        kind: type and unit.
        meaning: in Markdown; empty if that of the row before covers this one.
        always: whether it is always there, in the object that contains it.
        tolerance: in `iccm check`; None for the usual one.
        in_batch: whether results of `iccm batch` contain it.
        repeats: whether another row describes the same key in another object, so that the page leaves this one out.
    """

    key: str
    kind: Kind
    meaning: str = ""
    always: bool = False
    tolerance: Tolerance | None = None
    in_batch: bool = False
    repeats: bool = False


class Report(NamedTuple):
    """A kind of report.

    Attributes:
        title: what writes it, as a sentence.
        sections: rows by heading, as on the page.
    """

    title: str
    sections: dict[str, tuple[FigureRow, ...]]

    @property
    def rows(self) -> Iterator[FigureRow]:
        """All rows."""
        return (row for rows in self.sections.values() for row in rows)


def _list(item: Kind, **limits: int) -> Kind:
    return Kind({"type": "array", "items": item.schema, **limits})


def _enum(*words: str) -> Kind:
    return Kind({"enum": list(words)})


def _number(unit: str, **limits: float) -> Kind:
    return Kind({"type": ["number", "null"], **limits}, unit)


TEXT, TEXT_OR_NULL = Kind({"type": "string"}), Kind({"type": ["string", "null"]})
FLAG, FLAG_OR_NULL = Kind({"type": "boolean"}), Kind({"type": ["boolean", "null"]})
TRUE = Kind({"const": True})
OBJECT, OBJECT_OR_NULL = Kind({"type": "object"}), Kind({"type": ["object", "null"]})
OBJECTS, TEXTS = _list(OBJECT), _list(TEXT)
NUMBERS = Kind({"type": "object", "additionalProperties": {"type": ["number", "null"]}})
TIMES = Kind({"type": "object", "additionalProperties": {"type": "number"}}, "seconds")
COUNT, COUNT_OR_NULL = Kind({"type": "integer", "minimum": 0}), Kind({"type": ["integer", "null"]})
COUNT_OR_ALL = Kind({"type": "integer", "minimum": -1}, "texels")
POSITIVE_COUNT = Kind({"type": "integer", "minimum": 1})
PIXELS = POSITIVE_COUNT._replace(unit="pixels")
SIZE = _list(POSITIVE_COUNT, minItems=2, maxItems=2)._replace(unit="pixels")
PLACE = _list(Kind({"type": "number"}), minItems=2, maxItems=2)
BOX = _list(PLACE, minItems=2, maxItems=2)
PLACE_OR_NULL = Kind({"type": ["array", "null"], "items": COUNT.schema, "minItems": 2, "maxItems": 2})
HASH = Kind({"type": "string", "pattern": "^[0-9a-f]{64}$"})
DIAGONALS = _number("target diagonals")
SPACE_DIAGONALS = _number("target diagonals, in space")
SHARE = _number("share", minimum=0, maximum=1)
COUNTED_SHARE = Kind({"type": "number", "minimum": 0, "maximum": 1}, "share of a number")
RATIO = _number("ratio")
RATIO_FROM_ONE = Kind({"type": "number", "minimum": 1}, "ratio")
MODULUS = _number("modulus")
DECADES = _number("decades")
DEGREES = _number("degrees")
LENGTH = Kind({"type": "number"}, "lengths of the mesh")
MILLIMETRES = _number("millimetres", exclusiveMinimum=0)
SECONDS = Kind({"type": "number", "minimum": 0}, "seconds")
NOT_NEGATIVE = Kind({"type": "number", "minimum": 0})

IGNORED = Tolerance(ignore=True)
SAMPLED = Tolerance(abs=0.002)
"""For shares that are counted by samples and pixels, which may fall on either side of an edge."""


def schema_row(name: str) -> FigureRow:
    """Return the row of the key that names a kind of report and its version."""
    return FigureRow("schema", Kind({"const": name}), "name and version of this schema", always=True)


def under(place: str, rows: tuple[FigureRow, ...]) -> tuple[FigureRow, ...]:
    """Return rows again with their keys inside another key, such as `parts[]`."""
    return tuple(row._replace(key=f"{place}.{row.key}", repeats=True) for row in rows)


STATUS = (
    FigureRow("status", TEXT, "how the solver ended, as a [word](exit-codes.md#statuses)", always=True),
    FigureRow("message", TEXT, "the same as a sentence", always=True),
)
BOUNDARY = (
    FigureRow(
        "boundary",
        OBJECT_OR_NULL,
        "distance between the image of the boundary and the target's outline; null for `deform`",
        always=True,
        in_batch=True,
    ),
    FigureRow("boundary.rms", DIAGONALS, "root mean square", always=True),
    FigureRow("boundary.hausdorff", DIAGONALS, "two-sided Hausdorff distance", always=True),
    FigureRow(
        "boundary.given",
        DIAGONALS,
        "largest distance of the source's vertices as given, if the map has fewer",
    ),
    FigureRow(
        "boundary.source",
        _number("source diagonals"),
        "with the status `source_gap`: distance between the boundary that the map covers and the source's outline",
    ),
)
DILATATION = (
    FigureRow(
        "dilatation",
        OBJECT,
        "ratio of the axes of the ellipses that small circles become, over the target's area; 1 is conformal. "
        "Between surfaces it is measured on these",
        always=True,
        in_batch=True,
    ),
    FigureRow("dilatation.median", RATIO, always=True),
    FigureRow("dilatation.p95", RATIO, "95 % of the area stay below it", always=True),
    FigureRow("dilatation.max", RATIO, "largest", always=True),
)
AREA_SCALE = (
    FigureRow(
        "log10_area",
        OBJECT,
        "decimal logarithm of the area scale, over the source's area",
        always=True,
        in_batch=True,
    ),
    FigureRow("log10_area.p05", DECADES, always=True),
    FigureRow("log10_area.median", DECADES, always=True),
    FigureRow("log10_area.p95", DECADES, always=True),
)
STRETCH = (
    FigureRow(
        "stretch",
        OBJECT,
        "max(s₁, 1/s₂) of the map's singular values relative to the mean scale, over the *target's* area; 1 is a "
        "similarity",
        always=True,
    ),
    FigureRow("stretch.p50", RATIO, always=True),
    FigureRow("stretch.p95", RATIO, always=True),
    FigureRow("stretch.max", RATIO, always=True),
    FigureRow("scale", OBJECT, always=True),
    FigureRow(
        "scale.within2",
        SHARE,
        "of the target: where the linear scale is within a factor of 2 of the mean; bare parts count as outside",
        always=True,
    ),
    FigureRow("scale.within4", SHARE, "the same for a factor of 4", always=True),
    FigureRow("turn", DEGREES, "mean rotation of the picture, counter-clockwise", always=True),
)
INJECTIVE = (
    FigureRow("injective", OBJECT, "where the map is proven to be one-to-one", always=True, in_batch=True),
    FigureRow(
        "injective.certified",
        FLAG,
        "whether the map is proven to be one-to-one, also between samples, on the source moved inwards by `depth`. "
        "Balanced maps are certified up to the boundary, in exact arithmetic",
        always=True,
    ),
    FigureRow("injective.depth", _number("inradii of the source"), "how far inwards the source is moved"),
    FigureRow("injective.share", SHARE, "share of the source's area that remains", always=True),
    FigureRow("injective.zeros", COUNT_OR_NULL, "folds that were found"),
    FigureRow(
        "injective.max_beltrami", MODULUS, "largest modulus of the Beltrami coefficient (conformal, paper)"
    ),
    FigureRow("injective.simple_image", FLAG_OR_NULL, "whether the image's outline does not cross itself"),
    FigureRow("injective.obstacle", TEXT, "why the certificate does not reach the boundary", always=True),
    FigureRow(
        "injective.folded",
        SHARE,
        "share of the source's area that folds, or shrinks below what floating point numbers can represent; above "
        ".01 the status is `folded`",
    ),
)
UV = (
    FigureRow("uv", OBJECT, in_batch=True),
    FigureRow(
        "uv.flipped",
        COUNT,
        "triangles of the written mesh that are flipped in the new coordinates, after rounding as in the file; any of "
        "them gives the status `flipped` and exit code 1",
        always=True,
    ),
    FigureRow("uv.degenerate", COUNT, "triangles without area, in the same way", always=True),
)
NOTES = FigureRow(
    "notes",
    TEXTS,
    "omitted or simplified content, and doubts about the result, such as a gap between the outlines, or overlaps",
    always=True,
)
INPUTS = (
    FigureRow("inputs", OBJECTS, "the files that were read", always=True),
    FigureRow("inputs[].path", TEXT, always=True, tolerance=IGNORED),
    FigureRow("inputs[].sha256", HASH, always=True),
)
VERSION = FigureRow("version", TEXT, "of iccm", always=True, tolerance=IGNORED)
RIM = (
    FigureRow("rim_vertices", COUNT, "vertices added by `--subdivide-rim`"),
    FigureRow("rim_edges_left", COUNT, "edges that it left straight because adjacent triangles would flip"),
)
ALSO_WRITTEN = FigureRow("also_written", TEXTS, "companion files")
CHARTS = (
    FigureRow("charts", COUNT, "charts of the layout (baked and relaid pictures)", always=True),
    FigureRow("mirrored_triangles", COUNT, always=True),
    FigureRow("flat_triangles", COUNT, "triangles without area in the layout", always=True),
    FigureRow("outside_triangles", COUNT, "triangles outside the square of texture coordinates", always=True),
    FigureRow("overlapping_texels", COUNT, "texels in several triangles", always=True),
    FigureRow("covered_texels", COUNT, always=True),
)
LAYOUT = (
    FigureRow("method", TEXT, "`conformal`, `lscm`, `balanced`, or the file of the outline", always=True),
    FigureRow("vertices", COUNT, always=True),
    FigureRow("triangles", COUNT, always=True),
    FigureRow("boundary_vertices", COUNT),
    FigureRow("holes", COUNT),
    FigureRow("seam_edges", COUNT, "edges that were cut"),
    FigureRow("seam_length", LENGTH),
    FigureRow("turned", COUNT, "triangles that are turned over in the layout"),
)
CONCAVE = FigureRow("concave_polygons", COUNT, "polygons that another program may triangulate differently")
DISTANCE = (
    FigureRow(
        "distance", OBJECT, "between the surfaces, relative to the diagonal", always=True, in_batch=True
    ),
    FigureRow("distance.limit", NOT_NEGATIVE, "largest allowed", always=True),
    FigureRow("distance.p95", NOT_NEGATIVE, always=True),
    FigureRow("distance.max", NOT_NEGATIVE, always=True),
)
SAME_TRIANGLES = FigureRow(
    "same_triangles", COUNT, "triangles that the old mesh has, too", always=True, in_batch=True
)
SEEN = (
    FigureRow(
        "shown",
        SHARE,
        "for drawings: share of the source's painted area that the result shows; for several parts, of all together",
        tolerance=SAMPLED,
        in_batch=True,
    ),
    FigureRow(
        "covered",
        SHARE,
        "for drawings: share of the target's painted area that shows something",
        tolerance=SAMPLED,
        in_batch=True,
    ),
    FigureRow(
        "cracks",
        SHARE,
        "for drawings: share of the target's painted area in slits that show nothing and are narrower than 6 pixels of "
        "512; above .005 a note reports it",
        tolerance=SAMPLED,
        in_batch=True,
    ),
)


def optional(rows: tuple[FigureRow, ...]) -> tuple[FigureRow, ...]:
    """Return rows that reports may lack: the first one, and those of the others that it does not contain."""
    return tuple(row._replace(always=row.always and "." in row.key) for row in rows)


MAP = Report(
    "What iccm map and deform write with --report.",
    {
        "Outcome": (
            schema_row("iccm.report/1"),
            *STATUS,
            NOTES,
            FigureRow("iterations", COUNT, "steps of the solver", always=True),
            FigureRow("vertices", COUNT, "boundary vertices", always=True),
            FigureRow("energies", _list(NUMBERS), "each term of the energy at each step", always=True),
            FigureRow(
                "seconds",
                TIMES,
                "`solve`, `evaluate`, `resample`, `total` and others; omitted with `SOURCE_DATE_EPOCH`",
                tolerance=IGNORED,
            ),
            *INPUTS,
            VERSION,
            FigureRow("job", OBJECT, "the options that are not defaults", always=True, tolerance=IGNORED),
            FigureRow(
                "not_written",
                _list(TEXT, minItems=1),
                "outputs that were not reached within `--time-limit`; the status is `limit`",
            ),
        ),
        "Accuracy of the outline and of constraints": (
            *BOUNDARY,
            FigureRow("pins", OBJECTS, "in the order of the command", always=True),
            FigureRow("pins[].error", DIAGONALS, "distance of the pin from its place", always=True),
            FigureRow("pins[].tolerance", DIAGONALS, "for soft pins: distance up to which they count as met"),
            FigureRow("strokes", OBJECTS, always=True),
            FigureRow(
                "strokes[].error",
                DIAGONALS,
                "root mean square distance of the stroke from its place",
                always=True,
            ),
            FigureRow("holes", OBJECTS, "pairs of holes, counted from 1"),
            FigureRow("holes[].source", COUNT_OR_NULL, "null for a hole without a partner", always=True),
            FigureRow("holes[].target", COUNT_OR_NULL, always=True),
            FigureRow("holes[].gap", DIAGONALS, "distance of their outlines", always=True),
        ),
        "Distortion": (*STRETCH, *DILATATION, *AREA_SCALE),
        "One-to-one": INJECTIVE,
        "Hidden and bare parts": (
            *SEEN,
            FigureRow(
                "left_out",
                SHARE,
                "for partial maps: share of the source that is not shown, because of concavities or ignored holes",
            ),
            FigureRow(
                "uncovered", SHARE, "for partial maps: share of the target's area to which nothing is mapped"
            ),
            FigureRow(
                "parts",
                OBJECTS,
                "with `--parts all`, `each` or `elements`, for each part; the same keys at the top level describe the "
                "largest part",
            ),
            FigureRow(
                "parts[].source", TEXT, "as `#` selects it; empty with `each` and `elements`", always=True
            ),
            FigureRow("parts[].target", TEXT, always=True),
            *under("parts[]", (STATUS[0], *BOUNDARY, *DILATATION, *AREA_SCALE, *INJECTIVE)),
            FigureRow("unpaired", OBJECT, "with `--parts all`: parts without a partner"),
            FigureRow("unpaired.source", TEXTS),
            FigureRow("unpaired.target", TEXTS),
            FigureRow("unpaired.empty", SHARE, "their share of the area of the target's parts"),
            FigureRow(
                "without_map",
                OBJECTS,
                "with `--parts all` or `each`: omitted parts, for which no map was found; the exit code is 1",
            ),
            FigureRow("without_map[].source", TEXT, always=True),
            FigureRow("without_map[].target", TEXT, always=True),
            FigureRow("without_map[].message", TEXT, always=True),
            FigureRow(
                "overlap",
                SHARE,
                "with `--parts all`, if parts of the target overlap: the share of their area that is covered twice",
            ),
        ),
        "Rigid regions": (
            FigureRow("regions", OBJECTS, "rigid regions, from the top left on"),
            FigureRow("regions[].dilatation", RATIO_FROM_ONE, "95 % of the region stay below it"),
            FigureRow(
                "regions[].size",
                OBJECT,
                "linear scale relative to the mean scale of the map; for `deform`, relative to its original size; on a "
                "mesh, relative to the region's own flattening",
            ),
            FigureRow("regions[].size.p05", Kind({"type": "number"}, "ratio")),
            FigureRow("regions[].size.p50", Kind({"type": "number"}, "ratio")),
            FigureRow("regions[].size.p95", Kind({"type": "number"}, "ratio")),
            FigureRow("regions[].scale", Kind({"type": "number"}, "ratio"), "its median"),
            FigureRow("regions[].turn", Kind({"type": "number"}, "degrees"), "rotation, counter-clockwise"),
            FigureRow("regions[].of", _enum("target"), "for regions of `--rigid-target`"),
        ),
        "Meshes": (
            *optional(UV),
            FigureRow(
                "apart",
                OBJECT,
                "between two meshes: distance between points and their origins, over the target's area; an error "
                "measure if both are copies of one model in one place",
            ),
            FigureRow("apart.median", SPACE_DIAGONALS, always=True),
            FigureRow("apart.p95", SPACE_DIAGONALS, always=True),
            FigureRow("apart.max", SPACE_DIAGONALS, always=True),
            FigureRow("mapped", COUNTED_SHARE, "share of the target file's faces that are mapped"),
            FigureRow("flattening", OBJECT, "how the target mesh was flattened"),
            *under("flattening", (*LAYOUT, *optional(DILATATION), *optional(AREA_SCALE))),
            FigureRow("flattening.notes", TEXTS),
            ALSO_WRITTEN,
            *RIM,
            FigureRow("outside_points", COUNT, "points of a mesh that lay outside the map by rounding"),
            FigureRow("outside_distance", DIAGONALS, "their largest distance"),
            FigureRow("torn_triangles", COUNT, "triangles across a cut"),
            CONCAVE,
            *optional(CHARTS),
            FigureRow("conflicting_texels", COUNT, "texels in several triangles that show different places"),
            FigureRow("exact_triangles", COUNT, "triangles that are baked exactly"),
            FigureRow("padding", COUNT_OR_ALL, "by which charts extend; -1: over the whole picture"),
        ),
        "Pictures": (
            FigureRow("empty", TRUE, "a picture or STMap shows nothing"),
            FigureRow("pixels", OBJECT),
            FigureRow("pixels.width", PIXELS),
            FigureRow("pixels.height", PIXELS),
            FigureRow("pixels.inside", COUNT, "number of pixels inside", always=True),
            FigureRow("pixels.edge", COUNT, "at the edge", always=True),
            FigureRow("pixels.fallback", COUNT, "solved one by one"),
            FigureRow(
                "pixels.paper",
                TEXT,
                "colour of the paper around a drawing that is its own picture (`--background`)",
            ),
            FigureRow(
                "pixels.background",
                TEXT,
                "`target` if the target's own drawing or photo is shown behind the result (`--background target`)",
            ),
            FigureRow(
                "pixels.checkerboard",
                TRUE,
                "the picture is the numbered checkerboard, because the source is a plain shape and `--texture` was not "
                "given",
            ),
        ),
    },
)
"""`iccm.report/1`."""

FLATTEN = Report(
    "What iccm flatten writes with --report.",
    {
        "Layouts": (
            schema_row("iccm.flatten/1"),
            VERSION,
            FigureRow("status", _enum("done", "flipped", "overlaps"), always=True),
            FigureRow("overlap", TEXT_OR_NULL, "what keeps the layout from being one-to-one", always=True),
            *(row._replace(always=True) for row in LAYOUT),
            *DILATATION,
            *AREA_SCALE,
            *optional(BOUNDARY),
            *optional(STRETCH),
            *(row._replace(always=True) for row in UV),
            CONCAVE._replace(always=True),
            FigureRow("box", BOX, "lower left and upper right corner", always=True),
            FigureRow("each_chart", OBJECTS, "charts, the largest on the surface first", always=True),
            FigureRow("each_chart[].triangles", COUNT, always=True),
            FigureRow("each_chart[].area_share", SHARE, "of the surface", always=True),
            FigureRow(
                "each_chart[].layout_share", SHARE, "of the area of all charts in the layout", always=True
            ),
            *under("each_chart[]", DILATATION),
            FigureRow(
                "each_chart[].density",
                RATIO,
                "texel density relative to that of the whole layout",
                always=True,
            ),
            FigureRow("each_chart[].box", BOX, "lower left and upper right corner", always=True),
            FigureRow(
                "millimetres",
                MILLIMETRES,
                "length of a unit of the layout in `.svg` and `.dxf`; null for texture coordinates",
            ),
            FigureRow(
                "boundary_loops", _list(COUNT), "number of vertices of each, the outer one first", always=True
            ),
            NOTES,
            *RIM,
            ALSO_WRITTEN,
            *INPUTS,
        )
    },
)
"""`iccm.flatten/1`."""

RELAYOUT = Report(
    "What iccm relayout writes with --report.",
    {
        "Relaid textures": (
            schema_row("iccm.relayout/1"),
            VERSION,
            FigureRow("status", _enum("done", "far", "overlapping", "empty"), always=True),
            FigureRow("size", SIZE, "width and height of the largest picture", always=True),
            FigureRow("triangles", COUNT, always=True),
            SAME_TRIANGLES,
            *DISTANCE,
            FigureRow(
                "nearest_texels", COUNT, "taken from the nearest point of the old surface", always=True
            ),
            FigureRow("far_texels", COUNT, "left empty: farther than the limit", always=True),
            FigureRow("layout", OBJECT, "of the new mesh's texture coordinates", always=True),
            *under("layout", CHARTS),
            FigureRow(
                "layout.conflicting_texels",
                COUNT,
                "in several triangles that show different parts of the old texture",
            ),
            *INPUTS,
            NOTES,
            FigureRow("written", TEXTS, always=True),
        )
    },
)
"""`iccm.relayout/1`."""

CARTOGRAM = Report(
    "What iccm cartogram writes with --report.",
    {
        "Cartograms": (
            schema_row("iccm.cartogram/1"),
            FigureRow("input", TEXT, "the file of regions", always=True),
            FigureRow(
                "by", TEXT, "the property, or the column of the table, that the areas follow", always=True
            ),
            FigureRow("regions", POSITIVE_COUNT, "number of regions", always=True),
            FigureRow(
                "crs",
                TEXT_OR_NULL,
                "the projection of the output; null if the coordinates were used unchanged",
                always=True,
            ),
            FigureRow(
                "area_error", OBJECT, "difference of areas from those wanted, relative to these", always=True
            ),
            FigureRow("area_error.max", NOT_NEGATIVE._replace(unit="ratio"), always=True),
            FigureRow("area_error.mean", NOT_NEGATIVE._replace(unit="ratio"), always=True),
            FigureRow("area_error.worst", TEXT, "the region with the largest one", always=True),
            FigureRow(
                "dilatation",
                OBJECT,
                "how far a small circle becomes an ellipse, over the area; 1 is not at all",
                always=True,
            ),
            FigureRow("dilatation.mean", RATIO_FROM_ONE, always=True),
            FigureRow("dilatation.p95", RATIO_FROM_ONE, always=True),
            FigureRow("folds", COUNT, "number of triangles that are turned over", always=True),
            FigureRow("certified", FLAG, "whether the map is proven to be one-to-one", always=True),
            FigureRow("vertices", COUNT, "of the triangulation", always=True),
            FigureRow("steps", COUNT, "of Newton's method", always=True),
        )
    },
)
"""`iccm.cartogram/1`."""

STANDARDIZE = Report(
    "The report.json of iccm standardize.",
    {
        "Specimens": (
            schema_row("iccm.standardize/1"),
            FigureRow(
                "reference",
                TEXT_OR_NULL,
                "the specimen that is the standard; null for the mean shape",
                always=True,
            ),
            FigureRow("size", SIZE, "width and height of the pictures", always=True),
            FigureRow("landmarks", TEXTS, "their names, in order", always=True),
            FigureRow("landmarks_on_outline", TEXTS, always=True),
            FigureRow("pins", TEXTS, "landmarks that the maps meet as pins", always=True),
            FigureRow("colours", TEXT, "the unit of the spread", always=True),
            FigureRow("specimens", OBJECTS, always=True),
            FigureRow("specimens[].specimen", TEXT, always=True),
            FigureRow("specimens[].status", TEXT, "`done`, `failed`, or the status of the map", always=True),
            FigureRow(
                "specimens[].procrustes_distance",
                _number("centroid sizes"),
                "of its landmarks from the mean shape, both of centroid size 1",
                always=True,
            ),
            FigureRow(
                "specimens[].centroid_size",
                _number("units of the specimen"),
                "of its landmarks",
                always=True,
            ),
            FigureRow("specimens[].rotation", DEGREES, "from the specimen to the mean shape", always=True),
            FigureRow("specimens[].mirrored", FLAG_OR_NULL, always=True),
            FigureRow(
                "specimens[].dilatation_p95",
                RATIO,
                "of the map of the specimen onto the mean shape",
                always=True,
            ),
            FigureRow(
                "specimens[].injective",
                _number("share"),
                "share of the specimen on which the map is certified to be one-to-one",
                always=True,
            ),
            FigureRow(
                "specimens[].outline_gap",
                _number("diagonals of the mean shape"),
                "Hausdorff distance of the outlines",
                always=True,
            ),
            FigureRow("specimens[].seconds", _number("seconds"), always=True, tolerance=IGNORED),
            FigureRow(
                "specimens[].picture", TEXT_OR_NULL, "relative to the folder of the output", always=True
            ),
            FigureRow("specimens[].map", TEXT_OR_NULL, "relative to the folder of the output", always=True),
            FigureRow("specimens[].message", TEXT, "what is wrong; empty if nothing is", always=True),
            FigureRow(
                "spread",
                OBJECT,
                "standard deviation of the pictures at a pixel, where at least two count",
            ),
            FigureRow("spread.mean", NOT_NEGATIVE),
            FigureRow("spread.median", NOT_NEGATIVE),
            FigureRow("spread.p95", NOT_NEGATIVE),
            FigureRow("spread.max", NOT_NEGATIVE),
            FigureRow(
                "spread.brightest",
                NOT_NEGATIVE,
                "the spread that the brightest colour of the picture shows",
            ),
            FigureRow("summarised", COUNT, "number of pictures in mean and spread"),
        )
    },
)
"""`iccm.standardize/1`."""


def batch_rows() -> tuple[FigureRow, ...]:
    """Return the rows of the figures that results of `iccm batch` contain, with those inside them."""
    rows = [row for report in (MAP, RELAYOUT) for row in report.rows]
    names = [row.key for row in rows if row.in_batch and "." not in row.key]
    return tuple(row for row in rows if row.key.split(".")[0] in names)


RESULT = Report(
    "A line of iccm batch.",
    {
        "Results of batches": (
            schema_row("iccm.result/1"),
            FigureRow("job", POSITIVE_COUNT, "number of the job in the manifest", always=True),
            FigureRow("name", TEXT, always=True),
            FigureRow("place", TEXT, "file and line of the job", always=True),
            FigureRow(
                "status",
                _enum("done", "poor", "failed", "error", "timeout", "killed", "cancelled"),
                always=True,
            ),
            FigureRow("message", TEXT, always=True),
            FigureRow("outputs", OBJECTS, "what was written", always=True),
            FigureRow("outputs[].path", TEXT, always=True),
            FigureRow("outputs[].sha256", HASH, always=True),
            FigureRow("figures", OBJECT, "some of the report", always=True),
            *under("figures", optional(batch_rows())),
            FigureRow("notes", TEXTS, always=True),
            FigureRow("idle", TEXTS, "options without effect in this job, which were given for several jobs"),
            FigureRow("seconds", SECONDS, always=True, tolerance=IGNORED),
            FigureRow("attempts", COUNT, always=True),
            FigureRow("resumed", FLAG, "whether an earlier run had done it", always=True),
        )
    },
)
"""`iccm.result/1`."""

CHECK = Report(
    "A line of iccm check --json.",
    {
        "Verdicts": (
            schema_row("iccm.check/1"),
            FigureRow("name", TEXT, always=True),
            FigureRow("state", _enum("same", "differs", "new", "missing"), always=True),
            FigureRow("problems", TEXTS, always=True),
            FigureRow("notes", TEXTS),
            FigureRow("figures", NUMBERS, "measured differences of a picture", always=True),
            FigureRow("moved", OBJECTS, "figures that are too far from their baselines", always=True),
            FigureRow("moved[].key", TEXT, always=True),
            FigureRow("moved[].run", TEXT, always=True),
            FigureRow("moved[].baseline", TEXT, always=True),
            FigureRow("moved[].limit", TEXT, always=True),
            FigureRow(
                "worst", PLACE_OR_NULL, "column and row of a picture's largest difference", always=True
            ),
        )
    },
)
"""`iccm.check/1`."""

REPORTS = {
    "report": MAP,
    "flatten": FLATTEN,
    "relayout": RELAYOUT,
    "cartogram": CARTOGRAM,
    "standardize": STANDARDIZE,
    "result": RESULT,
    "check": CHECK,
}
"""The kinds of reports by the name in their schema, `iccm.NAME/1`."""

BATCH_FIGURES = tuple(dict.fromkeys(row.key.split(".")[0] for row in batch_rows()))
"""The keys of a report that results of `iccm batch` contain."""


def tolerances() -> dict[str, Tolerance]:
    """Return the tolerances of `iccm check` that differ from the usual one, by patterns of keys."""
    found: dict[str, Tolerance] = {}
    for row in (row for report in REPORTS.values() for row in report.rows):
        if row.tolerance is not None:
            pattern = row.key.replace("[]", ".*")
            found[pattern + ".*" if row.kind.schema.get("type") == "object" else pattern] = row.tolerance
    return found


def page_rows(rows: Iterable[FigureRow]) -> str:
    """Return rows of a table in Markdown: key, unit and meaning.

    A row without a meaning is added to the row before, if both are inside the same key.

    Examples:
        >>> print(page_rows([Row("size.p05", RATIO, "of 5 %"), Row("size.p95", RATIO)]), end="")
        | `size.p05`, `.p95` | ratio | of 5 % |
    """
    lines: list[tuple[str, str, str, str]] = []  # the key that contains it, and the cells
    for row in rows:
        place, _, last = row.key.rpartition(".")
        if row.repeats or (not row.meaning and row.kind.schema.get("type") == "object"):
            continue
        if not row.meaning and place and lines and lines[-1][0] == place:
            _, keys, unit, meaning = lines[-1]
            lines[-1] = (place, f"{keys}, `.{last}`", unit, meaning)
        else:
            lines.append((place, f"`{row.key}`", row.kind.unit, row.meaning))
    return "".join(f"| {' | '.join(cells)} |\n" for _, *cells in lines)


def schema_of(name: str) -> dict[str, Any]:
    """Return the JSON schema of a kind of report, one of `REPORTS`."""
    report = REPORTS[name]
    root: dict[str, Any] = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"iccm.{name}/1",
        "description": report.title,
        "type": "object",
    }
    for row in report.rows:
        *path, last = row.key.split(".")
        node = root
        for key in path:
            node = node["properties"][key.removesuffix("[]")]
            node = node["items"] if key.endswith("[]") else node
        schema = deepcopy(row.kind.schema)  # objects are given properties
        if row.meaning:
            schema["description"] = row.meaning
        node.setdefault("properties", {})[last] = schema
        if row.always:
            node.setdefault("required", []).append(last)
    return root
