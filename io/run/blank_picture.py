"""Detection of blank pictures: an empty or single-coloured picture is never written without a note."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

ALIKE_VALUE_SHARE = 0.01
"""Relative to white, or to the largest value: colours that differ by less look the same."""
OPAQUE_ALPHA = 0.99  # alpha above which a pixel counts as opaque: the highest 8-bit values


class Colours:
    """The colours of a picture, inspected block by block until two different ones are found.

    Args:
        numbers: whether it is one of numbers, such as counts, which may be small compared with those of its type.
    """

    def __init__(self, *, numbers: bool = False) -> None:
        self._numbers = numbers
        self.empty = True
        self._low: NDArray | None = None
        self._high: NDArray | None = None
        self._several = False

    @property
    def single(self) -> bool:
        """Whether there are opaque pixels, and all of them have the same colour."""
        return self._low is not None and not self._several

    def see(self, pixels: NDArray, alpha: int) -> None:
        """Inspect the next block (rows, width, c) of a picture; `alpha` is the index of its alpha channel, or -1."""
        if self._several:
            return
        white = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1.0
        if alpha >= 0:
            self.empty = self.empty and not pixels[..., alpha].any()
            colours = pixels[pixels[..., alpha] >= OPAQUE_ALPHA * white]
            colours = np.delete(colours, alpha, axis=1)
        else:
            self.empty = self.empty and not pixels.size
            colours = pixels.reshape(-1, pixels.shape[2])
        colours = colours[np.isfinite(colours).all(axis=1)] if colours.dtype.kind == "f" else colours
        if not colours.size:
            return
        low, high = colours.min(axis=0).astype(float), colours.max(axis=0).astype(float)
        self._low = low if self._low is None else np.minimum(low, self._low)
        self._high = high if self._high is None else np.maximum(high, self._high)
        of_type = pixels.dtype.kind == "u" and not self._numbers
        largest = white if of_type else np.abs([self._low, self._high]).max()
        self._several = bool((self._high - self._low > ALIKE_VALUE_SHARE * largest).any())

    def note(self, covered: bool, textured: bool) -> str | None:
        """Return a note if the picture is blank, else None.

        Args:
            covered: whether any pixel lies in the target.
            textured: whether the texture's place in the source could be changed by an option.
        """
        if self.empty:
            if not covered:
                return "the picture is empty: no part of the target lies in the area that it shows"
            reason, picture = "the texture is transparent where the source lies", "the picture is empty"
        elif self.single:
            reason, picture = (
                "the texture has only one colour where the source lies",
                "the picture shows a single colour",
            )
        else:
            return None
        return f"{picture}: {reason}" + (
            "; use --texture-box bbox to lay the whole texture on the source" if textured else ""
        )
