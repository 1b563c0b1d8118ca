"""Arguments that are files: shells complete their names; whether they are there is told by what reads them."""

import click

FILE = click.Path(readable=False)
