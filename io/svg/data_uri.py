"""Files that a drawing embeds as `data:image/png;base64,…`."""

import base64
import binascii
import re
from urllib.parse import unquote_to_bytes

_ENCODED = re.compile(r"data:(?P<kind>[^,]*?)(?P<base64>;base64)?,", re.IGNORECASE)


def content_of(address: str) -> bytes | None:
    """Return the file that a `data:` address contains; None where it is malformed."""
    match = _ENCODED.match(address.strip())
    if not match:
        return None
    text = address.strip()[match.end() :]
    try:
        raw = unquote_to_bytes(text)
        return base64.b64decode(b"".join(raw.split())) if match["base64"] else raw
    except (ValueError, binascii.Error):
        return None
