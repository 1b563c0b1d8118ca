"""How solving can fail."""

from ..errors import InputError


class Stuck(Exception):
    """One attempt failed; the next one may not."""


class NoMapError(InputError):
    """No map without folds was found; the message says why in a sentence."""
