"""Limits on input and output: what exceeds one of them is rejected with a message, before memory is allocated for it.

Limits that a user can raise are defaults of options (`io/options.py`). Limits of a single method, such as the number of
vertices of its mesh, are defined with the method. `docs/limitations.md` lists all of them.
"""

from ..limits import (
    ARCHIVE_BYTES as ARCHIVE_BYTES,
)
from ..limits import (
    COORDINATE as COORDINATE,
)
from ..limits import (
    MESH_COORDINATE as MESH_COORDINATE,
)
from ..limits import (
    UNPACKED_BYTES as UNPACKED_BYTES,
)
from ..limits import (
    UNPACKED_RATIO as UNPACKED_RATIO,
)
from ..limits import (
    VERTICES as VERTICES,
)

FACES = 5_000_000
"""Faces of a mesh; --max-faces."""
PIXELS = 1 << 28
"""Pixels of a picture that is read or written; --max-pixels."""
SEGMENTS = 1 << 20
"""Lines and curves drawn by an SVG; --max-segments."""

SIDE = 1 << 17
"""Pixels of one side of a picture that is written."""
MEMORY = 1 << 62
"""Bytes that --memory accepts."""
NAME_BYTES = 255
"""Bytes of a file name, the limit of nearly every file system."""
TILE = 9999
"""Largest number of a tile (UDIM)."""

DRAWING_BYTES = 1 << 30
"""Bytes of a picture whose silhouette is traced, or of an OBJ that is read as an outline."""
SILHOUETTE_PIXELS = 1 << 27
"""Pixels of a picture whose silhouette is traced."""
PIECES = 50
"""Pieces of a silhouette that are traced, the largest first."""
PARTS = 64
"""Parts of a drawing for --parts all, the largest first: each needs a solution."""

SVG_BYTES = 32 << 20
"""Bytes of an SVG, and of the decompressed content of an .svgz."""
SVG_DEPTH = 200
"""Nested elements."""
JSON_DEPTH = 200
"""Nested lists and objects of JSON: functions that call themselves for each level can process them."""
SVG_ELEMENTS = 300_000
"""Elements of any kind, text and definitions included."""
SVG_SHAPES = 100_000
"""Paths, rectangles and so on, and subpaths: a tenth of a millisecond each."""
DXF_ENTITIES = 200_000
"""Entities that a DXF drawing shows, with those of each reference to a block: a tenth of a millisecond each."""
DXF_DEPTH = 30
"""References to blocks inside of each other."""
SVG_COPIES = 50_000
"""Elements that are repeated by <use>, clip paths, masks, markers and filters."""
SVG_COPIED = 8 << 20
"""Characters of repeated elements: a second or two."""
SVG_LINKS = 40
"""Length of a chain of definitions that refer to each other."""
SVG_LETTERS = 20_000
"""Letters of text that are outlined: 50 µs each."""
SVG_FONTS = 100
"""Fonts used by a drawing: some milliseconds each."""
SVG_POINTS = 4_000_000
"""Points of all shapes after curves are flattened: 64 MB, stored several times."""
SVG_NUMBER = 1e60
"""Largest coordinate, argument or length in a drawing, such that products of a few of them stay finite."""
STYLE_CHARACTERS = 1 << 20
"""Characters of style sheets: two seconds."""
SELECTORS, SELECTOR_CHARACTERS = 50_000, 1000
"""Selectors of style sheets, a second and a half, and characters of a selector; longer ones are ignored."""
RULES = 2_000_000
"""Steps in matching selectors with elements: a second and a half."""
CROSSINGS = 50_000
"""Crossings of outlines that are filled together: 50 µs and 3 KB each."""
CUT_FACES = 150_000
"""Faces into which outlines that cross themselves or each other cut the plane, of a whole drawing: 10 to 60 µs each."""
CUT_POINTS = 20_000_000
"""Points of shapes, and of the clip paths and masks that cut them: some seconds."""
NEAR_SEGMENTS, NESTED_RUNS = 4_000_000, 2_000_000
"""Pairs of segments, and of subpaths, whose boxes overlap: half a second, and a second."""
WINDINGS = 200_000_000
"""Points times segments for which winding numbers are computed: two seconds."""
ARTWORK_CURVES = 100_000
"""Lines and curves of a drawing that is mapped as artwork; each takes up to a millisecond."""
ARTWORK_COVERED = 3 * ARTWORK_CURVES
"""The same, counted once for every clip path, mask or filter that applies to them: 10 µs each."""
RENDERED_PIXELS = 1 << 24
"""Pixels of a drawing rendered for a map, and of a picture that is resampled inside of a drawing: a second."""
RENDER_SECONDS = 30.0
"""Seconds for rendering a drawing as a texture; few take one second."""

