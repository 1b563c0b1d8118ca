"""Shapes from files of every format, planar or flattened, and the constraints between them."""
