"""Data of pictures of numbers besides their pixels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

HALF = 65536  # 32-bit integers are sampled as two 16-bit ones
INTEGERS = "iu"


@dataclass(frozen=True, eq=False)
class Raster:
    """Data of pictures of numbers besides their pixels.

    Attributes:
        dtype: of the numbers in the file.
        nodata: the value that stands for no data, if any.
        labels: whether the numbers are those of regions, which must not be mixed.
        halves: whether each channel is stored as two of 16 bits, the lower half first.
        pages: number of pages of the file, which are the bands; 1 if the bands are in one page.
        description: that of ImageJ or OME.
        shown: how ImageJ shows the channels, which stays true: their names, ranges and lookup tables.
        resolution: pixels per unit in x and y, as TIFF states it for ImageJ.
        bands: what GDAL states about each band, as (index, name, role, text): its name, unit, scale and offset.
        colormap: (3, n) palette of a TIFF.
    """

    dtype: np.dtype
    nodata: float | None = None
    labels: bool = False
    halves: bool = False
    pages: int = 1
    description: str = ""
    shown: Mapping[str, Any] = field(default_factory=dict)
    resolution: tuple[Any, Any] | None = None
    bands: tuple[tuple[int, str, str, str], ...] = ()
    colormap: NDArray | None = None

    @property
    def fill(self) -> float:
        """The value beyond the shape: that of no data, else 0."""
        return 0.0 if self.nodata is None else self.nodata

    def restore(self, pixels: NDArray, alpha: int) -> NDArray:
        """Return (h, w, bands) numbers as in the file, from (h, w, c) sampled pixels and the index of their alpha."""
        inside = pixels[..., alpha] > (0.5 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max // 2)
        values = np.delete(pixels, alpha, axis=2)
        if self.halves:
            wide = values[..., 0::2].astype(np.int64) + HALF * values[..., 1::2].astype(np.int64)
            values = wide.astype(np.uint32).view(self.dtype) if self.dtype.itemsize == 4 else wide
        if self.dtype.kind in INTEGERS and values.dtype.kind == "f":
            bounds = np.iinfo(self.dtype)
            values = np.clip(np.rint(values.astype(float)), bounds.min, bounds.max)
        values = values.astype(self.dtype)
        values[~inside] = np.array(self.fill).astype(self.dtype)
        return values
