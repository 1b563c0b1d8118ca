"""One job: described, run, reported.

    iccm.io.run.run(iccm.io.run.Job(source="a.svg", target="b.svg"))

Names are imported when first used, so that reading a job costs no numerics.
"""

from importlib import import_module

_HOME = {"Job": "job", "run": "execute"}
__all__ = sorted(_HOME)


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'iccm.io.run' has no attribute {name!r}")
    return getattr(import_module(f".{_HOME[name]}", __name__), name)
