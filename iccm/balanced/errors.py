"""Errors of the solver."""

from ..arrays import Complex
from ..errors import InputError


class Stuck(Exception):
    """One attempt failed; the next one may not."""


class Tangled(Stuck):
    """Folds remain.

    Attributes:
        u: (n,) images, as few folded as could be.
    """

    def __init__(self, u: Complex):
        super().__init__("no map without folds was found for this correspondence of the outlines")
        self.u = u


class NoMapError(InputError):
    """No map without folds was found; the message says why in a sentence."""
