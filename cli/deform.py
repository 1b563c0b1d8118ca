"""`iccm deform`."""

from __future__ import annotations

from typing import Any

import click

from . import options
from .map import execute
from .options import FILE


@click.command("deform", cls=options.Command)
@click.argument("shape", type=FILE)
@options.of("deform")
def command(shape: str, **arguments: Any) -> int:
    """Deform SHAPE (a file or file#id) and its texture with pins and strokes, without a target.

    Pins and strokes are met exactly, nothing folds, and every part stays as rigid as possible.

    \b
    iccm deform cat.svg --pin 256,150:270,140 --pin 256,420:256,420 -o cat-up.png
    iccm deform cat.svg --constraints tail.json --plot tail.png

    Exit code: 0 done, 1 the result is not good enough, 2 wrong input.
    """
    return execute({"source": shape, **arguments})
