"""Mean and standard deviation of pictures at each pixel, with the number of pictures that show it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Index, Real
from ...errors import InputError
from ...pixels.colour import srgb_from_linear
from ..pictures import image_files
from ..pictures.image import Image

SHOWN_ALPHA = 0.5  # alpha from which a picture counts at a pixel
LARGEST_SHOWN_QUANTILE = 0.999  # of the spread, which has the brightest colour: a few pixels may exceed it


@dataclass(frozen=True, eq=False)
class Statistics:
    """Statistics of pictures of the same size.

    Attributes:
        mean: (h, w, c) mean of the colours as stored, from 0 to 1; 0 where no picture counts.
        spread: (h, w, c) sample standard deviation (n - 1); 0 where fewer than two pictures count.
        count: (h, w) number of pictures that count.
    """

    mean: Real
    spread: Real
    count: Index

    @classmethod
    def of(cls, paths: Iterable[str]) -> Statistics:
        """Read pictures one after another, and return their statistics (Welford 1962).

        A picture counts where its alpha is at least one half. Grey pictures become colours if others have colours.

        Raises:
            InputError: a picture cannot be read.
        """
        mean: NDArray | None = None
        squares: NDArray | None = None
        count: NDArray | None = None
        for path in paths:
            colours, counted = _read(path)
            if mean is None or squares is None or count is None:
                mean, squares = np.zeros(colours.shape), np.zeros(colours.shape)
                count = np.zeros(colours.shape[:2], np.int64)
            if colours.shape[2] > mean.shape[2]:
                mean, squares = (np.repeat(part, colours.shape[2], axis=2) for part in (mean, squares))
            elif colours.shape[2] < mean.shape[2]:
                colours = np.repeat(colours, mean.shape[2], axis=2)
            count += counted
            change = np.where(counted[..., None], colours - mean, 0.0)
            mean += change / np.maximum(count, 1)[..., None]
            squares += change * np.where(counted[..., None], colours - mean, 0.0)
        if mean is None or squares is None or count is None:
            raise InputError("no pictures to summarise")
        spread = np.sqrt(np.maximum(squares, 0) / np.maximum(count - 1, 1)[..., None])
        return cls(mean, spread, count)

    @property
    def counted(self) -> NDArray[np.bool_]:
        """(h, w) where at least one picture counts."""
        is_counted: NDArray[np.bool_] = self.count > 0
        return is_counted

    @property
    def overall(self) -> Real:
        """(h, w) the spread of all channels: the root of the mean of their variances."""
        overall: Real = np.sqrt(np.mean(self.spread**2, axis=2))
        return overall

    def figures(self) -> dict[str, Any]:
        """Return figures for the report: quantiles of the spread where at least two pictures count."""
        several = self.overall[self.count > 1]
        if not several.size:
            return {}
        return {
            "mean": float(several.mean()),
            "median": float(np.median(several)),
            "p95": float(np.quantile(several, 0.95)),
            "max": float(several.max()),
        }

    def write(self, folder: Path, names: dict[str, str]) -> float:
        """Write the statistics as pictures.

        Args:
            folder: where to write.
            names: name of the file for `mean` and `spread` (to look at), `mean_data` and `spread_data` (floats with
                alpha), and `count` (whole numbers).

        Returns:
            The spread that the brightest colour of the picture shows.
        """
        alpha = self.counted[..., None]
        eight = np.rint(255 * np.concatenate([np.clip(self.mean, 0, 1), alpha], axis=2)).astype(np.uint8)
        last = eight.shape[2] - 1
        several = self.overall[self.count > 1]
        largest = float(np.quantile(several, LARGEST_SHOWN_QUANTILE)) if several.size else 0.0
        image_files.write(folder / names["mean"], Image(eight, last))
        image_files.write(folder / names["spread"], Image(_heat(self.overall, largest, self.counted), 3))
        for name, values in (("mean_data", self.mean), ("spread_data", self.spread)):
            floats = np.concatenate([values, alpha], axis=2).astype(np.float32)
            image_files.write(folder / names[name], Image(floats, last, colorspace="data"))
        count = np.minimum(self.count, np.iinfo(np.uint16).max).astype(np.uint16)
        image_files.write(folder / names["count"], Image(count[..., None], colorspace="data"))
        return largest


def _read(path: str) -> tuple[NDArray, NDArray[np.bool_]]:
    """Return colours (h, w, c) from 0 to 1 without alpha, and where the picture counts."""
    image = image_files.read(path)
    scale = np.iinfo(image.pixels.dtype).max if image.pixels.dtype.kind == "u" else 1
    values: NDArray = image.pixels.astype(float) / scale
    if image.alpha < 0:
        return values, np.ones(values.shape[:2], bool)
    return np.delete(values, image.alpha, axis=2), values[..., image.alpha] >= SHOWN_ALPHA


def _heat(values: Real, largest: float, counted: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return values as colours from black to bright yellow, transparent where nothing is shown."""
    import OpenImageIO as oiio

    shares = np.clip(values / largest, 0, 1) if largest > 0 else np.zeros(values.shape)
    light = oiio.ImageBufAlgo.color_map(oiio.ImageBuf(shares[..., None].astype(np.float32)), 0, "inferno")
    colours = srgb_from_linear(light.get_pixels(oiio.FLOAT))
    shown = np.where(counted, 1.0, 0.0)[..., None]
    return np.rint(255 * np.concatenate([np.clip(colours, 0, 1), shown], axis=2)).astype(np.uint8)
