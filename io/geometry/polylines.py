"""OBJ files with lines (`l`) and points (`p`) in a plane z = constant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ..point_syntax import coordinate
from .document import Geometry, Images, TextDocument

_KEPT = (b"o", b"g", b"#")


@dataclass
class Polylines(TextDocument):
    """Elements in order: text that is kept, points, and lines.

    Attributes:
        order: "text", "p" or "l" with their content, in file order.
        z: the height of the plane.
    """

    keeps = False

    order: list[tuple[str, str]]
    z: float
    geometry: Geometry

    @classmethod
    def parse(cls, data: bytes, columns: str | None) -> Polylines:
        """Parse vertices and the elements that refer to them by number; negative numbers count from the end."""
        vertices: list[tuple[float, float, float]] = []
        order: list[tuple[str, str]] = []
        points: list[complex] = []
        lines: list[np.ndarray] = []
        for k, line in enumerate(data.decode("utf-8-sig").replace("\\\n", " ").splitlines()):
            words, where = line.split(), f"line {k + 1}"
            if not words:
                continue
            if words[0] == "v":
                if len(words) < 4:
                    raise InputError(f"{where}: a vertex needs x, y and z")
                x, y, z = (coordinate(word, where) for word in words[1:4])
                vertices.append((x, y, z))
            elif words[0] in ("l", "p"):
                corners = np.array([_vertex(word, vertices, where) for word in words[1:]])
                if corners.size < (2 if words[0] == "l" else 1):
                    raise InputError(f"{where}: has too few vertices")
                if words[0] == "l":
                    lines.append(corners)
                    order.append(("l", ""))
                else:
                    points += corners.tolist()
                    order += [("p", "")] * corners.size
            elif words[0] == "f":
                raise InputError(f"{where}: is a face; only lines (l) and points (p) can be mapped")
            elif words[0] in ("o", "g") or line.startswith("#"):
                order.append(("text", line))
        if not (points or lines):
            raise InputError("contains no lines (l) or points (p)")
        heights = [height for _, _, height in vertices]
        if max(heights) - min(heights) > 1e-6 * np.ptp(np.array(vertices), axis=0).max():
            raise InputError("its vertices do not lie in a plane z = constant")
        return cls(order, heights[0], Geometry(np.array(points, complex), lines))

    def text(self, images: Images) -> str:
        """Return the same elements with new vertices; a line that was cut becomes several."""
        out: list[str] = []
        count, points, lines = 0, iter(images.points.tolist()), iter(images.lines)
        for kind, text in self.order:
            if kind == "text":
                out.append(text)
                continue
            pieces = [[next(points)]] if kind == "p" else [piece.tolist() for piece in next(lines)]
            for piece in pieces:
                if not all(z == z for z in piece):
                    continue
                out += [f"v {z.real!r} {z.imag!r} {self.z!r}" for z in piece]
                out.append(f"{kind} {' '.join(str(count + k + 1) for k in range(len(piece)))}")
                count += len(piece)
        return "\n".join(out) + "\n"


def _vertex(word: str, vertices: list[tuple[float, float, float]], where: str) -> complex:
    try:
        number = int(word.partition("/")[0])
    except ValueError:
        number = 0
    index = number - 1 if number > 0 else len(vertices) + number
    if number == 0 or not 0 <= index < len(vertices):
        raise InputError(f"{where}: no vertex {word}")
    return complex(*vertices[index][:2])
