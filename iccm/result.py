"""The result of a solve: a map, what was given, and figures about its quality."""

import inspect
import warnings
from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from os import PathLike
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from .arrays import Box, Complex, Numbers, Pairs, Real
from .axes import is_pairs, on_pairs
from .curve import Curve
from .errors import InputError, MissingFileError
from .figures import Figures
from .fit_data import Details
from .fit_files import from_map_file, to_map_file
from .maps.extended_inverse import ExtendedInverse
from .maps.regions import outline_in_source
from .maps.summary import in_short
from .saved.map_file import MapFile, SavedPlane, read
from .transform import Transform

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DETAILS = tuple(field.name for field in fields(Details))
PLOTTED_PIXELS = 480  # of the picture in a plot, on its longer side


class Fit(Figures):
    """The result of `iccm.fit` and `iccm.deform`.

    Attributes:
        map: the continuous map from source to target.
        energies: one dict per iteration, from term name to value, with "total"; lengths are relative to the
            target's radius.
        source: the domain of the map.
        target: boundary of the target; None for a deformation.
        pins: (k, 2) complex, source and target of each pin.
        strokes: pairs of source and target strokes.
        notes: messages about decisions of the solver, such as omitted content.
        source_holes: outlines of the source's holes, clockwise.
        target_holes: those of the target's.
        rigid: the rigid regions, with their similarities and remaining distortion.
        axes: meaning of pairs of numbers in the source and in the target, see `iccm.axes`.
        details: how the map was set up: whole drawings, surfaces, holes, tolerances; see `iccm.fit_data.Details`.

    >>> import iccm
    >>> square = np.array([0, 1, 1 + 1j, 1j])
    >>> fit = iccm.fit(square, 2 * square)
    >>> complex(np.round(fit.inverse(1 + 1j), 3)), fit.report()["injective"]["certified"]
    ((0.5+0.5j), True)
    """

    __signature__ = inspect.signature(Figures)

    def __init__(self, *values: Any, **given: Any):
        if "ended" in given:  # its former name
            warnings.warn("Fit: pass _ended instead of ended", DeprecationWarning, stacklevel=2)
            given["_ended"] = given.pop("ended")
        if given.pop("passed_holes", None) is not None:
            warnings.warn("Fit: passed_holes has no effect", DeprecationWarning, stacklevel=2)
        if former := {name: given.pop(name) for name in DETAILS if name in given}:
            text = f"Fit: pass {' and '.join(former)} in details"
            warnings.warn(text, DeprecationWarning, stacklevel=2)
            given["details"] = replace(given.get("details", Details()), **former)
        super().__init__(*values, **given)

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if not name.startswith("_")]

    def __repr__(self) -> str:
        counts = [("pin", len(self.pins)), ("stroke", len(self.strokes)), ("hole", len(self.source_holes))]
        suffix = "".join(f", {count} {name}{'s' * (count > 1)}" for name, count in counts if count)
        kind, count = type(self.map).__name__, self.map.polygon.size
        return f"<Fit: {self._ended.name.lower()}, {kind} with {count} boundary vertices{suffix}>"

    if not TYPE_CHECKING:  # for a type checker, a class with __getattr__ has every attribute

        def __getattr__(self, name: str) -> Any:
            if name not in FORMER_NAMES:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            present, value = FORMER_NAMES[name]
            text = f"Fit.{name}: use {present}; the old name works until iccm 2"
            warnings.warn(text, DeprecationWarning, stacklevel=2)
            return value(self)

    @overload
    def inverse(self, w: Pairs) -> Real: ...

    @overload
    def inverse(self, w: complex) -> complex: ...

    @overload
    def inverse(self, w: Numbers) -> Complex: ...

    def inverse(self, w: Pairs | complex | Numbers) -> Complex | Real | complex:
        """Return the points z with map(z) = w.

        The result is NaN if there are none (for balanced maps, more than 1e-3 of the diagonal outside). Points
        are complex numbers of any shape, or pairs (…, 2); the result has the same form.

        Raises:
            InputError: neither complex numbers nor pairs.
        """
        if is_pairs(w):
            return on_pairs(self._inverse, w, self.axes[::-1])
        return self._inverse(w)[()]  # type: ignore[arg-type]

    @property
    def transform(self) -> Transform:
        """The map and its inverse with the interface of scikit-image's transforms.

        Points are complex or pairs of x and y. Pairs are always x and y, as in `skimage.transform`; y is down
        if the shapes were given that way. The inverse has a value everywhere inside the target: where the
        target stays bare, it is that of the nearest covered point.
        """
        source, target = ("xy" if axes == "xy" else "screen" for axes in self.axes)
        return Transform(self.map, self._inverse_inside, (source, target))

    def _inverse_inside(self, w: Complex) -> Complex:
        """Return the inverse; inside the target, where it is not covered, that of the nearest point of the image."""
        w = np.asarray(w, np.complex128)
        z = self._inverse(w)
        if self.target is None:
            return z
        flat, preimages = w.ravel(), z.ravel()
        missing = np.flatnonzero(np.isnan(preimages) & np.isfinite(flat))
        missing = missing[self.target.contains(flat[missing])]
        for hole in self.target_holes:
            missing = missing[~hole.contains(flat[missing])]
        if missing.size:
            preimages = preimages.copy()
            preimages[missing] = ExtendedInverse(self.map)(flat[missing])
        return preimages.reshape(w.shape)

    def then(self, other: "Fit | Transform") -> Transform:
        """Return the composition: this map first, then `other`, which starts from its target.

        Raises:
            InputError: `other` is not a map.
        """
        return self.transform.then(other.transform if isinstance(other, Fit) else other)

    def save(
        self, path: str | PathLike, planes: tuple[SavedPlane, SavedPlane] | None = None, **about: Any
    ) -> None:
        """Write the map to a file that `iccm.load` reads exactly, bit for bit. The name should end in .npz.

        Args:
            path: the file; it is replaced.
            planes: coordinate frames and canvases of the source's and the target's files, which are saved too;
                by default y up and bounding boxes.
            **about: further JSON data for `MapFile.about`.

        Raises:
            InputError: the map is between flattened surfaces, or the file cannot be written.
        """
        try:
            to_map_file(self, planes, about).write(path)
        except FileNotFoundError as error:
            raise MissingFileError(f"{path}: its folder does not exist") from error
        except (OSError, TypeError) as error:
            raise InputError(f"{path}: cannot write this file: {error}") from error

    def _repr_png_(self) -> bytes:
        """Return a numbered checkerboard mapped to the target, for notebooks."""
        from .pixels.thumbnail import png

        return png(self._checkerboard()[0])

    def _repr_html_(self) -> str:
        """Return the summary and a numbered checkerboard mapped to the target, for notebooks."""
        from base64 import b64encode
        from html import escape

        picture = b64encode(self._repr_png_()).decode()
        words = escape(self.summary() if self.status.ok else f"{self.summary()}. {self.status.value}")
        picture_tag = f'<img alt="the map" src="data:image/png;base64,{picture}">'
        return f"<figure>{picture_tag}<figcaption>{words}</figcaption></figure>"

    def plot(
        self,
        report: dict[str, Any] | None = None,
        names: tuple[str, str] = ("source", "mapped source"),
        carried: tuple[NDArray, Box] | None = None,
        *,
        ax: "Axes | None" = None,
    ) -> "Figure":
        """Return a matplotlib figure of the map: `fit.plot().savefig("fit.png")`.

        With `ax`, only the mapped picture and the target's outline are drawn there. Otherwise the figure shows
        a grid in the source and in the image, the mapped picture, area scale and dilatation over the source,
        and the report with its notes.

        Args:
            report: the report of the map, if it is already computed.
            names: titles of the source and of its image.
            carried: a mapped picture, 8 bits per channel in sRGB, and its box in the target's plane; by default
                a numbered checkerboard.
            ax: axes to draw into; their figure is returned.

        Raises:
            InputError: matplotlib is not installed.
        """
        if ax is not None:
            _figures().draw_carried(ax, carried or self._checkerboard(), self.target or Curve(self.image))
            return ax.figure  # type: ignore[return-value]
        return _figures().figure(
            *(self.map, self.source, self.target, self.image),
            openings=self.coverage.openings,
            lost=self.coverage.lost_regions,
            painted=[drawing.painted for drawing in self.details.drawings or ()],
            pins=self.pins,
            strokes=self.strokes,
            regions=[outline_in_source(region, self._inverse) for region in self.rigid],
            carried=carried or self._checkerboard(),
            report=report or self.report(),
            names=names,
        )

    def _checkerboard(self) -> tuple[NDArray, Box]:
        """Return a numbered checkerboard over the source's bounding box, mapped to the target, and its box there."""
        from .pixels.canvas import Canvas, proportional
        from .pixels.checkerboard import checkerboard
        from .pixels.texture import Texture
        from .pixels.warp import warp

        textured, box = self._boxes
        canvas = Canvas.about(*proportional(PLOTTED_PIXELS, box[1] - box[0]), box)
        return warp(self.map, Texture(checkerboard(), textured), canvas).pixels, canvas.box

    def summary(self) -> str:
        """Return the most important figures in one line, as the command line shows them.

        >>> import iccm
        >>> square = np.array([0, 1, 1 + 1j, 1j])
        >>> iccm.fit(square, 2 * square).summary()
        'scale within 2× on 100 % · no folds'
        """
        return in_short(self.report())


