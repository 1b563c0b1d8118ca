"""Shapes moved by pins and strokes alone: the balanced energy with a free outline.

mesh       a mesh of the shape, constraints as its vertices and edges
method     the deformation: a similarity, then a coarse and a fine mesh
"""
