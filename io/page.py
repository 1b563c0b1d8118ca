"""Results on one page of HTML that needs nothing else: a table that sorts and filters, and a detail for each row.

The page's script is `page.html`. What comes from files (names, messages) reaches it as JSON and is shown as text.
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

LONGER = 1600  # pixels of a picture on a page; larger ones are made smaller


@dataclass
class Cell:
    """What stands in a table.

    Attributes:
        text: what is read.
        sort: by what a column is sorted, where that is not its text.
        state: "good" or "bad", by colour.
        image: a `data:` address.
        link: where a click leads, relative to the page.
    """

    text: str
    sort: float | None = None
    state: str | None = None
    image: str | None = None
    link: str | None = None


@dataclass
class Row:
    """A line of the table, and what is shown when it is chosen.

    Attributes:
        good: whether nobody has to look at it.
        cells: as many as the table has columns.
        detail: title, problems, figures, update and pair, as `page.html` reads them.
    """

    good: bool
    cells: list[Cell] = field(default_factory=list)
    detail: dict[str, Any] | None = None


def page(title: str, told: str, columns: list[str], rows: list[Row]) -> bytes:
    """Return the page, as UTF-8."""
    data = {"title": title, "told": told, "columns": columns, "rows": [asdict(row) for row in rows]}
    text = json.dumps(data).replace("<", "\\u003c")  # ASCII, without a tag that could end the script
    template = (files(__package__) / "page.html").read_text(encoding="utf-8")
    return template.replace("DATA", text, 1).encode()


def address(pixels: NDArray[np.uint8], longer: int = LONGER) -> str:
    """Return a `data:` address of (h, w, 3 or 4) pixels, at most so many on the longer side, as a PNG."""
    from PIL import Image

    picture = Image.fromarray(pixels)
    if max(picture.size) > longer:
        picture.thumbnail((longer, longer))
    buffer = io.BytesIO()
    picture.save(buffer, "png")
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()
