"""TPS files of landmarks, as in tpsDig and geomorph: y points up from the lower edge of the image."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ...arrays import Complex
from ...errors import InputError, naming
from ..point_syntax import coordinate
from .document import NOWHERE, Geometry, Images, TextDocument

MISSING = "NA NA"
_COUNT = re.compile(r"\s*(LM|POINTS)\s*=\s*([0-9]{1,9})\s*", re.IGNORECASE)
_KEY = re.compile(r"\s*(\w+)\s*=(.*)", re.DOTALL)
_SPECIMEN = re.compile(r"(?=^\s*LM\s*=)", re.IGNORECASE | re.MULTILINE)
_NAME = re.compile(r"^\s*(IMAGE|ID)\s*=(.*)$", re.IGNORECASE | re.MULTILINE)


@dataclass
class Tps(TextDocument):
    """Lines of text, and the numbers of those that are positions."""

    upward = True

    lines: list[str]
    places: list[int]
    geometry: Geometry
    notes: tuple[str, ...] = ()

    @classmethod
    def parse(cls, data: bytes, columns: str | None) -> Tps:
        """Parse LM=n and POINTS=n, which are followed by n positions; all other lines are kept."""
        lines = data.decode("utf-8-sig").splitlines()
        places: list[int] = []
        z: list[complex] = []
        remaining = 0
        for k, line in enumerate(lines):
            count = _COUNT.fullmatch(line)
            if remaining and not count and line.strip():
                z.append(_place(line, k + 1))
                places.append(k)
                remaining -= 1
            elif remaining and (count or line.strip()):
                raise InputError(
                    f"line {k + 1}: the landmarks before this line are incomplete ({remaining} missing)"
                )
            elif count:
                remaining = int(count[2])
            elif re.match(r"\s*LM3", line, re.IGNORECASE):
                raise InputError(
                    f"line {k + 1}: landmarks in space (LM3) are not supported; use two coordinates"
                )
            elif line.strip() and not _KEY.fullmatch(line):
                raise InputError(f"line {k + 1}: {line.strip()[:40]!r} is not KEY=VALUE")
        if remaining:
            raise InputError(f"the file ends before the last {remaining} landmarks")
        if not places:
            raise InputError("contains no landmarks (LM=…)")
        scaled = any(re.match(r"\s*SCALE\s*=", line, re.IGNORECASE) for line in lines)
        notes = ("SCALE is dropped, because it belongs to the original image",) if scaled else ()
        numbers = [str(number) for number in range(1, len(z) + 1)]
        return cls(lines, places, Geometry(np.array(z), names=numbers), notes)

    def text(self, images: Images) -> str:
        """Return the lines with images of positions; missing ones become NA, so that landmarks keep their numbers."""
        out = list(self.lines)
        for k, z in zip(self.places, images.points.tolist()):
            out[k] = f"{z.real!r} {z.imag!r}" if z == z else MISSING
        kept = [line for line in out if not re.match(r"\s*SCALE\s*=", line, re.IGNORECASE)]
        lines = [
            f"IMAGE={images.name}" if re.match(r"\s*IMAGE\s*=", line, re.IGNORECASE) else line
            for line in kept
        ]
        return "\n".join(lines) + "\n"


def _place(line: str, number: int) -> complex:
    words = line.split()
    if [word.upper() for word in words] == ["NA", "NA"]:
        return NOWHERE
    if len(words) != 2:
        raise InputError(
            f"line {number}: {line.strip()[:40]!r} is not a position; write its x and y, such as 12.5 40"
        )
    x, y = (coordinate(word, f"line {number}") for word in words)
    return complex(x, y)


def specimens_of(data: bytes) -> list[tuple[str, Complex]]:
    """Return name and landmarks (k,) of each specimen in a file; NaN for missing landmarks.

    The name is that in IMAGE=, else that in ID=, else empty. Points of curves are left out.

    Raises:
        InputError: the file is invalid; the message starts with what is wrong.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("not a UTF-8 text file; save it as UTF-8") from None
    blocks = [block for block in _SPECIMEN.split(text) if _COUNT.match(block)]
    if not blocks:
        raise InputError("contains no landmarks (LM=…)")
    specimens = []
    for number, block in enumerate(blocks, 1):
        with naming(f"specimen {number}"):
            points = Tps.parse(block.encode(), None).geometry.points
        names = {key.upper(): name.strip() for key, name in _NAME.findall(block)}
        count = _COUNT.match(block)
        assert count is not None
        specimens.append((names.get("IMAGE") or names.get("ID", ""), points[: int(count[2])]))
    return specimens
