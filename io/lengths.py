"""Units of length, and the width and height of drawings in them."""

from __future__ import annotations

MILLIMETRES = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
"""Millimetres in the units of models and drawings, by the names that options have."""
CSS_PIXELS = {
    "px": 1.0,
    "in": 96.0,
    "cm": 96 / 2.54,
    "mm": 96 / 25.4,
    "q": 24 / 25.4,
    "pt": 96 / 72,
    "pc": 16.0,
}
"""Pixels in the absolute units of CSS, in lower case."""


def svg_size(size: complex, millimetres: float | None, unit: str = "") -> dict[str, str]:
    """Return the attributes `width` and `height` of an SVG drawing; none if the length of its unit is unknown.

    Args:
        size: width + i height in user units.
        millimetres: length of a user unit.
        unit: in which to write the size, one of `CSS_PIXELS`; otherwise millimetres.

    >>> svg_size(384 + 96j, 25.4 / 96, "in")
    {'width': '4in', 'height': '1in'}
    >>> svg_size(384 + 96j, 0.5)
    {'width': '192mm', 'height': '48mm'}
    """
    if millimetres is None:
        return {}
    unit = unit if unit in CSS_PIXELS else "mm"
    factor = millimetres * 96 / 25.4 / CSS_PIXELS[unit]
    suffix = {"px": "", "q": "Q"}.get(unit, unit)
    return {
        "width": f"{size.real * factor:.9g}{suffix}",
        "height": f"{size.imag * factor:.9g}{suffix}",
    }
