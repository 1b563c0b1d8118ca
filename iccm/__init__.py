"""Iterative closest conformal maps between planar domains, and texture transfer through them.

    fit = iccm.fit(source, target)        # (n,) and (m,) complex vertices, x + iy, y up
    fit.map(z), fit.inverse(w), fit.report()
    iccm.transfer(texture, source, target).pixels     # (h, w, c) pixels to pixels on the target

Names are imported when first used, so that `import iccm` costs nothing.
"""

from importlib import import_module

__version__ = "0.1.0"

_HOME = {
    "Curve": "curve",
    "Fit": "result",
    "HarmonicMap": "maps.harmonic",
    "IccmError": "errors",
    "InputError": "errors",
    "Status": "result",
    "Transfer": "texture_transfer",
    "TriangulatedMap": "maps.triangulated.map",
    "checkerboard": "pixels.checkerboard",
    "deform": "solve",
    "fit": "solve",
    "transfer": "texture_transfer",
    "warp": "texture_transfer",
}
__all__ = sorted(_HOME)


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'iccm' has no attribute {name!r}")
    return getattr(import_module(f".{_HOME[name]}", __name__), name)
