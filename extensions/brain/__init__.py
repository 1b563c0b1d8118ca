"""Cortical surfaces of GIFTI and FreeSurfer, and numbers and labels at their vertices.

brain_formats  surfaces and patches, and values at their vertices
brain_readers  the functions that read files in the separate process
"""

from ...io.extras import Extra
from ...io.formats import Format

EXTRA = Extra("brain", "cortical surfaces of GIFTI and FreeSurfer", {"nibabel": "nibabel"})
GIFTI = Format(mesh="iccm.extensions.brain.brain_formats:GiftiFormat", extra=EXTRA)
FREESURFER = Format(mesh="iccm.extensions.brain.brain_formats:FreeSurferFormat", extra=EXTRA)
VALUES = Format(overlay="iccm.extensions.brain.brain_formats:FreeSurferFormat", extra=EXTRA)
