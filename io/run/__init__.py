"""One job: its description, its run and its report.

    iccm.io.run.run(iccm.io.run.Job(source="a.svg", target="b.svg"))

Names are imported when first used, so that reading a job costs no numerics.

job            `Job`: the validated description of one run
earlier        outputs of earlier runs, which the same command may replace
execute        `run`: inputs, map, outputs, report
inputs         the input files of a job
resolve        values of a job that are filled in from its files
constraints    pins and strokes in the core plane
point_files    pins from two files of points
parts          `--parts all`
projected      maps of sheets that are seen in pictures
layout_choice  the layout of a mesh inside a picture, where its outline would stretch the picture
pieces         landmarks for pairs of pieces of two meshes
by_position    pins between two meshes in the same place
state          the state of a running job
phases         progress and times of the phases of a job
framing        the area and size of pictures, and the area of the texture
texture        the texture: a file, or what the source itself shows
blank_picture  detection of blank pictures
outputs/       the outputs of a run
plots          figures for `--plot`
report         the report
morph          `iccm morph`
between        intermediate drawings of a morph
flatten        `iccm flatten`
flat_files     a flattening as a file
overlay_picture  a picture of an overlay in a flattening
relayout       `iccm relayout`
requirements   what options need in order to have an effect; those that were given in vain are refused
flat_colours   drawings of a few flat colours as areas, and which areas of two drawings become each other in a morph
along          `--along`: bend the source along a line of the target
preview        the contact sheet of a textured mesh: views from four sides, drawn without a display, a driver or…
maps           the maps of a job: solved for each pair of shapes, from scratch or continued from an earlier map
background     the target's own drawing, photo or text, shown behind the result (`--background target`)
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .execute import run as run
    from .job import Job as Job

_HOME = {"Job": "job", "run": "execute"}
__all__ = sorted(_HOME)


if not TYPE_CHECKING:  # a type checker assumes that a module with __getattr__ has every name

    def __getattr__(name):
        if name not in _HOME:
            raise AttributeError(f"module 'iccm.io.run' has no attribute {name!r}")
        return getattr(import_module(f".{_HOME[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name.startswith("__")), *__all__})
