"""Arguments that are files: shells complete their names; whether they are there is told by what reads them."""

import click

from ..io import references

FILE = click.Path(readable=False)


def _outside(ctx: click.Context, param: click.Parameter, allowed: bool) -> None:
    ctx.with_resource(references.outside(allowed))


OUTSIDE = click.option(
    "--outside",
    is_flag=True,
    expose_value=False,
    callback=_outside,
    help="Take material libraries and pictures that a mesh names from anywhere, not only from its folder and below.",
)
