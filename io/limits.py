"""Limits on what is read and made: input above one of them is rejected in a line, before memory is taken for it.

A limit that a user can raise is the default of an option (`io/options.py`). What a method bounds for itself, such as
the vertices of its mesh, stands with the method.
"""

FACES = 5_000_000
"""Faces of a mesh; --max-faces."""
PIXELS = 1 << 28
"""Pixels of a picture, read or made; --max-pixels."""
SEGMENTS = 1 << 20
"""Lines and curves that an SVG draws; --max-segments."""
SIDE = 1 << 17
"""Pixels of one side of a picture that is made."""
MEMORY = 1 << 62
"""Bytes that --memory can name."""
VERTICES = 4000
"""Boundary vertices that --vertices can ask for: a map's equations are a dense matrix."""
BALANCE = 10
"""The largest --balance: beyond 4 areas hardly change, and angles pay for it."""
