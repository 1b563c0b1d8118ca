"""One job: described, run, reported.

    iccm.io.run.run(iccm.io.run.Job(source="a.svg", target="b.svg"))

Names are imported when first used, so that reading a job costs no numerics.
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
    return sorted({*globals(), *__all__})
