"""Affine maps of the plane as SVG writes them: `transform` lists, viewports and their composition."""

import math
import re
from dataclasses import dataclass
from functools import lru_cache

from ...errors import InputError

_FUNCTION = re.compile(r"[\s,]*+([A-Za-z]++)\s*+\(([^()]*+)\)")
_ARGUMENT = re.compile(
    r"\s*+(?:,\s*+)?([+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?)(px|deg|rad|grad|turn)?"
)
_ALLOWED = {
    "matrix": (6,),
    "translate": (1, 2),
    "scale": (1, 2),
    "rotate": (1, 3),
    "skewX": (1,),
    "skewY": (1,),
    **dict.fromkeys(("translateX", "translateY", "scaleX", "scaleY", "rotateZ"), (1,)),
}
_DEGREES = {"rad": 180 / math.pi, "grad": 0.9, "turn": 360.0}


@dataclass(frozen=True)
class Affine:
    """The map z -> alpha z + beta conj(z) + gamma of points x + iy, whichever way y points."""

    alpha: complex = 1
    beta: complex = 0
    gamma: complex = 0

    @classmethod
    def matrix(cls, a: float, b: float, c: float, d: float, e: float, f: float) -> "Affine":
        """Create SVG's matrix(a b c d e f): x' = a x + c y + e, y' = b x + d y + f."""
        return cls(complex(a + d, b - c) / 2, complex(a - d, b + c) / 2, complex(e, f))

    def __call__(self, z):
        """Return the image of a complex number or array."""
        return self.alpha * z + self.beta * z.conjugate() + self.gamma

    def __matmul__(self, inner: "Affine") -> "Affine":
        """Return the map that applies `inner` first, as nested SVG elements do."""
        return Affine(
            self.alpha * inner.alpha + self.beta * inner.beta.conjugate(),
            self.alpha * inner.beta + self.beta * inner.alpha.conjugate(),
            self(complex(inner.gamma)),
        )

    @property
    def determinant(self) -> float:
        """The factor by which areas change, negative for a reflection."""
        return abs(self.alpha) ** 2 - abs(self.beta) ** 2

    @property
    def inverse(self) -> "Affine":
        """The inverse map; the determinant must not be zero."""
        alpha, beta = complex(self.alpha).conjugate() / self.determinant, -self.beta / self.determinant
        return Affine(alpha, beta, -(alpha * self.gamma + beta * complex(self.gamma).conjugate()))


def to_svg(map: Affine) -> str:
    """Return the map as SVG's matrix(a b c d e f)."""
    x, y, shift = map.alpha + map.beta, map.alpha - map.beta, complex(map.gamma)
    return (
        "matrix("
        + " ".join(f"{v:.9g}" for v in (x.real, x.imag, -y.imag, y.real, shift.real, shift.imag))
        + ")"
    )


@lru_cache(64)  # for elements that <use> draws again
def parse(text: str) -> Affine:
    """Return the map of a `transform` attribute; empty or `none` is the identity.

    Raises:
        InputError: an unknown function, a wrong number of arguments, or anything that is not a number.
    """
    result, position = Affine(), 0
    if text.strip() in ("", "none"):
        return result
    while match := _FUNCTION.match(text, position):
        result = result @ _function(match[1], match[2])
        position = match.end()
    if text[position:].strip(" \t\r\n,"):
        raise InputError(f"transform: invalid at {text[position:].strip()[:24]!r}")
    return result


def _function(name: str, text: str) -> Affine:
    values, position = [], 0
    while match := _ARGUMENT.match(text, position):
        values.append(float(match[1]) * _DEGREES.get(match[2] or "", 1.0))
        position = match.end()
    if (
        text[position:].strip()
        or len(values) not in _ALLOWED.get(name, ())
        or not all(map(math.isfinite, values))
    ):
        raise InputError(f"transform: invalid {name}({text.strip()[:32]})")
    if name == "matrix":
        return Affine.matrix(*values)
    if name == "translate":
        return translation(*values)
    if name in ("translateX", "translateY"):
        return translation(*(values if name == "translateX" else [0, *values]))
    if name in ("scaleX", "scaleY"):
        x, y = (values[0], 1) if name == "scaleX" else (1, values[0])
        return Affine.matrix(x, 0, 0, y, 0, 0)
    if name == "scale":
        return Affine.matrix(values[0], 0, 0, values[-1], 0, 0)
    if name in ("rotate", "rotateZ"):
        return rotation(*values)
    shear = math.tan(math.radians(values[0]))
    return Affine.matrix(1, 0, shear, 1, 0, 0) if name == "skewX" else Affine.matrix(1, shear, 0, 1, 0, 0)


def translation(x: float, y: float = 0) -> Affine:
    """Return the translation by (x, y)."""
    return Affine(gamma=complex(x, y))


def rotation(degrees: float, x: float = 0, y: float = 0) -> Affine:
    """Return SVG's rotation about (x, y), from the x axis towards the y axis."""
    turn, centre = complex(math.cos(math.radians(degrees)), math.sin(math.radians(degrees))), complex(x, y)
    return Affine(turn, 0, centre - turn * centre)


def viewport(
    place: tuple[float, float, float, float], box: tuple[float, float, float, float], aspect: str
) -> Affine:
    """Return the map from a viewBox (x, y, width, height) to the rectangle `place` under `preserveAspectRatio`.

    Raises:
        InputError: `aspect` is malformed.
    """
    match = re.fullmatch(
        r"(?:defer\s+)?(?:(none)|x(Min|Mid|Max)Y(Min|Mid|Max))(?:\s+(meet|slice))?", aspect.strip()
    )
    if not match:
        raise InputError(f"preserveAspectRatio: invalid value {aspect[:32]!r}")
    sx, sy = place[2] / box[2], place[3] / box[3]
    if not match[1]:
        sx = sy = max(sx, sy) if match[4] == "slice" else min(sx, sy)
    part = {"Min": 0.0, "Mid": 0.5, "Max": 1.0, None: 0.0}
    x = place[0] + (place[2] - sx * box[2]) * part[match[2]] - sx * box[0]
    y = place[1] + (place[3] - sy * box[3]) * part[match[3]] - sy * box[1]
    return Affine.matrix(sx, 0, 0, sy, x, y)
