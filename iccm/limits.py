"""Limits on inputs that the library checks itself; `iccm.io.limits` adds those of files, and has all of them."""

COORDINATE = 1e100
"""Largest coordinate of an outline, a pin or a saved map, so that areas can be computed."""
MESH_COORDINATE = 1e60
"""Largest coordinate of a mesh: squares of areas stay finite."""
VERTICES = 4000
"""Boundary vertices that --vertices accepts: the equations of a map are a dense matrix."""

ARCHIVE_BYTES = 1 << 30
"""Bytes to which all members of an archive (.npz, .zip) unpack: maps have about 100 per vertex, fields 24 per pixel."""
UNPACKED_BYTES, UNPACKED_RATIO = 1 << 28, 100
"""Bytes to which a compressed file unpacks, or relative to its size if that is more. Coordinates and meshes as text
shrink to a thirtieth at best; a file that shrinks to a thousandth is made to fill the memory.
"""
CRS_CHARACTERS = 20_000
"""Characters of the description of a coordinate reference system in a saved map."""
