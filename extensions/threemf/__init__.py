"""3MF files, the format of 3D printing.

threemf_format  objects of a package at their places
"""

from ...io.extras import Extra
from ...io.formats import Format

EXTRA = Extra("3mf", "meshes in 3MF files", {name: name for name in ("lxml", "networkx")})
FORMAT = Format(mesh="iccm.extensions.threemf.threemf_format:ThreeMfFormat", could_hold_uv=True, extra=EXTRA)
