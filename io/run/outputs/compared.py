"""The contact sheet of --compare: the result of each fit, with its cost, to choose from by eye."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pictures
from PIL import ImageDraw, ImageFont

from ....errors import InputError
from ....fits import FITS
from ....maps.approximation import triangulated
from ....pixels.canvas import Canvas, proportional
from ... import formats
from ...pictures import image_files
from ...pictures.image import Image
from ..job import Job
from ..maps import cost_of_fit
from ..phases import Phases
from ..report import OutputReport
from ..state import Run
from .output import Output
from .picture import displayed

SIDE_PIXELS = 320  # longer side of each picture
BORDER_PIXELS = 12  # around each picture
LABEL_PIXELS = 40  # height of the two lines of text above it
TEXT_PIXELS = 14  # size of the text
COLUMNS = 3
GROUND, INK, MARK = (244, 244, 244), (34, 38, 43), (209, 102, 45)
"""Colours of the background, of the text, and of the text of the fit that was chosen."""
SAME_DIFFERENCE = 1.0
"""Mean difference of 255 below which two pictures are the same."""


class Result(NamedTuple):
    """The result of a fit.

    Attributes:
        fit: its name.
        picture: (h, w, c) as screens show it; None if there is no map.
        words: its cost and shares, or why there is no map.
    """

    fit: str
    picture: NDArray | None
    words: str


class Compared(Output):
    """A contact sheet of all fits."""

    shows = True

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require the suffix of a PNG, and a map whose fit can be chosen."""
        if formats.suffix_of(self.name) != ".png":
            raise InputError(f"{self.name}: unknown suffix for --compare; use .png")
        if onto_mesh or job.several or job.place != "fill" or job.along is not None or not job.exact:
            raise InputError(
                f"--compare {self.name}: only works for one balanced map onto a planar drawing, without --parts, "
                "--place and --along"
            )

    def check(self, run: Run) -> None:
        """Require plane shapes."""
        if run.source.is_mesh:
            raise InputError(f"--compare {self.name}: {run.source.spec} is a mesh; leave it out")

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Solve for the map of each fit, and draw all of them."""
        with run.phases.timed("compare"):
            results = [_result(run, run.job.fit or "auto")]
            for name in FITS:
                if name != results[0].fit:
                    results.append(_solved(run, name))
            image_files.write(path, Image(_sheet(results)))
        return OutputReport()


def _solved(run: Run, name: str) -> Result:
    """Return the result of another fit of the same job."""
    assert run.solve is not None
    job = run.job.model_copy(update={"fit": name})
    try:
        other = Run.read(job, run.inputs.of_job(job), run.threads, lambda note: None, Phases())
        run.solve(other)
    except InputError as error:
        return Result(name, None, str(error))
    return _result(other, name)


def _result(run: Run, name: str) -> Result:
    """Return the result of a run that is solved."""
    low, high = run.canvas.box
    canvas = Canvas.about(*proportional(SIDE_PIXELS, high - low), run.canvas.box)
    words = [f"cost {_cost(run):.2f}"]
    seen = run.fit.coverage.seen
    if seen is not None:
        words.append(f"shows {1 - seen.hidden:.0%}, covers {1 - seen.bare:.0%}")
    return Result(name, displayed(run, canvas), " · ".join(words))


def _cost(run: Run) -> float:
    """Return the cost of a finished map: of the detail that is seen of a picture, or of areas."""
    detail, drawings = run.detail, run.fit.details.drawings
    if detail is None or detail.is_empty or drawings is None:
        return cost_of_fit(run.fit)
    source, target = drawings
    map = triangulated(run.fit.map)
    from ....drawings.detail import TargetView
    from ....frames.composition import seen_cost, subject_of

    triangles, view = (map.source, map.image, map.faces), TargetView.of(target.painted)
    return seen_cost(triangles, detail, view, subject_of(source, detail), run.job.balance).total


def _sheet(results: Sequence[Result]) -> NDArray[np.uint8]:
    """Return (h, w, 3) all results in rows, the requested one first, in another colour."""
    width, height = SIDE_PIXELS + 2 * BORDER_PIXELS, SIDE_PIXELS + LABEL_PIXELS + 2 * BORDER_PIXELS
    rows = -(-len(results) // COLUMNS)
    sheet = Pictures.new("RGB", (COLUMNS * width, rows * height), GROUND)
    drawing, font = ImageDraw.Draw(sheet), ImageFont.load_default(TEXT_PIXELS)
    for number, result in enumerate(results):
        left = number % COLUMNS * width + BORDER_PIXELS
        top = number // COLUMNS * height + BORDER_PIXELS
        is_same = number > 0 and _are_same(results[0].picture, result.picture)
        title = f"--fit {result.fit}: {FITS[result.fit].summary}"
        ink = MARK if number == 0 or is_same else INK
        words = f"same as {results[0].fit} · {result.words}" if is_same else result.words
        drawing.text((left, top), title, ink, font)
        drawing.text((left, top + LABEL_PIXELS // 2), words[: SIDE_PIXELS // 7], ink, font)
        if result.picture is not None:
            picture = Pictures.fromarray(result.picture).convert("RGBA")
            sheet.paste(picture, (left, top + LABEL_PIXELS), picture)
    return np.asarray(sheet)


def _are_same(first: NDArray | None, second: NDArray | None) -> bool:
    if first is None or second is None or first.shape != second.shape:
        return False
    return float(np.abs(first.astype(float) - second).mean()) < SAME_DIFFERENCE
