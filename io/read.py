"""Reading files from Python: `read_shape` for `iccm.fit`, `read_image` for textures."""

from __future__ import annotations

from os import PathLike, fspath
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .pictures import image_files
from .run.inputs import Inputs
from .run.job import make
from .shapes.shape import Shape


def read_shape(
    path: str | PathLike,
    *,
    trace: Literal["auto", "dark", "light", "inside"] = "auto",
    cut_open: bool = False,
) -> Shape:
    """Read a shape from a drawing, a picture with a silhouette, a mesh or a font, as `iccm.fit` takes it.

    Args:
        path: A file, or `file#id`, an element of it, as on the command line: `logo.svg#badge`, `font.ttf#text=Word`.
        trace: How to find a shape in a picture: "auto", "dark", "light" or "inside".
        cut_open: Whether a closed mesh may be cut open.

    Returns:
        A shape with `curve`, the outline in the plane with y up, `holes`, and `box`, the corners of the canvas.

    Raises:
        InputError: The file is missing, or no shape can be read from it.

    Examples:
        >>> import iccm
        >>> import pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder) / "kite.svg"
        ...     _ = path.write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0L4 1L5 5L1 4Z"/></svg>')
        ...     iccm.read_shape(path).curve.area
        15.0
    """
    text = fspath(path)
    return Inputs(make({"source": text, "trace": trace, "cut_open": cut_open, "no_cut": not cut_open})).shape(
        text
    )


def read_image(path: str | PathLike) -> NDArray:
    """Read a picture as an array (h, w, c) of the type that is stored, row 0 on top, with straight alpha.

    Args:
        path: Any picture that `iccm map --texture` takes.

    Raises:
        InputError: The file is missing, or is not a picture.

    Examples:
        >>> import iccm
        >>> import pathlib, tempfile
        >>> from PIL import Image
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     Image.new("RGB", (3, 2), (255, 0, 0)).save(path := pathlib.Path(folder) / "red.png")
        ...     iccm.read_image(path).shape
        (2, 3, 3)
    """
    return np.asarray(image_files.read(fspath(path)).pixels)
