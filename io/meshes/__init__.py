"""Meshes in files: every format read into arrays, OBJ kept line by line."""
