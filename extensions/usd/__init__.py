"""USD files.

usd_format  meshes of a stage with their texture coordinates; the rest of the stage is kept
usd_reader  the function that reads a file in the separate process
"""

from ...io.extras import Extra
from ...io.formats import Format

EXTRA = Extra("usd", "meshes in USD files", {"pxr": "usd-core"})
FORMAT = Format(mesh="iccm.extensions.usd.usd_format:UsdFormat", uv=True, extra=EXTRA)
