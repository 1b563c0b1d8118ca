"""A self-contained HTML page for results: a table that can be sorted and filtered, with details for each row.

The page's script is in `page.html`. File names and messages are passed to it as JSON and shown as text.
"""

from __future__ import annotations

import base64
import io
import json
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

LONGER_SIDE_PIXELS = 1600  # longer side of a picture on a page in pixels; larger pictures are reduced


@dataclass
class Cell:
    """A cell of the table.

    Attributes:
        text: the text shown.
        sort: number to sort the column by, if not by the text.
        state: "good" or "bad", shown as a colour.
        image: a `data:` address.
        link: address to open on a click, relative to the page.
    """

    text: str
    sort: float | None = None
    state: str | None = None
    image: str | None = None
    link: str | None = None


@dataclass
class Row:
    """A row of the table, with the details that are shown when it is selected.

    Attributes:
        good: whether it needs no attention.
        cells: one for each column.
        detail: title, problems, figures, update and pair, as `page.html` reads them.
    """

    good: bool
    cells: list[Cell] = field(default_factory=list)
    detail: dict[str, Any] | None = None


def page(title: str, summary: str, columns: list[str], rows: list[Row]) -> bytes:
    """Return the page as UTF-8."""
    data = {"title": title, "summary": summary, "columns": columns, "rows": [asdict(row) for row in rows]}
    text = json.dumps(data).replace("<", "\\u003c")  # ASCII, without tags that could end the script
    template = (files(__package__) / "page.html").read_text(encoding="utf-8")
    return template.replace("DATA", text, 1).encode()


def address(pixels: NDArray[np.uint8], longer: int = LONGER_SIDE_PIXELS) -> str:
    """Return a `data:` address of (h, w, 3 or 4) pixels as a PNG, at most `longer` pixels on the longer side."""
    from PIL import Image

    picture = Image.fromarray(pixels)
    if max(picture.size) > longer:
        picture.thumbnail((longer, longer))
    buffer = io.BytesIO()
    picture.save(buffer, "png")
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()
