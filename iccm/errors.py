"""The two ways a call can fail because of what it was given."""


class IccmError(Exception):
    """Base of every error that `iccm` raises on purpose."""


class InputError(IccmError, ValueError):
    """The user's input is wrong. The message is one line: file, place, what is wrong, what to do."""
