"""A background for drawings used as textures: a paper colour where the drawing is transparent."""

from dataclasses import replace

import numpy as np

from ..arrays import Real
from .colour import Float, decode, encode
from .texture import Texture

INK_SHARE = 0.15
"""Least share of the drawing's mean colour in the colour of the paper: enough to distinguish it from white if the
drawing is dark."""
PAPER_CONTRAST_RATIO = 1.25
"""Contrast of the paper with white, so that the target's shape is visible on a white page. For a light drawing, paper
has half the drawing's contrast with white (in logarithms), if that is less."""
LEAST_CONTRAST_RATIO = 1.3
"""Contrast with white (WCAG 2.2: from 1 to 21) below which a drawing is meant for a dark page."""
INK_SHARES_TRIED = 100
"""Number of shares of ink in the paper that are compared; neighbours differ by less than is visible."""
LUMINANCE_WEIGHTS = (0.2126, 0.7152, 0.0722)  # of red, green and blue in linear light (IEC 61966-2-1)


def on_paper(texture: Texture) -> Texture:
    """Return a texture with paper where it is transparent, opaque everywhere.

    The paper is tinted with the drawing's mean colour: light, but not white, or almost black where the drawing itself
    is nearly white. Colours are mixed in the stored encoding, as drawing programs do.

    Parameters
    ----------
    texture
        Grey or RGB colours with an alpha channel; a texture without alpha is returned as it is.

    Examples
    --------
    >>> pixels = np.zeros((2, 3, 4), np.uint8)
    >>> pixels[:, 0] = 200, 0, 0, 255
    >>> on_paper(Texture(pixels, (0, 3 + 2j), alpha=3)).pixels[0].tolist()
    [[200, 0, 0, 255], [247, 217, 217, 255], [247, 217, 217, 255]]
    """
    if texture.alpha < 0:
        return texture
    pixels = texture.pixels
    values = decode(pixels, texture.alpha, srgb=False, associated=texture.associated, premultiply=True)
    alpha = values[..., texture.alpha].copy()
    colours = [k for k in range(pixels.shape[2]) if k != texture.alpha]
    painted = max(float(alpha.sum()), 1.0)
    mean = np.array([values[..., k].sum(dtype=np.float64) for k in colours]) / painted
    bare = 1 - alpha
    for k, paper in zip(colours, _paper(mean, texture.transfer == "srgb")):
        values[..., k] += bare * paper
    values[..., texture.alpha] = 1
    return replace(
        texture, pixels=encode(values, pixels.dtype, texture.alpha, srgb=False, associated=texture.associated)
    )


def _paper(mean: Float | Real, is_srgb: bool) -> Float:
    """Return the colour (c,) of the paper for a drawing with a mean colour (c,)."""
    contrast = _contrast_with_white(mean[None], is_srgb)[0]
    if contrast < LEAST_CONTRAST_RATIO:
        return (INK_SHARE * mean).astype(np.float32)
    shares = np.linspace(INK_SHARE, 1, INK_SHARES_TRIED)[:, None]
    papers = shares * mean + (1 - shares)
    contrast_goal = min(PAPER_CONTRAST_RATIO, np.sqrt(contrast))
    first = np.argmax(_contrast_with_white(papers, is_srgb) >= contrast_goal)
    return papers[first].astype(np.float32)


def _contrast_with_white(colours: Float | Real, is_srgb: bool) -> Float:
    """Return the contrast ratios (n,) of colours (n, c) with white (WCAG 2.2)."""
    light = decode(colours[None].astype(np.float32), -1, srgb=is_srgb, associated=False, premultiply=False)
    count = colours.shape[1]
    weights = np.array(LUMINANCE_WEIGHTS) if count == 3 else np.full(count, 1 / count)
    return 1.05 / (light[0] @ weights + 0.05)
