"""File names that are valid on every system."""

import os
import re
import unicodedata

from .. import limits

FORBIDDEN = re.compile(r'[<>:"|?*\x00-\x1f]')
RESERVED = re.compile(r"(?i)(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])(\..*)?")


def mistake(path: str) -> str | None:
    """Return why a relative path cannot be written here or on Windows; None if it can."""
    quoted = repr(path[:60]) if len(path) > 60 or not path.isprintable() else path
    try:
        encoded = [os.fsencode(part) for part in path.split("/")]
    except UnicodeEncodeError:
        return f"{quoted}: the name is not valid Unicode; choose another"
    if "\0" in path:
        return f"{quoted}: the name contains a NUL character; choose another"
    if any(len(part) > limits.NAME_BYTES for part in encoded):
        return f"{quoted}…: the name is longer than {limits.NAME_BYTES} bytes; choose a shorter one"
    _drive, relative = os.path.splitdrive(path)
    for part in re.split(r"[/\\]", relative):
        forbidden = FORBIDDEN.search(part)
        if forbidden:
            return f"{quoted}: Windows does not allow {forbidden[0]!r} in names; choose another"
        if RESERVED.fullmatch(part) or (part.endswith((".", " ")) and part.strip(".")):
            return f"{quoted}: Windows does not allow the name {part!r}; choose another"
    return None


def alike(path: str) -> str:
    """Return a key that is equal for names that differ only in case or Unicode normalization."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())
