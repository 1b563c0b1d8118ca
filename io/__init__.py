"""Bytes to nouns and back: shapes, images, meshes, reports."""
