"""Shapes moved by pins and strokes alone: the balanced energy with a free outline.

mesh       a mesh of the shape, constraints as its vertices and edges
deformed   the mesh, its image, and what holds its vertices
method     the deformation: a similarity, then a coarse and a fine mesh
"""
