"""TPS files with two specimens (`.tps`), of which the first one is the source."""

from __future__ import annotations

import numpy as np

from ....errors import InputError
from ...geometry.tps import specimens_of
from .landmarks_file import LandmarksFile, digits
from .pairs import LandmarkPairs


class TpsPairs(LandmarksFile):
    """The landmarks of two specimens, paired by their numbers."""

    axes = ("lower-edge", "lower-edge")

    def parse(self, content: bytes) -> LandmarkPairs:
        """Return the landmarks that neither specimen lacks, named by their numbers from 1."""
        specimens = [points for _, points in specimens_of(content)]
        if len(specimens) != 2:
            raise InputError(f"has {len(specimens)} specimens; pairs need two, the source and the target")
        first, second = specimens
        if len(first) != len(second):
            raise InputError(f"the first specimen has {len(first)} landmarks but the second {len(second)}")
        pairs = LandmarkPairs(self.axes)
        for number, (z, w) in enumerate(zip(first.tolist(), second.tolist()), 1):
            if not np.isnan(z) and not np.isnan(w):
                pairs.append(str(number), (z.real, z.imag), (w.real, w.imag))
        return pairs

    def text(self, pairs: LandmarkPairs) -> str:
        """Return two specimens, called source and target."""
        lines: list[str] = []
        for specimen, points in (("source", pairs.source), ("target", pairs.target)):
            lines += [
                f"LM={len(points)}",
                *(" ".join(map(digits, point)) for point in points),
                f"ID={specimen}",
            ]
        return "\n".join(lines) + "\n"