READ_PIXELS = 1 << 29
"""Pixels of a picture that is read without an option for the limit."""
MESH_BYTES = 4 << 30
"""Bytes of a mesh file, of a buffer beside it, or of the picture that is written with it."""
SCENE_BYTES = 1 << 26
"""Bytes of the JSON of a glTF file."""
BUFFER_BYTES = 1 << 32
"""Bytes of one buffer view of a glTF file."""
ITEMS_PER_FACE = 12
"""Elements in accessors of a glTF file without data, which are zeros, relative to the faces allowed."""
PRIMITIVES = 10_000
"""Primitives of a glTF file: a millisecond each."""
REPEATED_FACES = 100_000
"""Triangles of a glTF file that are drawn again at the same place: 50 µs and 4 KB each."""
DEFLATE_RATIO = 1032
"""Bytes for which a byte of compressed data can stand: a file that promises more is damaged."""
MESH_HEADER_BYTES = 1 << 16
"""Bytes of the header of a PLY, OFF or FreeSurfer file, with its comments."""
COPIES_3MF = 10_000
"""Objects of a 3MF file that are shown, with each copy: a millisecond each."""
VTK_POINTS_PER_FACE = 8
"""Points of a VTK file, relative to the faces allowed."""
USD_SECTIONS = 64
"""Sections of a binary USD file."""
GIFTI_DIMENSIONS = 6
"""Dimensions of an array of GIFTI."""
LIBRARY_BYTES = 16 << 20
"""Bytes of the material libraries of a mesh."""

GEOMETRY_BYTES = 1 << 30
"""Bytes of a file of points, lines and polygons."""
COLLECTION_DEPTH = 50
"""Collections of geometries inside of each other."""
FIELD_DIMENSIONS, FIELD_COMPONENTS = 4, 4
"""Dimensions of a picture or field of ITK, and values of a pixel: vectors and colours with alpha have fewer."""
WORLD_FILE_BYTES = 4096
"""Bytes of a world file, which has six numbers."""
PROJECTION_BYTES = 1 << 16
"""Bytes of the description of a coordinate reference system (.prj)."""
MAP_COORDINATE = 1e15
"""Largest coordinate at which a georeferenced picture lies, in units of its map."""
TIFF_DESCRIPTION_BYTES = 1 << 24
"""Bytes of the description in a TIFF file."""
CONSTRAINTS_BYTES = 16 << 20
"""Bytes of a file of pins and strokes."""
START_ENTRIES = 200_000
"""Vertices, and triangles, of an earlier map in a file of pins and strokes."""
FINGERPRINT_DIGITS = 16
"""Hexadecimal digits of the fingerprint of a starting map that is kept."""
MANIFEST_BYTES = 64 << 20
"""Bytes of a manifest."""
JOBS = 100_000
"""Jobs of a manifest."""
GLOB_ENTRIES, GLOB_SECONDS = 1_000_000, 60
"""Entries of folders that are searched for the patterns of a manifest, and seconds for that."""
DEPTH = 8
"""Nesting of lists and tables in a manifest; pins need three levels."""
TABLE_COLUMNS = 200_000
"""Columns of a table of points: one for each gene of an assay, and more."""
COMPARED_BYTES = 1 << 28
"""Bytes of a report or a file of tolerances for `iccm check`."""

READER_SECONDS, READER_SECONDS_PER_MEGABYTE = 6, 0.5
"""Processor time of the process that reads a file with a library in native code, and further time for large files: ten
times what the slowest of these libraries needs."""
READER_WALL_TIME_RATIO = 20
"""Time that this process may take relative to its processor time: other processes may keep the machine busy."""
READER_BYTES, READER_BYTES_RATIO = 2 << 30, 40
"""Address space of this process, and further address space relative to the size of the file, which may be compressed.
Libraries reserve up to a gigabyte when they are loaded."""

HANDLES = 400
"""Handles of a map."""
PAGE_PINS, PAGE_STROKES, PAGE_POINTS = 500, 100, 2000
"""Pins, strokes, and points of a stroke on the page of `iccm edit`."""
PAGE_MESSAGE_BYTES = 1 << 22
"""Bytes of a message from that page."""
PAGE_FILE_BYTES = 1 << 28
"""Bytes of a file chosen on that page."""
PAGE_TEXELS = 8192
"""Texels of one side of a texture on the page: supported by nearly every WebGL 2 implementation."""