def _detail(name: str, fit: Fit) -> Any:
    return getattr(fit.details, name)


FORMER_NAMES: dict[str, tuple[str, Callable[[Fit], Any]]] = {
    **{name: (f"details.{name}", partial(_detail, name)) for name in DETAILS},
    "ended": ("status", lambda fit: fit._ended),
    "lost": ('report()["injective"]["folded"]', lambda fit: fit._folded_share),
    "has_drifted": ("status", lambda fit: fit._has_drifted),
    "is_far_off": ("status", lambda fit: fit._is_far_off),
    "doubts": ('report()["notes"]', lambda fit: fit._doubts),
    "iterations": ('report()["iterations"]', lambda fit: max(0, len(fit.energies) - 1)),
    "boxes": ("source.box and target.box", lambda fit: fit._boxes),
    "boundary": ('report()["boundary"]', lambda fit: fit._boundary),
    "diagonal": ("target.diagonal", lambda fit: fit._diagonal),
    "inverted": ("transform.inverse", lambda fit: lambda: fit.transform.inverse),
    "interior": ("points of your own", lambda fit: fit._interior),
    "outline_of": (
        "the rings of the region",
        lambda fit: lambda region: outline_in_source(region, fit._inverse),
    ),
    "seen": ("coverage.hidden and coverage.bare", lambda fit: fit.coverage.seen),
    "shown": ("1 - coverage.hidden", lambda fit: _shown(fit)),
    "covered": ("1 - coverage.bare", lambda fit: _covered(fit)),
    "left_out": ("coverage.hidden", lambda fit: fit.coverage.left_out),
    "uncovered": ("coverage.bare", lambda fit: fit.coverage.uncovered),
    "unseen": ("coverage.lost_regions", lambda fit: fit.coverage.unseen),
    "without_partner": ("coverage.lost_regions", lambda fit: fit.coverage.without_partner),
    "cracks": ("coverage.cracks", lambda fit: fit.coverage.cracks),
    "is_partial": ("coverage.is_partial", lambda fit: fit.coverage.is_partial),
    "openings": ("coverage.openings", lambda fit: fit.coverage.openings),
    "passed_holes": ("nothing: maps do not ignore holes", lambda fit: ((), ())),
    "voids": ("coverage.voids", lambda fit: fit.coverage.voids),
    "moved_rings": ("map", lambda fit: fit._moved_rings),
    "visible_map": ("map", lambda fit: fit._visible_map),
}
"""Former names of attributes of `Fit`: what to use instead, and their value."""


