"""One job: described, run, reported.

    iccm.io.run.run(iccm.io.run.Job(source="a.svg", target="b.svg"))

Names are imported when first used, so that reading a job costs no numerics.

job            `Job`: one run, described and validated
earlier        outputs of earlier runs, which the same command may replace
execute        `run`: inputs, map, outputs, report
inputs         the files that a job reads
resolve        what a job leaves open, filled in from its files
constraints    pins and strokes in the core plane
parts          `--parts all`
by_position    pins between two meshes in the same place
state          a job under way
phases         what is under way, and how long it took
framing        what pictures show, how large, and what the texture covers
texture        where the texture comes from
blank_picture  pictures that show nothing
outputs/       what a run writes
plots          what `--plot` draws
report         the report
morph          `iccm morph`
between        drawings on the way from one to another
flatten        `iccm flatten`
flat_files     a flattening as a file
relayout       `iccm relayout`
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .execute import run as run
    from .job import Job as Job

_HOME = {"Job": "job", "run": "execute"}
__all__ = sorted(_HOME)


if not TYPE_CHECKING:  # a type checker takes a module with __getattr__ to have every name

    def __getattr__(name):
        if name not in _HOME:
            raise AttributeError(f"module 'iccm.io.run' has no attribute {name!r}")
        return getattr(import_module(f".{_HOME[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name.startswith("__")), *__all__})
