"""The results of a batch on one HTML page, with thumbnails and links to the outputs."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ...errors import InputError
from .. import formats
from ..files import relative_path
from ..page import Cell, Row, address, page

THUMBNAIL_PIXELS = 96  # longer side in pixels
PICTURED_JOBS = 1000  # jobs with a thumbnail at most
COLUMNS = ["job", "result", "status", "figures", "seconds", "message"]


def html(results: list[dict[str, Any]], jobs: str, where: str) -> bytes:
    """Return the page for a file in the folder `where`, to which links are relative."""
    results = sorted(results, key=lambda result: result["job"])
    counts = Counter(result["status"] for result in results)
    summary = ", ".join(f"{number} {status}" for status, number in counts.most_common())
    if len(results) > PICTURED_JOBS:
        summary += f"; the first {PICTURED_JOBS} have thumbnails"
    rows = [_row(result, where, k < PICTURED_JOBS) for k, result in enumerate(results)]
    return page(f"iccm batch {jobs}", summary, COLUMNS, rows)


def _row(result: dict[str, Any], where: str, pictured: bool) -> Row:
    outputs = [output["path"] for output in result["outputs"]]
    picture = next((path for path in outputs if formats.of(path).picture), None)
    first = picture or next(iter(outputs), None)
    good = result["status"] == "done"
    link = quote(relative_path(first, where).replace(os.sep, "/")) if first else None
    cells = [
        Cell(str(result["job"]), sort=result["job"]),
        Cell(result["name"], image=thumbnail(picture) if picture and pictured else None, link=link),
        Cell(result["status"], state="good" if good else "bad"),
        Cell(_figures(result["figures"])),
        Cell(f"{result['seconds']:.2f}", sort=result["seconds"]),
        Cell(" ".join([result["message"], *result["notes"]])),
    ]
    return Row(good, cells)


def _figures(figures: dict[str, Any]) -> str:
    """Return the main figures: the outline's gap, the 95 % quantile of the dilatation, and how much of drawings is
    seen.
    """
    gap, dilatation = _figure(figures, "boundary", "hausdorff"), _figure(figures, "dilatation", "p95")
    shares = [(name, _number(figures.get(name))) for name in ("shown", "covered", "cracks")]
    entries = [("gap", gap), ("dilatation p95", dilatation), *shares]
    return ", ".join(f"{name} {value:.3g}" for name, value in entries if value is not None)


def _figure(report: dict[str, Any], group: str, name: str) -> float | None:
    """Return a figure of a report, which may come from a journal; None if it is missing or not a number."""
    group_figures = report.get(group)
    return _number(group_figures.get(name)) if isinstance(group_figures, dict) else None


def _number(value: Any) -> float | None:
    return value if isinstance(value, float | int) else None


def thumbnail(path: str) -> str | None:
    """Return a small copy of a picture; None if it is missing or browsers cannot show it."""
    import numpy as np

    from ..pictures import image_files

    try:
        pixels = image_files.read(Path(path)).pixels
    except (InputError, OSError):
        return None
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    elif pixels.dtype != np.uint8:
        pixels = (255 * np.clip(np.nan_to_num(pixels), 0, 1)).astype(np.uint8)
    step = max(1, max(pixels.shape[:2]) // (4 * THUMBNAIL_PIXELS))
    channels = {1: [0, 0, 0], 2: [0, 0, 0, 1]}.get(pixels.shape[2], range(min(pixels.shape[2], 4)))
    return address(np.ascontiguousarray(pixels[::step, ::step][..., list(channels)]), THUMBNAIL_PIXELS)