def _shown(fit: Fit) -> float | None:
    return None if fit.coverage.seen is None else 1 - fit.coverage.seen.hidden


def _covered(fit: Fit) -> float | None:
    return None if fit.coverage.seen is None and fit.target is None else 1 - fit.coverage.bare


def _figures() -> Any:
    """Return the module that draws figures.

    Raises:
        InputError: matplotlib is not installed.
    """
    try:
        from .maps import figure
    except ImportError:
        raise InputError("plot needs the package matplotlib: pip install 'iccm[plot]'") from None
    return figure


def refuse_other_results(fit: Any, name: str) -> None:
    """Raise an InputError if something is not a result of `iccm.fit` or `iccm.deform`."""
    if not isinstance(fit, Fit):
        raise InputError(
            f"{name}: takes a result of iccm.fit or iccm.deform, not of type {type(fit).__name__}"
        )


def result_of(map_file: MapFile) -> Fit:
    """Return the result that a map file contains.

    Raises:
        InputError: the data about the map are inconsistent.
    """
    data = from_map_file(map_file)
    return Fit(**{field.name: getattr(data, field.name) for field in fields(data)})


def load(path: str | PathLike) -> Fit:
    """Return the result that `Fit.save`, or `iccm map -o map.npz`, wrote; it evaluates to the same values, bit for bit.

    Raises:
        MissingFileError: the file does not exist; also an InputError and a FileNotFoundError.
        InputError: the file does not contain a valid map.

    >>> import tempfile, pathlib, iccm
    >>> square = np.array([0, 1, 1 + 1j, 1j])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     iccm.fit(square, 3 * square).save(path := pathlib.Path(folder) / "map.npz")
    ...     complex(np.round(iccm.load(path).map(0.5 + 0.5j), 6))
    (1.5+1.5j)
    """
    if not isinstance(path, str | PathLike):
        raise InputError(f"load: takes the name of a file, not an object of type {type(path).__name__}")
    try:
        return result_of(read(path))
    except MissingFileError:
        raise
    except InputError as error:
        raise error if str(error).startswith(str(path)) else error.named(path) from error
