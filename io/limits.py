"""Limits on what is read and made: input above one of them is rejected in a line, before memory is taken for it.

A limit that a user can raise is the default of an option (`io/options.py`). What a method bounds for itself, such as
the vertices of its mesh, stands with the method.
"""

FACES = 5_000_000
"""Faces of a mesh; --max-faces."""
PIXELS = 1 << 28
"""Pixels of a picture, read or made; --max-pixels."""
SEGMENTS = 1 << 20
"""Lines and curves that an SVG draws; --max-segments."""

SIDE = 1 << 17
"""Pixels of one side of a picture that is made."""
MEMORY = 1 << 62
"""Bytes that --memory can name."""
VERTICES = 4000
"""Boundary vertices that --vertices can ask for: a map's equations are a dense matrix."""
BALANCE = 10
"""The largest --balance: beyond 4 areas hardly change, and angles pay for it."""
COORDINATE = 1e100
"""The largest coordinate of a point that a user names."""
NAME_BYTES = 255
"""Bytes of one name of a file, on nearly every disk."""
TILE = 9999
"""The largest number of a tile (UDIM)."""

DRAWING_BYTES = 1 << 30
"""Bytes of a picture whose silhouette is traced, or of an OBJ that is read as an outline."""
SILHOUETTE_PIXELS = 1 << 27
"""Pixels of a picture whose silhouette is traced."""
PIECES = 50
"""Pieces of a silhouette that are traced, the largest first."""
PARTS = 64
"""Parts of a drawing that --parts all maps, the largest first: each is solved for."""

SVG_BYTES = 32 << 20
"""Bytes of an SVG, and of what a compressed one (.svgz) holds."""
SVG_DEPTH = 200
"""Nested elements."""
SVG_ELEMENTS = 300_000
"""Elements of any kind, text and definitions included."""
SVG_SHAPES = 100_000
"""Paths, rectangles and so on, and runs of paths: a tenth of a millisecond each."""
SVG_COPIES = 50_000
"""Elements that <use>, clip paths, masks, markers and filters make again."""
SVG_COPIED = 8 << 20
"""Characters of these: a second or two."""
SVG_LINKS = 40
"""Definitions that refer to each other in a chain."""
SVG_LETTERS = 20_000
"""Letters of texts that are outlined: 50 µs each."""
SVG_FONTS = 100
"""Fonts that a drawing asks for: some milliseconds each."""
SVG_POINTS = 4_000_000
"""Points of all shapes once their curves are polylines: 64 MB, several times."""
SVG_NUMBER = 1e60
"""The largest coordinate, argument or length in a drawing: products of a few of them stay finite."""
STYLE_CHARACTERS = 1 << 20
"""Characters of style sheets: two seconds."""
SELECTORS, SELECTOR_CHARACTERS = 50_000, 1000
"""Selectors of style sheets, a second and a half, and characters of one; longer ones are not read."""
RULES = 2_000_000
"""Steps in holding selectors against elements: a second and a half."""
CROSSINGS = 50_000
"""Crossings of the outlines that are filled together: 50 µs and 3 KB each."""
CUT_POINTS = 20_000_000
"""Points of shapes, and of the clip paths and masks that cut them: some seconds."""
NEAR_SEGMENTS, NESTED_RUNS = 4_000_000, 2_000_000
"""Pairs of segments, and of runs, whose boxes overlap: half a second, and a second."""
WINDINGS = 200_000_000
"""Points times segments, for which windings are counted: two seconds."""
ARTWORK_CURVES = 100_000
"""Lines and curves of a drawing that is carried as artwork, each of which takes up to a millisecond."""
ARTWORK_COVERED = 3 * ARTWORK_CURVES
"""Of these, as often as each lies under a clip path, mask or filter: 10 µs."""
RENDER_SECONDS = 30.0
"""Seconds that rendering a drawing as a texture may take; few take one."""

READ_PIXELS = 1 << 29
"""Pixels of a picture that is read where no option bounds them."""
MESH_BYTES = 4 << 30
"""Bytes of a mesh file, of a buffer beside it, or of the picture that it is written with."""
SCENE_BYTES = 1 << 26
"""Bytes of the JSON of a glTF file."""
BUFFER_BYTES = 1 << 32
"""Bytes of one buffer view of a glTF file."""
ITEMS_PER_FACE = 12
"""Items of a glTF file without data, which stand for zeros, by the faces that are allowed."""
LIBRARY_BYTES = 16 << 20
"""Bytes of a material library that is read."""

GEOMETRY_BYTES = 1 << 30
"""Bytes of a file of points, lines and polygons."""
CONSTRAINTS_BYTES = 16 << 20
"""Bytes of a file of pins and strokes."""
START_ENTRIES = 200_000
"""Vertices, and triangles, of the earlier map that a file of pins and strokes may hold."""
MANIFEST_BYTES = 64 << 20
"""Bytes of a manifest."""
JOBS = 100_000
"""Jobs of a manifest."""
GLOB_ENTRIES, GLOB_SECONDS = 1_000_000, 60
"""Entries of folders that the globs of a manifest look at, and how long they may take."""
DEPTH = 8
"""Lists and tables in each other, in a manifest; pins need three."""
COMPARED_BYTES = 1 << 28
"""Bytes of a report or of tolerances that `iccm check` reads."""

PAGE_PINS, PAGE_STROKES, PAGE_POINTS = 500, 100, 2000
"""Pins, strokes, and points of a stroke, that the page of `iccm edit` may place."""
PAGE_MESSAGE_BYTES = 1 << 22
"""Bytes of one message of that page."""
PAGE_FILE_BYTES = 1 << 28
"""Bytes of a file that is chosen on that page."""
PAGE_TEXELS = 8192
"""Texels of one side of a texture that the page shows: what nearly every WebGL 2 takes."""
