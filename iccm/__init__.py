"""Iterative closest conformal maps between planar domains, and texture transfer through them.

    fit = iccm.fit(source, target)        # (n,) and (m,) complex vertices, x + iy, y up
    fit.map(z), fit.inverse(w), fit.report()
    iccm.transfer(texture, source, target).pixels     # (h, w, c) pixels to pixels on the target

Names are imported on first use, so that `import iccm` is fast.

__main__          `python -m iccm`
solve             `fit` and `deform`: check the input and call a method
texture_transfer  `transfer`, `warp` and STMaps: arrays in, arrays out
given             conversion of users' shapes: arrays, polygons, paths, contours
capabilities      which method supports which constraint, on which kinds of shapes
pins              pins, soft and exact
problem           the domains and constraints of a solve, checked
options           the options of a solve, with their ranges
result            `Fit`: the map and figures about its quality
status            how a solver ended
coverage          which parts of both shapes a map covers
transform         maps with the interface of scikit-image's transforms
balanced/         the default method: outline onto outline, without folds, with uniform scale
frames/           maps of whole drawings through frames
cartograms/       maps in which each region has a prescribed area
drawings/         whole drawings as regions, frames around them, and the cost of maps
conformal/        the conformal method, to a tolerance
paper/            the algorithm of the paper
projection/       sheets on simple surfaces seen by a camera
surfaces/         balanced maps of surfaces
flattening/       flattening of mesh patches into the plane
meshes/           triangle meshes, their topology, layouts and textures
maps/             maps: evaluation, inverse, injectivity, distortion
pixels/           pictures: sampling, filtering, coverage
saved/            saved maps, and points, lines and polygons mapped by them
linalg/           sparse factorisations
curve             polylines in the plane, closed or open
procrustes        landmarks superimposed, and mean outlines
polygons          unions and offsets of regions of many parts
plane             areas, boxes, similarities and exact orientation of points in the plane
buckets           a grid of square buckets for nearest points
sorting           stable orders of small integers
arrays            types of arrays, and conversions to them
axes              the meaning of pairs of numbers: y up or down, rows and columns
native/           the compiled core, C++ kernels called from Python
parallel          threads over slices of a fixed size
blas              linear algebra on one thread
memory            storage of large arrays
progress          progress of long computations, for listeners
deadline          limits on time
fits              the values of the option `fit`
errors            exceptions
io/               files: shapes, pictures, meshes, jobs, reports
cli/              the command line
extensions/       formats that are found by entry points, each in a folder that can be deleted
symmetry          mirror symmetry of outlines: how far an outline is from its mirror image, and its axes of symmetry
figures           figures about a result: distances of outlines, distortion, folds, and the report that collects them
fit_data          what a result consists of: a map, what was given, notes, and what follows from these at once
fit_files         results as saved maps, and back
limits            limits on inputs that the library checks itself; `iccm.io.limits` adds those of files, and has all of…
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .curve import Curve as Curve
    from .errors import Cancelled as Cancelled
    from .errors import IccmError as IccmError
    from .errors import InputError as InputError
    from .flattening.interpolation import morph as morph
    from .flattening.of_arrays import flatten as flatten
    from .io.read import read_image as read_image
    from .io.read import read_shape as read_shape
    from .maps.harmonic import HarmonicMap as HarmonicMap
    from .maps.triangulated.map import TriangulatedMap as TriangulatedMap
    from .pins import Pin as Pin
    from .pins import Stroke as Stroke
    from .pixels.checkerboard import checkerboard as checkerboard
    from .progress import Progress as Progress
    from .result import Fit as Fit
    from .result import load as load
    from .solve import deform as deform
    from .solve import fit as fit
    from .status import Status as Status
    from .texture_transfer import Transfer as Transfer
    from .texture_transfer import from_stmap as from_stmap
    from .texture_transfer import stmap as stmap
    from .texture_transfer import transfer as transfer
    from .texture_transfer import warp as warp
    from .transform import Transform as Transform

__version__ = "1.0.0"

_HOME = {
    "Cancelled": "errors",
    "Curve": "curve",
    "Fit": "result",
    "HarmonicMap": "maps.harmonic",
    "IccmError": "errors",
    "InputError": "errors",
    "Status": "status",
    "Transfer": "texture_transfer",
    "Transform": "transform",
    "TriangulatedMap": "maps.triangulated.map",
    "checkerboard": "pixels.checkerboard",
    "deform": "solve",
    "fit": "solve",
    "flatten": "flattening.of_arrays",
    "from_stmap": "texture_transfer",
    "load": "result",
    "Pin": "pins",
    "Stroke": "pins",
    "Progress": "progress",
    "morph": "flattening.interpolation",
    "read_image": "io.read",
    "read_shape": "io.read",
    "stmap": "texture_transfer",
    "transfer": "texture_transfer",
    "warp": "texture_transfer",
}
__all__ = sorted(_HOME)


if not TYPE_CHECKING:  # for a type checker, a module with __getattr__ has every name

    def __getattr__(name):
        if name not in _HOME:
            raise AttributeError(f"module 'iccm' has no attribute {name!r}")
        return getattr(import_module(f".{_HOME[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name.startswith("__")), *__all__})
