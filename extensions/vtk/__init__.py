"""VTK files: surfaces and grids, as ParaView saves them.

vtk_format  surfaces with their texture coordinates, and numbers at their points
vtk_reader  the function that reads a file in the separate process
"""

from ...io.extras import Extra
from ...io.formats import Format

EXTRA = Extra("vtk", "meshes in VTK files, as ParaView saves them", {"vtkmodules": "vtk"})
SURFACES = Format(mesh="iccm.extensions.vtk.vtk_format:VtkFormat", uv=True, extra=EXTRA)
GRIDS = Format(mesh="iccm.extensions.vtk.vtk_format:VtkFormat", could_hold_uv=True, extra=EXTRA)
