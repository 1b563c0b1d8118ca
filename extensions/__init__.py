"""Extensions that come with iccm, each in a folder that can be deleted, found by the entry points in pyproject.toml.

brain/    cortical surfaces of GIFTI and FreeSurfer, and values at their vertices
threemf/  3MF files
usd/      USD files
vtk/      VTK files
"""
