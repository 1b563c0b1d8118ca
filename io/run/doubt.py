"""Remarks that are told to those who want quiet."""


class Doubt(str):
    """A remark on the result itself, not on how it was made: whoever wants quiet wants to know it."""

    __slots__ = ()
