"""Holes: their outlines at a level, which goes to which, and correspondences of rings to start from."""
